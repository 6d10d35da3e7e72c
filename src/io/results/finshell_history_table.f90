!> A history file as a table of words: names of the columns and rows, for printing.
module finshell_history_table
   use finshell_error, only: error_t, raise, text_of
   use finshell_field, only: name_t
   use finshell_history, only: read_lines
   use finshell_kinds, only: wp
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: history_table_t, read_history, find_column, number_at, own_columns

   !> The columns that every history has, beside monitors, factors of cases and motion.
   character(len=*), parameter :: own_columns = ',increment,load_factor,iterations,negative_pivots,critical_point,residual,' &
                                  //'correction,snap,found_by,stabilisation,'

   type :: history_table_t
      character(len=:), allocatable :: file
      type(name_t), allocatable :: names(:)
      type(name_t), allocatable :: words(:, :) !< (columns, rows)
   end type history_table_t

contains

   !> Read NAME.history.csv. Errors: no such file; a row with more or fewer values than there are columns; no number.
   subroutine read_history(file, table, error)
      character(len=*), intent(in) :: file
      type(history_table_t), intent(out) :: table
      type(error_t), allocatable, intent(out) :: error
      type(name_t), allocatable :: lines(:), words(:)
      integer :: i, k, status
      real(wp) :: number

      table%file = file
      call read_lines(file, lines, error)
      if (allocated(error)) return
      if (size(lines) > 0) call split(lines(1)%text, table%names)
      if (size(lines) == 0) allocate (table%names(0))
      if (find_column(table, 'increment') /= 1 .or. find_column(table, 'load_factor') /= 2) then
         call raise(error, status_io_error, file//':1: this is no history of a run: its first columns are not increment and ' &
                    //'load_factor')
         return
      end if
      allocate (table%words(size(table%names), size(lines) - 1))
      do i = 2, size(lines)
         call split(lines(i)%text, words)
         if (size(words) /= size(table%names)) then
            call raise(error, status_io_error, file//':'//text_of(i)//': '//text_of(size(table%names)) &
                       //' values are expected, found '//text_of(size(words)))
            return
         end if
         do k = 1, size(words)
            read (words(k)%text, *, iostat=status) number
            if (status /= 0 .or. words(k)%text == '') then
               call raise(error, status_io_error, file//':'//text_of(i)//': '//table%names(k)%text//" = '"//words(k)%text &
                          //"': expected a number")
               return
            end if
            table%words(k, i - 1) = words(k)
         end do
      end do
   end subroutine read_history

   !> The place of a column; 0: there is none of this name.
   pure integer function find_column(table, name) result(k)
      type(history_table_t), intent(in) :: table
      character(len=*), intent(in) :: name
      do k = 1, size(table%names)
         if (table%names(k)%text == name) return
      end do
      k = 0
   end function find_column

   !> A value as a number; NaN where it is missing.
   real(wp) function number_at(table, column, row) result(number)
      type(history_table_t), intent(in) :: table
      integer, intent(in) :: column, row
      integer :: status
      read (table%words(column, row)%text, *, iostat=status) number
      if (status /= 0) number = 0 ! `read_history` has read it before
   end function number_at

   !> The values of a line, without the quotes of CSV.
   pure subroutine split(line, words)
      character(len=*), intent(in) :: line
      type(name_t), allocatable, intent(out) :: words(:)
      character(len=:), allocatable :: word
      integer :: i, n
      logical :: quoted
      allocate (words(1 + count([(line(i:i) == ',', i=1, len(line))])))
      word = ''
      n = 0
      quoted = .false.
      do i = 1, len(line)
         if (line(i:i) == '"') then
            if (quoted .eqv. .false.) then
               if (i > 1) then
                  if (line(i - 1:i - 1) == '"') word = word//'"' ! a doubled one
               end if
            end if
            quoted = .not. quoted
         else if (line(i:i) == ',' .and. .not. quoted) then
            n = n + 1
            words(n) = name_t(word)
            word = ''
         else if (line(i:i) /= achar(13)) then
            word = word//line(i:i)
         end if
      end do
      n = n + 1
      words(n) = name_t(word)
      words = words(:n)
   end subroutine split
end module finshell_history_table
