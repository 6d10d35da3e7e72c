!> Result files of a session: those of a run, written when the host asks for it.
module finshell_session_files
   use finshell_error, only: error_t, raise
   use finshell_kinds, only: wp
   use finshell_monitor, only: restart_none
   use finshell_session, only: session_t
   use finshell_status, only: status_input_error
   implicit none
   private
   public :: write_state, close_files

contains

   !> Write the present state: NAME.vtkhdf, NAME.xdmf, NAME.history.csv. The first call creates the files; the state that they begin
   !> with is that of the call. Errors: a file that cannot be written, or others than those of the first call.
   subroutine write_state(session, name, error)
      type(session_t), intent(inout), target :: session
      character(len=*), intent(in) :: name !< with folder, without ending
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: ignored
      real(wp), allocatable :: no_levels(:)
      integer :: i
      if (allocated(session%reporter)) then
         if (session%reporter%base_name /= name) then
            call raise(error, status_input_error, "results of this model go to '"//session%reporter%base_name//"', found '"//name &
                       //"'; a model has one set of files")
            return
         end if
         call session%reporter%increment(session%problem%state, session%bell%last, error)
         return
      end if
      allocate (session%reporter)
      allocate (no_levels(0))
      associate (input => session%input, reporter => session%reporter)
         reporter%quiet = .true.
         reporter%cases = input%factors
         reporter%duration = session%bell%duration
         reporter%energy = session%bell%energy
         do i = 1, size(input%outputs) ! every state that is written has its fields
            input%outputs(i)%every = 1
            input%outputs(i)%last = .false.
            if (allocated(input%outputs(i)%load_levels)) deallocate (input%outputs(i)%load_levels)
            if (allocated(input%outputs(i)%times)) deallocate (input%outputs(i)%times)
            input%outputs(i)%restart = restart_none
         end do
         reporter%continued = session%bell%last%increment
         call reporter%open(name, input%text, session%problem, input%monitors, input%outputs, input%probes, no_levels, error)
         if (.not. allocated(error)) return
      end associate
      call close_files(session, ignored)
   end subroutine write_state

   subroutine close_files(session, error)
      type(session_t), intent(inout) :: session
      type(error_t), allocatable, intent(out) :: error
      integer :: i
      if (.not. allocated(session%reporter)) return
      do i = 1, size(session%reporter%parts)
         session%reporter%parts(i)%last_written = session%reporter%last%increment
      end do
      do i = 1, size(session%reporter%probes)
         session%reporter%probes(i)%last_written = session%reporter%last%increment
      end do
      call session%reporter%finish(session%problem%state, error)
      deallocate (session%reporter)
   end subroutine close_files
end module finshell_session_files
