!> Linear buckling: K phi = -factor K_geo phi about the unloaded state or about an equilibrium state.
!>
!> K is the tangent at the state. K_geo is what a load factor of 1 adds to it: the geometric part for the resultants of the linear
!> solution, at the geometry of the state, and the load stiffness of follower pressures. It is exact, a difference of two
!> tangents that differ in nothing else; the change of the geometry before buckling is left out, as usual. Fibres that act in
!> tension only count for K where the linear solution stretches them (finshell_linear_step), first that of the constant loads.
module finshell_buckling
   use finshell_factor, only: by_load_factor, extrapolate, factors_at
   use finshell_kinds, only: wp, dp
   use finshell_freedoms, only: n_nodal
   use finshell_arpack, only: pencil_t, lanczos
   use finshell_assembly, only: predict_stress
   use finshell_batch, only: n_resultants
   use finshell_connectors, only: add_geometric
   use finshell_error, only: error_t, raise, text_of
   use finshell_equations, only: scatter
   use finshell_equilibrium, only: equilibrium_t
   use finshell_linear_solver, only: linear_solver_t
   use finshell_growing, only: grown_by, part_of_growth
   use finshell_linear_step, only: growing_by, linear_motion, report_change
   use finshell_mesh_sorting, only: sorted_order
   use finshell_mode, only: normalise_mode
   use finshell_observer, only: observer_t
   use finshell_sparsity, only: sparsity_t
   use finshell_state, only: linear_change_t
   use finshell_status, only: status_invalid_argument, status_not_converged, status_singular_matrix
   use finshell_step, only: step_t, control_buckling
   use finshell_symmetric_matrix, only: make_symmetric, symmetric_pattern
   use finshell_team, only: largest_of
   implicit none
   private
   public :: solve_buckling, buckling_matrices

   type, extends(pencil_t) :: buckling_pencil_t
      type(sparsity_t) :: pattern !< symmetric
      type(linear_solver_t) :: solver !< holds K, or K + shift K_geo
      real(dp), allocatable :: stiffness(:), geometric(:)
      logical :: shifted = .false.
   contains
      procedure :: apply
      procedure :: metric
   end type buckling_pencil_t

