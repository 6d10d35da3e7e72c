!> The error of a mesh, estimated from one solution: element by element, in the energy norm, and of a monitored displacement.
!>
!> What the strains of an element (membrane strain and curvature) are off those that are smoothed over its surroundings
!> (finshell_strain_patch) is taken for their error; its energy with the tangent stiffness K of the section there is
!> eta^2 = 1/2 int d.K d dA. This is the usual difference of resultants in the norm of K^-1 (Zienkiewicz & Zhu 1987), written so
!> that no stiffness has to be inverted: sheets without any have errors too. Strains are those of the reference: nothing changes in
!> rigid motions.
module finshell_error_indicator
   use finshell_assembly, only: paying_threads
   use finshell_discretisation, only: at_once, gather_elements, gathered_t
   use finshell_batch, only: rotation_quaternion
   use finshell_equations, only: scatter
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t
   use finshell_freedoms, only: n_nodal
   use finshell_kinds, only: wp, dp
   use finshell_lapack, only: dsyev
   use finshell_state, only: linear_change_t, moved_state, small_part, state_t
   use finshell_status, only: status_ok
   use finshell_strain_batch, only: element_strains_t, recover_strains, strain_points
   use finshell_strain_patch, only: n_strains, new_surroundings, smooth_strain, surroundings_t
   use finshell_mean_displacement, only: mean_displacement_t
   implicit none
   private
   public :: indicator_t, goal_t, estimate_error, estimate_goal_error, monitor_gradient
   public :: surface_strains_t, strains_of, strain_defects

   !> Error of a state in the energy norm, estimated.
   type :: indicator_t
      real(wp), allocatable :: eta(:) !< (elements) root of the energy of the error of each, root of force length; never NaN
      logical, allocatable :: missing(:) !< (elements) could not be recovered; eta is 0 there
      real(wp) :: total = 0 !< root of the sum of eta^2
      real(wp) :: energy = 0 !< stored in the elements
      real(wp) :: relative = 0 !< total/sqrt(energy + total^2); 0 of an unloaded structure
   end type indicator_t

   !> Error of a monitored displacement, estimated.
   type :: goal_t
      type(indicator_t) :: state !< as of estimate_error
      real(wp), allocatable :: dual(:) !< (elements) indicator of the adjoint: root of energy, per unit of the monitor
      real(wp), allocatable :: eta(:) !< (elements) 2 state%eta dual: share of the error of the monitor, in its unit
      real(wp) :: bound = 0 !< sum of eta
      real(wp) :: change = 0 !< signed: exact minus computed value
   end type goal_t

   !> Strains of all elements of a structure.
   type :: surface_strains_t
      real(wp), allocatable :: axes(:, :, :) !< (3, 2, elements), see element_strains_t
      real(wp), allocatable :: area(:), energy(:)
      real(wp), allocatable :: strain(:, :, :) !< (6, 3, elements) membrane strain and curvature; component, point
      real(wp), allocatable :: stiffness(:, :, :) !< (6, 6, elements), made definite; unallocated: not asked for
      logical, allocatable :: missing(:)
   end type surface_strains_t

