!> What the groups of an input file have in common: sets of the mesh by name, components by name, vectors, errors with their place.
module finshell_input_common
   use finshell_kinds, only: wp
   use finshell_field, only: name_characters
   use finshell_error, only: error_t, text_of
   use finshell_mesh, only: mesh_t, find_node_set, find_element_set, find_edge_set, node_set_names, element_set_names
   use finshell_mesh, only: edge_set_names
   use finshell_namelist, only: group_t, get, get_strings, complain_about
   use finshell_namelist_values, only: suggestion
   implicit none
   private
   public :: get_set, get_sets, get_component, position_of, get_vector, get_few, in_node_sets, in_element_sets, &
      place_error, check_name
   public :: kind_node, kind_element, kind_edge

   integer, parameter :: kind_node = 1, kind_element = 2, kind_edge = 3
   character(len=*), parameter :: kind_keys(3) = [character(len=11) :: 'node_set', 'element_set', 'edge_set']

contains

   !> The key node_set, element_set or edge_set: the name of one set of the mesh.
   subroutine get_set(group, kind_of_set, mesh, name, error, default)
      type(group_t), intent(inout) :: group
      integer, intent(in) :: kind_of_set !< kind_node, kind_element, kind_edge
      type(mesh_t), intent(in) :: mesh
      character(len=:), allocatable, intent(inout) :: name
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), intent(in), optional :: default

      call get(group, trim(kind_keys(kind_of_set)), name, error, default)
      call check_set(group, trim(kind_keys(kind_of_set)), kind_of_set, mesh, name, error)
   end subroutine get_set

   !> The same for one or several sets; none when the key is absent and not required.
   subroutine get_sets(group, kind_of_set, mesh, names, error, required)
      type(group_t), intent(inout) :: group
      integer, intent(in) :: kind_of_set
      type(mesh_t), intent(in) :: mesh
      character(len=:), allocatable, intent(out) :: names(:)
      type(error_t), allocatable, intent(inout) :: error
      logical, intent(in) :: required
      integer :: i

      call get_strings(group, trim(kind_keys(kind_of_set)), names, error, required=required)
      do i = 1, size(names)
         call check_set(group, trim(kind_keys(kind_of_set)), kind_of_set, mesh, trim(names(i)), error)
      end do
   end subroutine get_sets

   !> (nodes) Those of node sets that the mesh has.
   pure function in_node_sets(mesh, names) result(member)
      type(mesh_t), intent(in) :: mesh
      character(len=*), intent(in) :: names(:)
      logical :: member(size(mesh%coordinates, 2))
      integer :: i
      member = .false.
      do i = 1, size(names)
         member(mesh%node_sets(find_node_set(mesh, trim(names(i))))%members) = .true.
      end do
   end function in_node_sets

   !> (elements) Those of element sets that the mesh has.
   pure function in_element_sets(mesh, names) result(member)
      type(mesh_t), intent(in) :: mesh
      character(len=*), intent(in) :: names(:)
      logical :: member(size(mesh%triangles, 2))
      integer :: i
      member = .false.
      do i = 1, size(names)
         member(mesh%element_sets(find_element_set(mesh, trim(names(i))))%members) = .true.
      end do
   end function in_element_sets

   !> Raise an error unless the mesh has the set and the set has members.
   subroutine check_set(group, key, kind_of_set, mesh, name, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      integer, intent(in) :: kind_of_set
      type(mesh_t), intent(in) :: mesh
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: names, what, guess
      integer :: i, members

      if (allocated(error)) return
      members = 0
      select case (kind_of_set)
      case (kind_node)
         what = 'node set'
         i = find_node_set(mesh, name)
         names = node_set_names(mesh)
         if (i > 0) members = size(mesh%node_sets(i)%members)
      case (kind_element)
         what = 'element set'
         i = find_element_set(mesh, name)
         names = element_set_names(mesh)
         if (i > 0) members = size(mesh%element_sets(i)%members)
      case default
         what = 'edge set'
         i = find_edge_set(mesh, name)
         names = edge_set_names(mesh)
         if (i > 0) members = size(mesh%edge_sets(i)%edges, 2)
      end select
      if (i == 0) then
         guess = suggestion(name, names)
         if (allocated(mesh%empty_sets)) then
            if (index(mesh%empty_sets, '"'//name//'"') > 0) guess = ' (the mesh file has a physical group of this name, but it ' &
               //'has no elements)'
         end if
         call complain_about(group, key, 'there is no '//what//" '"//name//"'"//guess//'; the mesh has: '//names, error)
      else if (members == 0) then
         call complain_about(group, key, 'the '//what//" '"//name//"' is empty", error)
      end if
   end subroutine check_set

   !> The key component: position of its value in a list, 'x, y, z' or '11, 22, 12'; 0 when absent.
   subroutine get_component(group, choices, component, error, required)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: choices
      integer, intent(out) :: component
      type(error_t), allocatable, intent(inout) :: error
      logical, intent(in) :: required
      character(len=:), allocatable :: name

      component = 0
      if (required) then
         call get(group, 'component', name, error, choices=choices)
      else
         call get(group, 'component', name, error, default='', choices=choices)
      end if
      if (allocated(error) .or. name == '') return
      component = position_of(name, choices)
   end subroutine get_component

   !> Position of a word in a list of words that are no part of each other: 'x, y, z'.
   pure integer function position_of(word, list)
      character(len=*), intent(in) :: word, list
      integer :: i
      position_of = 1
      do i = 1, index(list, word)
         if (list(i:i) == ',') position_of = position_of + 1
      end do
   end function position_of

   !> A key with three numbers. Without `default` it is required.
   subroutine get_vector(group, key, vector, error, default, nonzero)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      real(wp), intent(out) :: vector(3)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), intent(in), optional :: default(3)
      logical, intent(in), optional :: nonzero !< (0, 0, 0) is an error
      real(wp), allocatable :: values(:)

      vector = 0
      if (present(default)) vector = default
      call get(group, key, values, error, required=.not. present(default), number=3)
      if (allocated(error) .or. size(values) == 0) return
      vector = values
      if (.not. present(nonzero)) return
      if (nonzero .and. .not. norm2(vector) > 0) call complain_about(group, key, 'the vector (0, 0, 0) is no direction', error)
   end subroutine get_vector

   !> Give an error that came from elsewhere the place of a group (or of one of its keys).
   subroutine place_error(group, key, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: placed

      if (.not. allocated(error)) return
      call complain_about(group, key, error%message, placed)
      error%message = placed%message
   end subroutine place_error

   !> One to three numbers.
   subroutine get_few(group, key, numbers, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      real(wp), allocatable, intent(out) :: numbers(:)
      type(error_t), allocatable, intent(inout) :: error
      call get(group, key, numbers, error, required=.true.)
      if (size(numbers) > 3 .and. .not. allocated(error)) call complain_about(group, key, text_of(size(numbers)) &
         //' numbers were found; expected one to three', error)
   end subroutine get_few

   !> Refuse a name that could not become part of a file or a data set: letters, digits, _ - . only.
   subroutine check_name(group, key, name, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: key
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(inout) :: error

      if (allocated(error)) return
      if (name == '' .or. verify(name, name_characters) > 0 .or. verify(name, '.') == 0) call complain_about(group, key, &
         "'"//name//"' is no name; a name is made of letters, digits, _ - and .", error)
   end subroutine check_name
end module finshell_input_common
