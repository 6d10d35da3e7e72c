!> The command history: columns of a history file as aligned text, or as a plot of characters.
module finshell_history_view
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
   use finshell_error, only: error_t, raise
   use finshell_field, only: name_t
   use finshell_history_table, only: find_column, history_table_t, number_at, read_history
   use finshell_kinds, only: wp
   use finshell_options, only: exit_input, exit_ok, options_t
   use finshell_resume, only: base_of
   use finshell_status, only: status_input_error
   use finshell_text, only: nearest_name
   use finshell_text_plot, only: linear_plot
   implicit none
   private
   public :: show_history

   character(len=*), parameter :: technical = ',negative_pivots,critical_point,residual,correction,snap,found_by,stabilisation,'

contains

   !> Print the columns that were asked for; of none what a reader wants to see, which leaves out how the increments were found.
   subroutine show_history(options, code)
      type(options_t), intent(in) :: options
      integer, intent(out) :: code
      type(history_table_t) :: table
      type(error_t), allocatable :: error
      integer, allocatable :: columns(:)

      code = exit_input
      call read_history(base_of(options%results)//'.history.csv', table, error)
      if (.not. allocated(error)) call choose_columns(options, table, columns, error)
      if (.not. allocated(error)) then
         if (size(table%words, 2) == 0) call raise(error, status_input_error, table%file//': no increment has converged yet')
      end if
      if (allocated(error)) then
         write (error_unit, '(a)') 'finshell: '//error%message
         return
      end if
      code = exit_ok
      if (options%plot) then
         call plot(table, columns)
      else
         call print_rows(table, columns)
      end if
   end subroutine show_history

   subroutine print_rows(table, columns)
      type(history_table_t), intent(in) :: table
      integer, intent(in) :: columns(:)
      integer, parameter :: narrowest = 14
      character(len=:), allocatable :: line, word
      integer :: k, row
      do row = 0, size(table%words, 2)
         line = ''
         do k = 1, size(columns)
            associate (name => table%names(columns(k))%text)
               word = name
               if (row > 0) word = short(table%words(columns(k), row)%text)
               line = line//right(word, max(narrowest, len(name)) + merge(1, 0, k > 1))
            end associate
         end do
         write (output_unit, '(a)') line
      end do
   end subroutine print_rows

   !> Places of the columns that were asked for. Error: there is no such column.
   subroutine choose_columns(options, table, columns, error)
      type(options_t), intent(in) :: options
      type(history_table_t), intent(in) :: table
      integer, allocatable, intent(out) :: columns(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: names, near
      integer :: i, k
      allocate (columns(0))
      if (size(options%words) < 2) then
         do i = 1, size(table%names)
            if (index(technical, ','//table%names(i)%text//',') == 0) columns = [columns, i]
         end do
         return
      end if
      do i = 2, size(options%words)
         k = find_column(table, options%words(i)%text)
         if (k == 0) then
            names = list_of(table%names)
            near = nearest_name(options%words(i)%text, names)
            if (near /= '') near = ", did you mean '"//near//"'?"
            call raise(error, status_input_error, table%file//": no column '"//options%words(i)%text//"'"//near//'; columns: ' &
                       //names)
            return
         end if
         columns = [columns, k]
      end do
   end subroutine choose_columns

   !> The second column over the first one, without rows where one of them is missing.
   subroutine plot(table, columns)
      type(history_table_t), intent(in) :: table
      integer, intent(in) :: columns(:)
      real(wp), allocatable :: x(:), y(:)
      logical, allocatable :: there(:)
      character(len=72), allocatable :: lines(:)
      integer :: i
      x = [(number_at(table, columns(1), i), i=1, size(table%words, 2))]
      y = [(number_at(table, columns(2), i), i=1, size(table%words, 2))]
      there = ieee_is_finite(x) .and. ieee_is_finite(y)
      lines = linear_plot(pack(x, there), pack(y, there), table%names(columns(1))%text, table%names(columns(2))%text)
      do i = 1, size(lines)
         write (output_unit, '(a)') trim(lines(i))
      end do
      if (size(lines) == 0) write (output_unit, '(a)') 'No row has both values.'
   end subroutine plot

   !> Seven digits are enough to read.
   function short(word) result(text)
      character(len=*), intent(in) :: word
      character(len=:), allocatable :: text
      character(len=16) :: buffer
      real(wp) :: number
      integer :: status
      text = word
      if (scan(word, '.') == 0) return
      read (word, *, iostat=status) number
      if (status /= 0) return
      write (buffer, '(g14.7)') number
      text = trim(adjustl(buffer))
   end function short

   pure function right(word, width) result(text)
      character(len=*), intent(in) :: word
      integer, intent(in) :: width
      character(len=width) :: text
      text = word
      text = adjustr(text)
   end function right

   pure function list_of(names) result(text)
      type(name_t), intent(in) :: names(:)
      character(len=:), allocatable :: text
      integer :: i
      text = names(1)%text
      do i = 2, size(names)
         text = text//', '//names(i)%text
      end do
   end function list_of
end module finshell_history_view
