!> Text files with lines of numbers: one line for each element, or for each node.
module finshell_input_number_file
   use finshell_error, only: error_t, text_of
   use finshell_input_common, only: place_error
   use finshell_kinds, only: wp
   use finshell_namelist, only: complain_about, group_t
   use finshell_text, only: is_blank, parse_real, read_whole_file
   implicit none
   private
   public :: read_number_file

contains

   !> A file of lines with as many numbers each, at most so many, separated by blanks or commas; # begins a comment. Errors name
   !> key, file and line.
   subroutine read_number_file(group, key, file, most, values, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key, file
      integer, intent(in) :: most !< numbers in a line
      real(wp), allocatable, intent(out) :: values(:, :) !< (numbers in a line, lines)
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: refusal
      character(len=:), allocatable :: text
      real(wp), allocatable :: all(:)
      real(wp) :: here(most)
      integer :: at, first, found, last, line, n, width
      logical :: ok

      allocate (values(0, 0))
      if (allocated(error)) return
      call read_whole_file(file, text, refusal)
      if (allocated(refusal)) then
         call place_error(group, key, refusal)
         call move_alloc(refusal, error)
         return
      end if
      text = text//achar(10)
      allocate (all(max(1, len(text))))
      n = 0
      width = 0
      line = 0
      first = 1
      do while (first <= len(text))
         line = line + 1
         last = first + index(text(first:), achar(10)) - 2
         found = 0
         at = first
         first = last + 2
         if (index(text(at:last), '#') > 0) last = at + index(text(at:last), '#') - 2
         do
            do while (at <= last)
               if (.not. (is_blank(text(at:at)) .or. text(at:at) == ',')) exit
               at = at + 1
            end do
            if (at > last) exit
            found = found + 1
            if (found > most) then
               call complain_about(group, key, file//':'//text_of(line)//': there are more than '//text_of(most) &
                                   //' numbers in this line', error)
               return
            end if
            call take(text(at:last), here(found), ok)
            if (.not. ok) then
               call complain_about(group, key, file//':'//text_of(line)//": '"//word(text(at:last))//"' is no number", error)
               return
            end if
            at = at + len(word(text(at:last)))
         end do
         if (found == 0) cycle
         if (width > 0 .and. found /= width) then
            call complain_about(group, key, file//':'//text_of(line)//': '//text_of(found)//' numbers were found; expected ' &
                                //text_of(width)//' as in the lines before', error)
            return
         end if
         width = found
         all(n + 1:n + found) = here(:found)
         n = n + found
      end do
      if (n == 0) then
         call complain_about(group, key, file//' has no numbers', error)
      else
         values = reshape(all(:n), [width, n/width])
      end if
   end subroutine read_number_file

   !> The first word of a text that begins with one.
   pure function word(text) result(first)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: first
      integer :: i
      do i = 1, len(text)
         if (is_blank(text(i:i)) .or. text(i:i) == ',') exit
      end do
      first = text(:i - 1)
   end function word

   pure subroutine take(text, value, ok)
      character(len=*), intent(in) :: text
      real(wp), intent(out) :: value
      logical, intent(out) :: ok
      call parse_real(word(text), value, ok)
   end subroutine take
end module finshell_input_number_file
