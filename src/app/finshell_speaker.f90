!> The observer of a run: the process that speaks reports, all learn of its errors. Every process observes the same increments.
module finshell_speaker
   use finshell_error, only: error_t
   use finshell_observer, only: observer_t, record_t
   use finshell_reporter, only: reporter_t
   use finshell_state, only: linear_change_t, state_t
   use finshell_team, only: agree, leads, team_t
   implicit none
   private
   public :: speaker_t

   type, extends(observer_t) :: speaker_t
      type(reporter_t), pointer, private :: reporter => null()
      class(team_t), pointer, private :: team => null()
   contains
      procedure :: take
      procedure :: increment
   end type speaker_t

contains

   subroutine take(self, reporter, team)
      class(speaker_t), intent(inout) :: self
      type(reporter_t), intent(in), target :: reporter
      class(team_t), pointer, intent(in) :: team
      self%reporter => reporter
      self%team => team
   end subroutine take

   !> See finshell_observer.
   subroutine increment(self, state, record, error, change)
      class(speaker_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      type(error_t), allocatable, intent(out) :: error
      type(linear_change_t), intent(in), optional, target :: change
      if (leads(self%team)) call self%reporter%increment(state, record, error, change)
      call agree(self%team, error)
   end subroutine increment
end module finshell_speaker
