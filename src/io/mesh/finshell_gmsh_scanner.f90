!> The numbers of a Gmsh MSH 4.1 file, text or binary, one after the other, with the place for messages.
module finshell_gmsh_scanner
   use finshell_kinds, only: wp, dp, i4, i8
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_input_error
   use finshell_text, only: is_blank, parse_integer, parse_real
   use finshell_word_scanner, only: word_scanner_t
   implicit none
   private
   public :: gmsh_scanner_t

   !> All take procedures do nothing (and return 0) when an error is already there.
   type, extends(word_scanner_t) :: gmsh_scanner_t
      logical :: binary = .false.
   contains
      procedure :: take_line
      procedure :: take_word
      procedure :: take_integer
      procedure :: take_size
      procedure :: take_real
      procedure :: skip_section
      procedure :: end_section
      procedure :: place
      procedure :: complain
   end type gmsh_scanner_t

contains

   !> The rest of the line, without trailing blanks; its end is passed.
   subroutine take_line(self, rest)
      class(gmsh_scanner_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: rest
      call self%word_scanner_t%take_line(rest)
      self%at = self%at + 1
      self%line = self%line + 1
   end subroutine take_line

   !> The next word of text.
   subroutine take_word(self, word, error)
      class(gmsh_scanner_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: word
      type(error_t), allocatable, intent(inout) :: error
      if (self%at_end()) call self%complain('the file ends where a number is expected', error)
      call self%take(word, error)
   end subroutine take_word

   !> A C int.
   integer function take_integer(self, error) result(number)
      class(gmsh_scanner_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      integer(i8) :: wide

      number = 0
      if (allocated(error)) return
      if (self%binary) then
         if (has_bytes(self, 4, error)) number = int(transfer(self%text(self%at:self%at + 3), 1_i4))
         self%at = self%at + 4
      else
         wide = text_integer(self, error)
         if (abs(wide) > huge(number)) then
            call self%complain('an integer is too large', error)
         else
            number = int(wide)
         end if
      end if
   end function take_integer

   !> A C size_t. With `count = .true.` it must be possible as a number of things that follow in the file.
   integer(i8) function take_size(self, error, count) result(number)
      class(gmsh_scanner_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      logical, intent(in), optional :: count

      number = 0
      if (allocated(error)) return
      if (self%binary) then
         if (has_bytes(self, 8, error)) number = transfer(self%text(self%at:self%at + 7), 1_i8)
         self%at = self%at + 8
      else
         number = text_integer(self, error)
      end if
      if (.not. present(count) .or. allocated(error)) return
      if (.not. count) return
      if (number < 0 .or. number > len(self%text) - self%at + 1) then
         call self%complain('a count is impossible: the file does not hold that much', error)
         number = 0
      end if
   end function take_size

   !> A C double.
   real(wp) function take_real(self, error) result(number)
      class(gmsh_scanner_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: word
      logical :: ok

      number = 0
      if (allocated(error)) return
      if (self%binary) then
         if (has_bytes(self, 8, error)) number = real(transfer(self%text(self%at:self%at + 7), 1.0_dp), wp)
         self%at = self%at + 8
      else
         call self%take_word(word, error)
         if (allocated(error)) return
         call parse_real(word, number, ok)
         if (.not. ok) call self%complain("found '"//shortened(word)//"' where a number is expected", error)
      end if
   end function take_real

   integer(i8) function text_integer(self, error) result(number)
      class(gmsh_scanner_t), intent(inout) :: self
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: word
      logical :: ok

      number = 0
      call self%take_word(word, error)
      if (allocated(error)) return
      call parse_integer(word, number, ok)
      if (ok) return
      if (index(word, '$End') == 1) then
         call self%complain("found '"//shortened(word)//"' where an integer is expected: the section holds less than it " &
            //'announces', error)
      else
         call self%complain("found '"//shortened(word)//"' where an integer is expected", error)
      end if
   end function text_integer

   logical function has_bytes(self, n, error)
      class(gmsh_scanner_t), intent(in) :: self
      integer, intent(in) :: n
      type(error_t), allocatable, intent(inout) :: error
      has_bytes = self%at + n - 1 <= len(self%text)
      if (.not. has_bytes) call self%complain('the file ends where a number is expected', error)
   end function has_bytes

   !> Go to behind `$End<name>`.
   subroutine skip_section(self, name, error)
      class(gmsh_scanner_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(inout) :: error
      integer :: length, i

      if (allocated(error)) return
      length = index(self%text(self%at:), '$End'//name)
      if (length == 0) then
         call self%complain('the section $'//name//' is not closed by $End'//name, error)
         return
      end if
      if (.not. self%binary) then
         do i = self%at, self%at + length - 2
            if (self%text(i:i) == achar(10)) self%line = self%line + 1
         end do
      end if
      self%at = self%at + length - 1 + len('$End'//name)
   end subroutine skip_section

   !> Take `$End<name>`, which must come next: a section holds what it announces and no more.
   subroutine end_section(self, name, error)
      class(gmsh_scanner_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(inout) :: error
      integer :: length

      if (allocated(error)) return
      if (self%at_end()) then
         call self%complain('the section $'//name//' is not closed by $End'//name, error)
         return
      end if
      length = min(len('$End'//name), len(self%text) - self%at + 1)
      if (self%text(self%at:self%at + length - 1) == '$End'//name) then
         self%at = self%at + length
         if (self%at > len(self%text)) return
         if (is_blank(self%text(self%at:self%at)) .or. self%text(self%at:self%at) == achar(10)) return
      end if
      if (self%binary) then
         call self%complain('$End'//name//' is expected here: the section $'//name//' holds more than it announces, or less', error)
      else
         length = scan(self%text(self%at:), achar(10)) - 1
         if (length < 0) length = len(self%text) - self%at + 1
         call self%complain("found '"//shortened(trim(self%text(self%at:self%at + length - 1)))//"' where $End"//name &
            //' is expected: the section $'//name//' holds more than it announces', error)
      end if
   end subroutine end_section

   !> Where the scanner is, for `complain`: the line, in a binary file the byte.
   pure integer function place(self)
      class(gmsh_scanner_t), intent(in) :: self
      place = merge(self%at, self%line, self%binary)
   end function place

   !> Raise an error with the file and the line (of a binary file: the byte); `line` if it is not the current one.
   subroutine complain(self, message, error, line)
      class(gmsh_scanner_t), intent(in) :: self
      character(len=*), intent(in) :: message
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in), optional :: line
      integer :: byte
      if (.not. self%binary) then
         call self%word_scanner_t%complain(message, error, line)
      else if (.not. allocated(error)) then
         byte = self%at
         if (present(line)) byte = line
         call raise(error, status_input_error, self%file//': byte '//text_of(byte)//': '//message)
      end if
   end subroutine complain

   pure function shortened(word) result(text)
      character(len=*), intent(in) :: word
      character(len=:), allocatable :: text
      text = word
      if (len(word) > 30) text = word(:30)//'...'
   end function shortened
end module finshell_gmsh_scanner
