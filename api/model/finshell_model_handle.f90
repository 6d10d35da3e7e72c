!> C interface of models: the handle, and how a pointer that is none is told from it.
module finshell_model_handle
   use, intrinsic :: iso_c_binding, only: c_f_pointer, c_int32_t, c_int64_t, c_intptr_t, c_ptr
   use finshell_session, only: session_t
   use finshell_session_fields, only: shelf_t
   use finshell_session_memory, only: memory_t
   implicit none
   private
   public :: model_t, new_model, free_model, model_of, slots

   integer, parameter :: slots = 8

   !> 'FINMODEL' in ASCII: see finshell_capi_handle.
   integer(c_int64_t), parameter :: magic = int(z'46494E4D4F44454C', c_int64_t)

   type :: members_t
      integer(c_int32_t), allocatable :: members(:)
   end type members_t

   type :: model_t
      integer(c_int64_t) :: mark = magic
      type(session_t) :: session
      type(memory_t) :: memories(0:slots - 1)
      type(shelf_t) :: shelf
      integer(c_int32_t), allocatable :: triangles(:, :) !< from 0
      type(members_t), allocatable :: node_sets(:), element_sets(:) !< from 0
   end type model_t

contains

   !> Null when there is no memory.
   function new_model() result(model)
      type(model_t), pointer :: model
      integer :: memory
      allocate (model, stat=memory)
      if (memory /= 0) nullify (model)
   end function new_model

   !> The model of a pointer; null when it is none.
   function model_of(pointer) result(model)
      type(c_ptr), intent(in) :: pointer
      type(model_t), pointer :: model
      integer(c_int64_t), pointer :: mark
      nullify (model)
      if (transfer(pointer, 0_c_intptr_t) >= 0 .and. transfer(pointer, 0_c_intptr_t) < 4096) return
      call c_f_pointer(pointer, mark)
      if (mark == magic) call c_f_pointer(pointer, model)
   end function model_of

   subroutine free_model(pointer)
      type(c_ptr), intent(in) :: pointer
      type(model_t), pointer :: model
      integer(c_int64_t), pointer, volatile :: mark ! or else the compiler drops what is written before memory is freed
      model => model_of(pointer)
      if (.not. associated(model)) return
      call c_f_pointer(pointer, mark)
      mark = 0
      deallocate (model)
   end subroutine free_model
end module finshell_model_handle
