!> Equilibrium from a state near by, at what the end of a step prescribes: as after a change of the mesh.
module finshell_resettle
   use finshell_control, only: constraint_t
   use finshell_convergence, only: field_norms
   use finshell_descent, only: descend
   use finshell_error, only: error_t, raise
   use finshell_factor, only: factor_at
   use finshell_kinds, only: dp, wp
   use finshell_newton, only: newton_result_t, solve_increment
   use finshell_observer, only: record_t
   use finshell_problem, only: problem_t
   use finshell_state, only: state_t
   use finshell_status, only: status_not_converged
   use finshell_step, only: control_displacement, control_load, control_volume, convergence_t, mixed_never, prescribes_monitored, &
      step_t
   implicit none
   private
   public :: resettle

   real(wp), parameter :: usual_increment = 0.1_wp !< of the whole way from rest

contains

   !> Iterate from `state` to equilibrium: at its load factor or, where the step prescribes a displacement or a volume, at
   !> `value` of that. Newton's method as the step asks for it, then plain, then, under load, a descent. Errors: all have failed,
   !> or the step cannot be watched; the problem is then in `state`.
   subroutine resettle(problem, step, state, value, record, error, levels, predicted, stable, rescue)
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(state_t), intent(in) :: state !< of the mesh of the problem
      real(wp), intent(in) :: value !< of what is monitored
      type(record_t), intent(out) :: record
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: levels(2) !< of forces and moments, if there may be none at rest
      !> Stresses of the state for its first tangent; then corrections are weighed by what the state has moved from rest.
      real(wp), intent(in), optional :: predicted(:, :)
      !> A stable state is near: where Newton's method finds an unstable one, a descent under load looks for that.
      logical, intent(in), optional :: stable
      logical, intent(in), optional :: rescue !< by plain Newton and by a descent where the first iteration fails; default: yes
      type(newton_result_t) :: result, newton
      type(state_t) :: found
      type(constraint_t) :: constraint
      type(convergence_t) :: settings
      real(wp) :: least(2), whole(2)
      real(dp) :: now
      integer :: attempt, pivots
      logical :: doubtful, rescued

      call problem%watch_step(step, error)
      if (allocated(error)) return
      whole = 0
      if (present(predicted)) whole = usual_increment*moved(problem, state)
      problem%state = state
      call problem%accept()
      constraint%control = control_load
      if (prescribes_monitored(step%control)) &
         constraint%control = merge(control_volume, control_displacement, allocated(step%volumes))
      constraint%scaling = step%scaling
      constraint%target = factor_at(state, step%scaling)
      if (constraint%control /= control_load) constraint%target = value
      settings = step%convergence
      least = 0
      if (present(levels)) least = levels
      rescued = .true.
      if (present(rescue)) rescued = rescue
      do attempt = 1, merge(2, 1, rescued)
         if (attempt > 1) settings%mixed = mixed_never
         call solve_increment(problem, constraint, settings, least, result, predicted=predicted, whole=whole)
         record%iterations = record%iterations + result%iterations
         record%cuts = attempt - 1
         if (result%converged) exit
         call problem%restore()
      end do
      doubtful = rescued .and. .not. result%converged
      if (present(stable) .and. result%converged) doubtful = stable .and. problem%negative_pivots > 0
      if (doubtful .and. step%descent .and. constraint%control == control_load .and. allocated(problem%weight)) then
         newton = result
         found = problem%state
         pivots = problem%negative_pivots
         call problem%restore()
         call descend(problem, constraint%target, settings, least, huge(1.0_wp), result, step%scaling)
         record%iterations = record%iterations + result%iterations
         record%descended = result%converged
         if (newton%converged .and. .not. result%converged) then
            result = newton
            problem%state = found
            problem%negative_pivots = pivots
            call problem%evaluate(.false., error)
            if (allocated(error)) return
         end if
      end if
      if (.not. result%converged) then
         if (.not. allocated(result%reason)) result%reason = 'no equilibrium'
         call raise(error, status_not_converged, result%reason)
         return
      end if
      problem%state%increment = state%increment + 1
      call problem%accept()
      record%increment = problem%state%increment
      record%control = constraint%control
      record%negative_pivots = problem%negative_pivots
      record%regularised = result%regularised
      record%load_factor = problem%state%load_factor
      record%residual = result%residual
      record%correction = result%correction
      record%rounding = result%rounding
      call cpu_time(now)
      record%cpu_time = now
   end subroutine resettle

   !> How far the structure has moved from rest: norms as `correction_ratio` takes them.
   function moved(problem, state) result(norms)
      class(problem_t), intent(inout) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: norms(2)
      real(wp) :: x(problem%n)
      problem%state = state
      problem%base = state
      problem%base%displacement = 0
      problem%base%rotation = 0
      problem%base%rotation(1, :) = 1
      call problem%increment(x)
      norms = field_norms(x, problem%field)
   end function moved
end module finshell_resettle
