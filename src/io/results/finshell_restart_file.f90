!> The file NAME.restart: what a run needs to go on, of its last increment or of all that it has written.
!>
!> A record that has been written is never touched again: the file of one record is replaced as a whole, by renaming, further
!> records are appended, and what a killed run has left of one is no record. Numbers are as in memory, bit for bit.
module finshell_restart_file
   use finshell_disk, only: rename_in_system
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: i8, wp
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: restart_file_t, restart_head_t, read_restart

   character(len=*), parameter :: mark = 'finshell restart 1'//new_line('a')
   integer(i8), parameter :: longest = 2_i8**40

   !> What belongs to the run as a whole.
   type :: restart_head_t
      character(len=:), allocatable :: input_file, input_text
      integer :: refine = 0 !< levels of refinement beyond what the input says
      integer(i8) :: model = 0 !< fingerprint of the mesh and all that was read beside the input
   end type restart_head_t

   type :: restart_file_t
      character(len=:), allocatable :: name
      type(restart_head_t) :: head
      logical :: keeps_all = .false.
      logical, private :: begun = .false. !< there is a file of this run
   contains
      procedure :: write => write_record
      procedure :: keep
   end type restart_file_t

contains

   !> Write the record of an increment, which replaces others or, where all are kept, comes behind them.
   subroutine write_record(self, increment, numbers, error)
      class(restart_file_t), intent(inout) :: self
      integer, intent(in) :: increment
      real(wp), intent(in) :: numbers(:)
      type(error_t), allocatable, intent(out) :: error
      character(len=256) :: reason
      integer :: status, unit
      logical :: appends
      appends = self%begun .and. self%keeps_all
      if (appends) then
         open (newunit=unit, file=self%name, status='old', action='write', form='unformatted', access='stream', position='append', &
               iostat=status, iomsg=reason)
      else
         open (newunit=unit, file=self%name//'~', status='replace', action='write', form='unformatted', access='stream', &
               iostat=status, iomsg=reason)
         associate (head => self%head)
            if (status == 0) write (unit, iostat=status, iomsg=reason) mark, &
               int([head%refine, len(head%input_file), len(head%input_text)], i8), head%model, head%input_file, head%input_text
         end associate
      end if
      if (status == 0) write (unit, iostat=status, iomsg=reason) int([increment, size(numbers)], i8), numbers, &
         int([size(numbers), increment], i8)
      if (status == 0) close (unit, iostat=status, iomsg=reason)
      if (status == 0 .and. .not. appends) then
         if (.not. rename_in_system(self%name//'~', self%name)) then
            status = 1
            reason = 'it cannot be given its name'
         end if
      end if
      self%begun = .true.
      if (status /= 0) call raise(error, status_io_error, self%name//': cannot be written: '//trim(reason))
   end subroutine write_record

   !> Go on with the file of an earlier run after an increment: later records are dropped.
   subroutine keep(self, last, error)
      class(restart_file_t), intent(inout) :: self
      integer, intent(in) :: last
      type(error_t), allocatable, intent(out) :: error
      type(restart_file_t) :: fresh
      type(restart_head_t) :: head
      integer, allocatable :: increments(:), kept(:)
      real(wp), allocatable :: numbers(:)
      integer :: i
      call read_restart(self%name, head, kept, error)
      if (allocated(error)) return
      kept = pack(kept, kept <= last)
      if (.not. self%keeps_all) kept = [last]
      fresh = restart_file_t(name=self%name//'~kept', head=self%head, keeps_all=.true.)
      do i = 1, size(kept)
         call read_restart(self%name, head, increments, error, kept(i), numbers)
         if (.not. allocated(error)) call fresh%write(kept(i), numbers, error)
         if (allocated(error)) return
      end do
      if (.not. rename_in_system(fresh%name, self%name)) &
         call raise(error, status_io_error, self%name//': cannot be replaced')
      self%begun = .true.
   end subroutine keep

   !> The head and the increments that are there, of the last record of each; and the numbers of one of them. Errors: no such file;
   !> a file of another kind; nothing in it.
   subroutine read_restart(name, head, increments, error, wanted, numbers)
      character(len=*), intent(in) :: name
      type(restart_head_t), intent(out) :: head
      integer, allocatable, intent(out) :: increments(:) !< in the order of the file, each once
      type(error_t), allocatable, intent(out) :: error
      integer, intent(in), optional :: wanted !< one of the increments
      real(wp), allocatable, intent(out), optional :: numbers(:)
      character(len=len(mark)) :: found
      character(len=256) :: reason
      integer(i8) :: length, lengths(3), place, first(2), last(2)
      integer :: status, unit

      allocate (increments(0))
      open (newunit=unit, file=name, status='old', action='read', form='unformatted', access='stream', iostat=status, iomsg=reason)
      if (status /= 0) then
         call raise(error, status_io_error, name//': cannot restart: '//trim(reason))
         return
      end if
      inquire (unit, size=length)
      found = ''
      read (unit, iostat=status) found, lengths, head%model
      if (status == 0 .and. found == mark .and. all(lengths(2:) >= 0) .and. sum(lengths(2:)) <= length) then
         head%refine = int(lengths(1))
         allocate (character(len=lengths(2)) :: head%input_file)
         allocate (character(len=lengths(3)) :: head%input_text)
         read (unit, iostat=status) head%input_file, head%input_text
      else
         status = 1
      end if
      do while (status == 0)
         inquire (unit, pos=place)
         read (unit, iostat=status) first
         if (status /= 0) exit
         if (first(2) < 0 .or. first(2) > longest .or. place + 8*(first(2) + 4) - 1 > length) exit
         read (unit, pos=place + 8*(first(2) + 2), iostat=status) last
         if (status /= 0 .or. any(last /= first([2, 1]))) exit
         increments = [pack(increments, increments /= first(1)), int(first(1))]
         if (.not. present(wanted)) cycle
         if (first(1) /= wanted) cycle
         if (allocated(numbers)) deallocate (numbers)
         allocate (numbers(first(2)))
         read (unit, pos=place + 16, iostat=status) numbers
         if (status == 0) read (unit, iostat=status) last
         if (status /= 0) exit
      end do
      close (unit)
      if (found /= mark) then
         call raise(error, status_io_error, name//': cannot restart: finshell has not written this file, or another version of it')
      else if (size(increments) == 0) then
         call raise(error, status_io_error, name//': cannot restart: the file is damaged')
      end if
      if (allocated(error) .or. .not. present(wanted)) return
      if (.not. any(increments == wanted)) call raise(error, status_io_error, name//': cannot restart from increment ' &
         //text_of(wanted)//': expected is one of '//list_of(increments))
   end subroutine read_restart

   function list_of(increments) result(text)
      integer, intent(in) :: increments(:)
      character(len=:), allocatable :: text
      integer, parameter :: most = 20
      integer :: i
      text = text_of(increments(1))
      do i = 2, min(size(increments), most)
         text = text//', '//text_of(increments(i))
      end do
      if (size(increments) > most) text = text//', ... '//text_of(increments(size(increments)))
      if (size(increments) == 1) text = text//" (restart = 'every' in &output keeps more)"
   end function list_of
end module finshell_restart_file
