!> C interface: the handle of a section, and how a pointer that is none is told from it; the same for handles of other kinds.
module finshell_capi_handle
   use, intrinsic :: iso_c_binding, only: c_f_pointer, c_int64_t, c_intptr_t, c_ptr
   use finshell_kinds, only: wp
   use finshell_section, only: section_t
   implicit none
   private
   public :: card_t, handle_t, new_handle, free_handle, handle_of, section_of, is_marked, wipe, name_length

   integer, parameter :: name_length = 32 !< of laws, parameters and options; longer ones are unknown

   !> 'FINSHELL' in ASCII, the first thing a handle points to. Freed memory has another number there: ours is wiped before.
   integer(c_int64_t), parameter :: magic = int(z'46494E5348454C4C', c_int64_t)

   !> What a layer was made of, for those who ask.
   type :: card_t
      character(len=name_length) :: law = ''
      character(len=name_length), allocatable :: names(:) !< of the parameters of the law
      real(wp), allocatable :: values(:)
      real(wp) :: angle = 0 !< degrees
      real(wp) :: density = 0
   end type card_t

   type :: handle_t
      integer(c_int64_t) :: mark = magic
      type(section_t) :: section
      type(card_t), allocatable :: cards(:) !< of the layers
   end type handle_t

contains

   !> A handle with an empty section; null when there is no memory.
   function new_handle() result(handle)
      type(handle_t), pointer :: handle
      integer :: memory
      allocate (handle, stat=memory)
      if (memory /= 0) nullify (handle)
   end function new_handle

   !> The handle at a pointer; null when the pointer is none.
   function handle_of(pointer) result(handle)
      type(c_ptr), intent(in) :: pointer
      type(handle_t), pointer :: handle
      nullify (handle)
      if (is_marked(pointer, magic)) call c_f_pointer(pointer, handle)
   end function handle_of

   !> The section of a handle; null when the pointer is none.
   function section_of(pointer) result(section)
      type(c_ptr), intent(in) :: pointer
      type(section_t), pointer :: section
      type(handle_t), pointer :: handle
      nullify (section)
      handle => handle_of(pointer)
      if (associated(handle)) section => handle%section
   end function section_of

   !> Free what a handle points to; nothing happens when the pointer is none.
   subroutine free_handle(pointer)
      type(c_ptr), intent(in) :: pointer
      type(handle_t), pointer :: handle
      handle => handle_of(pointer)
      if (.not. associated(handle)) return
      call wipe(pointer)
      deallocate (handle)
   end subroutine free_handle

   !> Whether a pointer is to something that begins with a number.
   function is_marked(pointer, mark) result(answer)
      type(c_ptr), intent(in) :: pointer
      integer(c_int64_t), intent(in) :: mark
      logical :: answer
      integer(c_int64_t), pointer :: found
      ! no program has memory in its first page
      answer = transfer(pointer, 0_c_intptr_t) < 0 .or. transfer(pointer, 0_c_intptr_t) >= 4096
      if (.not. answer) return
      call c_f_pointer(pointer, found)
      answer = found == mark
   end function is_marked

   !> Take the mark from what is about to be freed.
   subroutine wipe(pointer)
      type(c_ptr), intent(in) :: pointer
      integer(c_int64_t), pointer, volatile :: mark ! or else the compiler drops what is written before memory is freed
      call c_f_pointer(pointer, mark)
      mark = 0
   end subroutine wipe
end module finshell_capi_handle
