!> Hydrostatic pressure: weight of the fluid times the depth below a level that stays in space, along the current normals, on the
!> facets and on the caps of elements with a curved reference. Nothing acts above the level.
!>
!> With the depth d = level - up.x, linear on a facet, N the linear functions and G_ij the mean of N_i N_j over the facet, where
!> it is wet only, the forces are f_i = weight W_i S, W = G d, S the area vector. As dW/dd = G, all is exact, also where the level
!> cuts a facet. A cap, of volume V, has the mean pressure of its facet: potential -weight V sum(W).
module finshell_hydrostatic
   use finshell_kinds, only: wp
   use finshell_freedoms, only: membrane_at, n_membrane, n_shell, shell_at, ux, uz
   use finshell_acting_load, only: acting_load_t, load_item_t, append, positions, with_rotations
   use finshell_cap_terms, only: caps_at
   use finshell_equations, only: equations_t
   use finshell_error, only: error_t
   use finshell_load, only: load_t
   use finshell_loaded_set, only: loaded_elements
   use finshell_pressure_region, only: symmetric_origin, boundary_edges
   use finshell_rotation, only: cross_product, spin
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t, curved_elements
   implicit none
   private
   public :: add_hydrostatic

   !> On facets: in the follower form, as finshell_follower_load.
   type, extends(acting_load_t) :: hydrostatic_t
      real(wp) :: weight = 0 !< of the fluid, per volume
      real(wp) :: level = 0 !< of its surface: up.x there
      real(wp) :: up(3) = 0
   contains
      procedure :: evaluate => evaluate_facets
      procedure :: energy => energy_of_facets
   end type hydrostatic_t

   type, extends(hydrostatic_t) :: hydrostatic_caps_t
   contains
      procedure :: evaluate => evaluate_caps
      procedure :: energy => energy_of_caps
   end type hydrostatic_caps_t

