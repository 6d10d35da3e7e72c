!> C interface of models: increments, what the host gives, checkpoints. See finshell_model.h for what the functions promise.
!>
!> One call of a process works at a time: solvers, HDF5 and gfortran's texts of deferred length keep things in static memory.
module finshell_model_steps
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_pointer, c_int32_t, c_ptr
   use finshell_c_text, only: store_text, text_from
   use finshell_error, only: error_t
   use finshell_model_handle, only: model_t, slots
   use finshell_model_status, only: enter, model_status_t, refuse, report
   use finshell_session_memory, only: go_back, remember
   use finshell_visit, only: visit_t
   implicit none
   private
   public :: c_record_t, state, advance, settle, set_force, set_displacement, checkpoint, restore

   !> finshell_model_record of the header.
   type, bind(c) :: c_record_t
      integer(c_int32_t) :: increment, step, reports, finished, iterations, cuts, negative_pivots, critical_point, snap, rounding
      real(c_double) :: load_factor, time, size, proposed, residual, correction
      character(kind=c_char) :: step_name(32), control(32)
   end type c_record_t

contains

   function state(handle, record, status) result(code) bind(c, name='finshell_model_state')
      type(c_ptr), value :: handle
      type(c_record_t), intent(out), optional :: record
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
      type(model_t), pointer :: model
!$omp critical (finshell_models)
      call enter(visit, handle, 'finshell_model_state', model, code, status)
      if (code == 0) code = tell(model, record)
      call visit%leave()
!$omp end critical (finshell_models)
   end function state

   function advance(handle, size, record, status) result(code) bind(c, name='finshell_model_advance')
      type(c_ptr), value :: handle
      real(c_double), value :: size
      type(c_record_t), intent(out), optional :: record
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
      type(model_t), pointer :: model
!$omp critical (finshell_models)
      call enter(visit, handle, 'finshell_model_advance', model, code, status)
      if (code == 0) code = move_on(model, size, record, status)
      call visit%leave()
!$omp end critical (finshell_models)
   end function advance

   function settle(handle, record, status) result(code) bind(c, name='finshell_model_settle')
      type(c_ptr), value :: handle
      type(c_record_t), intent(out), optional :: record
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
      type(model_t), pointer :: model
!$omp critical (finshell_models)
      call enter(visit, handle, 'finshell_model_settle', model, code, status)
      if (code == 0) code = settle_in(model, record, status)
      call visit%leave()
!$omp end critical (finshell_models)
   end function settle

   function set_force(handle, node_set, number, values, status) result(code) bind(c, name='finshell_model_set_force')
      type(c_ptr), value :: handle, node_set, values
      integer(c_int32_t), value :: number
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
      type(model_t), pointer :: model
!$omp critical (finshell_models)
      call enter(visit, handle, 'finshell_model_set_force', model, code, status)
      if (code == 0) code = take_force(model, node_set, number, values, status)
      call visit%leave()
!$omp end critical (finshell_models)
   end function set_force

   function set_displacement(handle, node_set, component, number, values, status) result(code) &
      bind(c, name='finshell_model_set_displacement')
      type(c_ptr), value :: handle, node_set, values
      integer(c_int32_t), value :: component, number
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
      type(model_t), pointer :: model
!$omp critical (finshell_models)
      call enter(visit, handle, 'finshell_model_set_displacement', model, code, status)
      if (code == 0) code = take_displacement(model, node_set, component, number, values, status)
      call visit%leave()
!$omp end critical (finshell_models)
   end function set_displacement

   function checkpoint(handle, slot, status) result(code) bind(c, name='finshell_model_checkpoint')
      type(c_ptr), value :: handle
      integer(c_int32_t), value :: slot
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
      type(model_t), pointer :: model
!$omp critical (finshell_models)
      call enter(visit, handle, 'finshell_model_checkpoint', model, code, status)
      if (code == 0) code = keep(model, slot, .true., status)
      call visit%leave()
!$omp end critical (finshell_models)
   end function checkpoint

   function restore(handle, slot, status) result(code) bind(c, name='finshell_model_restore')
      type(c_ptr), value :: handle
      integer(c_int32_t), value :: slot
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(visit_t) :: visit
      type(model_t), pointer :: model
!$omp critical (finshell_models)
      call enter(visit, handle, 'finshell_model_restore', model, code, status)
      if (code == 0) code = keep(model, slot, .false., status)
      call visit%leave()
