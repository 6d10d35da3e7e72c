!> The history file NAME.history.csv: one row per converged increment, values in full precision, flushed at once.
!>
!> Header: increment,load_factor,iterations,negative_pivots,<monitor names>,critical_point,residual,correction,snap,
!> found_by,stabilisation, and of inputs with steps in time motion_columns (finshell_field). Names are quoted where CSV needs it.
module finshell_history
   use finshell_disk, only: cut_in_system, length_in_system, rename_in_system
   use finshell_error, only: error_t, raise, text_of
   use finshell_field, only: check_increment, increment_t, monitor_value, motion_columns, name_t
   use finshell_kinds, only: i8, wp
   use finshell_status, only: status_invalid_argument, status_io_error
   implicit none
   private
   public :: history_file_t, read_lines

   type :: history_file_t
      private
      integer :: unit = -1
      integer(i8) :: length = 0 !< bytes of the rows that are complete
      character(len=:), allocatable :: name
      type(name_t), allocatable :: monitors(:)
      logical :: in_time = .false. !< with the columns of the motion
   contains
      procedure :: create
      procedure :: publish
      procedure :: open_for_restart
      procedure :: append
      procedure :: close => close_history
      procedure, private :: open_unit
      procedure, private :: put
   end type history_file_t

   integer, parameter :: own_columns = 10 !< besides monitors and motion

