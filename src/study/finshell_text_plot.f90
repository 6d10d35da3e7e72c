!> Plots made of characters: both axes logarithmic, or both linear.
module finshell_text_plot
   use finshell_kinds, only: wp
   implicit none
   private
   public :: text_plot, linear_plot

   integer, parameter :: columns = 54, rows = 14, margin = 11

contains

   !> Lines of a plot of points (x, y > 0), each drawn as its mark, the later one where two meet. Empty where there is
   !> nothing to draw.
   pure function text_plot(x, y, marks, x_name, y_name, level) result(lines)
      real(wp), intent(in) :: x(:), y(:)
      character, intent(in) :: marks(:)
      character(len=*), intent(in) :: x_name, y_name
      real(wp), intent(in), optional :: level !< of y, drawn as a line
      character(len=72), allocatable :: lines(:)
      real(wp) :: bottom, left, right, top
      integer :: column, i, row

      allocate (lines(0))
      if (count(x > 0 .and. y > 0) == 0) return
      left = floor(log10(minval(x, mask=x > 0 .and. y > 0)))
      right = max(left + 1, real(ceiling(log10(maxval(x, mask=x > 0 .and. y > 0))), wp))
      bottom = floor(log10(minval(y, mask=x > 0 .and. y > 0)))
      top = ceiling(log10(maxval(y, mask=x > 0 .and. y > 0)))
      if (present(level)) bottom = min(bottom, real(floor(log10(level)), wp))
      if (present(level)) top = max(top, real(ceiling(log10(level)), wp))
      top = max(top, bottom + 1)
      deallocate (lines)
      allocate (lines(rows + 4))
      lines = ''
      lines(1) = y_name
      do row = 0, rows
         lines(row + 2) (margin:margin) = '|'
      end do
      ! decades
      do i = nint(bottom), nint(top)
         row = nint(rows*(top - i)/(top - bottom))
         write (lines(row + 2) (:margin - 1), '(es8.0e2)') 10.0_wp**i
         lines(row + 2) (margin:margin) = '+'
      end do
      if (present(level)) then
         row = nint(rows*(top - log10(level))/(top - bottom))
         lines(row + 2) (margin + 1:margin + columns) = repeat('- ', columns/2)
      end if
      lines(rows + 3) (margin:) = '+'//repeat('-', columns)
      lines(rows + 4) = ''
      do i = nint(left), nint(right)
         column = margin + nint(columns*(i - left)/(right - left))
         lines(rows + 3) (column:column) = '+'
         if (column + 1 <= len(lines)) write (lines(rows + 4) (max(1, column - 5):column + 2), '(es8.0e2)') 10.0_wp**i
      end do
      lines = [character(len=72) :: lines, repeat(' ', margin)//x_name]
      do i = 1, size(x)
         if (.not. (x(i) > 0 .and. y(i) > 0)) cycle
         row = nint(rows*(top - log10(y(i)))/(top - bottom))
         column = margin + nint(columns*(log10(x(i)) - left)/(right - left))
         lines(row + 2) (column:column) = marks(i)
      end do
   end function text_plot

   !> Lines of a plot of points, drawn as `*`. Empty where there is none.
   pure function linear_plot(x, y, x_name, y_name) result(lines)
      real(wp), intent(in) :: x(:), y(:)
      character(len=*), intent(in) :: x_name, y_name
      character(len=72), allocatable :: lines(:)
      integer, parameter :: marks_along = 3, marks_up = 3 !< numbers at the axes, less one
      real(wp) :: bottom, left, right, top
      integer :: column, i, row

      allocate (lines(0))
      if (size(x) == 0) return
      call bounds(x, left, right)
      call bounds(y, bottom, top)
      deallocate (lines)
      allocate (lines(rows + 5))
      lines = ''
      lines(1) = y_name
      do row = 0, rows
         lines(row + 2) (margin:margin) = '|'
      end do
      do i = 0, marks_up
         row = nint(rows*(marks_up - i)/real(marks_up, wp))
         lines(row + 2) (:margin - 1) = label(bottom*(1 - i/real(marks_up, wp)) + top*(i/real(marks_up, wp)))
         lines(row + 2) (margin:margin) = '+'
      end do
      lines(rows + 3) (margin:) = '+'//repeat('-', columns)
      do i = 0, marks_along
         column = margin + nint(columns*i/real(marks_along, wp))
         lines(rows + 3) (column:column) = '+'
         lines(rows + 4) (column + 4 - len(label(left)):column + 3) = &
            label(left*(1 - i/real(marks_along, wp)) + right*(i/real(marks_along, wp)))
      end do
      lines(rows + 5) = repeat(' ', margin)//x_name
      do i = 1, size(x)
         row = nint(rows*((top/2 - y(i)/2)/(top/2 - bottom/2)))
         column = margin + nint(columns*((x(i)/2 - left/2)/(right/2 - left/2)))
         lines(row + 2) (column:column) = '*'
      end do
   end function linear_plot

   !> A number at an axis, to the right.
   pure function label(x) result(text)
      real(wp), intent(in) :: x
      character(len=margin - 1) :: text
      write (text, '(es9.2e2)') x
      if (index(text, '*') > 0) write (text, '(es10.2e3)') x
      text = adjustr(text)
   end function label

   !> The least and the largest value, apart also where all are alike.
   pure subroutine bounds(values, low, high)
      real(wp), intent(in) :: values(:)
      real(wp), intent(out) :: low, high
      real(wp) :: room
      low = minval(values)
      high = maxval(values)
      room = max(tiny(1.0_wp)/epsilon(1.0_wp), 1.0e-6_wp*max(abs(low), abs(high)))
      if (high/2 - low/2 > room/2) return
      if (.not. max(abs(low), abs(high)) > 0) room = 1
      low = low - room
      high = high + room
   end subroutine bounds
end module finshell_text_plot
