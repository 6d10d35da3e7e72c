!> All steps of a job, one after the other.
module finshell_job
   use finshell_buckling, only: solve_buckling
   use finshell_dynamic, only: solve_dynamic
   use finshell_equations, only: equations_t, free_part
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t
   use finshell_explicit, only: solve_explicit
   use finshell_frequencies, only: solve_frequencies
   use finshell_kinds, only: wp
   use finshell_linear_step, only: solve_linear
   use finshell_load_case, only: change_case
   use finshell_observer, only: record_t
   use finshell_path, only: path_t
   use finshell_reporter, only: reporter_t
   use finshell_resettle, only: resettle
   use finshell_speaker, only: speaker_t
   use finshell_state, only: state_t
   use finshell_team, only: agree
   use finshell_step, only: control_buckling, control_displacement, control_dynamic, control_explicit, control_frequencies, &
      control_linear, control_volume, is_in_time, leaves_state, prescribes_monitored, step_t
   implicit none
   private
   public :: follow_steps

contains

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
      integer :: begin, first, i
      first = findloc(is_in_time(steps%control), .true., dim=1)
      begin = 1
      if (present(from)) begin = from
      do i = begin, size(steps)
         call speaker%begin_step(steps, i, problem%state)
         call change_case(problem, steps(i)%case, error)
         if (allocated(error)) return
         if (i == first .and. present(velocity) .and. .not. allocated(path%course)) &
            problem%state%velocity = free_part(problem%equations, velocity)
         select case (steps(i)%control)
         case (control_linear); call solve_linear(problem, steps(i), speaker, error)
         case (control_buckling); call solve_buckling(problem, steps(i), speaker, error)
         case (control_dynamic); call solve_dynamic(problem, steps(i), path, speaker, error)
         case (control_frequencies); call solve_frequencies(problem, steps(i), speaker, error)
         case (control_explicit); call solve_explicit(problem, steps(i), speaker, path%increments, path%iterations, error, &
                                                        path%course, path%underway)
         case default
            if (allocated(problem%state%velocity)) call come_to_rest(steps(i), problem, path, speaker, error)
            if (.not. allocated(error) .and. path%underway .and. i == begin) then
               call path%follow(problem, steps(i), speaker, error, resume=.true.)
            else if (.not. allocated(error)) then
               call path%follow(problem, steps(i), speaker, error)
            end if
         end select
         if (.not. allocated(error) .and. (leaves_state(steps(i)%control) .or. is_in_time(steps(i)%control))) &
            call reporter%checkpoint%end_step(i, error)
         call agree(problem%team, error)
         if (allocated(error)) return
      end do
   end subroutine follow_steps

   !> The motion ends: equilibrium at what acts now, or at the present value of what the step prescribes. A step whose load is that
   !> of the motion would have nothing to do otherwise.
   subroutine come_to_rest(step, problem, path, speaker, error)
      type(step_t), intent(in) :: step !< the one that begins
      type(equilibrium_t), intent(inout) :: problem
      type(path_t), intent(inout) :: path
      type(speaker_t), intent(inout) :: speaker
      type(error_t), allocatable, intent(out) :: error
      type(record_t) :: record
      type(state_t) :: state
      real(wp) :: value

      deallocate (problem%state%velocity)
      if (allocated(problem%state%acceleration)) deallocate (problem%state%acceleration)
      call problem%accept()
      state = problem%state
      value = 0
      if (step%control == control_volume) call problem%watch_volume(error, step%element_set)
      if (step%control == control_displacement) call problem%watch(step%node_set, step%component, error)
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
      call speaker%increment(problem%state, record, error)
   end subroutine come_to_rest
end module finshell_job
