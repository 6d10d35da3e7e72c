!> Natural frequencies of small vibrations about the state: K phi = omega^2 M phi, K the exact tangent there, with the stiffness of
!> prestress and of loads; M the masses of the elements (finshell_mass).
!>
!> Found by shift and invert (Ericsson & Ruhe 1980) from below all of them, in free bodies and unstable states too. What is found
!> is counted: K - b M has as many negative pivots as there are omega^2 below b.
module finshell_frequencies
   use finshell_kinds, only: wp, dp
   use finshell_arpack, only: pencil_t, lanczos
   use finshell_bordered, only: border_t
   use finshell_equations, only: gather, scatter
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_freedoms, only: n_nodal, ux, uz
   use finshell_linear_solver, only: linear_solver_t
   use finshell_linear_step, only: report_change
   use finshell_mass_assembly, only: add_masses, check_masses, mass_kind_t, masses_times
   use finshell_mesh_sorting, only: sorted_order
   use finshell_mode, only: normalise_mode
   use finshell_observer, only: observer_t, vibration_t
   use finshell_point_masses, only: point_masses
   use finshell_sparsity, only: sparsity_t
   use finshell_state, only: linear_change_t
   use finshell_status, only: status_input_error, status_invalid_argument, status_not_converged, status_singular_matrix
   use finshell_step, only: step_t, control_frequencies
   use finshell_symmetric_matrix, only: make_symmetric, symmetric_pattern
   use finshell_team, only: largest_of
   implicit none
   private
   public :: solve_frequencies, check_vibration

   real(dp), parameter :: two_pi = 2*acos(-1.0_dp)
   !> Values of omega^2 below this part of the largest are rounding of K. Free plates and spheres come to 3e-17.
   real(dp), parameter :: rounding = 1.0e-15_dp

   type, extends(pencil_t) :: vibration_pencil_t
      type(sparsity_t) :: pattern !< symmetric
      type(linear_solver_t) :: solver !< holds K - shift M
      real(dp), allocatable :: stiffness(:), mass(:)
      real(dp) :: fastest = 0 !< estimate of the largest omega^2
      integer :: below = 0 !< values below the shift
      type(border_t) :: border !< pressures of chambers, which have no masses
      integer, allocatable :: diagonal(:)
      real(dp), allocatable :: gradient(:, :), compliance(:) !< of the border; unallocated: none
   contains
      procedure :: factorise
      procedure :: apply
      procedure :: metric
   end type vibration_pencil_t

