!> A mesh of triangles with named sets.
!>
!> Built by `new_mesh` and the `add_*_set` procedures, by the generators (finshell_mesh_disk, ...) or by a reader
!> (finshell_gmsh). Every mesh has the node set 'all' and the element set 'all'; an edge set also exists as node set.
module finshell_mesh
   use finshell_kinds, only: wp, i8
   use finshell_error, only: text_of
   use finshell_lineage, only: lineage_t
   use finshell_mesh_sorting, only: sorted_unique
   use finshell_rotation, only: cross_product
   use finshell_surface, only: surface_t
   implicit none
   private
   public :: set_t, edge_set_t, mesh_t
   public :: new_mesh, add_loose_node, add_node_set, add_element_set, add_edge_set
   public :: find_node_set, find_element_set, find_edge_set, node_set_names, element_set_names, edge_set_names
   public :: elements_at, mesh_area, mesh_size, mean_side, twice_area_vector, node_text, element_text

   !> Nodes or elements by name; numbers ascending, each once.
   type :: set_t
      character(len=:), allocatable :: name
      integer, allocatable :: members(:)
      logical :: grows = .false. !< of a file: lines and regions of nodes, to which nodes between them will belong, not points
   end type set_t

   !> Element edges by name, in the order of the line they form.
   type :: edge_set_t
      character(len=:), allocatable :: name
      integer, allocatable :: edges(:, :) !< (2, edges): pairs of nodes
   end type edge_set_t

   type :: mesh_t
      real(wp), allocatable :: coordinates(:, :) !< (3, nodes)
      integer, allocatable :: triangles(:, :) !< (3, elements): node numbers, counterclockwise seen from the tip of the normal
      type(set_t), allocatable :: node_sets(:)
      type(set_t), allocatable :: element_sets(:)
      type(edge_set_t), allocatable :: edge_sets(:)
      !> (3, nodes) normals of the surface, of any length, where the generator knows it to be curved; unallocated: not known.
      real(wp), allocatable :: normal(:, :)
      type(surface_t) :: surface !< that of the generator
      !> Two nodes may share a position (the lips of a slit); otherwise check_mesh refuses them.
      logical :: coincident_nodes_allowed = .false.
      !> What the file calls nodes and elements, for messages; not allocated for generated meshes.
      integer(i8), allocatable :: node_tags(:), element_tags(:)
      !> Nodes of no element, which come last: for what is joined to the mesh (&node).
      integer :: loose = 0
      !> Names of sets that the file announces but leaves empty, each in ".
      character(len=:), allocatable :: empty_sets
      character(len=:), allocatable :: notes !< what was done to the contents of the file, for the user; '' or unallocated: nothing
      character(len=:), allocatable :: results !< the result file that it is of, which no run may replace; unallocated: of none
      !> Of a mesh that was refined triangle by triangle.
      type(lineage_t), allocatable :: lineage
      !> Of any refined mesh: its node sets before. Forces at each of their nodes keep their sum.
      type(set_t), allocatable :: former_node_sets(:)
   end type mesh_t