contains

   !> `direction` of the load: up; its numbers: level, and weight per volume. Error: no such set.
   subroutine add_hydrostatic(load, structure, equations, list, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(load_item_t), allocatable, intent(inout) :: list(:)
      type(error_t), allocatable, intent(inout) :: error
      type(hydrostatic_t) :: facets
      type(hydrostatic_caps_t) :: caps
      integer, allocatable :: edges(:, :)
      real(wp) :: origin(3)
      integer :: i
      call loaded_elements(load, structure, facets%elements, error)
      if (allocated(error)) return
      facets%scaling = load%scaling
      facets%up = load%direction/norm2(load%direction)
      facets%level = load%numbers(1)
      facets%weight = load%numbers(2)
      ! where a uniform pressure does no work on the boundary, one that varies does none either
      call symmetric_origin(structure%mesh, equations, facets%elements, facets%symmetric, origin)
      ! on planes of symmetry the potential below may miss a part
      call boundary_edges(structure%mesh, facets%elements, edges, joints=equations%links%joints)
      facets%has_energy = all([(all(equations%number(ux:uz, edges(:, i)) == 0), i=1, size(edges, 2))]) .and. facets%symmetric &
                          .and. .not. equations%links%any()
      call append(list, facets)
      caps%elements = curved_elements(structure, facets%elements)
      if (size(caps%elements) == 0) return
      caps%rows = with_rotations
      caps%has_energy = .true.
      caps%scaling = facets%scaling
      caps%up = facets%up
      caps%level = facets%level
      caps%weight = facets%weight
      call append(list, caps)
   end subroutine add_hydrostatic

   !> Mean of N_i N_j over the part of a triangle where d > 0, with respect to the whole; and its derivative with a change of d that
   !> is the same everywhere, an integral along the line d = 0.
   pure subroutine wet_part(d, gram, line)
      real(wp), intent(in) :: d(3) !< at the corners
      real(wp), intent(out) :: gram(3, 3), line(3, 3)
      real(wp), parameter :: whole(3, 3) = reshape(real([2, 1, 1, 1, 2, 1, 1, 1, 2], wp)/12, [3, 3])
      real(wp) :: n(3, 3), share(2)
      integer :: a, b(2), i
      gram = 0
      line = 0
      if (count(d > 0) == 3) gram = whole
      if (mod(count(d > 0), 3) == 0) return
      ! corner a is alone on its side; the line cuts the sides to the others at these shares
      a = findloc(d > 0, count(d > 0) == 1, 1)
      b = [1 + mod(a, 3), 1 + mod(a + 1, 3)]
      share = d(a)/(d(a) - d(b))
      n = 0
      n(a, :) = [1.0_wp, 1 - share(1), 1 - share(2)]
      n(b(1), 2) = share(1)
      n(b(2), 3) = share(2)
      do i = 1, 3
         gram(:, i) = product(share)/12*(matmul(n, n(i, :)) + sum(n, 2)*sum(n(i, :)))
         line(:, i) = abs(d(a))/(3*product(d(a) - d(b)))*(matmul(n(:, 2:), n(i, 2:)) + sum(n(:, 2:), 2)*sum(n(i, 2:)))
      end do
      if (count(d > 0) == 2) gram = whole - gram
   end subroutine wet_part

   subroutine evaluate_facets(self, structure, equations, state, force, factor, stiffness)
      class(hydrostatic_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: force(:, :)
      real(wp), intent(in), optional :: factor
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :)
      real(wp), allocatable :: x(:, :, :)
      real(wp) :: area(3), turn(3, 3, 3), d(3), gram(3, 3), line(3, 3), w(3)
      integer :: e, i, j
      x = positions(structure, state, self%elements)
      do e = 1, size(self%elements)
         d = self%level - matmul(self%up, x(:, :, e))
         call wet_part(d, gram, line)
         w = self%weight*matmul(gram, d)
         area = 0.5_wp*cross_product(x(:, 2, e) - x(:, 1, e), x(:, 3, e) - x(:, 1, e))
         force(:, e) = reshape(spread(area, 2, 3)*spread(w, 1, 3), [n_membrane])
         if (.not. present(stiffness)) cycle
         do j = 1, 3
            turn(:, :, j) = 0.5_wp*spin(x(:, 1 + mod(j + 1, 3), e) - x(:, 1 + mod(j, 3), e))
            do i = 1, 3
               stiffness(membrane_at(i) + ux:membrane_at(i) + uz, membrane_at(j) + ux:membrane_at(j) + uz, e) &
                  = factor*(w(i)*turn(:, :, j) - self%weight*gram(i, j)*spread(area, 2, 3)*spread(self%up, 1, 3))
            end do
         end do
      end do
      if (equations%n < 0) force = 0
   end subroutine evaluate_facets

   !> The weight times the integral of the depth over the fluid, by its divergence: -(d^2/2) up.
   function energy_of_facets(self, structure, equations, state) result(energy)
      class(hydrostatic_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp) :: energy, d(3), gram(3, 3), line(3, 3)
      real(wp), allocatable :: x(:, :, :)
      integer :: e
      x = positions(structure, state, self%elements)
      energy = 0*equations%n
      do e = 1, size(self%elements)
         d = self%level - matmul(self%up, x(:, :, e))
         call wet_part(d, gram, line)
         energy = energy + 0.25_wp*self%weight*dot_product(d, matmul(gram, d)) &
            *dot_product(self%up, cross_product(x(:, 2, e) - x(:, 1, e), x(:, 3, e) - x(:, 1, e)))
      end do
   end function energy_of_facets

   subroutine evaluate_caps(self, structure, equations, state, force, factor, stiffness)
      class(hydrostatic_caps_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: force(:, :)
      real(wp), intent(in), optional :: factor
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :)
      real(wp), allocatable :: x(:, :, :), volume(:)
      real(wp) :: d(3), gram(3, 3), line(3, 3), mean, slope(n_shell), bend(n_shell, n_shell)
      integer :: e, i, j
      allocate (volume(size(self%elements)))
      x = positions(structure, state, self%elements)
      call caps_at(structure, self%elements, state, volume, force, stiffness, equations%held)
      do e = 1, size(volume)
         d = self%level - matmul(self%up, x(:, :, e))
         call wet_part(d, gram, line)
         mean = self%weight*sum(matmul(gram, d))
         slope = 0
         bend = 0
         do i = 1, 3
            slope(shell_at(i) + ux:shell_at(i) + uz) = -self%weight*sum(gram(:, i))*self%up
            do j = 1, 3
               bend(shell_at(i) + ux:shell_at(i) + uz, shell_at(j) + ux:shell_at(j) + uz) &
                  = self%weight*line(i, j)*spread(self%up, 2, 3)*spread(self%up, 1, 3)
            end do
         end do
         if (present(stiffness)) stiffness(:, :, e) = factor*(mean*stiffness(:, :, e) + volume(e)*bend &
            + spread(force(:, e), 2, n_shell)*spread(slope, 1, n_shell) + spread(slope, 2, n_shell)*spread(force(:, e), 1, n_shell))
         force(:, e) = mean*force(:, e) + volume(e)*slope
      end do
   end subroutine evaluate_caps

   function energy_of_caps(self, structure, equations, state) result(energy)
      class(hydrostatic_caps_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp) :: energy, d(3), gram(3, 3), line(3, 3)
      real(wp), allocatable :: x(:, :, :), volume(:)
      integer :: e
      allocate (volume(size(self%elements)))
      x = positions(structure, state, self%elements)
      call caps_at(structure, self%elements, state, volume, held=equations%held)
      energy = 0
      do e = 1, size(volume)
         d = self%level - matmul(self%up, x(:, :, e))
         call wet_part(d, gram, line)
         energy = energy - self%weight*sum(matmul(gram, d))*volume(e)
      end do
   end function energy_of_caps
end module finshell_hydrostatic
