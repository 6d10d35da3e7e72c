!> C interface: what membranes have alone. See finshell.h for what the functions promise.
module finshell_capi_membrane
   use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_ptr
   use finshell_capi_common, only: c_status_t, refuse, refuse_memory
   use finshell_capi_elements, only: as_seen_by, c_elements_t, conclude, freedoms_of, read_block, receive, receive_own, &
      receive_section
   use finshell_membrane_batch, only: recover_membranes
   use finshell_section, only: section_t
   use finshell_status, only: status_ok
   implicit none
   private
   public :: elements_wrinkles

contains

   function elements_wrinkles(section, elements, state, ridge, codes, status) result(code) &
      bind(c, name='finshell_elements_wrinkles')
      type(c_ptr), value :: section, elements
      integer(c_int32_t), intent(out), optional :: state(*), codes(*)
      real(c_double), intent(out), optional :: ridge(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_elements_wrinkles'
      type(c_elements_t) :: block
      code = read_block(place, elements, block, status)
      if (code == status_ok) code = wrinkles_given(place, section, block, state, ridge, codes, status)
   end function elements_wrinkles

   function wrinkles_given(place, section, given, sheet, ridge, codes, status) result(code)
      character(len=*), intent(in) :: place
      type(c_ptr), intent(in) :: section
      type(c_elements_t), intent(in) :: given
      integer(c_int32_t), intent(out), optional :: sheet(given%n), codes(given%n)
      real(c_double), intent(out), optional :: ridge(3, given%n)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(section_t), pointer :: s
      type(c_elements_t) :: block
      real(c_double), pointer, contiguous, dimension(:, :, :) :: x, u, r, state, normal
      real(c_double), pointer, contiguous, dimension(:, :) :: direction, toward
      real(c_double), pointer, contiguous :: thickness(:), offset(:), growth(:, :, :)
      integer, allocatable :: held(:, :)
      integer(c_int32_t), allocatable :: found(:)
      integer :: memory

      code = receive_section(place, section, s, status)
      if (code /= status_ok) return
      if (.not. s%membrane) then
         code = refuse(status, place, 'the section is that of a shell, which has no wrinkles, expected one of a membrane')
         return
      end if
      block = as_seen_by(s, given)
      code = receive(place, block, freedoms_of(s), x, u, r, state, direction, normal, toward, held, status)
      if (code /= status_ok .or. block%n == 0) return
      call receive_own(block, s, thickness, offset, growth)
      allocate (found(block%n), stat=memory)
      if (memory /= 0) then
         code = refuse_memory(status, place)
         return
      end if
      call recover_membranes(s, block%n, x, u, found, state=sheet, ridge=ridge, direction=direction, &
                             thickness=thickness, growth=growth)
      if (present(codes)) codes = found
      code = conclude(place, block, found, status)
   end function wrinkles_given
end module finshell_capi_membrane
