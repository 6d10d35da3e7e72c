!> All steps of a job, one after the other.
module finshell_job
   use finshell_buckling, only: solve_buckling
   use finshell_dynamic, only: solve_dynamic
   use finshell_equations, only: free_part
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t
   use finshell_explicit, only: solve_explicit
   use finshell_frequencies, only: solve_frequencies
   use finshell_kinds, only: wp
   use finshell_linear_step, only: solve_linear
   use finshell_load_case, only: change_case
   use finshell_observer, only: observer_t, record_t
   use finshell_path, only: path_t
   use finshell_reporter, only: reporter_t
   use finshell_resettle, only: resettle
   use finshell_speaker, only: speaker_t
   use finshell_stage, only: change_stage, forget_path, is_same_stage, let_go
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   use finshell_team, only: agree
   use finshell_timed_step, only: solve_timed
   use finshell_step, only: control_buckling, control_dynamic, control_explicit, control_frequencies, &
      control_linear, control_timed, is_in_time, is_motion, leaves_state, prescribes_monitored, step_t
   implicit none
   private
   public :: follow_steps, follow_step, may_float

contains

   !> May rigid motions be free in a step and those behind it with the same supports?
   pure logical function may_float(structure, steps, first)
      type(structure_t), intent(in) :: structure
      type(step_t), intent(in) :: steps(:)
      integer, intent(in) :: first
      integer :: i
      may_float = .true.
      do i = first, size(steps)
         if (.not. is_same_stage(structure, first, i)) exit
         may_float = may_float .and. (steps(i)%control == control_frequencies .or. is_motion(steps(i)%control))
      end do
   end function may_float

   !> Follow them from the state of the problem. Errors: those of the first step that fails.
   subroutine follow_steps(steps, problem, path, reporter, speaker, error, velocity, from)
      type(step_t), intent(in) :: steps(:)
      type(equilibrium_t), intent(inout) :: problem
      type(path_t), intent(inout) :: path
      type(reporter_t), intent(inout) :: reporter
      type(speaker_t), intent(inout) :: speaker !< of the reporter
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: velocity(:, :) !< (n_nodal, nodes) and spins that the first step in time begins with
      integer, intent(in), optional :: from !< the step to begin with, or to go on with where the path is under way
      integer :: begin, i
      begin = 1
      if (present(from)) begin = from
      do i = begin, size(steps)
         call speaker%begin_step(steps, i, problem%state)
         call follow_step(steps, i, problem, path, speaker, error, velocity, resumes=i == begin)
         if (.not. allocated(error) .and. (leaves_state(steps(i)%control) .or. is_in_time(steps(i)%control))) &
            call reporter%checkpoint%end_step(i, error)
         call agree(problem%team, error)
         if (allocated(error)) return
      end do
   end subroutine follow_steps

   !> Follow one of the steps of a job from the state of the problem.
   subroutine follow_step(steps, i, problem, path, observer, error, velocity, resumes)
      type(step_t), intent(in) :: steps(:)
      integer, intent(in) :: i !< which one
      type(equilibrium_t), intent(inout) :: problem
      type(path_t), intent(inout) :: path
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: velocity(:, :) !< as for `follow_steps`
      logical, intent(in), optional :: resumes !< it goes on where the path is under way
      logical :: goes_on

      goes_on = .false.
      if (present(resumes)) goes_on = resumes
      call begin_stage(steps, i, problem, path, observer, error)
      if (.not. allocated(error)) call change_case(problem, steps(i)%case, error)
      if (.not. allocated(error) .and. leaves_state(steps(i)%control)) call path%ramps_before(problem, steps(i), observer, error)
      if (allocated(error)) return
      if (i == findloc(is_motion(steps%control), .true., dim=1) .and. present(velocity) .and. .not. allocated(path%course)) &
         problem%state%velocity = free_part(problem%equations, velocity)
      select case (steps(i)%control)
      case (control_linear); call solve_linear(problem, steps(i), observer, error)
      case (control_buckling); call solve_buckling(problem, steps(i), observer, error)
      case (control_dynamic); call solve_dynamic(problem, steps(i), path, observer, error)
      case (control_frequencies); call solve_frequencies(problem, steps(i), observer, error)
      case (control_explicit); call solve_explicit(problem, steps(i), observer, path%increments, path%iterations, error, &
                                                   path%course, path%underway)
      case default
         if (allocated(problem%state%velocity)) call come_to_rest(steps(i), problem, path, observer, error)
         if (allocated(error)) return
         if (steps(i)%control == control_timed) then
            call solve_timed(problem, steps(i), path, observer, error, goes_on)
         else
            call path%follow(problem, steps(i), observer, error, resume=goes_on .and. path%underway)
         end if
      end select
   end subroutine follow_step

   !> Supports and loads that come or go with a step. What that puts out of balance is let go before it; a motion begins with it.
   subroutine begin_stage(steps, i, problem, path, observer, error)
      type(step_t), intent(in) :: steps(:)
      integer, intent(in) :: i !< the step that begins
      type(equilibrium_t), intent(inout) :: problem
      type(path_t), intent(inout) :: path
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: part
      logical :: changes, starts

      starts = problem%state%increment == 0
      changes = .not. is_same_stage(problem%structure, problem%stage, i)
      if (changes) then
         if (allocated(problem%state%velocity) .and. .not. is_motion(steps(i)%control)) &
            call come_to_rest(steps(i), problem, path, observer, error)
         if (allocated(error)) return
         problem%may_float = may_float(problem%structure, steps, i)
         call change_stage(problem, i, error)
         call forget_path(path)
      end if
      if (allocated(error)) then
         error%message = "step '"//steps(i)%name//"': "//error%message
         return
      end if
      problem%stage = i
      if (.not. (changes .or. (starts .and. allocated(problem%state%followers))) .or. is_motion(steps(i)%control)) return
      if (starts) call problem%evaluate(.false., error)
      ! what was left out of balance before is nothing to let go
      part = 2*maxval(steps(max(i - 1, 1):i)%convergence%residual)
      if (.not. allocated(error)) call let_go(problem, part, error)
   end subroutine begin_stage

   !> The motion ends: equilibrium at what acts now, or at the present value of what the step prescribes. A step whose load is that
   !> of the motion would have nothing to do otherwise.
   subroutine come_to_rest(step, problem, path, observer, error)
      type(step_t), intent(in) :: step !< the one that begins
      type(equilibrium_t), intent(inout) :: problem
      type(path_t), intent(inout) :: path
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      type(record_t) :: record
      type(state_t) :: state
      real(wp) :: value

      deallocate (problem%state%velocity)
      if (allocated(problem%state%acceleration)) deallocate (problem%state%acceleration)
      call problem%accept()
      state = problem%state
      value = 0
      call problem%watch_step(step, error)
      if (allocated(error)) return
      if (prescribes_monitored(step%control)) value = problem%monitored(state)
      ! without a load there are no forces at rest, but those of the motion tell what is small
      call problem%evaluate(.false., error)
      if (allocated(error)) return
      call resettle(problem, step, state, value, record, error, &
                    max(path%mean_levels, [problem%force_level, problem%moment_level]))
      if (allocated(error)) then
         error%message = "step '"//step%name//"': the motion before it does not come to rest: "//error%message &
                         //'; let it go on with damping until it has settled'
         return
      end if
      path%underway = .false.
      path%increments = path%increments + 1
      path%iterations = path%iterations + record%iterations
      call observer%increment(problem%state, record, error)
   end subroutine come_to_rest
end module finshell_job
