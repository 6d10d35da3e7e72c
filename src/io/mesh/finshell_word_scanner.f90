!> The words of a text, one after the other, with the line for messages.
module finshell_word_scanner
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: wp
   use finshell_status, only: status_input_error
   use finshell_text, only: is_blank, lower_case, parse_real
   implicit none
   private
   public :: word_scanner_t

   !> All procedures do nothing when an error is already there.
   type :: word_scanner_t
      character(len=:), allocatable :: file, text
      integer :: at = 1 !< next character
      integer :: line = 1
   contains
      procedure :: at_end
      procedure :: take
      procedure :: take_line
      procedure :: take_reals
      procedure :: expect
      procedure :: complain
   end type word_scanner_t

contains

   !> Skip white space; true when nothing is left.
   logical function at_end(self)
      class(word_scanner_t), intent(inout) :: self
      do while (self%at <= len(self%text))
         if (self%text(self%at:self%at) == achar(10)) then
            self%line = self%line + 1
         else if (.not. is_blank(self%text(self%at:self%at))) then
            exit
         end if
         self%at = self%at + 1
      end do
      at_end = self%at > len(self%text)
   end function at_end

   !> The next word.
   subroutine take(self, word, error)
      class(word_scanner_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: word
      type(error_t), allocatable, intent(inout) :: error
      integer :: start
      word = ''
      if (allocated(error)) return
      if (self%at_end()) then
         call self%complain('the file ends too early', error)
         return
      end if
      start = self%at
      do while (self%at <= len(self%text))
         if (is_blank(self%text(self%at:self%at)) .or. self%text(self%at:self%at) == achar(10)) exit
         self%at = self%at + 1
      end do
      word = self%text(start:self%at - 1)
   end subroutine take

   !> The rest of the line.
   subroutine take_line(self, rest)
      class(word_scanner_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: rest
      integer :: length
      length = index(self%text(self%at:), achar(10)) - 1
      if (length < 0) length = len(self%text) - self%at + 1
      rest = self%text(self%at:self%at + length - 1)
      self%at = self%at + length
      do while (len(rest) > 0)
         if (.not. is_blank(rest(len(rest):))) exit
         rest = rest(:len(rest) - 1)
      end do
   end subroutine take_line

   subroutine take_reals(self, values, error)
      class(word_scanner_t), intent(inout) :: self
      real(wp), intent(out) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: word
      integer :: i
      logical :: ok
      values = 0
      do i = 1, size(values)
         call self%take(word, error)
         if (allocated(error)) return
         call parse_real(word, values(i), ok)
         if (.not. ok) call self%complain("found '"//word(:min(len(word), 30))//"' where a number is expected", error)
      end do
   end subroutine take_reals

   !> Take a word that must come next, in any case.
   subroutine expect(self, wanted, error)
      class(word_scanner_t), intent(inout) :: self
      character(len=*), intent(in) :: wanted
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: word
      call self%take(word, error)
      if (allocated(error)) return
      if (lower_case(word) /= wanted) call self%complain("found '"//word(:min(len(word), 30))//"' where "//wanted &
         //' is expected', error)
   end subroutine expect

   !> Raise an error with file and line, `line` if it is not the current one.
   subroutine complain(self, message, error, line)
      class(word_scanner_t), intent(in) :: self
      character(len=*), intent(in) :: message
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in), optional :: line
      integer :: here
      if (allocated(error)) return
      here = self%line
      if (present(line)) here = line
      call raise(error, status_input_error, self%file//':'//text_of(here)//': '//message)
   end subroutine complain
end module finshell_word_scanner
