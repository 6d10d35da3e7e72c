!> Locates a limit or bifurcation point inside an increment that passed it, between brackets (Illinois method, a bisection that
!> uses the values), by shorter arc-length increments from the same base.
module finshell_locate
   use finshell_kinds, only: wp
   use finshell_error, only: error_t
   use finshell_problem, only: problem_t
   use finshell_state, only: state_t
   use finshell_step, only: step_t, control_arc_length
   use finshell_control, only: arc_norm, arc_product, control_vector
   use finshell_observer, only: record_t
   use finshell_newton, only: newton_result_t
   use finshell_targets, only: targets_t
   use finshell_tracker, only: tracker_t, attempt_t
   use finshell_stability, only: stability_t, event_between, no_event, limit_point, limit_and_bifurcation, smallest_eigenpair, &
      load_cosine
   implicit none
   private
   public :: mark, location_t

   type :: location_t
      logical :: found = .false.
      real(wp), allocatable :: vector(:) !< null vector, largest displacement 1
      real(wp) :: cosine = 0 !< between null vector and load
      integer :: solves = 0 !< linear solves it took
   end type location_t

   integer, parameter :: most_trials = 25, most_failures = 4
   real(wp), parameter :: narrow = 1.0e-4_wp !< bracket, part of the increment
   real(wp), parameter :: small = 1.0e-3_wp !< test value, relative to those at the ends of the increment
   !> Tolerances of the trials, if the step's are wider: a test value needs a better equilibrium state than a path does.
   real(wp), parameter :: residual = 1.0e-5_wp, correction = 1.0e-4_wp

