!> The groups &field: values that differ from element to element, for thicknesses, offsets and growth.
!>
!> Groups of one name make one field: each covers its element sets, a later one what an earlier one has. Values of node sets are
!> kept at the nodes: elements have the mean of their corners.
module finshell_input_field
   use finshell_error, only: error_t, text_of
   use finshell_input_common, only: check_name, get_few, get_sets, get_vector, in_element_sets, in_node_sets, kind_element, &
      kind_node, place_error
   use finshell_input_number_file, only: read_number_file
   use finshell_kinds, only: wp
   use finshell_lineage, only: nodal_values, parent_element
   use finshell_mesh, only: mesh_t
   use finshell_namelist, only: check_all_used, complain_about, get, group_t, has, namelist_t
   use finshell_namelist_values, only: suggestion
   use finshell_rotation, only: cross_product
   use finshell_table, only: table_t
   use finshell_vtkhdf_mesh, only: read_cell_data
   implicit none
   private
   public :: field_t, read_fields, get_field

   type :: field_t
      character(len=:), allocatable :: name
      real(wp), allocatable :: values(:, :) !< (numbers of each element, elements)
      logical, allocatable :: known(:) !< (elements) those that it covers
      real(wp), allocatable :: nodal(:, :) !< (numbers, nodes) of groups with node sets; unallocated: there was none
      logical, allocatable :: known_node(:) !< (nodes)
   end type field_t

   integer, parameter :: most = 3 !< numbers of an element

