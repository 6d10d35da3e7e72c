!> All that a run can report, in one list: fields on nodes, fields on elements, numbers of the whole structure.
module finshell_result_fields
   use finshell_field_batch, only: element_field_t, element_fields, n_element_fields, at_surfaces, at_layers
   use finshell_node_fields, only: node_field_t, node_fields, n_node_fields
   use finshell_error, only: text_of
   implicit none
   private
   public :: result_field_t, result_fields, find_field, field_names, place_name
   public :: on_nodes, on_elements, on_structure, on_connector, on_cut, error_entry

   integer, parameter :: on_nodes = 1, on_elements = 2, on_structure = 3, on_connector = 4, on_cut = 5

   !> Behind the entries of the table of element fields: the field that is made of the surroundings of elements, `error`
   !> (finshell_error_indicator).
   integer, parameter :: error_entry = n_element_fields + 1

   type :: result_field_t
      character(len=24) :: name = ''
      character(len=12) :: components = '' !< 'x, y, z', ...; blank for a scalar
      integer :: on = on_structure
      logical :: adds_up = .false. !< the value of several items is their sum, else their mean
      integer :: entry = 0 !< in the table of nodal or of element fields
      logical :: surfaces = .false., layers = .false. !< the value has places in the element, bottom to top
      character(len=20) :: dimension = ''
      character(len=128) :: meaning = ''
   end type result_field_t

contains

   !> All fields, in the order of the result files.
   pure function result_fields() result(table)
      type(result_field_t), allocatable :: table(:)
      type(node_field_t) :: nodal(n_node_fields)
      type(element_field_t) :: elemental(n_element_fields)
      integer :: i
      nodal = node_fields()
      elemental = element_fields()
      table = [(result_field_t(nodal(i)%name, nodal(i)%components, on_nodes, nodal(i)%adds_up, i, .false., .false., &
                               nodal(i)%dimension, nodal(i)%meaning), i=1, n_node_fields), &
               (result_field_t(elemental(i)%name, elemental(i)%components, on_elements, .false., i, &
                               elemental(i)%at == at_surfaces, elemental(i)%at == at_layers, &
                               elemental(i)%dimension, elemental(i)%meaning), i=1, n_element_fields), &
               around('error', 'sqrt(force length)', &
                      'estimated: root of the energy of the error of the mesh in the element'), &
               whole('volume', 'length^3', &
                     'between the pressurised elements and the origin of their pressure'), &
               whole('energy', 'force length', &
                     'stored in the structure, and in foundations and springs'), &
               whole('relative_error', '-', &
                     'estimated, of the mesh in the energy norm: root of the sum of error^2 over that of the energy'), &
               whole('time', 'time', &
                     'spent in steps in time'), &
               whole('kinetic_energy', 'force length', &
                     'of the motion; zero at rest'), &
               whole('momentum', 'force time', &
                     'of the motion; zero at rest', 'x, y, z'), &
               whole('angular_momentum', 'force length time', &
                     'of the motion, about the origin of the axes; zero at rest', 'x, y, z'), &
               of_connector('connector_force', 'force (length)', &
                            'of a spring, bar or cable, tension positive; its moment if it turns'), &
               of_connector('connector_extension', 'length or -', &
                            'of a spring; the strain of a bar or cable; the angle of what turns'), &
               through('section_force', 'force', 'that the rest of the structure exerts on a set of elements'), &
               through('section_moment', 'force length', 'that the rest of the structure exerts on a set of elements')]
   end function result_fields

   !> A number of each element, made of its surroundings.
   pure function around(name, dimension, meaning) result(field)
      character(len=*), intent(in) :: name, dimension, meaning
      type(result_field_t) :: field
      field = whole(name, dimension, meaning)
      field%on = on_elements
      field%entry = error_entry
   end function around

   !> A number of each member of a connector.
   pure function of_connector(name, dimension, meaning) result(field)
      character(len=*), intent(in) :: name, dimension, meaning
      type(result_field_t) :: field
      field = whole(name, dimension, meaning)
      field%on = on_connector
   end function of_connector

   !> A number of the whole structure.
   pure function whole(name, dimension, meaning, components) result(field)
      character(len=*), intent(in) :: name, dimension, meaning
      character(len=*), intent(in), optional :: components !< none: a scalar
      type(result_field_t) :: field
      field%name = name
      field%dimension = dimension
      field%meaning = meaning
      if (present(components)) field%components = components
   end function whole

   !> What is transmitted through a cut (finshell_section_force).
   pure function through(name, dimension, meaning) result(field)
      character(len=*), intent(in) :: name, dimension, meaning
      type(result_field_t) :: field
      field = whole(name, dimension, meaning, 'x, y, z')
      field%on = on_cut
   end function through

   !> The number of a field, 0: there is none of this name.
   pure integer function find_field(name)
      character(len=*), intent(in) :: name
      type(result_field_t), allocatable :: table(:)
      table = result_fields()
      do find_field = size(table), 1, -1
         if (table(find_field)%name == name) exit
      end do
   end function find_field

   !> All names, separated by commas; without those of the whole structure and of cuts if there is to be one value an item.
   pure function field_names(only_items) result(names)
      logical, intent(in) :: only_items
      character(len=:), allocatable :: names
      type(result_field_t), allocatable :: table(:)
      integer :: i
      table = result_fields()
      names = trim(table(1)%name)
      do i = 2, size(table)
         if (.not. (only_items .and. table(i)%on >= on_structure)) names = names//', '//trim(table(i)%name)
      end do
   end function field_names

   !> The name of an element field at one of its places.
   pure function place_name(field, place) result(name)
      type(element_field_t), intent(in) :: field
      integer, intent(in) :: place
      character(len=:), allocatable :: name
      character(len=*), parameter :: surfaces(3) = [character(len=6) :: 'bottom', 'middle', 'top']
      name = trim(field%name)
      select case (field%at)
      case (at_surfaces); name = name//'_'//trim(surfaces(place))
      case (at_layers); name = name//'_layer'//text_of(place)
      end select
   end function place_name
end module finshell_result_fields
