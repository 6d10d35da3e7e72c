!> C interface of models: how a call ends.
module finshell_model_status
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int32_t, c_null_char, c_ptr
   use finshell_c_text, only: store_text
   use finshell_error, only: error_t
   use finshell_model_handle, only: model_of, model_t
   use finshell_status, only: status_invalid_argument, status_not_converged, status_ok
   use finshell_visit, only: visit_t
   implicit none
   private
   public :: model_status_t, done, refuse, report, enter

   integer, parameter :: message_length = 1016 !< as in finshell_model.h

   !> finshell_model_status of the header.
   type, bind(c) :: model_status_t
      integer(c_int32_t) :: code
      integer(c_int32_t) :: reserved
      character(kind=c_char) :: message(message_length)
   end type model_status_t

contains

   function done(status) result(code)
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      code = status_ok
      if (.not. present(status)) return
      status%code = code
      status%reserved = 0
      status%message(1) = c_null_char
   end function done

   !> The caller's mistake.
   function refuse(status, place, message) result(code)
      type(model_status_t), intent(out), optional :: status
      character(len=*), intent(in) :: place !< name of the C function
      character(len=*), intent(in) :: message
      integer(c_int32_t) :: code
      code = status_invalid_argument
      call fill(status, code, place//': '//message)
   end function refuse

   !> How an error of the analysis or of the input is told; done, when there is none.
   function report(status, place, error) result(code)
      type(model_status_t), intent(out), optional :: status
      character(len=*), intent(in) :: place
      type(error_t), allocatable, intent(in) :: error
      integer(c_int32_t) :: code
      if (.not. allocated(error)) then
         code = done(status)
         return
      end if
      code = int(error%code, c_int32_t)
      if (code == status_ok) code = status_not_converged
      call fill(status, code, place//': '//error%message)
   end function report

   !> A call about a model begins, and works with as many threads as the model has. The visit is to be left, whatever the code.
   subroutine enter(visit, pointer, place, model, code, status)
      type(visit_t), intent(inout) :: visit
      type(c_ptr), intent(in) :: pointer
      character(len=*), intent(in) :: place
      type(model_t), pointer, intent(out) :: model
      integer(c_int32_t), intent(out) :: code
      type(model_status_t), intent(out), optional :: status
      call visit%begin()
      call find_model(pointer, place, model, code, status)
      if (code == status_ok) call visit%work_with(model%session%threads)
   end subroutine enter

   !> The model of a pointer; null, and a code, when it is none.
   subroutine find_model(pointer, place, model, code, status)
      type(c_ptr), intent(in) :: pointer
      character(len=*), intent(in) :: place
      type(model_t), pointer, intent(out) :: model
      integer(c_int32_t), intent(out) :: code
      type(model_status_t), intent(out), optional :: status
      model => model_of(pointer)
      if (associated(model)) then
         code = done(status)
      else if (c_associated(pointer)) then
         code = refuse(status, place, 'this is no model: it was destroyed, or never created')
      else
         code = refuse(status, place, 'the model is NULL')
      end if
   end subroutine find_model

   subroutine fill(status, code, message)
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t), intent(in) :: code
      character(len=*), intent(in) :: message
      if (.not. present(status)) return
      status%code = code
      status%reserved = 0
      call store_text(message, size(status%message), status%message)
   end subroutine fill
end module finshell_model_status
