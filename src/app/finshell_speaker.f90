!> The observer of a run: the process that speaks reports, all learn of its errors. Every process observes the same increments.
!> Whoever presses Ctrl-C ends the run through it (finshell_interrupt).
module finshell_speaker
   use finshell_error, only: error_t
   use finshell_interrupt, only: interrupted, is_terminal
   use finshell_observer, only: observer_t, raise_stop, record_t
   use finshell_progress_line, only: progress_line_t
   use finshell_reporter, only: reporter_t
   use finshell_state, only: linear_change_t, state_t
   use finshell_stations, only: stations_t
   use finshell_step, only: step_t
   use finshell_team, only: agree, leads, team_t
   implicit none
   private
   public :: speaker_t

   type, extends(observer_t) :: speaker_t
      type(reporter_t), pointer, private :: reporter => null()
      class(team_t), pointer, private :: team => null()
      type(progress_line_t) :: line
      type(stations_t) :: stations
   contains
      procedure :: take
      procedure :: begin_step
      procedure :: increment
      procedure :: wants_stop
   end type speaker_t

contains

   subroutine take(self, reporter, team)
      class(speaker_t), intent(inout) :: self
      type(reporter_t), intent(in), target :: reporter
      class(team_t), pointer, intent(in) :: team
      self%reporter => reporter
      self%team => team
      if (leads(team) .and. .not. reporter%quiet .and. is_terminal()) call self%line%enable()
   end subroutine take

   subroutine begin_step(self, steps, number, state)
      class(speaker_t), intent(inout) :: self
      type(step_t), intent(in) :: steps(:)
      integer, intent(in) :: number !< of the one that begins
      type(state_t), intent(in) :: state
      call self%reporter%begin_step(steps(number), number)
      call self%stations%begin(steps(number), number == size(steps))
      call self%line%begin_step(steps(number), number, size(steps), state%load_factor, state%time)
   end subroutine begin_step

   !> See finshell_observer.
   subroutine increment(self, state, record, error, change)
      class(speaker_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      type(error_t), allocatable, intent(out) :: error
      type(linear_change_t), intent(in), optional, target :: change
      if (self%stations%wanted) call self%stations%note(state, record)
      if (leads(self%team)) then
         call self%line%clear()
         call self%reporter%increment(state, record, error, change)
         if (.not. allocated(error)) call self%line%show(record)
         if (interrupted() .and. .not. allocated(error)) call raise_stop(error)
      end if
      call agree(self%team, error)
   end subroutine increment

   !> See finshell_observer.
   logical function wants_stop(self)
      class(speaker_t), intent(in) :: self
      wants_stop = interrupted() .and. leads(self%team)
   end function wants_stop
end module finshell_speaker
