!> A table of numbers in a file, rows of increments: modes (NAME.modes.csv), and probes.
module finshell_table_file
   use finshell_disk, only: rename_in_system
   use finshell_error, only: error_t, raise
   use finshell_field, only: name_t
   use finshell_history, only: read_lines
   use finshell_kinds, only: wp
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: table_file_t, mode_header

   character(len=*), parameter :: mode_header = 'increment,frequency,generalised_mass,effective_mass_x,effective_mass_y,' &
                                                //'effective_mass_z,mass'

   type :: table_file_t
      character(len=:), allocatable :: header !< names of the columns, the first one being increment
      logical, private :: begun = .false.
   contains
      procedure :: append
      procedure :: cut
   end type table_file_t

contains

   !> Go on with the file of an earlier run, if there is one: rows behind an increment are dropped.
   subroutine cut(self, name, last, error)
      class(table_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: last
      type(error_t), allocatable, intent(out) :: error
      type(name_t), allocatable :: lines(:)
      integer :: i, increment, status, unit
      logical :: exists
      inquire (file=name, exist=exists)
      if (.not. exists) return
      call read_lines(name, lines, error)
      if (allocated(error) .or. size(lines) == 0) return
      if (lines(1)%text /= self%header) then
         call raise(error, status_io_error, name//': cannot restart: the file has the columns '//lines(1)%text &
                    //', expected '//self%header)
         return
      end if
      open (newunit=unit, file=name//'~', status='replace', action='write', iostat=status)
      do i = 1, size(lines)
         increment = 0
         if (status == 0 .and. i > 1) read (lines(i)%text, *, iostat=status) increment
         if (status == 0 .and. increment <= last) write (unit, '(a)', iostat=status) lines(i)%text
      end do
      if (status == 0) close (unit, iostat=status)
      self%begun = status == 0
      if (self%begun) self%begun = rename_in_system(name//'~', name)
      if (.not. self%begun) call raise(error, status_io_error, name//': cannot be replaced')
   end subroutine cut

   !> Write rows of an increment; the first ones begin the file anew. Error: they cannot be written.
   subroutine append(self, name, increment, values, error)
      class(table_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name !< of the file
      integer, intent(in) :: increment
      real(wp), intent(in) :: values(:, :) !< (columns behind the increment, rows)
      type(error_t), allocatable, intent(out) :: error
      character(len=256) :: reason
      integer :: unit, status, closed, i
      if (self%begun) then
         open (newunit=unit, file=name, status='old', position='append', action='write', iostat=status, iomsg=reason)
      else
         open (newunit=unit, file=name, status='replace', action='write', iostat=status, iomsg=reason)
         if (status == 0) write (unit, '(a)', iostat=status, iomsg=reason) self%header
      end if
      if (status == 0) then
         do i = 1, size(values, 2)
            if (status == 0) write (unit, '(i0,*(:,",",g0))', iostat=status, iomsg=reason) increment, values(:, i)
         end do
         close (unit, iostat=closed)
         if (status == 0) status = closed
      end if
      self%begun = .true.
      if (status /= 0) call raise(error, status_io_error, name//': cannot be written: '//trim(reason))
   end subroutine append
end module finshell_table_file
