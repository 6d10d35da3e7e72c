!> C interface of models: fields, history, result files. See finshell_model.h for what the functions promise.
module finshell_model_results
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_int32_t, c_loc, c_ptr
   use finshell_c_text, only: text_from
   use finshell_error, only: error_t
   use finshell_model_handle, only: model_t
   use finshell_model_status, only: enter, model_status_t, refuse, report
   use finshell_session_fields, only: look
   use finshell_session_files, only: write_state
   use finshell_visit, only: visit_t
   implicit none
   private
   public :: c_array_t, field, history, write_results

   !> finshell_model_array of the header.
   type, bind(c) :: c_array_t
      type(c_ptr) :: values
      integer(c_int32_t) :: items, places, components, on
   end type c_array_t

contains

   function field(handle, name, mode, array, status) result(code) bind(c, name='finshell_model_field')
      type(c_ptr), value :: handle, name
      integer(c_int32_t), value :: mode
      type(c_array_t), intent(out), optional :: array
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
      type(model_t), pointer :: model
!$omp critical (finshell_models)
      call enter(visit, handle, 'finshell_model_field', model, code, status)
      if (code == 0) code = show_field(model, name, mode, array, status)
      call visit%leave()
!$omp end critical (finshell_models)
   end function field

   function history(handle, rows, columns, values, status) result(code) bind(c, name='finshell_model_history')
      type(c_ptr), value :: handle
      integer(c_int32_t), intent(out), optional :: rows, columns
      type(c_ptr), intent(out), optional :: values
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
      type(model_t), pointer :: model
!$omp critical (finshell_models)
      call enter(visit, handle, 'finshell_model_history', model, code, status)
      if (code == 0) code = show_history(model, rows, columns, values)
      call visit%leave()
!$omp end critical (finshell_models)
   end function history

   function write_results(handle, name, status) result(code) bind(c, name='finshell_model_write')
      type(c_ptr), value :: handle, name
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
      type(model_t), pointer :: model
!$omp critical (finshell_models)
      call enter(visit, handle, 'finshell_model_write', model, code, status)
      if (code == 0) code = write_now(model, name, status)
      call visit%leave()
!$omp end critical (finshell_models)
   end function write_results

   function show_field(model, name, mode, array, status) result(code)
      type(model_t), intent(inout), target :: model
      type(c_ptr), intent(in) :: name
      integer(c_int32_t), intent(in) :: mode
      type(c_array_t), intent(out), optional :: array
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_model_field'
      type(error_t), allocatable :: error
      real(c_double), pointer :: values(:, :, :)
      integer :: on
      if (.not. (c_associated(name) .and. present(array))) then
         code = refuse(status, place, 'name or array is NULL')
         return
      end if
      call look(model%shelf, model%session, text_from(name), int(mode), values, on, error)
      code = report(status, place, error)
      if (allocated(error)) return
      array%values = c_loc(values)
      array%components = size(values, 1, kind=c_int32_t)
      array%places = size(values, 2, kind=c_int32_t)
      array%items = size(values, 3, kind=c_int32_t)
      array%on = int(on, c_int32_t)
   end function show_field

   function show_history(model, rows, columns, values) result(code)
      type(model_t), intent(in), target :: model
      integer(c_int32_t), intent(out), optional :: rows, columns
      type(c_ptr), intent(out), optional :: values
      integer(c_int32_t) :: code
      code = 0
      associate (bell => model%session%bell)
         if (present(rows)) rows = int(bell%filled, c_int32_t)
         if (present(columns)) columns = size(bell%rows, 1, kind=c_int32_t)
         if (present(values)) values = c_loc(bell%rows)
      end associate
   end function show_history

   function write_now(model, name, status) result(code)
      type(model_t), intent(inout), target :: model
      type(c_ptr), intent(in) :: name
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_model_write'
      type(error_t), allocatable :: error
      if (.not. c_associated(name)) then
         code = refuse(status, place, 'name is NULL')
         return
      end if
      call write_state(model%session, text_from(name), error)
      code = report(status, place, error)
   end function write_now
end module finshell_model_results
