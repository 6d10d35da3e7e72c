!> C interface: the table of element fields, and any of them by name. See finshell.h for what the functions promise.
module finshell_capi_field
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_int32_t, c_ptr
   use finshell_c_text, only: store_text, text_from
   use finshell_capi_common, only: accept, c_status_t, refuse, refuse_memory
   use finshell_capi_elements, only: as_seen_by, c_elements_t, conclude, freedoms_of, read_block, receive, receive_own, &
      receive_section, receive_states
   use finshell_environment, only: environment_t, hold, release
   use finshell_field_batch, only: element_field_t, element_fields, find_element_field, field_value, field_places, recover_fields, &
      n_element_fields
   use finshell_law_states, only: law_states_t
   use finshell_section, only: section_t
   use finshell_status, only: status_no_value, status_ok
   implicit none
   private
   public :: field_count, field_information, recover_field, c_field_t

   integer, parameter :: short_size = 32, meaning_size = 128

   !> finshell_field_entry of the header.
   type, bind(c) :: c_field_t
      character(kind=c_char) :: name(short_size)
      character(kind=c_char) :: components(short_size)
      character(kind=c_char) :: dimension(short_size)
      character(kind=c_char) :: meaning(meaning_size)
      integer(c_int32_t) :: number
      integer(c_int32_t) :: at
   end type c_field_t

contains

   function field_count() result(n) bind(c, name='finshell_field_count')
      integer(c_int32_t) :: n
      n = n_element_fields
   end function field_count

   function field_information(i, information, status) result(code) bind(c, name='finshell_field_information')
      integer(c_int32_t), value :: i
      type(c_field_t), intent(out), optional :: information
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_field_information'
      type(element_field_t) :: table(n_element_fields)
      if (i < 0 .or. i >= n_element_fields) then
         code = refuse(status, place, 'i is #, expected 0 to one less than the number of fields', i)
      else if (.not. present(information)) then
         code = refuse(status, place, 'field is NULL')
      else
         table = element_fields()
         associate (field => table(i + 1))
            call store_text(field%name, short_size, information%name)
            call store_text(field%components, short_size, information%components)
            call store_text(field%dimension, short_size, information%dimension)
            call store_text(field%meaning, meaning_size, information%meaning)
            information%number = field%number
            information%at = field%at
         end associate
         code = accept(status)
      end if
   end function field_information

   function recover_field(section, elements, name, values, codes, status) result(code) bind(c, name='finshell_recover_field')
      type(c_ptr), value :: section, elements, name
      real(c_double), intent(out), optional :: values(*)
      integer(c_int32_t), intent(out), optional :: codes(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_recover_field'
      type(c_elements_t) :: block
      type(law_states_t) :: states
      type(section_t), pointer :: s
      real(c_double), pointer, contiguous, dimension(:, :, :) :: x, u, r, state, normal
      real(c_double), pointer, contiguous, dimension(:, :) :: direction, toward
      real(c_double), pointer, contiguous :: thickness(:), offset(:), growth(:, :, :)
      integer, allocatable :: held(:, :)
      type(element_field_t) :: table(n_element_fields)
      type(environment_t) :: environment
      real(c_double), allocatable :: raw(:, :), frame(:, :, :)
      integer(c_int32_t), allocatable :: found(:, :), worst(:)
      integer :: e, entry, first, memory, p, places

      code = read_block(place, elements, block, status)
      if (code /= status_ok) return
      call hold(environment)
!$omp critical (finshell_texts)
      entry = find_element_field(text_from(name))
      if (.not. c_associated(name)) then
         code = refuse(status, place, 'name is NULL')
      else if (entry == 0) then
         code = refuse(status, place, 'unknown field '''//text_from(name)//''', finshell_field_information lists them')
      end if
!$omp end critical (finshell_texts)
      call release(environment)
      if (code == status_ok) code = receive_section(place, section, s, status)
      if (code /= status_ok) return
      block = as_seen_by(s, block)
      code = receive(place, block, freedoms_of(s), x, u, r, state, direction, normal, toward, held, status)
      if (code == status_ok) code = receive_states(place, s, block, states, status)
      if (code /= status_ok .or. block%n == 0) return
      call receive_own(block, s, thickness, offset, growth)
      if (s%membrane) r => u ! not looked at, but something
      table = element_fields()
      associate (field => table(entry), n => block%n)
         places = field_places(field, size(s%layers))
         allocate (raw(places*field%raw, n), stat=memory)
         if (memory == 0) allocate (frame(3, 2, n), stat=memory)
         if (memory == 0) allocate (found(places, n), stat=memory)
         if (memory == 0) allocate (worst(n), stat=memory)
         if (memory /= 0) then
            code = refuse_memory(status, place)
            return
         end if
         call recover_fields(s, n, x, u, r, block%convention, [entry], size(s%layers), raw, found, frame, direction, state, held, &
                             normal, thickness, offset, growth, states)
         call hold(environment)
         do e = 1, n
            worst(e) = maxval(found(:, e), mask=found(:, e) /= status_no_value)
            if (all(found(:, e) == status_no_value)) worst(e) = status_ok
            if (.not. present(values)) cycle
            do p = 1, places
               first = ((e - 1)*places + p - 1)*field%number
               values(first + 1:first + field%number) = 0
               if (worst(e) == status_ok .and. found(p, e) == status_ok) values(first + 1:first + field%number) = &
                  field_value(field, raw((p - 1)*field%raw + 1:p*field%raw, e), frame(:, :, e))
            end do
         end do
         call release(environment)
      end associate
      if (present(codes)) codes(:block%n) = worst
      code = conclude(place, block, worst, status)
   end function recover_field
end module finshell_capi_field