contains

   !> Start a mesh: coordinates (3, nodes), triangles (3, elements), and the two sets 'all'.
   pure subroutine new_mesh(mesh, coordinates, triangles)
      type(mesh_t), intent(out) :: mesh
      real(wp), intent(in) :: coordinates(:, :)
      integer, intent(in) :: triangles(:, :)
      integer :: i

      mesh%coordinates = coordinates
      mesh%triangles = triangles
      allocate (mesh%node_sets(0), mesh%element_sets(0), mesh%edge_sets(0))
      call add_node_set(mesh, 'all', [(i, i=1, size(coordinates, 2))])
      call add_element_set(mesh, 'all', [(i, i=1, size(triangles, 2))])
   end subroutine new_mesh

   !> Add a node that belongs to no element, as a node set of its own. The set 'all' does not get it.
   pure subroutine add_loose_node(mesh, name, position)
      type(mesh_t), intent(inout) :: mesh
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: position(3)
      integer :: n
      n = size(mesh%coordinates, 2) + 1
      mesh%loose = mesh%loose + 1
      mesh%coordinates = reshape([mesh%coordinates, position], [3, n])
      if (allocated(mesh%normal)) mesh%normal = reshape([mesh%normal, 0.0_wp, 0.0_wp, 0.0_wp], [3, n])
      if (allocated(mesh%node_tags)) mesh%node_tags = [mesh%node_tags, maxval(mesh%node_tags) + 1]
      call add_node_set(mesh, name, [n])
   end subroutine add_loose_node

   !> Add a node set; members of an existing set of that name are kept and joined.
   pure subroutine add_node_set(mesh, name, members, grows)
      type(mesh_t), intent(inout) :: mesh
      character(len=*), intent(in) :: name
      integer, intent(in) :: members(:)
      logical, intent(in), optional :: grows !< see set_t
      call add_set(mesh%node_sets, name, members)
      if (present(grows)) mesh%node_sets(find_set(mesh%node_sets, name))%grows = grows
   end subroutine add_node_set

   !> Add an element set; members of an existing set of that name are kept and joined.
   pure subroutine add_element_set(mesh, name, members)
      type(mesh_t), intent(inout) :: mesh
      character(len=*), intent(in) :: name
      integer, intent(in) :: members(:)
      call add_set(mesh%element_sets, name, members)
   end subroutine add_element_set

   !> Add an edge set, edges (2, :) being pairs of nodes, and the node set of the same name; an existing one is extended.
   pure subroutine add_edge_set(mesh, name, edges)
      type(mesh_t), intent(inout) :: mesh
      character(len=*), intent(in) :: name
      integer, intent(in) :: edges(:, :)
      type(edge_set_t), allocatable :: grown(:)
      integer :: n, i

      n = size(mesh%edge_sets)
      i = find_edge_set(mesh, name)
      if (i > 0) then
         mesh%edge_sets(i)%edges = reshape([mesh%edge_sets(i)%edges, edges], [2, size(mesh%edge_sets(i)%edges, 2) + size(edges, 2)])
      else
         allocate (grown(n + 1))
         do i = 1, n
            grown(i) = mesh%edge_sets(i)
         end do
         grown(n + 1)%name = name
         grown(n + 1)%edges = edges
         call move_alloc(grown, mesh%edge_sets)
      end if
      call add_node_set(mesh, name, reshape(edges, [size(edges)]))
   end subroutine add_edge_set

   pure subroutine add_set(sets, name, members)
      type(set_t), allocatable, intent(inout) :: sets(:)
      character(len=*), intent(in) :: name
      integer, intent(in) :: members(:)
      type(set_t), allocatable :: grown(:)
      integer :: n, i

      i = find_set(sets, name)
      if (i > 0) then
         sets(i)%members = sorted_unique([sets(i)%members, members])
         return
      end if
      n = size(sets)
      allocate (grown(n + 1))
      do i = 1, n
         grown(i) = sets(i)
      end do
      grown(n + 1)%name = name
      grown(n + 1)%members = sorted_unique(members)
      call move_alloc(grown, sets)
   end subroutine add_set

   pure integer function find_set(sets, name) result(position)
      type(set_t), intent(in) :: sets(:)
      character(len=*), intent(in) :: name
      do position = size(sets), 1, -1
         if (sets(position)%name == name) return
      end do
      position = 0
   end function find_set

   !> Position of a node set in mesh%node_sets, 0 when there is none of that name (names are case-sensitive).
   pure integer function find_node_set(mesh, name) result(position)
      type(mesh_t), intent(in) :: mesh
      character(len=*), intent(in) :: name
      position = find_set(mesh%node_sets, name)
   end function find_node_set

   !> Position of an element set in mesh%element_sets, 0 when there is none of that name.
   pure integer function find_element_set(mesh, name) result(position)
      type(mesh_t), intent(in) :: mesh
      character(len=*), intent(in) :: name
      position = find_set(mesh%element_sets, name)
   end function find_element_set

   !> Position of an edge set in mesh%edge_sets, 0 when there is none of that name.
   pure integer function find_edge_set(mesh, name) result(position)
      type(mesh_t), intent(in) :: mesh
      character(len=*), intent(in) :: name
      do position = size(mesh%edge_sets), 1, -1
         if (mesh%edge_sets(position)%name == name) return
      end do
      position = 0
   end function find_edge_set

   !> The names of all node sets, for messages: "all, rim, centre".
   pure function node_set_names(mesh) result(text)
      type(mesh_t), intent(in) :: mesh
      character(len=:), allocatable :: text
      text = set_names(mesh%node_sets)
   end function node_set_names

   pure function element_set_names(mesh) result(text)
      type(mesh_t), intent(in) :: mesh
      character(len=:), allocatable :: text
      text = set_names(mesh%element_sets)
   end function element_set_names

   pure function edge_set_names(mesh) result(text)
      type(mesh_t), intent(in) :: mesh
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(mesh%edge_sets)
         if (i > 1) text = text//', '
         text = text//mesh%edge_sets(i)%name
      end do
      if (text == '') text = '(none)'
   end function edge_set_names

   pure function set_names(sets) result(text)
      type(set_t), intent(in) :: sets(:)
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(sets)
         if (i > 1) text = text//', '
         text = text//sets(i)%name
      end do
   end function set_names

   !> Elements at marked nodes.
   pure function elements_at(mesh, marked) result(list)
      type(mesh_t), intent(in) :: mesh
      logical, intent(in) :: marked(:) !< (nodes)
      integer, allocatable :: list(:)
      integer :: e
      list = pack([(e, e=1, size(mesh%triangles, 2))], [(any(marked(mesh%triangles(:, e))), e=1, size(mesh%triangles, 2))])
   end function elements_at

   !> Sum of the areas of all triangles.
   pure real(wp) function mesh_area(mesh) result(area)
      type(mesh_t), intent(in) :: mesh
      integer :: e
      area = 0.0_wp
      do e = 1, size(mesh%triangles, 2)
         area = area + 0.5_wp*norm2(twice_area_vector(mesh, e))
      end do
   end function mesh_area

   !> Diagonal of the box around all nodes.
   pure real(wp) function mesh_size(mesh) result(length)
      type(mesh_t), intent(in) :: mesh
      associate (x => mesh%coordinates(:, :size(mesh%coordinates, 2) - mesh%loose))
         length = norm2(maxval(x, dim=2) - minval(x, dim=2))
      end associate
   end function mesh_size

   !> Mean length of an element side.
   pure function mean_side(mesh) result(length)
      type(mesh_t), intent(in) :: mesh
      real(wp) :: length
      integer :: e, k
      length = 0
      do e = 1, size(mesh%triangles, 2)
         do k = 1, 3
            length = length + norm2(mesh%coordinates(:, mesh%triangles(mod(k, 3) + 1, e)) &
                                    - mesh%coordinates(:, mesh%triangles(k, e)))
         end do
      end do
      length = length/(3*size(mesh%triangles, 2))
   end function mean_side

   pure function twice_area_vector(mesh, element) result(n)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element
      real(wp) :: n(3)
      real(wp) :: a(3), b(3)
      associate (x => mesh%coordinates, t => mesh%triangles(:, element))
         a = x(:, t(2)) - x(:, t(1))
         b = x(:, t(3)) - x(:, t(1))
      end associate
      n = cross_product(a, b)
   end function twice_area_vector

   !> 'node 3', with its tag in the file where that is another number.
   pure function node_text(mesh, i) result(text)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: i
      character(len=:), allocatable :: text
      text = 'node '//text_of(i)
      if (allocated(mesh%node_tags)) text = text//tagged(mesh%node_tags, i)
   end function node_text

   !> 'element 3', likewise.
   pure function element_text(mesh, e) result(text)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: e
      character(len=:), allocatable :: text
      text = 'element '//text_of(e)
      if (allocated(mesh%element_tags)) text = text//tagged(mesh%element_tags, e)
   end function element_text

   pure function tagged(tags, i) result(text)
      integer(i8), intent(in) :: tags(:)
      integer, intent(in) :: i
      character(len=:), allocatable :: text
      character(len=24) :: buffer
      text = ''
      if (i < 1 .or. i > size(tags)) return
      if (tags(i) == i) return
      write (buffer, '(i0)') tags(i)
      text = ' (tag '//trim(buffer)//')'
   end function tagged
end module finshell_mesh
