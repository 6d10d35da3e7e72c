!> C interface: the handle of a section, and how a pointer that is none is told from it.
module finshell_capi_handle
   use, intrinsic :: iso_c_binding, only: c_f_pointer, c_int64_t, c_intptr_t, c_ptr
   use finshell_section, only: section_t
   implicit none
   private
   public :: handle_t, new_handle, free_handle, section_of

   !> 'FINSHELL' in ASCII, the first thing a handle points to. Freed memory has another number there: ours is wiped before.
   integer(c_int64_t), parameter :: magic = int(z'46494E5348454C4C', c_int64_t)

   type :: handle_t
      integer(c_int64_t) :: mark = magic
      type(section_t) :: section
   end type handle_t

contains

   !> A handle with an empty section; null when there is no memory.
   function new_handle() result(handle)
      type(handle_t), pointer :: handle
      integer :: memory
      allocate (handle, stat=memory)
      if (memory /= 0) nullify (handle)
   end function new_handle

   !> The section of a handle; null when the pointer is none.
   function section_of(pointer) result(section)
      type(c_ptr), intent(in) :: pointer
      type(section_t), pointer :: section
      type(handle_t), pointer :: handle
      integer(c_int64_t), pointer :: mark
      nullify (section)
      ! no program has memory in its first page
      if (transfer(pointer, 0_c_intptr_t) >= 0 .and. transfer(pointer, 0_c_intptr_t) < 4096) return
      call c_f_pointer(pointer, mark)
      if (mark /= magic) return
      call c_f_pointer(pointer, handle)
      section => handle%section
   end function section_of

   !> Free what a handle points to; nothing happens when the pointer is none.
   subroutine free_handle(pointer)
      type(c_ptr), intent(in) :: pointer
      type(handle_t), pointer :: handle
      integer(c_int64_t), pointer, volatile :: mark ! or else the compiler drops what is written before memory is freed
      if (.not. associated(section_of(pointer))) return
      call c_f_pointer(pointer, mark)
      mark = 0
      call c_f_pointer(pointer, handle)
      deallocate (handle)
   end subroutine free_handle
end module finshell_capi_handle
