!> Texts of C: strings closed by a null character, and buffers for them.
module finshell_c_text
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_int32_t, c_null_char, c_ptr, c_size_t
   implicit none
   private
   public :: text_from, store_text

   interface
      pure function c_strlen(text) result(length) bind(c, name='strlen')
         import :: c_ptr, c_size_t
         type(c_ptr), value :: text
         integer(c_size_t) :: length
      end function c_strlen
   end interface

contains

   !> A C text, '' for NULL.
   function text_from(text) result(copy)
      type(c_ptr), intent(in) :: text
      character(len=:), allocatable :: copy
      character(kind=c_char), pointer :: characters(:)
      integer :: i
      if (.not. c_associated(text)) then
         copy = ''
         return
      end if
      call c_f_pointer(text, characters, [c_strlen(text)])
      allocate (character(len=size(characters)) :: copy)
      do i = 1, size(characters)
         copy(i:i) = characters(i)
      end do
   end function text_from

   !> Text into a buffer, cut to fit, closed by a null character.
   pure subroutine store_text(text, size, buffer)
      character(len=*), intent(in) :: text
      integer(c_int32_t), intent(in) :: size !< >= 1
      character(kind=c_char), intent(inout) :: buffer(size)
      integer :: i, used
      used = min(len_trim(text), size - 1)
      do i = 1, used
         buffer(i) = text(i:i)
      end do
      buffer(used + 1) = c_null_char
   end subroutine store_text
end module finshell_c_text
