!> What all functions of the C interface share: the status structure, and how a failure is reported.
!>
!> gfortran (12) keeps the length of a text that a function returns as `character(len=:), allocatable` in static memory. So what
!> calls such functions (`text_from` is one) stands in the critical region `finshell_texts`; the procedures here call none, but for
!> `judge`, which enters the region itself.
module finshell_capi_common
   use, intrinsic :: iso_c_binding, only: c_char, c_int32_t, c_null_char
   use finshell_c_text, only: store_text
   use finshell_environment, only: environment_t, hold, release
   use finshell_status, only: status_invalid_argument, status_ok, status_out_of_memory, status_text
   implicit none
   private
   public :: c_status_t, accept, check_batch, refuse, refuse_memory, report, judge

   integer, parameter :: message_length = 244 !< as in finshell.h

   !> finshell_status of the header.
   type, bind(c) :: c_status_t
      integer(c_int32_t) :: code
      integer(c_int32_t) :: index !< from 0; -1: not about an element
      integer(c_int32_t) :: failed !< number of elements
      character(kind=c_char) :: message(message_length)
   end type c_status_t

contains

   !> Done.
   function accept(status) result(code)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      code = status_ok
      if (.not. present(status)) return
      status%code = status_ok
      status%index = -1
      status%failed = 0
      status%message(1) = c_null_char
   end function accept

   !> The call as a whole is refused. A '#' in the message stands for `value`.
   function refuse(status, place, message, value) result(code)
      type(c_status_t), intent(out), optional :: status
      character(len=*), intent(in) :: place !< name of the C function
      character(len=*), intent(in) :: message
      integer(c_int32_t), intent(in), optional :: value
      integer(c_int32_t) :: code
      character(len=12) :: digits
      integer :: i
      code = status_invalid_argument
      i = 0
      if (present(value)) i = index(message, '#')
      if (i == 0) then
         call fill(status, code, -1, 0, place//': '//message)
      else
         write (digits, '(i0)') value
         call fill(status, code, -1, 0, place//': '//message(:i - 1)//trim(digits)//message(i + 1:))
      end if
   end function refuse

   !> n makes sense; sets `status` to done.
   function check_batch(place, n, status) result(code)
      character(len=*), intent(in) :: place
      integer(c_int32_t), intent(in) :: n
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      if (n < 0) then
         code = refuse(status, place, 'n is #, expected a number of elements >= 0', n)
      else
         code = accept(status)
      end if
   end function check_batch

   function refuse_memory(status, place) result(code)
      type(c_status_t), intent(out), optional :: status
      character(len=*), intent(in) :: place
      integer(c_int32_t) :: code
      code = status_out_of_memory
      call fill(status, code, -1, 0, place//': out of memory')
   end function refuse_memory

   !> A call that is about no element has a code.
   function report(status, place, found) result(code)
      type(c_status_t), intent(out), optional :: status
      character(len=*), intent(in) :: place
      integer(c_int32_t), intent(in) :: found
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      code = found
      call hold(environment)
!$omp critical (finshell_texts)
      call fill(status, code, -1, 0, place//': '//status_text(code))
!$omp end critical (finshell_texts)
      call release(environment)
   end function report

   !> The code of a batch: that of the first element with a negative code or, without one, of the first with a positive code.
   function judge(status, place, n, codes, invalid, noun) result(code)
      type(c_status_t), intent(out), optional :: status
      character(len=*), intent(in) :: place
      integer(c_int32_t), intent(in) :: n
      integer(c_int32_t), intent(in) :: codes(n)
      character(len=*), intent(in), optional :: invalid !< what is wrong with the first element, when that is an invalid argument
      character(len=*), intent(in), optional :: noun !< what the codes are of, if not of elements
      integer(c_int32_t) :: code
      integer(c_int32_t) :: e, failed, first, worst
      type(environment_t) :: environment
      character(len=12) :: digits
      character(len=8) :: what
      failed = 0
      first = 0
      worst = 0
      do e = 1, n
         if (codes(e) == status_ok) cycle
         failed = failed + 1
         if (first == 0 .or. (worst > 0 .and. codes(e) < 0)) then
            first = e
            worst = codes(e)
         end if
      end do
      if (failed == 0) then
         code = accept(status)
         return
      end if
      code = worst
      if (.not. present(status)) return
      call hold(environment)
      write (digits, '(i0)') first - 1
      what = 'element'
      if (present(noun)) what = noun
      if (present(invalid) .and. code == status_invalid_argument) then
         call fill(status, code, first - 1, failed, place//': '//trim(what)//' '//trim(digits)//' (from 0): '//trim(invalid))
      else
!$omp critical (finshell_texts)
         call fill(status, code, first - 1, failed, place//': '//trim(what)//' '//trim(digits)//' (from 0): '//status_text(code))
!$omp end critical (finshell_texts)
      end if
      call release(environment)
   end function judge

   subroutine fill(status, code, index, failed, message)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t), intent(in) :: code, index, failed
      character(len=*), intent(in) :: message
      if (.not. present(status)) return
      status%code = code
      status%index = index
      status%failed = failed
      call store_text(message, message_length, status%message)
   end subroutine fill
end module finshell_capi_common
