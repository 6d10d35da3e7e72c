!> Text files of numbers: lines for elements or for nodes; separated by blanks or commas, # begins a comment. Errors name key, file
!> and line.
module finshell_input_number_file
   use finshell_error, only: error_t, text_of
   use finshell_input_common, only: place_error
   use finshell_kinds, only: wp
   use finshell_namelist, only: complain_about, group_t
   use finshell_text, only: is_blank, parse_real, read_whole_file
   implicit none
   private
   public :: read_number_file, read_vector_file

   !> What comes next in a file.
   integer, parameter :: a_number = 1, no_number = 2, end_of_line = 3, end_of_file = 4

   type :: scanner_t
      character(len=:), allocatable :: text !< ends with a line feed
      integer :: at = 1 !< next character
      integer :: line = 1
      logical :: ended = .false. !< the end of the line has been found
   contains
      procedure :: open => open_file
      procedure :: next
   end type scanner_t

contains

   subroutine open_file(self, group, key, file, error)
      class(scanner_t), intent(inout) :: self
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key, file
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: refusal
      call read_whole_file(file, self%text, refusal)
      if (allocated(refusal)) then
         call place_error(group, key, refusal)
         call move_alloc(refusal, error)
         return
      end if
      self%text = self%text//achar(10)
   end subroutine open_file

   !> The next number, a word that is none, or what ends here. `line` is that of it.
   subroutine next(self, found, value, word)
      class(scanner_t), intent(inout) :: self
      integer, intent(out) :: found
      real(wp), intent(out) :: value
      character(len=:), allocatable, intent(out) :: word
      integer :: first
      logical :: ok
      value = 0
      word = ''
      if (self%ended) self%line = self%line + 1
      self%ended = .false.
      do while (self%at <= len(self%text))
         if (.not. separates(self%text(self%at:self%at))) exit
         self%at = self%at + 1
      end do
      found = end_of_file
      if (self%at > len(self%text)) return
      if (self%text(self%at:self%at) == '#') self%at = self%at + index(self%text(self%at:), achar(10)) - 1
      if (self%text(self%at:self%at) == achar(10)) then
         found = end_of_line
         self%ended = .true.
         self%at = self%at + 1
         return
      end if
      first = self%at
      do while (.not. (separates(self%text(self%at:self%at)) .or. self%text(self%at:self%at) == '#' &
                       .or. self%text(self%at:self%at) == achar(10)))
         self%at = self%at + 1
      end do
      word = self%text(first:self%at - 1)
      call parse_real(word, value, ok)
      found = merge(a_number, no_number, ok)
   end subroutine next

   pure logical function separates(character)
      character(len=1), intent(in) :: character
      separates = is_blank(character) .or. character == ','
   end function separates

   !> A file of lines with as many numbers each, at most so many.
   subroutine read_number_file(group, key, file, most, values, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key, file
      integer, intent(in) :: most !< numbers in a line
      real(wp), allocatable, intent(out) :: values(:, :) !< (numbers in a line, lines)
      type(error_t), allocatable, intent(inout) :: error
      type(scanner_t) :: scanner
      real(wp), allocatable :: all(:)
      character(len=:), allocatable :: word
      real(wp) :: value
      integer :: found, here, n, width

      allocate (values(0, 0))
      if (allocated(error)) return
      call scanner%open(group, key, file, error)
      if (allocated(error)) return
      allocate (all(len(scanner%text)))
      n = 0
      width = 0
      here = 0
      do
         call scanner%next(found, value, word)
         select case (found)
         case (a_number, no_number)
            here = here + 1
            if (here > most) then
               call complain('there are more than '//text_of(most)//' numbers in this line')
            else if (found == no_number) then
               call complain("'"//word//"' is no number")
            else
               all(n + here) = value
            end if
         case (end_of_line)
            if (here > 0 .and. width > 0 .and. here /= width) call complain(text_of(here)//' numbers were found; expected ' &
                                                                            //text_of(width)//' as in the lines before')
            if (here > 0) width = here
            n = n + here
            here = 0
         case (end_of_file)
            exit
         end select
         if (allocated(error)) return
      end do
      if (n == 0) then
         call complain_about(group, key, file//' has no numbers', error)
      else
         values = reshape(all(:n), [width, n/width])
      end if

   contains

      subroutine complain(message)
         character(len=*), intent(in) :: message
         call complain_about(group, key, file//':'//text_of(scanner%line)//': '//message, error)
      end subroutine complain
   end subroutine read_number_file

   !> A file of lines with the three numbers of one thing (an element, a node) or several.
   subroutine read_vector_file(group, key, file, thing, number, vectors, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key, file, thing
      integer, intent(in) :: number !< of things in the mesh
      real(wp), allocatable, intent(out) :: vectors(:, :) !< (3, number)
      type(error_t), allocatable, intent(inout) :: error
      type(scanner_t) :: scanner
      character(len=:), allocatable :: word
      real(wp) :: value
      integer :: found, n

      allocate (vectors(3, number), source=0.0_wp)
      call scanner%open(group, key, file, error)
      n = 0
      do while (.not. allocated(error))
         call scanner%next(found, value, word)
         select case (found)
         case (a_number, no_number)
            n = n + 1
            if (n > 3*number) then
               call complain('there are more numbers than three for each of the '//text_of(number)//' '//thing//'s of the mesh')
            else if (found == no_number) then
               call complain("'"//word//"' is no number")
            else
               vectors(mod(n - 1, 3) + 1, (n - 1)/3 + 1) = value
            end if
         case (end_of_line)
            if (mod(n, 3) /= 0) call complain('this line leaves '//thing//' '//text_of(n/3 + 1)//' with '//text_of(mod(n, 3)) &
                                              //' of its three numbers')
         case (end_of_file)
            if (n < 3*number) call complain_about(group, key, file//' has '//text_of(n)//' numbers; expected three for each of ' &
                                                  //'the '//text_of(number)//' '//thing//'s of the mesh', error)
            return
         end select
      end do

   contains

      subroutine complain(message)
         character(len=*), intent(in) :: message
         call complain_about(group, key, file//':'//text_of(scanner%line)//': '//message, error)
      end subroutine complain
   end subroutine read_vector_file
end module finshell_input_number_file