!$omp end critical (finshell_models)
   end function restore

   !> Where the model stands.
   function tell(model, record) result(code)
      type(model_t), intent(in) :: model
      type(c_record_t), intent(out), optional :: record
      integer(c_int32_t) :: code
      code = 0
      if (.not. present(record)) return
      associate (s => model%session, last => model%session%bell%last)
         record%increment = int(s%problem%state%increment, c_int32_t)
         record%step = int(s%bell%step - 1, c_int32_t)
         record%reports = int(s%bell%reports, c_int32_t)
         record%finished = merge(1_c_int32_t, 0_c_int32_t, s%finished)
         record%iterations = int(last%iterations, c_int32_t)
         record%cuts = int(last%cuts, c_int32_t)
         record%negative_pivots = int(last%negative_pivots, c_int32_t)
         record%critical_point = int(last%event, c_int32_t)
         record%snap = merge(1_c_int32_t, 0_c_int32_t, last%snap)
         record%rounding = merge(1_c_int32_t, 0_c_int32_t, last%rounding)
         record%load_factor = s%problem%state%load_factor
         record%time = s%problem%state%time
         record%size = last%size
         record%proposed = s%proposed()
         record%residual = last%residual
         record%correction = last%correction
         call store_text(s%step_name(s%bell%step), size(record%step_name), record%step_name)
         call store_text(s%control_of(last%control), size(record%control), record%control)
      end associate
   end function tell

   function move_on(model, size, record, status) result(code)
      type(model_t), intent(inout) :: model
      real(c_double), intent(in) :: size
      type(c_record_t), intent(out), optional :: record
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(error_t), allocatable :: error
      call model%session%advance(size, error)
      code = tell(model, record)
      code = report(status, 'finshell_model_advance', error)
   end function move_on

   function settle_in(model, record, status) result(code)
      type(model_t), intent(inout) :: model
      type(c_record_t), intent(out), optional :: record
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(error_t), allocatable :: error
      call model%session%settle(error)
      code = tell(model, record)
      code = report(status, 'finshell_model_settle', error)
   end function settle_in

   function take_force(model, node_set, number, values, status) result(code)
      type(model_t), intent(inout) :: model
      type(c_ptr), intent(in) :: node_set, values
      integer(c_int32_t), intent(in) :: number
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_model_set_force'
      type(error_t), allocatable :: error
      real(c_double), pointer :: given(:, :)
      if (.not. (c_associated(node_set) .and. c_associated(values)) .or. number < 1) then
         code = refuse(status, place, 'node_set or values is NULL, or number below 1')
         return
      end if
      call c_f_pointer(values, given, [3, int(number)])
      call model%session%wishes%set_force(model%session%problem, text_from(node_set), given, error)
      code = report(status, place, error)
   end function take_force

   function take_displacement(model, node_set, component, number, values, status) result(code)
      type(model_t), intent(inout) :: model
      type(c_ptr), intent(in) :: node_set, values
      integer(c_int32_t), intent(in) :: component, number
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_model_set_displacement'
      type(error_t), allocatable :: error
      real(c_double), pointer :: given(:)
      if (.not. (c_associated(node_set) .and. c_associated(values)) .or. number < 1) then
         code = refuse(status, place, 'node_set or values is NULL, or number below 1')
         return
      end if
      call c_f_pointer(values, given, [int(number)])
      call model%session%wishes%set_displacement(model%session%problem, text_from(node_set), int(component) + 1, given, error)
      code = report(status, place, error)
   end function take_displacement

   function keep(model, slot, fresh, status) result(code)
      type(model_t), intent(inout) :: model
      integer(c_int32_t), intent(in) :: slot
      logical, intent(in) :: fresh !< a new one, else back to it
      type(model_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(error_t), allocatable :: error
      character(len=:), allocatable :: place
      place = 'finshell_model_restore'
      if (fresh) place = 'finshell_model_checkpoint'
      if (slot < 0 .or. slot >= slots) then
         code = refuse(status, place, 'a slot is 0 to 7')
         return
      end if
      if (fresh) then
         call remember(model%memories(slot), model%session)
      else
         call go_back(model%memories(slot), model%session, error)
      end if
      code = report(status, place, error)
   end function keep
end module finshell_model_steps