contains

   !> Find modes and give each to the observer as an increment: its load factor is the frequency, cycles per unit of time; negative
   !> where the state is unstable and the mode grows by exp(2 pi |f| t). Its displacements are those of the mode, the largest of a
   !> node being 1. The state stays.
   !>
   !> Errors: a section without density; loads with an unsymmetric stiffness; constant loads that do not act yet; modes that would
   !> be missing.
   subroutine solve_frequencies(problem, step, observer, error)
      type(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      type(vibration_pencil_t) :: pencil
      type(mass_kind_t) :: kind
      real(dp), allocatable :: squares(:), modes(:, :)

      call problem%accept()
      call check_vibration(problem, abs(problem%state%constant_factor - 1) <= 0, error)
      if (allocated(error)) return
      kind = mass_kind_t(step%mass, step%rotatory)
      call matrices(problem, kind, pencil, error)
      if (allocated(error)) return
      if (step%near > 0) then
         call find_near(pencil, min(step%modes, pencil%pattern%n - 1), (two_pi*step%near)**2, squares, modes, error)
      else
         call find_lowest(pencil, min(step%modes, pencil%pattern%n - 1), squares, modes, error)
      end if
      if (allocated(error)) return
      where (abs(squares) < rounding*pencil%fastest) squares = 0
      call report(problem, kind, squares, modes, observer, error)
   end subroutine solve_frequencies

   !> Refuse what has no frequencies: a section without density, turning moments, constant loads that do not act.
   subroutine check_vibration(problem, constants_act, error)
      type(equilibrium_t), intent(in) :: problem
      logical, intent(in) :: constants_act
      type(error_t), allocatable, intent(out) :: error
      if (size(problem%external%turning_nodes) > 0) then
         call raise(error, status_input_error, 'frequencies: a moment acts at node ' &
            //text_of(problem%external%turning_nodes(1))//', which can turn about several axes; such a moment is not conservative')
      else if (problem%has_constants .and. .not. constants_act) then
         call raise(error, status_input_error, "frequencies: the constant loads do not act yet: a step control = 'load' " &
            //'load_factor = 0 before this one brings them in')
      else
         call check_masses(problem%structure, error)
         if (allocated(error)) error%message = 'frequencies: '//error%message
      end if
   end subroutine check_vibration

   subroutine matrices(problem, kind, pencil, error)
      type(equilibrium_t), intent(inout) :: problem
      type(mass_kind_t), intent(in) :: kind
      type(vibration_pencil_t), intent(inout) :: pencil
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: k(:), m(:)
      real(dp) :: difference, largest(1)
      integer :: i

      pencil%of_masses = .true.
      call symmetric_pattern(problem, 'frequencies', pencil%pattern, error)
      if (.not. allocated(error)) call problem%evaluate_toward(.true., error)
      if (allocated(error)) return
      pencil%stiffness = problem%values
      allocate (pencil%mass(size(problem%values)), source=0.0_dp)
      call add_masses(problem%assembly, problem%structure, problem%state, kind, pencil%mass, error)
      if (.not. allocated(error)) call problem%external%masses%add(kind%rotatory, pencil%mass)
      if (.not. allocated(error)) call make_symmetric(problem, pencil%pattern, pencil%mass, difference, error)
      if (.not. allocated(error)) call make_symmetric(problem, pencil%pattern, pencil%stiffness, difference, error)
      if (allocated(error)) return
      if (difference > 1.0e-9_dp*maxval(abs(pencil%stiffness))) then
         call raise(error, status_invalid_argument, 'frequencies: the pressure is not conservative, as part of the edge of the ' &
            //'pressurised elements is free to move')
         return
      end if
      k = pencil%pattern%diagonal(pencil%stiffness)
      m = pencil%pattern%diagonal(pencil%mass)
      largest = 0
      if (any(m > 0)) largest = maxval(k/m, mask=m > 0)
      call largest_of(problem%team, largest)
      pencil%fastest = largest(1)
      if (allocated(problem%compliance)) then
         pencil%gradient = problem%gradient
         pencil%compliance = problem%compliance
         pencil%diagonal = [(pencil%pattern%find(i, i), i=1, pencil%pattern%n)]
      end if
      pencil%solver%options = problem%solver%options
      call pencil%solver%analyse(pencil%pattern, error, problem%solver)
   end subroutine matrices

   !> The lowest values: from a shift below all of them, and none missing.
   subroutine find_lowest(pencil, wanted, squares, modes, error)
      type(vibration_pencil_t), intent(inout) :: pencil
      integer, intent(in) :: wanted
      real(dp), allocatable, intent(out) :: squares(:), modes(:, :)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: most_attempts = 3
      integer, allocatable :: order(:)
      real(dp) :: shift, bound, least
      integer :: attempt, below, lost, more

      more = 0
      do attempt = 1, most_attempts
         call shift_below(pencil, shift, error)
         if (allocated(error)) return
         call lanczos(pencil, pencil%pattern%n, min(wanted + more, pencil%pattern%n - 1), shift, squares, modes, least, error)
         if (.not. allocated(error) .and. size(squares) == 0) call raise(error, status_not_converged, &
                                                                   'frequencies: no mode was found')
         if (allocated(error)) return
         ! Multiple values may be cut in two at the end: what lies clearly below the last is counted.
         bound = maxval(squares)
         bound = bound - 1.0e-5_dp*max(abs(bound), 100*rounding*pencil%fastest)
         below = count(squares < bound)
         call factorise_beside(pencil, bound, error)
         if (allocated(error)) return
         lost = pencil%below - below
         if (lost <= 0) exit
         more = more + lost + 2
         if (attempt == most_attempts) call raise(error, status_not_converged, 'frequencies: '//text_of(lost) &
            //' modes below '//text_of(frequency(bound))//' were not found')
         if (allocated(error)) return
      end do
      order = sorted_order(squares)
      order = order(:min(wanted, size(order)))
      squares = squares(order)
      modes = modes(:, order)
   end subroutine find_lowest

   !> Factorise K - shift M, positive definite: a shift as far below zero as is needed. It begins where it does not disturb, and yet
   !> keeps K - shift M of a free body clear of singular.
   subroutine shift_below(pencil, shift, error)
      type(vibration_pencil_t), intent(inout) :: pencil
      real(dp), intent(out) :: shift
      type(error_t), allocatable, intent(out) :: error
      real(dp), parameter :: nearest = 1.0e-11_dp, further = 30
      shift = -nearest*pencil%fastest
      do
         call pencil%factorise(shift, error)
         if (.not. allocated(error)) then
            if (pencil%below == 0) return
         else if (error%code /= status_singular_matrix .or. -shift > pencil%fastest) then
            return
         end if
         shift = further*shift
         if (-shift > further*pencil%fastest) exit
      end do
      if (.not. allocated(error)) call raise(error, status_not_converged, 'frequencies: the state is too unstable')
   end subroutine shift_below

   !> Those next to a value.
   subroutine find_near(pencil, wanted, shift, squares, modes, error)
      type(vibration_pencil_t), intent(inout) :: pencil
      integer, intent(in) :: wanted
      real(dp), intent(in) :: shift
      real(dp), allocatable, intent(out) :: squares(:), modes(:, :)
      type(error_t), allocatable, intent(out) :: error
      integer, allocatable :: order(:)
      real(dp) :: least
      call factorise_beside(pencil, shift, error)
      if (.not. allocated(error)) call lanczos(pencil, pencil%pattern%n, wanted, shift, squares, modes, least, error)
      if (allocated(error)) return
      if (size(squares) == 0) then
         call raise(error, status_not_converged, 'frequencies: no mode was found near '//text_of(frequency(shift)))
         return
      end if
      order = sorted_order(squares)
      squares = squares(order)
      modes = modes(:, order)
   end subroutine find_near

   subroutine factorise_beside(pencil, shift, error)
      type(vibration_pencil_t), intent(inout) :: pencil
      real(dp), intent(in) :: shift
      type(error_t), allocatable, intent(out) :: error
      call pencil%factorise(shift, error)
      if (.not. allocated(error)) return
      if (error%code /= status_singular_matrix) return
      deallocate (error)
      call raise(error, status_singular_matrix, 'frequencies: '//text_of(frequency(shift)) &
         //' is a frequency of the structure, near which modes cannot be looked for; take one beside it')
   end subroutine factorise_beside

   !> Each mode with its effective masses: (phi . M r)^2/(phi . M phi), r a unit motion along x, y or z of all there is.
   subroutine report(problem, kind, squares, modes, observer, error)
      type(equilibrium_t), intent(inout) :: problem
      type(mass_kind_t), intent(in) :: kind
      real(dp), intent(in) :: squares(:), modes(:, :) !< modes of unit length in M
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      type(linear_change_t) :: change
      type(vibration_t) :: vibration
      real(wp), allocatable :: along(:, :), rigid(:, :), carried(:, :)
      real(wp) :: scale
      integer :: i, k

      allocate (carried(problem%equations%n, ux:uz))
      do k = ux, uz
         allocate (rigid(n_nodal, size(problem%equations%number, 2)), source=0.0_wp)
         rigid(k, :) = 1
         call masses_times(problem%assembly, problem%structure, problem%state, kind, rigid, along, error)
         if (allocated(error)) return
         along = along + point_masses(problem%structure)*rigid
         vibration%whole_mass = sum(along(k, :))
         call gather(problem%equations, along, carried(:, k))
         deallocate (rigid)
      end do
      problem%internal_force = 0
      problem%external_force = 0
      problem%negative_pivots = 0
      change%alone = .true.
      allocate (change%motion(n_nodal, size(problem%equations%number, 2)))
      do i = 1, size(squares)
         call scatter(problem%equations, modes(:, i), change%motion)
         call normalise_mode(change%motion, scale)
         change%energy = 0.5_wp*squares(i)*scale**2
         vibration%frequency = frequency(squares(i))
         vibration%generalised_mass = scale**2
         vibration%effective_mass = matmul(modes(:, i), carried)**2
         call report_change(problem, change, vibration%frequency, control_frequencies, 0, observer, error, vibration)
         if (allocated(error)) return
      end do
   end subroutine report

   !> Cycles per unit of time; negative for growing motions.
   elemental real(dp) function frequency(square)
      real(dp), intent(in) :: square
      frequency = sign(sqrt(abs(square)), square)/two_pi
   end function frequency

   !> Factorise K - shift M.
   subroutine factorise(self, shift, error)
      class(vibration_pencil_t), intent(inout) :: self
      real(dp), intent(in) :: shift
      type(error_t), allocatable, intent(out) :: error
      if (allocated(self%compliance)) then
         call self%border%factorise(self%solver, self%stiffness - shift*self%mass, self%diagonal, self%pattern%team, &
                                    self%gradient, self%compliance, error)
         self%below = self%border%negative_pivots
      else
         call self%solver%factorise(self%stiffness - shift*self%mass, error)
         self%below = self%solver%negative_pivots
      end if
   end subroutine factorise

   !> See finshell_arpack.
   subroutine apply(self, x, kx, y, error)
      class(vibration_pencil_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: x(:), kx(:)
      real(dp), intent(inout), contiguous :: y(:)
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: b(:), z(:)
      if (allocated(self%compliance)) then
         b = [kx, 0*self%compliance]
         allocate (z(size(b)))
         call self%border%solve(self%solver, b, z, error)
         y = z(:size(y))
      else
         call self%solver%solve(kx, y, error)
      end if
      if (size(x) /= size(y)) y = 0
   end subroutine apply

   subroutine metric(self, x, y)
      class(vibration_pencil_t), intent(in) :: self
      real(dp), intent(in), contiguous :: x(:)
      real(dp), intent(inout), contiguous :: y(:)
      call self%pattern%multiply(self%mass, x, y)
   end subroutine metric
end module finshell_frequencies
