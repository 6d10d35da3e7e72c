!> C interface of models: the handle, and how a pointer that is none is told from it.
module finshell_model_handle
   use, intrinsic :: iso_c_binding, only: c_char, c_f_pointer, c_int32_t, c_int64_t, c_intptr_t, c_null_char, c_ptr, c_size_t
   use finshell_session, only: session_t
   use finshell_session_fields, only: shelf_t
   use finshell_session_memory, only: memory_t
   implicit none
   private
   public :: model_t, new_model, free_model, model_of, text_at, store, slots

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

   interface
      pure function c_strlen(text) result(length) bind(c, name='strlen')
         import :: c_ptr, c_size_t
         type(c_ptr), value :: text
         integer(c_size_t) :: length
      end function c_strlen
   end interface

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

   !> A C text, which is not NULL.
   function text_at(pointer) result(text)
      type(c_ptr), intent(in) :: pointer
      character(len=:), allocatable :: text
      character(kind=c_char), pointer :: characters(:)
      integer :: i
      call c_f_pointer(pointer, characters, [c_strlen(pointer)])
      allocate (character(len=size(characters)) :: text)
      do i = 1, size(characters)
         text(i:i) = characters(i)
      end do
   end function text_at

   !> Text into a buffer, cut to fit, closed by a null character.
   pure subroutine store(text, buffer)
      character(len=*), intent(in) :: text
      character(kind=c_char), intent(inout) :: buffer(:) !< not empty
      integer :: i, used
      used = min(len_trim(text), size(buffer) - 1)
      do i = 1, used
         buffer(i) = text(i:i)
      end do
      buffer(used + 1) = c_null_char
   end subroutine store
end module finshell_model_handle
