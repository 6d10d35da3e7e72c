!> The file NAME.modes.csv: frequency and masses of each mode, a row a mode.
module finshell_mode_table
   use finshell_disk, only: rename_in_system
   use finshell_error, only: error_t, raise
   use finshell_field, only: name_t
   use finshell_history, only: read_lines
   use finshell_kinds, only: wp
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: mode_table_t

   character(len=*), parameter :: header = 'increment,frequency,generalised_mass,effective_mass_x,effective_mass_y,' &
                                           //'effective_mass_z,mass'

   type :: mode_table_t
      private
      logical :: begun = .false.
   contains
      procedure :: append
      procedure :: cut
   end type mode_table_t

contains

   !> Go on with the file of an earlier run, if there is one: rows behind an increment are dropped.
   subroutine cut(self, name, last, error)
      class(mode_table_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: last
      type(error_t), allocatable, intent(out) :: error
      type(name_t), allocatable :: lines(:)
      integer :: i, increment, status, unit
      logical :: exists
      inquire (file=name, exist=exists)
      if (.not. exists) return
      call read_lines(name, lines, error)
      if (allocated(error)) return
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

   !> Write a row; the first one begins the file anew. Error: it cannot be written.
   subroutine append(self, name, increment, values, error)
      class(mode_table_t), intent(inout) :: self
      character(len=*), intent(in) :: name !< of the file
      integer, intent(in) :: increment
      real(wp), intent(in) :: values(:) !< in the order of the header
      type(error_t), allocatable, intent(out) :: error
      character(len=256) :: reason
      integer :: unit, status, closed
      if (self%begun) then
         open (newunit=unit, file=name, status='old', position='append', action='write', iostat=status, iomsg=reason)
      else
         open (newunit=unit, file=name, status='replace', action='write', iostat=status, iomsg=reason)
         if (status == 0) write (unit, '(a)', iostat=status, iomsg=reason) header
      end if
      if (status == 0) then
         write (unit, '(i0,*(:,",",g0))', iostat=status, iomsg=reason) increment, values
         close (unit, iostat=closed)
         if (status == 0) status = closed
      end if
      self%begun = .true.
      if (status /= 0) call raise(error, status_io_error, name//': cannot write the modes: '//trim(reason))
   end subroutine append
end module finshell_mode_table
