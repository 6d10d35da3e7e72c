!> The words of a namelist file: a cursor over its text, with the number of the line it is in.
module finshell_namelist_scanner
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_input_error
   use finshell_text, only: is_blank, is_digit
   implicit none
   private
   public :: cursor_t, check_characters, skip_space, take_word, take_string, at_key, next, excerpt, complain

   !> The text being read and the place reached.
   type :: cursor_t
      character(len=:), allocatable :: file, text
      integer :: at = 1, line = 1
   end type cursor_t

contains

   !> A file that is not text is refused at once.
   subroutine check_characters(here, error)
      type(cursor_t), intent(in) :: here
      type(error_t), allocatable, intent(inout) :: error
      integer :: i, line, code

      line = 1
      do i = 1, len(here%text)
         code = iachar(here%text(i:i))
         if (code == 10) then
            line = line + 1
         else if ((code < 32 .and. .not. is_blank(here%text(i:i))) .or. code == 127) then
            call complain(here, line, 'this is not a text file: it contains the byte '//text_of(code), error)
            return
         end if
      end do
   end subroutine check_characters

   !> A string in quotes; it must end in the same line.
   subroutine take_string(here, string, error)
      type(cursor_t), intent(inout) :: here
      character(len=:), allocatable, intent(out) :: string
      type(error_t), allocatable, intent(inout) :: error
      character :: quote
      integer :: start

      quote = next(here)
      start = here%at
      string = ''
      here%at = here%at + 1
      do while (here%at <= len(here%text))
         if (next(here) == achar(10)) exit
         if (next(here) == quote) then
            string = string//here%text(start + 1:here%at - 1)
            here%at = here%at + 1
            if (next(here) /= quote) return
            start = here%at - 1 ! a doubled quote: keep one of them
         end if
         here%at = here%at + 1
      end do
      call raise(error, status_input_error, 'the string that begins with '//here%text(start:min(here%at - 1, start + 30)) &
         //' is not closed in its line')
   end subroutine take_string

   !> Is the next thing `word =`? Nothing is taken.
   logical function at_key(here)
      type(cursor_t), intent(in) :: here
      integer :: i
      at_key = .false.
      i = here%at
      if (is_digit(here%text(i:i)) .or. scan(here%text(i:i), '''"') > 0) return
      do while (i <= len(here%text))
         if (ends_word(here%text(i:i))) exit
         i = i + 1
      end do
      at_key = character_after_space(here%text, i) == '='
   end function at_key

   !> The first character from i on that is neither blank nor in a comment; '' at the end.
   pure function character_after_space(text, i) result(c)
      character(len=*), intent(in) :: text
      integer, intent(in) :: i
      character :: c
      integer :: at
      logical :: comment

      comment = .false.
      do at = i, len(text)
         c = text(at:at)
         if (c == achar(10)) then
            comment = .false.
         else if (c == '!') then
            comment = .true.
         else if (.not. comment .and. .not. is_blank(c)) then
            return
         end if
      end do
      c = ''
   end function character_after_space

   !> Skip blanks, ends of lines and comments.
   pure subroutine skip_space(here)
      type(cursor_t), intent(inout) :: here
      logical :: comment

      comment = .false.
      do while (here%at <= len(here%text))
         associate (c => here%text(here%at:here%at))
            if (c == achar(10)) then
               here%line = here%line + 1
               comment = .false.
            else if (c == '!') then
               comment = .true.
            else if (.not. comment .and. .not. is_blank(c)) then
               return
            end if
         end associate
         here%at = here%at + 1
      end do
   end subroutine skip_space

   !> The longest run of characters without separator (may be empty).
   pure subroutine take_word(here, word)
      type(cursor_t), intent(inout) :: here
      character(len=:), allocatable, intent(out) :: word
      integer :: start
      start = here%at
      do while (here%at <= len(here%text))
         if (ends_word(here%text(here%at:here%at))) exit
         here%at = here%at + 1
      end do
      word = here%text(start:here%at - 1)
   end subroutine take_word

   pure logical function ends_word(c)
      character, intent(in) :: c
      ends_word = is_blank(c) .or. c == achar(10) .or. scan(c, ',=/!&''"') > 0
   end function ends_word

   !> The character at the cursor, '' at the end.
   pure character function next(here)
      type(cursor_t), intent(in) :: here
      next = ''
      if (here%at <= len(here%text)) next = here%text(here%at:here%at)
   end function next

   !> What stands at the cursor, for messages: up to the next separator, at least one and at most 30 characters.
   pure function excerpt(here) result(text)
      type(cursor_t), intent(in) :: here
      character(len=:), allocatable :: text
      integer :: last
      last = here%at
      do while (last < min(len(here%text), here%at + 29))
         if (ends_word(here%text(last + 1:last + 1))) exit
         last = last + 1
      end do
      text = here%text(here%at:min(last, len(here%text)))
   end function excerpt

   subroutine complain(here, line, message, error)
      type(cursor_t), intent(in) :: here
      integer, intent(in) :: line
      character(len=*), intent(in) :: message
      type(error_t), allocatable, intent(inout) :: error
      call raise(error, status_input_error, here%file//':'//text_of(line)//': '//trim(message))
   end subroutine complain
end module finshell_namelist_scanner
