!> Limit points and bifurcation points: noticed between two equilibrium states, told apart, and what else is known of them.
!>
!> At a limit point the load rate along the path changes its sign; at a bifurcation point the tangent becomes singular while it
!> does not. An equilibrium state is therefore described by the negative pivots of its tangent and by the sense of the load
!> rate, the sign of increment . x_t with K x_t = d residual / d factor (the tangent to the path is (x_t, 1) up to a factor).
module finshell_stability
   use finshell_kinds, only: wp
   use finshell_error, only: error_t
   use finshell_problem, only: problem_t
   use finshell_control, only: arc_product
   use finshell_equations, only: field_pressure
   use finshell_newton, only: newton_result_t
   implicit none
   private
   public :: stability_t, find_stability, event_between, hidden_pair, event_name, smallest_eigenpair, load_cosine
   public :: no_event, limit_point, bifurcation_point, limit_and_bifurcation

   integer, parameter :: no_event = 0, limit_point = 1, bifurcation_point = 2, limit_and_bifurcation = 3

   type :: stability_t
      logical :: known = .false.
      integer :: negative_pivots = -1 !< -1: not known (unsymmetric matrix)
      integer :: determinant_sign = 0 !< 0: not known
      real(wp) :: sense = 0 !< of the load rate along the path: 1 rising, -1 falling, 0 not known: the way is not chosen yet
      real(wp) :: change = 0 !< of the load factor in the increment that led here
   end type stability_t

   integer, parameter :: inverse_iterations = 6

contains

   !> Stability at the state that has just converged. As long as nothing seems to happen, the tangent of the last iteration tells
   !> for nothing; it belongs to a state before the last correction, so a change is confirmed with the tangent of the state itself.
   subroutine find_stability(problem, scaling, result, first, before, after, solves)
      class(problem_t), intent(inout) :: problem
      integer, intent(in) :: scaling !< the factor that changed
      type(newton_result_t), intent(in) :: result
      logical, intent(in) :: first !< increment of all: its first tangent tells the stability before it
      type(stability_t), intent(inout) :: before
      type(stability_t), intent(out) :: after
      integer, intent(inout) :: solves !< linear solves so far
      type(error_t), allocatable :: error
      real(wp), allocatable :: x(:), x_t(:)

      after%known = result%regularised == 0
      after%negative_pivots = problem%negative_pivots
      after%determinant_sign = problem%determinant_sign
      after%change = problem%change(scaling)
      after%sense = sign(1.0_wp, after%change)
      allocate (x(problem%n), x_t(problem%n))
      call problem%increment(x)
      if (allocated(result%x_t)) after%sense = sign(1.0_wp, arc_product(x, result%x_t, problem%field))
      if (first .and. .not. before%known .and. after%known) &
         before = stability_t(.true., result%first_pivots, result%first_determinant)
      if (.not. abs(before%sense) > 0) before%sense = sign(1.0_wp, result%first_change)
      if (event_between(before, after) == no_event) return
      call problem%evaluate(.true., error, scaling=scaling)
      if (.not. allocated(error)) call problem%factorise(error)
      if (.not. allocated(error)) call problem%solve(problem%rate, x_t, error)
      solves = solves + 1
      if (allocated(error)) return
      after%negative_pivots = problem%negative_pivots
      after%determinant_sign = problem%determinant_sign
      after%sense = sign(1.0_wp, arc_product(x, x_t, problem%field))
   end subroutine find_stability

   !> What lies between two states of a path.
   pure function event_between(before, after) result(event)
      type(stability_t), intent(in) :: before, after
      integer :: event
      integer :: changes
      event = no_event
      if (.not. (before%known .and. after%known)) return
      changes = 0
      if (before%negative_pivots >= 0 .and. after%negative_pivots >= 0) then
         changes = abs(after%negative_pivots - before%negative_pivots)
      else if (before%determinant_sign*after%determinant_sign < 0) then
         changes = 1
      end if
      if (before%sense*after%sense < 0) then
         event = limit_point
         if (changes >= 2) event = limit_and_bifurcation
      else if (hidden_pair(before, after)) then
         event = limit_point
      else if (changes > 0) then
         event = bifurcation_point
      end if
   end function event_between

   !> The load rises at both states and has fallen between them, or the other way round: two limit points in one increment.
   pure function hidden_pair(before, after) result(yes)
      type(stability_t), intent(in) :: before, after
      logical :: yes
      yes = before%known .and. after%known .and. before%sense*after%sense > 0 .and. before%sense*after%change < 0
   end function hidden_pair

   pure function event_name(event) result(name)
      integer, intent(in) :: event
      character(len=:), allocatable :: name
      select case (event)
      case (limit_point); name = 'limit point'
      case (bifurcation_point); name = 'bifurcation point'
      case (limit_and_bifurcation); name = 'limit point and bifurcation point'
      case default; name = 'nothing'
      end select
   end function event_name

   !> Eigenvalue of smallest magnitude of the factorised tangent and its vector (largest displacement 1), by inverse iteration.
   subroutine smallest_eigenpair(problem, start, value, vector, error)
      class(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: start(:) !< a guess, anything not zero
      real(wp), intent(out) :: value
      real(wp), allocatable, intent(out) :: vector(:)
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: x(:)
      real(wp) :: shape(problem%n)
      integer :: i
      ! Nothing may be missing from the start: a guess along the load would hide vectors orthogonal to it.
      shape = [(1 + 0.5_wp*sin(2.7_wp*i), i=1, problem%n)]
      vector = start/max(norm2(start), tiny(1.0_wp)) + 0.1_wp*shape/norm2(shape)
      where (problem%field == field_pressure) vector = 0 ! they are eliminated
      allocate (x(problem%n))
      value = 0
      do i = 1, inverse_iterations
         vector = vector/norm2(vector)
         call problem%solve(vector, x, error)
         if (allocated(error)) return
         where (problem%field == field_pressure) x = 0
         value = dot_product(vector, x)/dot_product(x, x)
         vector = x
      end do
      vector = vector/sqrt(max(arc_product(vector, vector, problem%field), tiny(1.0_wp)*dot_product(vector, vector)))
   end subroutine smallest_eigenpair

   !> Cosine between a null vector and the load, over the displacements: 0 at a bifurcation point.
   pure function load_cosine(problem, vector) result(cosine)
      class(problem_t), intent(in) :: problem
      real(wp), intent(in) :: vector(:)
      real(wp) :: cosine
      real(wp), allocatable :: load(:)
      real(wp) :: norms
      integer :: c, k
      load = problem%rate
      if (allocated(problem%compliance)) then
         k = size(problem%compliance)
         do c = 1, k
            ! inflow raises a pressure, or presses against walls that do not yield
            load(:problem%n - k) = load(:problem%n - k) - problem%gradient(:, c)*problem%rate(problem%n - k + c) &
                                   /merge(problem%compliance(c), 1.0_wp, problem%compliance(c) > 0)
         end do
      end if
      norms = sqrt(arc_product(vector, vector, problem%field)*arc_product(load, load, problem%field))
      cosine = 0
      if (norms > 0) cosine = abs(arc_product(vector, load, problem%field))/norms
   end function load_cosine
end module finshell_stability
