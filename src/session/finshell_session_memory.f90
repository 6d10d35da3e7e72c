!> Checkpoints of a session in memory: go on from one as often as one likes.
module finshell_session_memory
   use finshell_checkpoint, only: record_of, restore
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise
   use finshell_host, only: host_t
   use finshell_kinds, only: wp
   use finshell_ledger, only: entry_t
   use finshell_observer, only: record_t
   use finshell_session, only: session_t
   use finshell_state, only: state_t
   use finshell_status, only: status_input_error
   use finshell_wishes, only: wishes_t
   implicit none
   private
   public :: memory_t, remember, go_back

   type :: memory_t
      private
      real(wp), allocatable :: numbers(:) !< unallocated: nothing is remembered
      type(host_t) :: host
      type(wishes_t) :: wishes
      type(state_t) :: state
      type(entry_t) :: entry
      real(wp), allocatable :: internal_force(:, :), external_force(:, :)
      type(record_t) :: last
      integer :: step = 1, filled = 0
      logical :: begun = .false., finished = .false.
   end type memory_t

contains

   subroutine remember(memory, session)
      type(memory_t), intent(inout) :: memory
      type(session_t), intent(inout) :: session
      memory%numbers = record_of(session%problem, session%path, session%step)
      memory%host = session%problem%host
      memory%wishes = session%wishes
      memory%state = session%problem%state
      memory%entry = session%problem%entry
      memory%internal_force = session%problem%internal_force
      memory%external_force = session%problem%external_force
      memory%last = session%bell%last
      memory%filled = session%bell%filled
      memory%step = session%step
      memory%begun = session%begun
      memory%finished = session%finished
   end subroutine remember

   !> Errors: nothing was remembered.
   subroutine go_back(memory, session, error)
      type(memory_t), intent(in) :: memory
      type(session_t), intent(inout) :: session
      type(error_t), allocatable, intent(out) :: error
      integer :: step
      if (.not. allocated(memory%numbers)) then
         call raise(error, status_input_error, 'there is no checkpoint to go back to; finshell_model_checkpoint makes one')
         return
      end if
      associate (problem => session%problem)
         problem%host = memory%host
         session%wishes = memory%wishes
         call restore(memory%numbers, problem, session%path, step, error)
         if (.not. allocated(error)) call problem%take_host(error)
         if (allocated(error)) return
         problem%state = memory%state
         problem%base = memory%state
         problem%iterate = memory%state
         ! those of a state in motion are not what `restore` finds
         problem%entry = memory%entry
         problem%base_entry = memory%entry
         problem%internal_force = memory%internal_force
         problem%external_force = memory%external_force
      end associate
      session%bell%last = memory%last
      session%bell%filled = memory%filled
      session%bell%reports = 0
      session%step = memory%step
      session%begun = memory%begun
      session%finished = memory%finished
   end subroutine go_back
end module finshell_session_memory
