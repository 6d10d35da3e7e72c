!> What an element field is: its entry in the table of finshell_element_fields, and what follows from an entry.
module finshell_element_field
   use finshell_kinds, only: wp, i4, lanes
   use finshell_recovered, only: recovered_t
   use finshell_section, only: section_t
   implicit none
   private
   public :: element_field_t, field, field_places, field_value, most_components
   public :: at_element, at_surfaces, at_layers, change_linear, change_quadratic, change_none

   !> Where an element has values: one; bottom, middle and top of the section; the middle of each layer, bottom to top.
   integer, parameter :: at_element = 1, at_surfaces = 2, at_layers = 3
   !> What is reported of a linear change of a state: the change of the field to first order, or to second as of an energy; that of
   !> the state itself.
   integer, parameter :: change_linear = 1, change_quadratic = 2, change_none = 3
   integer, parameter :: most_components = 3 !< of any field, and of the tensors behind them

   type :: element_field_t
      character(len=24) :: name = ''
      character(len=12) :: components = '' !< 'x, y, z', ...; blank for a scalar
      integer :: at = at_element
      character(len=16) :: dimension = '' !< '-' for numbers
      character(len=128) :: meaning = ''
      integer :: number = 1 !< of components
      integer :: raw = 1 !< of components of what `recover` finds
      integer :: change = change_linear
      procedure(recover_interface), pointer, nopass :: recover => null()
      procedure(finish_interface), pointer, nopass :: finish => null() !< null: what `recover` finds is the field
   end type element_field_t

   abstract interface
      !> Values of a field at one of its places, of a block of elements.
      pure subroutine recover_interface(section, r, place, values, status)
         import :: section_t, recovered_t, wp, i4, lanes
         type(section_t), intent(in) :: section
         type(recovered_t), intent(in) :: r
         integer, intent(in) :: place !< of those that the section has: 1..field_places
         real(wp), intent(inout), contiguous :: values(:, :) !< (lanes, raw)
         integer(i4), intent(inout) :: status(lanes) !< status_no_value where there is none to be expected
      end subroutine recover_interface

      !> What is reported, of one element at one place.
      pure subroutine finish_interface(raw, frame, values)
         import :: wp
         real(wp), intent(in) :: raw(:), frame(3, 2) !< of the material direction, see recovered_t
         real(wp), intent(out) :: values(:)
      end subroutine finish_interface
   end interface

contains

   !> An entry of the table.
   pure function field(name, components, at, dimension, recover, meaning, finish, raw, change) result(entry)
      character(len=*), intent(in) :: name, components, dimension, meaning
      integer, intent(in) :: at
      procedure(recover_interface) :: recover
      procedure(finish_interface), optional :: finish
      integer, intent(in), optional :: raw !< default: as many as components
      integer, intent(in), optional :: change !< default: change_linear
      type(element_field_t) :: entry
      integer :: i
      entry%name = name
      entry%components = components
      entry%at = at
      entry%dimension = dimension
      entry%meaning = meaning
      entry%number = 1 + count([(components(i:i) == ',', i=1, len(components))])
      entry%raw = entry%number
      if (present(raw)) entry%raw = raw
      if (present(change)) entry%change = change
      entry%recover => recover
      if (present(finish)) entry%finish => finish
   end function field

   !> Number of places of a field.
   pure integer function field_places(field, layers)
      type(element_field_t), intent(in) :: field
      integer, intent(in) :: layers !< of the section, or as many as any section has
      select case (field%at)
      case (at_surfaces); field_places = 3
      case (at_layers); field_places = layers
      case default; field_places = 1
      end select
   end function field_places

   !> What is reported of one element at one place.
   pure function field_value(field, raw, frame) result(values)
      type(element_field_t), intent(in) :: field
      real(wp), intent(in) :: raw(:) !< what `recover` has found
      real(wp), intent(in) :: frame(3, 2) !< see recovered_t
      real(wp) :: values(field%number)
      if (associated(field%finish)) then
         call field%finish(raw, frame, values)
      else
         values = raw(:field%number)
      end if
   end function field_value
end module finshell_element_field
