!> The largest stable increment of central differences, 2/omega, and rotatory inertia that does not limit it.
!>
!> No frequency of a structure is higher than the highest of its elements, each with its own share of the lumped masses (Irons &
!> Treharne 1971). That of an element comes from a power iteration on its tangent, which begins where the last one ended and
!> adds its residual: from there on it bounds the eigenvalue from above.
!>
!> The natural rotatory inertia of a thin sheet, thickness^2/12 per mass, makes its drilling rotations by far the fastest motion.
!> With an inertia of `rotation_scaling` times the area of the element per mass they are as slow as the displacements (Key & Beisinger
!> 1971; Hughes, Cohen & Haroun 1978).
module finshell_stable_step
   use finshell_assembly, only: paying_threads
   use finshell_discretisation, only: evaluate_gathered, freedoms, gather_elements, gathered_t
   use finshell_equilibrium, only: equilibrium_t
   use finshell_freedoms, only: n_corners, n_nodal, n_shell, rx, rz, shell_at, ux, uz
   use finshell_kinds, only: wp, i4
   use finshell_rotation, only: cross_product
   use finshell_status, only: status_ok
   use finshell_structure, only: structure_t
   use finshell_team, only: largest_of
   implicit none
   private
   public :: stable_step_t, new_stable_step

   type :: stable_step_t
      integer :: element = 0 !< the one with the highest frequency
      real(wp) :: springs = 0 !< square of the highest frequency that elastic foundations add
      real(wp), allocatable :: share(:, :) !< (2, elements) of a corner: mass, rotatory inertia
      real(wp), allocatable, private :: vector(:, :) !< (n_shell, elements) where the last iteration ended
   contains
      procedure :: largest
      procedure :: nodal_inertia
   end type stable_step_t

   integer, parameter :: most_iterations = 60
   real(wp), parameter :: tolerance = 2.0e-3_wp !< of an eigenvalue, residual included
   real(wp), parameter :: refreshed = 0.02_wp !< part of a vector that is made new, lest another mode be never seen

