!> Errors of everything above the kernel: a code, and a sentence that names the place and says what to do.
!>
!> A procedure that can fail takes `type(error_t), allocatable, intent(out) :: error`; it is allocated exactly on failure.
module finshell_error
   use finshell_kinds, only: i4, i8
   implicit none
   private
   public :: error_t, raise, text_of

   type :: error_t
      integer(i4) :: code = 0 !< one of finshell_status
      character(len=:), allocatable :: message
   end type error_t

   !> A number as text, for messages and columns: a real has at most 14 characters.
   interface text_of
      module procedure :: text_of_integer
      module procedure :: text_of_large_integer
      module procedure :: text_of_real
   end interface text_of

contains

   !> Raise an error.
   pure subroutine raise(error, code, message)
      type(error_t), allocatable, intent(inout) :: error
      integer(i4), intent(in) :: code
      character(len=*), intent(in) :: message
      if (.not. allocated(error)) allocate (error)
      error%code = code
      error%message = message
   end subroutine raise

   pure function text_of_integer(i) result(text)
      integer, intent(in) :: i
      character(len=:), allocatable :: text
      character(len=24) :: buffer
      write (buffer, '(i0)') i
      text = trim(buffer)
   end function text_of_integer

   pure function text_of_large_integer(i) result(text)
      integer(i8), intent(in) :: i
      character(len=:), allocatable :: text
      character(len=24) :: buffer
      write (buffer, '(i0)') i
      text = trim(buffer)
   end function text_of_large_integer

   pure function text_of_real(x) result(text)
      use finshell_kinds, only: dp
      real(dp), intent(in) :: x
      character(len=:), allocatable :: text
      character(len=32) :: buffer
      write (buffer, '(es14.6)') x
      ! An exponent of three digits would push out its E: 1.797693+308 is read by nobody.
      if (scan(buffer, 'E') == 0) write (buffer, '(es15.6e3)') x
      text = trim(adjustl(buffer))
   end function text_of_real
end module finshell_error
