!> This program again, as another process with other arguments: it may fail, or be stopped, and nothing else suffers.
module finshell_process
   use, intrinsic :: iso_c_binding, only: c_char, c_double, c_int, c_null_char
   use finshell_kinds, only: dp
   implicit none
   private
   public :: arguments_t, process_t, start_process, last_words, end_with_parent, make_folder, rest

   !> Of a command line, one after the other.
   type :: arguments_t
      integer, private :: number = 0
      character(len=:), allocatable, private :: joined !< each with its zero
   contains
      procedure :: add
   end type arguments_t

   type :: process_t
      integer(c_int) :: number = -1 !< -1: it could not be started
      integer :: code = 0 !< exit code, once it has ended
      real(dp) :: seconds = 0 !< of processor time
   contains
      procedure :: ended
      procedure :: stop => stop_process
      procedure :: interrupt => interrupt_process
   end type process_t

   interface
      function c_start(program, count, arguments, output) bind(c, name='finshell_process_start') result(number)
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: program(*), arguments(*), output(*)
         integer(c_int), value :: count
         integer(c_int) :: number
      end function c_start

      function c_ended(number, code, seconds) bind(c, name='finshell_process_ended') result(yes)
         import :: c_double, c_int
         integer(c_int), value :: number
         integer(c_int), intent(out) :: code
         real(c_double), intent(out) :: seconds
         integer(c_int) :: yes
      end function c_ended

      subroutine c_kill(number) bind(c, name='finshell_process_kill')
         import :: c_int
         integer(c_int), value :: number
      end subroutine c_kill

      subroutine c_interrupt(number) bind(c, name='finshell_process_interrupt')
         import :: c_int
         integer(c_int), value :: number
      end subroutine c_interrupt

      !> End when the process that started this one does.
      subroutine end_with_parent() bind(c, name='finshell_process_end_with_parent')
      end subroutine end_with_parent

      !> Wait.
      subroutine rest(milliseconds) bind(c, name='finshell_process_rest')
         import :: c_int
         integer(c_int), value :: milliseconds
      end subroutine rest

      function c_make_folder(name) bind(c, name='finshell_make_folder') result(status)
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*)
         integer(c_int) :: status
      end function c_make_folder
   end interface

contains

   !> One more, or an option and its value.
   subroutine add(self, word, value)
      class(arguments_t), intent(inout) :: self
      character(len=*), intent(in) :: word
      character(len=*), intent(in), optional :: value
      if (.not. allocated(self%joined)) self%joined = ''
      self%joined = self%joined//word//c_null_char
      self%number = self%number + 1
      if (.not. present(value)) return
      self%joined = self%joined//value//c_null_char
      self%number = self%number + 1
   end subroutine add

   !> Start this program with some arguments. What it says goes to the file `output`.
   subroutine start_process(process, arguments, output)
      type(process_t), intent(out) :: process
      type(arguments_t), intent(in) :: arguments
      character(len=*), intent(in) :: output
      character(len=:), allocatable :: program
      integer :: length
      call get_command_argument(0, length=length)
      allocate (character(len=length) :: program)
      call get_command_argument(0, program)
      process%number = c_start(program//c_null_char, arguments%number, arguments%joined, output//c_null_char)
   end subroutine start_process

   !> Has it ended? Then exit code and time are known; it may be asked once only.
   logical function ended(self)
      class(process_t), intent(inout) :: self
      integer(c_int) :: code
      real(c_double) :: seconds
      integer(c_int) :: answer
      code = -1
      seconds = 0
      answer = c_ended(self%number, code, seconds)
      ended = answer /= 0
      if (.not. ended) return
      self%code = code
      self%seconds = seconds
   end function ended

   subroutine stop_process(self)
      class(process_t), intent(inout) :: self
      call c_kill(self%number)
   end subroutine stop_process

   !> What Ctrl-C does to it.
   subroutine interrupt_process(self)
      class(process_t), intent(inout) :: self
      call c_interrupt(self%number)
   end subroutine interrupt_process

   !> The last error in a file of what a run said.
   function last_words(file) result(words)
      character(len=*), intent(in) :: file
      character(len=:), allocatable :: words
      character(len=1000) :: line
      integer :: status, unit
      words = ''
      open (newunit=unit, file=file, status='old', action='read', iostat=status)
      if (status /= 0) return
      do
         read (unit, '(a)', iostat=status) line
         if (status /= 0) exit
         if (index(line, 'finshell: ') == 1 .and. index(line, 'warning: ') == 0) words = trim(line(len('finshell: ') + 1:))
      end do
      close (unit)
   end function last_words

   !> Make a folder, or find it there.
   logical function make_folder(name) result(there)
      character(len=*), intent(in) :: name
      there = c_make_folder(name//c_null_char) == 0
   end function make_folder
end module finshell_process