contains

   !> Find modes and give each to the observer as an increment: its load factor is the critical one, its displacements are those of
   !> the mode, the largest displacement of a node being 1. The state stays.
   !>
   !> Errors: loads with an unsymmetric stiffness; a state that is not stable; no mode found; modes that would be missing.
   subroutine solve_buckling(problem, step, observer, error)
      type(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      type(buckling_pencil_t) :: pencil
      type(linear_change_t) :: change
      real(dp), allocatable :: factors(:), modes(:, :)
      real(dp) :: shift
      real(wp) :: scale
      integer, allocatable :: order(:)
      integer :: i, solutions

      call problem%accept()
      if (size(problem%external%turning_nodes) > 0) then
         call raise(error, status_invalid_argument, 'buckling: a moment acts at node '//text_of(problem%external%turning_nodes(1)) &
            //', which can turn about several axes; such a moment is not conservative')
         return
      end if
      call buckling_matrices(problem, pencil%stiffness, pencil%geometric, change%toward, solutions, error)
      if (.not. allocated(error)) call take_symmetric(problem, pencil, error)
      pencil%solver%options = problem%solver%options
      if (.not. allocated(error)) call pencil%solver%analyse(pencil%pattern, error, problem%solver)
      if (allocated(error)) return
      shift = 0
      if (abs(step%near) > 0) shift = step%near - problem%state%load_factor
      call find_modes(pencil, step%modes, problem%state%load_factor, shift, factors, modes, error)
      if (allocated(error)) return

      order = sorted_order(factors)
      change%alone = .true.
      problem%internal_force = 0
      problem%external_force = 0
      problem%negative_pivots = 0
      allocate (change%motion(n_nodal, size(problem%equations%number, 2)))
      do i = 1, size(order)
         call scatter(problem%equations, modes(:, order(i)), change%motion)
         call normalise_mode(change%motion, scale)
         change%energy = 0.5_wp*scale**2 ! modes have unit length in K
         call report_change(problem, change, problem%state%load_factor + factors(order(i)), control_buckling, &
                            merge(solutions, 0, i == 1), observer, error)
         if (allocated(error)) exit
      end do
   end subroutine solve_buckling

   !> K and K_geo of the state, in the pattern of the problem. Constant loads that are not there yet count for K.
   subroutine buckling_matrices(problem, stiffness, geometric, toward, solutions, error)
      type(equilibrium_t), intent(inout) :: problem
      real(dp), allocatable, intent(out) :: stiffness(:), geometric(:)
      real(wp), allocatable, intent(out) :: toward(:, :) !< (n_nodal, nodes) decides which fibres act, see `linear_motion`
      integer, intent(out) :: solutions !< that it took to find them
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: constant(:, :), proportional(:, :), stress(:, :, :)
      real(wp) :: constant_change

      constant_change = 0
      if (problem%has_constants) constant_change = 1 - problem%state%constant_factor
      if (abs(constant_change) > 0) then
         call linear_motion(problem, 0.0_wp, constant_change, constant, toward, solutions, error)
         if (.not. allocated(error)) call linear_motion(problem, 1.0_wp, 0.0_wp, proportional, toward, solutions, error, constant)
      else
         call linear_motion(problem, 1.0_wp, 0.0_wp, proportional, toward, solutions, error)
         constant = 0*proportional
      end if
      if (allocated(error)) return
      allocate (stress(n_resultants, problem%assembly%elements, 2))
      call predict_stress(problem%assembly, problem%structure, problem%state, constant, stress(:, :, 1), toward=toward)
      call predict_stress(problem%assembly, problem%structure, problem%state, constant + proportional, stress(:, :, 2), &
                          toward=toward)
      if (allocated(problem%structure%growths)) then
         call add_growth(problem, growing_by(problem, 0.0_wp, constant_change), stress(:, :, 1))
         call add_growth(problem, growing_by(problem, 1.0_wp, constant_change), stress(:, :, 2))
         ! the material stays as it is: growth has changed the stress and nothing else
         problem%state%growing = factors_at(problem%state, size(problem%equations%motion, 3))
      end if
      problem%state%constant_factor = problem%state%constant_factor + constant_change
      call problem%evaluate_toward(.true., error, toward, stress=stress(:, :, 1))
      if (.not. allocated(error)) then
         call add_geometric(problem%external%list, problem%structure, problem%equations, problem%state, constant, problem%values)
         stiffness = problem%values
         call extrapolate(problem%state, by_load_factor, 1.0_wp)
         call problem%evaluate_toward(.true., error, toward, stress=stress(:, :, 2))
      end if
      if (.not. allocated(error)) then
         call add_geometric(problem%external%list, problem%structure, problem%equations, problem%state, constant + proportional, &
                            problem%values)
         geometric = problem%values - stiffness
      end if
      call problem%restore()
   end subroutine buckling_matrices

   !> Add what a change of growth adds to the resultants where nothing moves, linearised.
   subroutine add_growth(problem, change, stress)
      type(equilibrium_t), intent(in) :: problem
      real(wp), intent(in) :: change(:) !< (factors)
      real(wp), intent(inout) :: stress(:, :)
      real(wp), allocatable :: after(:, :), before(:, :), nothing(:, :)
      real(wp) :: part
      part = part_of_growth(problem%structure, problem%state, change)
      if (.not. part > 0) return
      allocate (after, before, mold=stress)
      allocate (nothing(n_nodal, size(problem%equations%number, 2)), source=0.0_wp)
      call predict_stress(problem%assembly, problem%structure, grown_by(problem%state, part*change), nothing, after)
      call predict_stress(problem%assembly, problem%structure, grown_by(problem%state, -part*change), nothing, before)
      stress = stress + (after - before)/(2*part)
   end subroutine add_growth

   !> Both matrices in symmetric storage. Error: a pressure that is not conservative.
   subroutine take_symmetric(problem, pencil, error)
      type(equilibrium_t), intent(in) :: problem
      type(buckling_pencil_t), intent(inout) :: pencil
      type(error_t), allocatable, intent(out) :: error
      real(dp), parameter :: rounding = 1.0e-9_dp
      real(dp) :: difference
      call symmetric_pattern(problem, 'buckling', pencil%pattern, error)
      if (.not. allocated(error)) call make_symmetric(problem, pencil%pattern, pencil%stiffness, difference, error)
      if (.not. allocated(error)) call make_symmetric(problem, pencil%pattern, pencil%geometric, difference, error)
      if (allocated(error)) return
      if (difference > rounding*maxval(abs(pencil%geometric))) call raise(error, status_invalid_argument, 'buckling: the ' &
         //'pressure is not conservative, as part of the edge of the pressurised elements is free to move')
   end subroutine take_symmetric

   !> Load factors (counted from the state) and modes.
   subroutine find_modes(pencil, wanted, load_factor, shift, factors, modes, error)
      type(buckling_pencil_t), intent(inout) :: pencil
      integer, intent(in) :: wanted
      real(dp), intent(in) :: load_factor !< of the state, for messages
      real(dp), intent(in) :: shift !< 0: the lowest positive factors
      real(dp), allocatable, intent(out) :: factors(:), modes(:, :)
      type(error_t), allocatable, intent(out) :: error
      !> Factors larger than this multiple of the smallest magnitude are rounding errors of an infinite one.
      real(dp), parameter :: infinite = 1.0e9_dp
      !> One lies on either side of a shift this close to a factor.
      real(dp), parameter :: aside = 1.0e-5_dp
      integer, parameter :: most_attempts = 3
      real(dp) :: least, largest(1)
      integer, allocatable :: kept(:)
      integer :: attempt, i, more, below, lost

      more = 0
      do attempt = 1, most_attempts
         call pencil%solver%factorise(pencil%stiffness, error)
         if (allocated(error)) return
         if (pencil%solver%negative_pivots /= 0) then
            call raise(error, status_invalid_argument, 'buckling: the tangent at load factor '//text_of(load_factor) &
               //' is not positive definite ('//text_of(pencil%solver%negative_pivots) &
               //' negative pivots): the state is unstable already')
            return
         end if
         largest = maxval(abs(pencil%geometric))
         call largest_of(pencil%pattern%team, largest)
         if (.not. largest(1) > 0) then
            call raise(error, status_not_converged, 'buckling: the load causes no stress that could make the structure buckle')
            return
         end if
         pencil%shifted = abs(shift) > 0
         if (pencil%shifted) then
            call factorise_beside(pencil, load_factor, shift, error)
            if (allocated(error)) return
         end if
         call lanczos(pencil, pencil%pattern%n, min(wanted + more, pencil%pattern%n - 1), shift, factors, modes, least, error)
         if (allocated(error)) return
         if (.not. pencil%shifted) then
            kept = pack([(i, i=1, size(factors))], factors > 0 .and. factors < infinite*least)
            factors = factors(kept)
            modes = modes(:, kept)
         end if
         if (size(factors) == 0) then
            call raise(error, status_not_converged, 'buckling: no critical load factor was found' &
               //trim(merge(' above that of the state: this load stabilises ', ' near that of the step                         ', &
                            .not. pencil%shifted)))
            return
         end if
         if (pencil%shifted) exit
         ! The negative pivots count the factors below: none must be missing.
         below = count(factors < maxval(factors)*(1 - aside))
         call factorise_beside(pencil, load_factor, maxval(factors)*(1 - aside), error)
         if (allocated(error)) return
         lost = pencil%solver%negative_pivots - below
         if (lost <= 0) exit
         more = more + lost + 2
         if (attempt == most_attempts) call raise(error, status_not_converged, 'buckling: ' &
            //text_of(lost)//' modes below load factor '//text_of(maxval(factors))//' were not found')
         if (allocated(error)) return
      end do
      if (.not. pencil%shifted .and. size(factors) > wanted) then
         kept = sorted_order(factors)
         modes = modes(:, kept(:wanted))
         factors = factors(kept(:wanted))
      end if
   end subroutine find_modes

   !> Factorise K + shift K_geo.
   subroutine factorise_beside(pencil, load_factor, shift, error)
      type(buckling_pencil_t), intent(inout) :: pencil
      real(dp), intent(in) :: load_factor, shift
      type(error_t), allocatable, intent(out) :: error
      call pencil%solver%factorise(pencil%stiffness + shift*pencil%geometric, error)
      if (.not. allocated(error)) return
      if (error%code /= status_singular_matrix) return
      deallocate (error)
      call raise(error, status_singular_matrix, 'buckling: the load factor '//text_of(load_factor + shift) &
         //' is a critical one, near which modes cannot be looked for; take one beside it')
   end subroutine factorise_beside

   !> See finshell_arpack; A = -K_geo.
   subroutine apply(self, x, kx, y, error)
      class(buckling_pencil_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: x(:), kx(:)
      real(dp), intent(inout), contiguous :: y(:)
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: b(:)
      if (self%shifted) then
         call self%solver%solve(kx, y, error)
      else
         allocate (b(size(x)))
         call self%pattern%multiply(self%geometric, x, b)
         b = -b
         call self%solver%solve(b, y, error)
      end if
   end subroutine apply

   subroutine metric(self, x, y)
      class(buckling_pencil_t), intent(in) :: self
      real(dp), intent(in), contiguous :: x(:)
      real(dp), intent(inout), contiguous :: y(:)
      call self%pattern%multiply(self%stiffness, x, y)
   end subroutine metric
end module finshell_buckling