contains

   !> Create the file, replacing an existing one, and write the header.
   subroutine create(self, name, monitors, error, in_time)
      class(history_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(name_t), intent(in) :: monitors(:)
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: in_time !< with the columns of the motion
      call self%open_unit(name, monitors, error)
      self%in_time = .false.
      if (present(in_time)) self%in_time = in_time
      if (.not. allocated(error)) call self%put(header(monitors, self%in_time), error)
   end subroutine create

   !> Rename the file, replacing another one of that name.
   subroutine publish(self, name, error)
      class(history_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      if (rename_in_system(self%name, name)) then
         self%name = name
      else
         call raise(error, status_io_error, name//': cannot give the history file its name')
      end if
   end subroutine publish

   !> Continue an existing file after increment `last`; later rows, and a row that was cut off, are dropped. What stays goes to a
   !> new file, for `publish`.
   subroutine open_for_restart(self, name, new_name, monitors, last, error, in_time)
      class(history_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name, new_name
      type(name_t), intent(in) :: monitors(:)
      integer, intent(in) :: last
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: in_time !< with the columns of the motion
      type(name_t), allocatable :: lines(:)
      character(len=:), allocatable :: head
      integer :: i, increment, reached, status
      head = header(monitors, .false.)
      if (present(in_time)) head = header(monitors, in_time)
      call read_lines(name, lines, error)
      if (allocated(error)) return
      if (size(lines) == 0) then
         call raise(error, status_io_error, name//': cannot restart: the history file is empty')
      else if (lines(1)%text /= head) then
         call raise(error, status_io_error, name//': cannot restart: the history file has the columns '//lines(1)%text &
            & //', expected '//head)
      else
         call self%create(new_name, monitors, error, in_time)
      end if
      reached = 0
      do i = 2, merge(0, size(lines), allocated(error))
         read (lines(i)%text, *, iostat=status) increment
         if (status /= 0 .or. increment > last .or. count_commas(lines(i)%text) /= columns(self)) cycle
         call self%put(lines(i)%text, error)
         reached = increment
         if (allocated(error)) exit
      end do
      if (.not. allocated(error) .and. reached < last) call raise(error, status_io_error, name//': cannot restart: the history ' &
         & //'ends with increment '//text_of(reached)//', expected is '//text_of(last))
   end subroutine open_for_restart

   !> Append one row. A row that is not finite is refused, but for what it declares missing: this is written as NaN.
   subroutine append(self, record, error)
      class(history_file_t), intent(inout) :: self
      type(increment_t), intent(in) :: record
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: row
      integer :: i
      call check_increment(record, self%monitors, error)
      if (.not. allocated(error) .and. self%in_time .and. .not. allocated(record%motion)) call raise(error, &
         & status_invalid_argument, self%name//': increment '//text_of(record%increment)//' has no values of the motion')
      if (allocated(error)) return
      row = text_of(record%increment)//','//exact(record%load_factor)//','//text_of(record%iterations)//',' &
         & //text_of(record%negative_pivots)
      do i = 1, size(self%monitors)
         row = row//','//exact(monitor_value(record, i))
      end do
      row = row//','//text_of(record%critical_point)//','//text_of(record%residual)//','//text_of(record%correction) &
         //','//text_of(record%snap)//','//text_of(record%found_by)//','//text_of(record%stabilisation)
      do i = 1, merge(size(motion_columns), 0, self%in_time)
         row = row//','//exact(record%motion(i))
      end do
      call self%put(row, error)
   end subroutine append

   subroutine close_history(self)
      class(history_file_t), intent(inout) :: self
      integer :: ignored
      ! allow(C181)
      if (self%unit /= -1) close (self%unit, iostat=ignored)
      self%unit = -1
   end subroutine close_history

   subroutine open_unit(self, name, monitors, error)
      class(history_file_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(name_t), intent(in) :: monitors(:)
      type(error_t), allocatable, intent(out) :: error
      character(len=256) :: reason
      integer :: status
      self%name = name
      self%monitors = monitors
      self%length = 0
      open (newunit=self%unit, file=name, status='replace', action='write', form='unformatted', access='stream', &
         & iostat=status, iomsg=reason)
      if (status == 0) return
      self%unit = -1
      call raise(error, status_io_error, name//': cannot create the history file: '//trim(reason))
   end subroutine open_unit

   subroutine put(self, line, error)
      class(history_file_t), intent(inout) :: self
      character(len=*), intent(in) :: line
      type(error_t), allocatable, intent(out) :: error
      character(len=256) :: reason
      integer :: status
      write (self%unit, iostat=status, iomsg=reason) line//new_line('a')
      if (status == 0) flush (self%unit, iostat=status, iomsg=reason)
      if (status == 0) status = merge(0, 1, length_in_system(self%name) >= self%length + len(line) + 1)
      if (status == 1) reason = 'the disk is full, or the file larger than allowed (ulimit -f)' ! gfortran does not tell
      if (status /= 0) then
         call raise(error, status_io_error, self%name//': cannot write the history file: '//trim(reason))
         call self%close()
         call cut_in_system(self%name, self%length)
      else
         self%length = self%length + len(line) + 1
      end if
   end subroutine put

   !> A number with the 17 digits that give it back bit for bit.
   pure function exact(x) result(text)
      real(wp), intent(in) :: x
      character(len=:), allocatable :: text
      character(len=32) :: buffer
      write (buffer, '(es25.16e3)') x
      text = trim(adjustl(buffer))
   end function exact

   !> Commas of a row without quotes.
   pure integer function columns(self)
      type(history_file_t), intent(in) :: self
      columns = own_columns - 1 + size(self%monitors) + merge(size(motion_columns), 0, self%in_time)
   end function columns

   function header(monitors, in_time) result(line)
      type(name_t), intent(in) :: monitors(:)
      logical, intent(in) :: in_time
      character(len=:), allocatable :: line
      integer :: i
      line = 'increment,load_factor,iterations,negative_pivots'
      do i = 1, size(monitors)
         line = line//','//quoted(monitors(i)%text)
      end do
      line = line//',critical_point,residual,correction,snap,found_by,stabilisation'
      do i = 1, merge(size(motion_columns), 0, in_time)
         line = line//','//trim(motion_columns(i))
      end do
   end function header

   !> A name as CSV wants it: in quotes, doubled inside, when it holds a comma, a quote or a blank at its ends.
   pure function quoted(name) result(text)
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: text
      integer :: i
      text = name
      if (scan(name, ',"'//new_line('a')) == 0 .and. len_trim(adjustl(name)) == len(name)) return
      text = '"'
      do i = 1, len(name)
         text = text//name(i:i)
         if (name(i:i) == '"') text = text//'"'
      end do
      text = text//'"'
   end function quoted

   pure integer function count_commas(line)
      character(len=*), intent(in) :: line
      integer :: i
      count_commas = 0
      do i = 1, len(line)
         if (line(i:i) == ',') count_commas = count_commas + 1
      end do
   end function count_commas

   !> The complete lines of a file: a last line without its end is left out.
   subroutine read_lines(name, lines, error)
      character(len=*), intent(in) :: name
      type(name_t), allocatable, intent(out) :: lines(:)
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: text
      character(len=256) :: reason
      integer :: unit, status, length, first, last, i
      length = 0
      open (newunit=unit, file=name, status='old', action='read', form='unformatted', access='stream', iostat=status, &
         & iomsg=reason)
      if (status == 0) then
         inquire (unit, size=length)
         allocate (character(len=length) :: text)
         read (unit, iostat=status, iomsg=reason) text
         close (unit)
      end if
      if (status /= 0) then
         call raise(error, status_io_error, name//': cannot read the history file: '//trim(reason))
         return
      end if
      allocate (lines(count([(text(i:i) == new_line('a'), i=1, length)])))
      first = 1
      do i = 1, size(lines)
         last = first + index(text(first:), new_line('a')) - 1
         lines(i)%text = text(first:last - 1)
         first = last + 1
      end do
   end subroutine read_lines
end module finshell_history