contains

   !> Note in the record what the increment passed; locate it on request. A point that cannot be located speaks against the
   !> increment, as it is easier to find in a shorter one, but not for ever.
   subroutine mark(tracker, problem, step, targets, before, attempt, after, result, record, place, cuts, complaint)
      type(tracker_t), intent(inout) :: tracker
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(targets_t), intent(in) :: targets
      type(stability_t), intent(in) :: before
      type(attempt_t), intent(inout) :: attempt
      type(stability_t), intent(inout) :: after
      type(newton_result_t), intent(inout) :: result
      type(record_t), intent(inout) :: record
      type(location_t), intent(out) :: place
      integer, intent(in) :: cuts
      character(len=:), allocatable, intent(inout) :: complaint

      record%negative_pivots = after%negative_pivots
      ! The first state of a branch does not lie beyond the point on the path that is left.
      if (attempt%control == control_vector) after%known = .false.
      record%event = event_between(before, after)
      if (record%event == no_event .or. .not. step%locate) return
      call locate(tracker, problem, step, targets, record%event, before, attempt, result, place)
      record%iterations = record%iterations + place%solves
      record%located = place%found
      record%load_cosine = place%cosine
      if (place%found) record%negative_pivots = problem%negative_pivots
      if (.not. place%found .and. cuts < min(2, step%maximum_cuts)) complaint = 'a critical point could not be located'
   end subroutine mark

   !> On success the state of the problem is the point, `attempt` and `result` are the increment that leads there. Else all is as
   !> before.
   subroutine locate(tracker, problem, step, targets, event, before, attempt, result, place)
      class(tracker_t), intent(inout) :: tracker
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(targets_t), intent(in) :: targets
      integer, intent(in) :: event
      type(stability_t), intent(in) :: before
      type(attempt_t), intent(inout) :: attempt
      type(newton_result_t), intent(inout) :: result
      type(location_t), intent(out) :: place
      type(state_t) :: beyond
      type(step_t) :: strict
      type(attempt_t) :: trial
      type(newton_result_t) :: trial_result
      type(error_t), allocatable :: error
      real(wp) :: length, low, high, f_low, f_high, f, part, whole
      integer :: i, failures, side
      logical :: limit

      limit = event == limit_point .or. event == limit_and_bifurcation
      beyond = problem%state
      strict = step
      strict%convergence%residual = min(residual, step%convergence%residual)
      strict%convergence%correction = min(correction, step%convergence%correction)
      call tracker%keep_increment(problem, step%scaling)
      length = arc_norm(tracker%overshoot, problem%field, tracker%overshoot_change, tracker%load_weight)
      low = 0
      high = 1
      call test(f_high)
      call problem%restore()
      call test(f_low)
      if (allocated(error) .or. .not. (length > 0 .and. f_low*f_high < 0)) then
         call go_back()
         return
      end if
      whole = min(abs(f_low), abs(f_high))
      failures = 0
      side = 0
      do i = 1, most_trials
         part = (low*f_high - high*f_low)/(f_high - f_low)
         if (mod(i, 5) == 0) part = 0.5_wp*(low + high)
         part = min(max(part, low + 0.02_wp*(high - low)), high - 0.02_wp*(high - low))
         trial = attempt_t(control=control_arc_length, size=part*length, landing=.true., interpolate=part)
         call tracker%try(problem, strict, targets, trial, trial_result)
         place%solves = place%solves + trial_result%iterations
         if (trial_result%converged) call test(f)
         if (.not. trial_result%converged .or. allocated(error)) then
            call problem%restore()
            failures = failures + 1
            if (failures > most_failures) exit
            ! Nearer to the base the iteration is safer.
            high = part
            f_high = sign(f_high, -f_low)
            cycle
         end if
         place%found = abs(f) <= small*whole .or. high - low <= narrow
         if (place%found) exit
         if (f*f_high > 0) then
            high = part
            f_high = f
            if (side == 1) f_low = 0.5_wp*f_low
            side = 1
         else
            low = part
            f_low = f
            if (side == -1) f_high = 0.5_wp*f_high
            side = -1
         end if
         call problem%restore()
      end do
      if (place%found) call find_null_vector()
      if (.not. place%found) then
         call go_back()
         return
      end if
      attempt = trial
      result = trial_result

   contains

      !> To the state where the increment ended, with its forces.
      subroutine go_back()
         type(error_t), allocatable :: ignored
         problem%state = beyond
         call problem%evaluate(.false., ignored, scaling=step%scaling)
      end subroutine go_back

      !> Passes zero at the point. Limit: load rate along the path; bifurcation: the eigenvalue that changes its sign.
      subroutine test(value)
         real(wp), intent(out) :: value
         real(wp), allocatable :: x(:), vector(:)
         logical :: other_side
         value = 0
         if (allocated(error)) return
         call problem%evaluate(.true., error, scaling=step%scaling)
         if (.not. allocated(error)) call problem%factorise(error)
         if (allocated(error)) return
         place%solves = place%solves + 1
         allocate (x(problem%n))
         if (limit) then
            call problem%solve(problem%rate, x, error)
            if (.not. allocated(error)) value = sign(1/arc_norm(x, problem%field, 1.0_wp, tracker%load_weight), &
               arc_product(tracker%overshoot, x, problem%field))
         else
            call smallest_eigenpair(problem, problem%rate, value, vector, error)
            if (problem%negative_pivots >= 0 .and. before%negative_pivots >= 0) then
               other_side = problem%negative_pivots /= before%negative_pivots
            else
               other_side = problem%determinant_sign /= before%determinant_sign
            end if
            value = merge(-abs(value), abs(value), other_side)
         end if
      end subroutine test

      subroutine find_null_vector()
         real(wp) :: value
         integer :: at
         call smallest_eigenpair(problem, problem%rate, value, place%vector, error)
         if (allocated(error)) then
            place%found = .false.
            return
         end if
         place%cosine = load_cosine(problem, place%vector)
         at = maxloc(abs(place%vector)*merge(1.0_wp, 0.0_wp, problem%field == 1), dim=1)
         place%vector = place%vector/place%vector(at)
      end subroutine find_null_vector
   end subroutine locate
end module finshell_locate
