!> The log of iterations (verbose in &output): lines on the screen and in NAME.iterations.log, each at once.
module finshell_iteration_log
   use, intrinsic :: iso_fortran_env, only: output_unit
   use finshell_error, only: error_t, raise
   use finshell_listener, only: iteration_t, listener_t
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: iteration_log_t

   character(len=*), parameter :: headings = '     it  method            residual: forces    moments  correction    rotation' &
                                             //'  part made  negative pivots  factor'

   type, extends(listener_t) :: iteration_log_t
      integer, private :: unit = -1
      logical, private :: quiet = .false.
   contains
      procedure :: open => open_log
      procedure :: iteration => log_iteration
      procedure :: say
      procedure, private :: put
      procedure :: close => close_log
   end type iteration_log_t

contains

   !> Begin the file, or go on with that of an earlier run.
   subroutine open_log(self, name, quiet, continues, error)
      class(iteration_log_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: quiet !< nothing on the screen
      logical, intent(in) :: continues
      type(error_t), allocatable, intent(out) :: error
      character(len=256) :: reason
      integer :: status
      logical :: exists
      self%quiet = quiet
      inquire (file=name, exist=exists)
      if (continues .and. exists) then
         open (newunit=self%unit, file=name, status='old', position='append', action='write', iostat=status, iomsg=reason)
      else
         open (newunit=self%unit, file=name, status='replace', action='write', iostat=status, iomsg=reason)
      end if
      if (status == 0) return
      self%unit = -1
      call raise(error, status_io_error, name//': cannot write the log of iterations: '//trim(reason))
   end subroutine open_log

   !> See finshell_listener.
   subroutine log_iteration(self, iteration)
      class(iteration_log_t), intent(inout) :: self
      type(iteration_t), intent(in) :: iteration
      character(len=16) :: method
      character(len=160) :: line
      associate (i => iteration)
         method = i%method
         write (line, '(i7,2x,a16,2es11.3)') i%number, method, i%residual
         if (i%factorised) then
            write (line(48:), '(2es12.3,es11.3)') i%correction, i%rotation, i%part
            if (i%negative_pivots >= 0) write (line(83:), '(i17)') i%negative_pivots
         end if
         if (i%factorised .and. i%negative_pivots < 0) line(99:99) = '?'
         write (line(102:), '(g0.8)') i%factor
      end associate
      call self%put(trim(line))
   end subroutine log_iteration

   !> See finshell_listener: what is tried gets headings.
   subroutine say(self, text)
      class(iteration_log_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      call self%put(text)
      if (index(text, ' ') /= 1) call self%put(headings)
   end subroutine say

   !> A disk that is full ends the log, not the run.
   subroutine put(self, line)
      class(iteration_log_t), intent(inout) :: self
      character(len=*), intent(in) :: line
      integer :: status
      if (.not. self%quiet) write (output_unit, '(a)') line
      if (self%unit == -1) return
      write (self%unit, '(a)', iostat=status) line
      if (status == 0) flush (self%unit, iostat=status)
      if (status /= 0) call self%close()
   end subroutine put

   subroutine close_log(self)
      class(iteration_log_t), intent(inout) :: self
      integer :: ignored
      ! allow(C181)
      if (self%unit /= -1) close (self%unit, iostat=ignored)
      self%unit = -1
   end subroutine close_log
end module finshell_iteration_log