contains

   !> Masses of the elements, and the frequency of springs.
   subroutine new_stable_step(self, problem, rotation_scaling, mass)
      type(stable_step_t), intent(out) :: self
      class(equilibrium_t), intent(in) :: problem
      real(wp), intent(in) :: rotation_scaling !< least rotatory inertia over mass times area; 0: the natural one
      real(wp), intent(in) :: mass(:, :) !< (n_nodal, nodes) lumped
      real(wp) :: area, inertia
      integer :: e
      associate (s => problem%structure)
         allocate (self%share(2, size(s%mesh%triangles, 2)))
         do e = 1, size(self%share, 2)
            associate (x => s%mesh%coordinates(:, s%mesh%triangles(:, e)), section => s%sections(s%element_section(e)))
               area = 0.5_wp*norm2(cross_product(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1)))
               inertia = max(section%inertia(3), rotation_scaling*area*section%inertia(1))
               self%share(:, e) = area/n_corners*[section%inertia(1), inertia]
            end associate
         end do
      end associate
      self%springs = springs_over_masses(problem, mass)
   end subroutine new_stable_step

   !> Replace the rotatory inertia of the nodes by that of the elements here.
   pure subroutine nodal_inertia(self, structure, mass)
      class(stable_step_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      real(wp), intent(inout) :: mass(:, :) !< (n_nodal, nodes)
      integer :: e, j
      mass(rx:rz, :) = 0
      do e = 1, size(self%share, 2)
         if (structure%sections(structure%element_section(e))%membrane) cycle
         do j = 1, n_corners
            associate (node => structure%mesh%triangles(j, e))
               mass(rx:rz, node) = mass(rx:rz, node) + self%share(2, e)
            end associate
         end do
      end do
   end subroutine nodal_inertia

   !> The largest stable increment at the present state.
   real(wp) function largest(self, problem)
      class(stable_step_t), intent(inout) :: self
      class(equilibrium_t), intent(in) :: problem
      real(wp), allocatable :: highest(:)
      real(wp) :: found(1)
      integer :: at, e, p
      logical :: fresh

      fresh = .not. allocated(self%vector)
      if (fresh) allocate (self%vector(n_shell, size(self%share, 2)))
      allocate (highest(size(self%share, 2)), source=0.0_wp)
      !$omp parallel do schedule(dynamic) num_threads(paying_threads(size(highest))) default(shared)
      do p = 1, size(problem%assembly%patches%group)
         call visit_patch(self, problem, p, fresh, highest)
      end do
      !$omp end parallel do
      at = 0
      found = 0
      do e = 1, size(highest)
         if (highest(e) > found(1)) at = e
         found = max(found, highest(e))
      end do
      self%element = at
      call largest_of(problem%team, found)
      largest = huge(largest)
      if (found(1) + self%springs > 0) largest = 2/sqrt(found(1) + self%springs)
   end function largest

   !> Largest eigenvalues of the elements of a patch. Those that cannot be evaluated are left out: the next force says so.
   subroutine visit_patch(self, problem, p, fresh, highest)
      type(stable_step_t), intent(inout) :: self
      class(equilibrium_t), intent(in) :: problem
      integer, intent(in) :: p
      logical, intent(in) :: fresh
      real(wp), intent(inout) :: highest(:)
      type(gathered_t) :: g
      real(wp), allocatable :: f(:, :), k(:, :, :)
      integer(i4), allocatable :: status(:)
      integer :: i, m, n
      associate (patches => problem%assembly%patches, structure => problem%structure)
         associate (mine => patches%element(patches%first(p):patches%first(p + 1) - 1), &
                    section => structure%sections(patches%group(p)))
            n = size(mine)
            m = freedoms(section)
            allocate (f(m, n), k(m, m, n), status(n))
            call gather_elements(structure, problem%state, mine, g, problem%equations%held)
            call evaluate_gathered(section, g, status, force=f, tangent=k, threads=1)
            do i = 1, n
               if (status(i) /= status_ok) cycle
               if (m == n_shell) then
                  call power_iteration(k(:, :, i), self%share(:, mine(i)), fresh, self%vector(:, mine(i)), highest(mine(i)))
               else
                  call power_iteration(k(:, :, i), self%share(:1, mine(i)), fresh, self%vector(:m, mine(i)), highest(mine(i)))
               end if
            end do
         end associate
      end associate
   end subroutine visit_patch

   !> Largest eigenvalue of a tangent over masses, with its residual.
   pure subroutine power_iteration(k, share, fresh, vector, value)
      real(wp), intent(in) :: k(:, :)
      real(wp), intent(in) :: share(:) !< of a corner: mass, and where it has rotations rotatory inertia
      logical, intent(in) :: fresh !< begin anew, not with the vector
      real(wp), intent(inout) :: vector(:)
      real(wp), intent(out) :: value
      real(wp) :: a(size(k, 1), size(k, 1)), scale(size(k, 1)), image(size(k, 1)), residual
      integer :: i, per_node
      per_node = size(k, 1)/n_corners
      do i = 0, n_corners - 1
         scale(i*per_node + ux:i*per_node + uz) = 1/sqrt(share(1))
         if (per_node == n_nodal) scale(i*per_node + rx:i*per_node + rz) = 1/sqrt(share(2))
      end do
      do i = 1, size(k, 1)
         a(:, i) = scale*k(:, i)*scale(i)
      end do
      if (fresh) then
         vector = irregular(size(vector))
      else
         vector = vector + refreshed*irregular(size(vector))
      end if
      vector = vector/norm2(vector)
      value = 0
      do i = 1, most_iterations
         image = matmul(a, vector)
         value = dot_product(vector, image)
         residual = norm2(image - value*vector)
         value = norm2(image)
         if (.not. value > 0) return
         vector = image/value
         if (residual <= tolerance*value) exit
      end do
      value = value + residual
   end subroutine power_iteration

   !> Numbers without pattern, the same ones every time, of length 1.
   pure function irregular(n) result(x)
      integer, intent(in) :: n
      real(wp) :: x(n)
      integer :: i, seed
      seed = 4711
      do i = 1, n
         seed = mod(1103*seed + 12721, 65536)
         x(i) = real(seed, wp)/32768 - 1
      end do
      x = x/norm2(x)
   end function irregular

   !> A bound (Gershgorin) for the eigenvalues of the stiffness of elastic foundations over the masses.
   real(wp) function springs_over_masses(problem, mass) result(bound)
      class(equilibrium_t), intent(in) :: problem
      real(wp), intent(in) :: mass(:, :) !< (n_nodal, nodes)
      real(wp) :: rows(uz, size(mass, 2))
      integer :: i, j
      rows = 0
      associate (springs => problem%external%springs(problem%structure, problem%equations))
         do i = 1, size(springs%elements)
            do j = 1, n_corners
               associate (row => rows(:, problem%structure%mesh%triangles(j, springs%elements(i))))
                  row = row + sum(abs(springs%stiffness(uz*(j - 1) + ux:uz*j, :, i)), dim=2)
               end associate
            end do
         end do
      end associate
      bound = maxval(rows/mass(ux:uz, :))
   end function springs_over_masses
end module finshell_stable_step