contains

   subroutine read_fields(namelist, folder, mesh, fields, error)
      type(namelist_t), intent(inout) :: namelist
      character(len=*), intent(in) :: folder !< prefix of the files that the groups name
      type(mesh_t), intent(in) :: mesh
      type(field_t), allocatable, intent(out) :: fields(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: i
      allocate (fields(0))
      do i = 1, size(namelist%groups)
         if (allocated(error)) return
         if (namelist%groups(i)%name == 'field') call read_field(namelist%groups(i), folder, mesh, fields, error)
      end do
   end subroutine read_fields

   !> One group: a new field, or a part of an earlier one.
   subroutine read_field(group, folder, mesh, fields, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: folder
      type(mesh_t), intent(in) :: mesh
      type(field_t), allocatable, intent(inout) :: fields(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), parameter :: kinds(3) = [character(len=5) :: 'value', 'over', 'file']
      character(len=:), allocatable :: name, node_sets(:), sets(:)
      real(wp), allocatable :: values(:, :)
      real(wp) :: otherwise
      logical :: covered(size(mesh%triangles, 2))
      integer :: i, n
      call get(group, 'name', name, error)
      call check_name(group, 'name', name, error)
      call get_sets(group, kind_element, mesh, sets, error, required=.false.)
      call get_sets(group, kind_node, mesh, node_sets, error, required=.false.)
      if (allocated(error)) return
      n = count([(has(group, trim(kinds(i))), i=1, size(kinds))])
      if (n /= 1) then
         call complain_about(group, '', 'one of value, over and file is expected; '//text_of(n)//' were found', error)
      else if (size(node_sets) > 0 .and. (size(sets) > 0 .or. .not. has(group, 'value'))) then
         call complain_about(group, 'node_set', 'a node set has a value, and no element set beside it', error)
      else if (has(group, 'otherwise') .and. size(node_sets) == 0) then
         call complain_about(group, 'otherwise', 'it belongs to node_set, which is missing', error)
      else if (has(group, 'value')) then
         call constant_values(group, mesh, values, error)
         call get(group, 'otherwise', otherwise, error, default=0.0_wp)
      else if (has(group, 'over')) then
         call values_over(group, mesh, values, error)
      else
         call file_values(group, folder, mesh, values, error)
      end if
      call check_all_used(group, error)
      if (allocated(error)) return
      do n = 1, size(fields)
         if (fields(n)%name == name) exit
      end do
      if (n > size(fields)) then
         fields = [fields, field_t(name, 0*values, spread(.false., 1, size(covered)))]
      else if (size(fields(n)%values, 1) /= size(values, 1)) then
         call complain_about(group, '', text_of(size(values, 1))//' numbers for each element, but the groups of this name before ' &
                             //'it have '//text_of(size(fields(n)%values, 1)), error)
         return
      end if
      if (size(node_sets) > 0) then
         if (has(group, 'otherwise')) call cover_nodes(mesh, [(.true., i=1, size(mesh%coordinates, 2))], 0*values(:, 1) &
                                                       + otherwise, fields(n))
         call cover_nodes(mesh, in_node_sets(mesh, node_sets), values(:, 1), fields(n))
         return
      end if
      covered = size(sets) == 0 .or. in_element_sets(mesh, sets)
      do i = 1, size(covered)
         if (covered(i)) fields(n)%values(:, i) = values(:, i)
      end do
      fields(n)%known = fields(n)%known .or. covered
   end subroutine read_field

   !> Give nodes a value, and elements all corners of which have one the mean of them.
   pure subroutine cover_nodes(mesh, nodes, value, field)
      type(mesh_t), intent(in) :: mesh
      logical, intent(in) :: nodes(:)
      real(wp), intent(in) :: value(:)
      type(field_t), intent(inout) :: field
      integer :: e, i
      if (.not. allocated(field%nodal)) then
         allocate (field%nodal(size(value), size(nodes)), source=0.0_wp)
         allocate (field%known_node(size(nodes)), source=.false.)
      end if
      do i = 1, size(nodes)
         if (nodes(i)) field%nodal(:, i) = value
      end do
      field%known_node = field%known_node .or. nodes
      do e = 1, size(mesh%triangles, 2)
         associate (corners => mesh%triangles(:, e))
            if (.not. (any(nodes(corners)) .and. all(field%known_node(corners)))) cycle
            field%values(:, e) = sum(field%nodal(:, corners), dim=2)/3
            field%known(e) = .true.
         end associate
      end do
   end subroutine cover_nodes

   subroutine constant_values(group, mesh, values, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      real(wp), allocatable, intent(out) :: values(:, :)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: numbers(:)
      call get_few(group, 'value', numbers, error)
      values = spread(numbers, 2, size(mesh%triangles, 2))
   end subroutine constant_values

   !> A table over a coordinate of the centres of elements, or over their distance from an axis or a point.
   subroutine values_over(group, mesh, values, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      real(wp), allocatable, intent(out) :: values(:, :)
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: over
      real(wp), allocatable :: points(:)
      real(wp) :: axis(3), origin(3), d(3), x
      type(table_t) :: table
      integer :: e
      allocate (values(1, size(mesh%triangles, 2)), source=0.0_wp)
      call get(group, 'over', over, error, choices='x, y, z, radius, distance')
      call get(group, 'points', points, error, required=.true.)
      axis = [0.0_wp, 0.0_wp, 1.0_wp]
      origin = 0
      if (allocated(error)) return
      if (over == 'radius') call get_vector(group, 'axis', axis, error, default=[0.0_wp, 0.0_wp, 1.0_wp], nonzero=.true.)
      if (over == 'radius' .or. over == 'distance') call get_vector(group, 'origin', origin, error, &
                                                                            default=[0.0_wp, 0.0_wp, 0.0_wp])
      if (allocated(error)) return
      if (mod(size(points), 2) /= 0 .or. size(points) < 4) then
         call complain_about(group, 'points', text_of(size(points))//' numbers were found; expected two points or more, each a ' &
                             //'length, and a value', error)
         return
      end if
      table%x = points(1::2)
      table%y = points(2::2)
      if (any(table%x(2:) <= table%x(:size(table%x) - 1))) then
         call complain_about(group, 'points', 'the lengths of the points have to rise', error)
         return
      end if
      do e = 1, size(values, 2)
         d = sum(mesh%coordinates(:, mesh%triangles(:, e)), dim=2)/3 - origin
         select case (over)
         case ('x'); x = d(1)
         case ('y'); x = d(2)
         case ('z'); x = d(3)
         case ('radius'); x = norm2(cross_product(axis, d))/norm2(axis)
         case default; x = norm2(d)
         end select
         values(1, e) = table%value(x)
      end do
   end subroutine values_over

   !> A text file with a line for each element or each node, or the cell data of a result file.
   subroutine file_values(group, folder, mesh, values, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: folder
      type(mesh_t), intent(in) :: mesh
      real(wp), allocatable, intent(out) :: values(:, :)
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: refusal
      character(len=:), allocatable :: array, at, file
      real(wp), allocatable :: given(:, :)
      integer :: elements, increment, nodes, e
      call get(group, 'file', file, error)
      call get(group, 'at', at, error, default='', choices='elements, nodes')
      if (allocated(error)) return
      if (index(file, '/') /= 1) file = folder//file
      if (has(group, 'array')) then
         call get(group, 'array', array, error)
         call get(group, 'increment', increment, error, default=-1, minimum=0)
         if (allocated(error)) return
         call read_cell_data(file, array, increment, most, given, refusal)
         call place_error(group, 'file', refusal)
         if (allocated(refusal)) call move_alloc(refusal, error)
      else
         call read_number_file(group, 'file', file, most, given, error)
      end if
      if (allocated(error)) return
      elements = size(mesh%triangles, 2)
      nodes = size(mesh%coordinates, 2)
      if (allocated(mesh%lineage)) then
         elements = size(mesh%lineage%triangles, 2)
         nodes = mesh%lineage%nodes
      end if
      if (has(group, 'array') .and. at == '') at = 'elements'
      if (at == '' .and. size(given, 2) == elements .and. elements == nodes) then
         call complain_about(group, 'at', "the mesh has as many nodes as elements; at = 'elements' or 'nodes' is expected", error)
         return
      end if
      if (at == '' .and. size(given, 2) == nodes) at = 'nodes'
      if (at == 'nodes' .and. size(given, 2) == nodes) then
         if (allocated(mesh%lineage)) given = nodal_values(mesh%lineage, given)
         allocate (values(size(given, 1), size(mesh%triangles, 2)))
         do e = 1, size(values, 2)
            values(:, e) = sum(given(:, mesh%triangles(:, e)), dim=2)/3
         end do
      else if (at /= 'nodes' .and. size(given, 2) == elements) then
         values = given
         if (allocated(mesh%lineage)) values = given(:, [(parent_element(mesh%lineage, e), e=1, size(mesh%triangles, 2))])
      else
         call complain_about(group, 'file', file//' has '//text_of(size(given, 2))//' lines of numbers; expected one for each ' &
                             //'of the '//text_of(elements)//' elements or of the '//text_of(nodes)//' nodes of the mesh', error)
      end if
   end subroutine file_values

   !> The values of the field that a key names, for some elements: so many numbers for each. Errors: no such field; elements that it
   !> does not cover.
   subroutine get_field(group, key, fields, elements, least, largest, values, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      type(field_t), intent(in) :: fields(:)
      integer, intent(in) :: elements(:)
      integer, intent(in) :: least, largest !< numbers that are expected
      real(wp), allocatable, intent(out) :: values(:, :) !< (numbers, size(elements))
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: known, name
      integer :: at, i
      allocate (values(least, size(elements)), source=0.0_wp)
      call get(group, key, name, error)
      if (allocated(error)) return
      known = ''
      at = 0
      do i = 1, size(fields)
         known = known//', '//fields(i)%name
         if (fields(i)%name == name) at = i
      end do
      if (known == '') known = ', (none)'
      if (at == 0) then
         call complain_about(group, key, "there is no &field '"//name//"'"//suggestion(name, known(3:))//'; there are: ' &
                             //known(3:), error)
         return
      end if
      associate (field => fields(at))
         if (size(field%values, 1) < least .or. size(field%values, 1) > largest) then
            call complain_about(group, key, "the field '"//name//"' has "//text_of(size(field%values, 1)) &
                                //' numbers for each element; expected ' &
                                //trim(merge('one         ', 'one to three', largest == 1)), error)
         else if (.not. all(field%known(elements))) then
            i = findloc(field%known(elements), .false., dim=1)
            call complain_about(group, key, "the field '"//name//"' does not cover element "//text_of(elements(i)), error)
         else
            values = field%values(:, elements)
         end if
      end associate
   end subroutine get_field
end module finshell_input_field
