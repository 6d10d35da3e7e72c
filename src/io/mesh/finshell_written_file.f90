!> Text files that others read: ours are marked, so that no file of somebody else is replaced; numbers lose nothing.
module finshell_written_file
   use finshell_error, only: error_t, raise
   use finshell_kinds, only: dp
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: written_file_t, signature, exact, row

   !> Stands within the first lines of our files. Others are not replaced: mostly they are the mesh that the input reads.
   character(len=*), parameter :: signature = 'Written by finshell'
   integer, parameter :: first_lines = 3

   !> The file: after a write that has failed nothing more is written.
   type :: written_file_t
      character(len=:), allocatable :: name
      integer, private :: unit = -1
      logical, private :: opened = .false., failed = .false.
      character(len=256), private :: reason = ''
   contains
      procedure :: create
      procedure :: put
      procedure :: finish
   end type written_file_t

contains

   !> Errors: a file of this name is there that finshell has not written. That it cannot be written `finish` says.
   subroutine create(self, name, error)
      class(written_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      integer :: status
      self%name = name
      if (foreign(name)) then
         call raise(error, status_io_error, name//': the file is there already, and finshell has not written it; take another ' &
                    //'name (name in &job) or another folder (-o)')
         return
      end if
      open (newunit=self%unit, file=name, status='replace', action='write', iostat=status, iomsg=self%reason)
      self%opened = status == 0
      self%failed = .not. self%opened
   end subroutine create

   !> A line.
   subroutine put(self, text)
      class(written_file_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      integer :: status
      if (self%failed) return
      write (self%unit, '(a)', iostat=status, iomsg=self%reason) text
      self%failed = status /= 0
   end subroutine put

   !> Close the file. Error: it could not be written.
   subroutine finish(self, error)
      class(written_file_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer :: status
      if (self%opened .and. self%failed) then
         close (self%unit)
      else if (self%opened) then
         close (self%unit, iostat=status, iomsg=self%reason)
         self%failed = status /= 0
      end if
      if (self%failed) call raise(error, status_io_error, self%name//': '//trim(self%reason))
   end subroutine finish

   !> Is there a file of this name without our signature?
   function foreign(name) result(yes)
      character(len=*), intent(in) :: name
      logical :: yes
      character(len=80) :: line
      integer :: i, unit, status
      inquire (file=name, exist=yes)
      if (.not. yes) return
      open (newunit=unit, file=name, status='old', action='read', iostat=status)
      if (status /= 0) return
      do i = 1, first_lines
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         yes = yes .and. index(line, signature) == 0
      end do
      close (unit)
   end function foreign

   !> Numbers with a blank between them.
   pure function row(numbers) result(text)
      integer, intent(in) :: numbers(:)
      character(len=:), allocatable :: text
      character(len=12*size(numbers)) :: buffer
      write (buffer, '(*(i0, 1x))') numbers
      text = trim(buffer)
   end function row

   !> A number with all its digits.
   pure function exact(x) result(text)
      real(dp), intent(in) :: x
      character(len=25) :: text
      write (text, '(es25.16e3)') x
      text = adjustl(text)
   end function exact
end module finshell_written_file