contains

   !> Of a converged state, or of a linear change of the state of the problem. Nothing of the problem changes, no matrix is needed.
   subroutine estimate_error(problem, state, indicator, change)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(indicator_t), intent(out) :: indicator
      type(linear_change_t), intent(in), optional :: change
      type(surface_strains_t) :: strains
      real(wp), allocatable :: defect(:, :, :)
      call strains_of(problem, state, strains, indicator%energy, change)
      call strain_defects(problem, strains, defect)
      call measure(strains, defect, indicator)
   end subroutine estimate_error

   !> Strains of a state, or of a linear change of that of the problem, and the energy that belongs to them.
   subroutine strains_of(problem, state, strains, energy, change)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(surface_strains_t), intent(out) :: strains
      real(wp), intent(out) :: energy
      type(linear_change_t), intent(in), optional :: change
      type(surface_strains_t) :: more
      if (.not. present(change)) then
         call strains_at(problem, state, strains)
         energy = sum(strains%energy)
         return
      end if
      call strains_at(problem, problem%state, strains)
      call add_change(problem, strains, change%motion, more)
      energy = sum(strains%energy) + change%energy
      if (.not. change%alone) more%strain = strains%strain + more%strain
      strains%strain = more%strain
      strains%missing = more%missing
      if (change%alone) energy = stored_by(strains)
   end subroutine strains_of

   !> Indicator from what the strains are off.
   pure subroutine measure(strains, defect, indicator)
      type(surface_strains_t), intent(in) :: strains
      real(wp), intent(in) :: defect(:, :, :)
      type(indicator_t), intent(inout) :: indicator
      integer :: e
      indicator%eta = [(sqrt(max(product_of(strains, defect, defect, e), 0.0_wp)), e=1, size(defect, 3))]
      indicator%missing = strains%missing
      indicator%total = norm2(indicator%eta)
      indicator%energy = max(indicator%energy, 0.0_wp)
      if (indicator%total > 0) indicator%relative = indicator%total/sqrt(indicator%energy + indicator%total**2)
   end subroutine measure

   !> Error of a displacement at the state of the problem, whose tangent is assembled and factorised here.
   !>
   !> With the adjoint z, K z = gradient, the error of the monitor is the work of the error of the state on that of z:
   !> int d.K d_z dA (Becker & Rannacher 2001), z being linearised about the state. Errors: a singular matrix.
   subroutine estimate_goal_error(problem, gradient, goal, error, change)
      type(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: gradient(:) !< (problem%n) derivative of the monitor with respect to the unknowns
      type(goal_t), intent(out) :: goal
      type(error_t), allocatable, intent(out) :: error
      type(linear_change_t), intent(in), optional :: change !< the monitor is that of a linear change, whose tangent is factorised
      type(surface_strains_t) :: strains, adjoint
      type(indicator_t) :: dual
      real(wp), allocatable :: z(:), motion(:, :), defect(:, :, :), dual_defect(:, :, :)
      integer :: e

      if (.not. present(change)) then
         call problem%evaluate(.true., error)
         if (.not. allocated(error)) call problem%factorise(error)
         if (allocated(error)) return
      end if
      allocate (z(problem%n), motion(n_nodal, size(problem%equations%number, 2)))
      call problem%solve(gradient, z, error)
      if (allocated(error)) return
      call scatter(problem%equations, z, motion)
      call strains_of(problem, problem%state, strains, goal%state%energy, change)
      call strain_defects(problem, strains, defect)
      call measure(strains, defect, goal%state)
      call add_change(problem, strains, motion, adjoint)
      adjoint%stiffness = strains%stiffness
      call strain_defects(problem, adjoint, dual_defect)
      call measure(adjoint, dual_defect, dual)
      goal%dual = dual%eta
      goal%eta = 2*goal%state%eta*dual%eta
      goal%bound = sum(goal%eta)
      goal%change = 2*sum([(product_of(strains, defect, dual_defect, e), e=1, size(defect, 3))])
   end subroutine estimate_goal_error

   !> Derivative of the mean displacement of nodes with respect to the unknowns.
   pure subroutine monitor_gradient(problem, nodes, component, gradient)
      type(equilibrium_t), intent(in) :: problem
      integer, intent(in) :: nodes(:), component !< 1 to 3, global
      real(wp), allocatable, intent(out) :: gradient(:) !< (problem%n)
      type(mean_displacement_t) :: mean
      real(wp) :: rate
      mean%nodes = nodes
      mean%component = component
      allocate (gradient(problem%n), source=0.0_wp)
      call mean%gradient(problem%structure, problem%equations, problem%state, gradient(:problem%equations%n), rate)
   end subroutine monitor_gradient

   !> Strains of all elements at a state, and the stiffness of their sections.
   subroutine strains_at(problem, state, strains, stiff)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(surface_strains_t), intent(out) :: strains
      logical, intent(in), optional :: stiff !< default .true.
      type(gathered_t) :: g
      type(element_strains_t) :: part
      integer, allocatable :: list(:)
      logical :: with_stiffness
      integer :: e, first, i, n, p, s

      with_stiffness = .true.
      if (present(stiff)) with_stiffness = stiff
      associate (structure => problem%structure)
         n = size(structure%mesh%triangles, 2)
         allocate (strains%axes(3, 2, n), strains%area(n), strains%energy(n), strains%strain(n_strains, 3, n), strains%missing(n))
         if (with_stiffness) allocate (strains%stiffness(n_strains, n_strains, n))
         do s = 1, size(structure%sections)
            list = pack([(i, i=1, n)], structure%element_section == s)
            !$omp parallel do schedule(dynamic) num_threads(paying_threads(size(list))) default(shared) private(g, part, e, i, p)
            do first = 1, size(list), at_once
               associate (mine => list(first:min(first + at_once - 1, size(list))))
                  call gather_elements(structure, state, mine, g, problem%equations%held)
                  call recover_strains(structure%sections(s), size(mine), g%x, g%u, g%q, rotation_quaternion, part, &
                                       with_stiffness, g%direction, g%held, g%normal, g%thickness, g%offset, g%growth)
                  do i = 1, size(mine)
                     e = mine(i)
                     strains%axes(:, :, e) = part%axes(:, :, i)
                     strains%area(e) = part%area(i)
                     strains%energy(e) = part%energy(i)
                     strains%missing(e) = part%status(i) /= status_ok
                     do p = 1, 3
                        strains%strain(:, p, e) = [part%membrane(:, i), part%curvature(:, p, i)]
                     end do
                     if (with_stiffness) strains%stiffness(:, :, e) = definite(part%stiffness(:, :, i))
                  end do
               end associate
            end do
            !$omp end parallel do
         end do
      end associate
   end subroutine strains_at

   !> The matrix with its eigenvalues made positive, where some are not.
   pure function definite(k) result(d)
      real(wp), intent(in) :: k(n_strains, n_strains)
      real(wp) :: d(n_strains, n_strains)
      real(wp) :: scale(n_strains)
      integer :: i
      d = k
      if (is_definite(k)) return
      if (.not. any(abs(k(:3, 4:)) > 0)) then
         if (.not. is_definite(k(:3, :3))) d(:3, :3) = positive(k(:3, :3))
         if (any(abs(k(4:, 4:)) > 0)) d(4:, 4:) = positive(k(4:, 4:)) ! membranes have none
         return
      end if
      ! membrane and bending have their own units
      scale(:3) = 1/sqrt(max(maxval(abs(k(:3, :3))), tiny(1.0_wp)))
      scale(4:) = 1/sqrt(max(maxval(abs(k(4:, 4:))), tiny(1.0_wp)))
      do i = 1, n_strains
         d(:, i) = k(:, i)*scale*scale(i)
      end do
      d = positive(d)
      do i = 1, n_strains
         d(:, i) = d(:, i)/(scale*scale(i))
      end do
   end function definite

   pure function positive(k) result(d)
      real(wp), intent(in) :: k(:, :)
      real(wp) :: d(size(k, 1), size(k, 1))
      real(dp) :: v(size(k, 1), size(k, 1)), w(size(k, 1)), work(3*size(k, 1))
      integer :: info
      v = k
      call dsyev('V', 'U', size(w), v, size(w), w, work, size(work), info)
      d = k
      if (info == 0) d = matmul(v*spread(abs(w), 1, size(w)), transpose(v))
   end function positive

   !> By Cholesky's factorisation.
   pure logical function is_definite(k)
      real(wp), intent(in) :: k(:, :)
      real(wp) :: l(size(k, 1), size(k, 1)), d
      integer :: i, j
      is_definite = .false.
      l = 0
      do j = 1, size(k, 1)
         d = k(j, j) - sum(l(j, :j - 1)**2)
         if (.not. d > 0) return
         l(j, j) = sqrt(d)
         do i = j + 1, size(k, 1)
            l(i, j) = (k(i, j) - dot_product(l(i, :j - 1), l(j, :j - 1)))/l(j, j)
         end do
      end do
      is_definite = .true.
   end function is_definite

   !> Linear change of the strains of the state of the problem in a motion.
   subroutine add_change(problem, strains, motion, changed)
      type(equilibrium_t), intent(in) :: problem
      type(surface_strains_t), intent(in) :: strains !< at the state
      real(wp), intent(in) :: motion(:, :) !< (n_nodal, nodes) displacements and spins
      type(surface_strains_t), intent(out) :: changed
      type(surface_strains_t) :: behind
      real(wp) :: part
      part = small_part(motion, problem%detail)
      call strains_at(problem, moved_state(problem%state, motion, part), changed, stiff=.false.)
      call strains_at(problem, moved_state(problem%state, motion, -part), behind, stiff=.false.)
      changed%strain = (changed%strain - behind%strain)/(2*part)
      changed%missing = changed%missing .or. behind%missing .or. strains%missing
   end subroutine add_change

   !> What smoothed strains are more than those of the elements.
   subroutine strain_defects(problem, strains, defect)
      type(equilibrium_t), intent(in) :: problem
      type(surface_strains_t), intent(in) :: strains
      real(wp), allocatable, intent(out) :: defect(:, :, :) !< (6, 3, elements) component, point; 0 where strains are missing
      type(surroundings_t) :: surroundings
      real(wp), allocatable :: mean(:, :)
      logical, allocatable :: found(:)
      real(wp) :: points(3, 3), smooth(n_strains, 3)
      integer :: e, n
      n = size(strains%area)
      call new_surroundings(surroundings, problem%structure)
      mean = sum(strains%strain, 2)/3
      found = .not. strains%missing
      allocate (defect(n_strains, 3, n), source=0.0_wp)
      associate (mesh => problem%structure%mesh)
         !$omp parallel do private(points, smooth) schedule(static)
         do e = 1, n
            if (.not. found(e)) cycle
            points = matmul(mesh%coordinates(:, mesh%triangles(:, e)), strain_points) - spread(surroundings%centre(:, e), 2, 3)
            call smooth_strain(surroundings, mesh%triangles, strains%axes, mean, found, e, points, smooth)
            defect(:, :, e) = smooth - strains%strain(:, :, e)
         end do
         !$omp end parallel do
      end associate
   end subroutine strain_defects

   !> Half the work of stiffness and two fields of strains over an element.
   pure function product_of(strains, a, b, e) result(work)
      type(surface_strains_t), intent(in) :: strains
      real(wp), intent(in) :: a(:, :, :), b(:, :, :)
      integer, intent(in) :: e
      real(wp) :: work
      integer :: p
      work = 0
      do p = 1, 3
         work = work + strains%area(e)/3*0.5_wp*dot_product(a(:, p, e), matmul(strains%stiffness(:, :, e), b(:, p, e)))
      end do
   end function product_of

   !> Energy of strains.
   pure function stored_by(strains) result(energy)
      type(surface_strains_t), intent(in) :: strains
      real(wp) :: energy
      integer :: e
      energy = sum([(product_of(strains, strains%strain, strains%strain, e), e=1, size(strains%area))])
   end function stored_by
end module finshell_error_indicator
