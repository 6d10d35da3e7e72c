!> Element fields of many elements in one call, by their table (finshell_element_fields).
module finshell_field_batch
   use finshell_block, only: bad_shape, check_input, gather, gather_own, vanishing
   use finshell_element, only: block_t, recover_block
   use finshell_element_field, only: element_field_t, field_places, field_value, most_components, at_element, at_surfaces, &
      at_layers, change_linear, change_quadratic, change_none
   use finshell_element_fields, only: element_fields, find_element_field, n_element_fields
   use finshell_environment, only: environment_t, hold, release
   use finshell_kinds, only: wp, i4, lanes
   use finshell_law_states, only: law_states_t
   use finshell_membrane, only: membrane_t, recover_membrane
   use finshell_membrane_chunk, only: check_membranes, gather_membranes
   use finshell_point_states, only: new_point_states, point_states_t
   use finshell_own, only: n_growth
   use finshell_recovered, only: recovered_t
   use finshell_section, only: section_t
   use finshell_status, only: status_invalid_argument, status_material_limit, status_no_value, status_ok
   implicit none
   private
   public :: recover_fields
   public :: element_field_t, element_fields, find_element_field, field_value, field_places, n_element_fields
   public :: at_element, at_surfaces, at_layers, change_linear, change_quadratic, change_none

contains

   !> Fields of n elements, as their tables' `recover` finds them: `field_value` makes of them what is reported.
   !>
   !> Other arguments as in recover_elements (finshell_batch). Only what is asked for is evaluated. A value that cannot be recovered
   !> is 0 and has a status: that of the element or, as a law may end at the surfaces and not before, its own; status_no_value where
   !> there is none to be expected, as in layers that the section has not.
   subroutine recover_fields(section, n, x, u, rotation, convention, fields, layers, raw, status, frame, direction, state, held, &
                             normal, thickness, offset, growth, states)
      type(section_t), intent(in) :: section
      integer, intent(in) :: n, convention
      real(wp), intent(in) :: x(3, 3, n), u(3, 3, n), rotation(:, :, :)
      integer, intent(in) :: fields(:) !< their numbers in the table
      integer, intent(in) :: layers !< number of layers of which there is to be a place: those of the section, or more
      !> (rows, n): for each field in turn, for each of its places, the components (`raw` of the table).
      real(wp), intent(out), contiguous :: raw(:, :)
      integer(i4), intent(out), contiguous :: status(:, :) !< (places, n): for each field in turn, each of its places
      real(wp), intent(out), optional :: frame(3, 2, n) !< of the material direction, see recovered_t
      real(wp), intent(in), optional :: direction(3, n), state(4, 3, n)
      integer, intent(in), optional :: held(3, n)
      real(wp), intent(in), optional :: normal(3, 3, n)
      type(law_states_t), intent(in), optional :: states !< as in recover_elements
      real(wp), intent(in), optional :: thickness(n), offset(n), growth(n_growth, size(section%layers), n)
      type(element_field_t) :: table(n_element_fields)
      type(block_t) :: block
      type(membrane_t) :: membrane
      type(environment_t) :: environment
      type(recovered_t) :: r
      type(point_states_t) :: remembered
      real(wp) :: values(lanes, most_components)
      integer(i4) :: found(lanes), input(lanes), here(lanes)
      integer :: first, f, l, p, place, row, used
      logical :: changed

      raw = 0
      if (present(frame)) frame = 0
      if (bad_shape(rotation, convention, n, present(state))) then
         status = status_invalid_argument
         return
      end if
      table = element_fields()
      call hold(environment)
      do first = 0, n - 1, lanes
         used = min(lanes, n - first)
         input = status_ok
         if (section%membrane) then
            call gather_membranes(first, n, x, u, membrane, direction)
            call gather_own(section, first, n, membrane%own, thickness, growth=growth)
            call check_membranes(membrane, present(direction), input, changed)
            call recover_membrane(section, membrane, r, found)
         else
            call gather(first, n, x, u, rotation, convention, block, direction, state, held, normal=normal)
            call gather_own(section, first, n, block%own, thickness, offset, growth)
            call check_input(block, present(direction), input, changed)
            if (present(states)) call new_point_states(states, first, n, remembered)
            nullify (remembered%all%end)
            call recover_block(section, block, r, found, remembered)
         end if
         where (input /= status_ok) found = input
         row = 0
         p = 0
         do f = 1, size(fields)
            associate (field => table(fields(f)))
               do place = 1, field_places(field, layers)
                  here = found
                  values = 0
                  if (field%at == at_layers .and. place > size(section%layers)) then
                     here = max(here, status_no_value)
                  else
                     call field%recover(section, r, place, values(:, :field%raw), here)
                  end if
                  where (here == status_ok .and. .not. vanishing(reshape(values, [most_components*lanes])) <= 0) &
                     here = status_material_limit
                  where (found /= status_ok) here = found
                  p = p + 1
                  do l = 1, used
                     status(p, first + l) = here(l)
                     if (here(l) == status_ok) raw(row + 1:row + field%raw, first + l) = values(l, :field%raw)
                  end do
                  row = row + field%raw
               end do
            end associate
         end do
         if (.not. present(frame)) cycle
         do l = 1, used
            if (found(l) == status_ok) frame(:, :, first + l) = r%frame(l, :, :)
         end do
      end do
      call release(environment)
   end subroutine recover_fields
end module finshell_field_batch
