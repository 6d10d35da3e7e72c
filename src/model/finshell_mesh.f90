!> A mesh of triangles with named sets, and the checks every mesh must pass before it is computed on.
!>
!> Built by `new_mesh` and the `add_*_set` procedures, by the generators (finshell_mesh_disk, ...) or by a reader
!> (finshell_gmsh). Every mesh has the node set 'all' and the element set 'all'; an edge set also exists as node set.
module finshell_mesh
   use finshell_kinds, only: wp, dp, i8
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_input_error, status_degenerate_reference, status_not_a_number
   use finshell_mesh_sorting, only: sorted_order, sorted_unique
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   implicit none
   private
   public :: set_t, edge_set_t, mesh_t
   public :: new_mesh, add_node_set, add_element_set, add_edge_set
   public :: find_node_set, find_element_set, find_edge_set, node_set_names, element_set_names, edge_set_names
   public :: mesh_area, mesh_size, check_mesh

   !> Nodes or elements by name; numbers ascending, each once.
   type :: set_t
      character(len=:), allocatable :: name
      integer, allocatable :: members(:)
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
      !> Two nodes may share a position (the lips of a slit); otherwise check_mesh refuses them.
      logical :: coincident_nodes_allowed = .false.
   end type mesh_t

   !> Nodes closer than this, relative to the size of the mesh, coincide.
   real(wp), parameter :: coincidence = 1.0e-9_wp
   !> A triangle whose height over its longest side is below this fraction of that side is degenerate.
   real(wp), parameter :: flatness = 1.0e-8_wp

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

   !> Add a node set; members of an existing set of that name are kept and joined.
   pure subroutine add_node_set(mesh, name, members)
      type(mesh_t), intent(inout) :: mesh
      character(len=*), intent(in) :: name
      integer, intent(in) :: members(:)
      call add_set(mesh%node_sets, name, members)
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
      length = norm2(maxval(mesh%coordinates, dim=2) - minval(mesh%coordinates, dim=2))
   end function mesh_size

   pure function twice_area_vector(mesh, element) result(n)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element
      real(wp) :: n(3)
      real(wp) :: a(3), b(3)
      associate (x => mesh%coordinates, t => mesh%triangles(:, element))
         a = x(:, t(2)) - x(:, t(1))
         b = x(:, t(3)) - x(:, t(1))
      end associate
      n = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
   end function twice_area_vector

   !> Refuse a mesh that cannot be computed on; the message names the nodes and elements concerned.
   !>
   !> Found: no nodes or elements; a node number out of range; a coordinate that is not a number; a degenerate triangle; a node
   !> without element; two nodes at one place (unless mesh%coincident_nodes_allowed); an edge of more than two triangles;
   !> neighbours with opposite normals; an empty set or a member out of range.
   pure subroutine check_mesh(mesh, error)
      type(mesh_t), intent(in) :: mesh
      type(error_t), allocatable, intent(out) :: error

      call check_sizes(mesh, error)
      if (.not. allocated(error)) call check_triangles(mesh, error)
      if (.not. allocated(error)) call check_used(mesh, error)
      if (.not. allocated(error) .and. .not. mesh%coincident_nodes_allowed) call check_duplicates(mesh, error)
      if (.not. allocated(error)) call check_edges(mesh, error)
      if (.not. allocated(error)) call check_sets(mesh%node_sets, 'node', size(mesh%coordinates, 2), error)
      if (.not. allocated(error)) call check_sets(mesh%element_sets, 'element', size(mesh%triangles, 2), error)
   end subroutine check_mesh

   pure subroutine check_sizes(mesh, error)
      type(mesh_t), intent(in) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      integer :: i

      if (.not. allocated(mesh%coordinates) .or. .not. allocated(mesh%triangles)) then
         call raise(error, status_input_error, 'mesh: no coordinates or no triangles were given')
      else if (size(mesh%coordinates, 2) == 0 .or. size(mesh%triangles, 2) == 0) then
         call raise(error, status_input_error, 'mesh: it has '//text_of(size(mesh%coordinates, 2))//' nodes and ' &
            //text_of(size(mesh%triangles, 2))//' triangles; at least one triangle is needed')
      else
         do i = 1, size(mesh%coordinates, 2)
            if (all(ieee_is_finite(mesh%coordinates(:, i)))) cycle
            call raise(error, status_not_a_number, 'mesh: a coordinate of node '//text_of(i)//' is NaN or infinite')
            return
         end do
      end if
   end subroutine check_sizes

   pure subroutine check_triangles(mesh, error)
      type(mesh_t), intent(in) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: longest
      integer :: e, k, t(3)

      do e = 1, size(mesh%triangles, 2)
         t = mesh%triangles(:, e)
         do k = 1, 3
            if (t(k) >= 1 .and. t(k) <= size(mesh%coordinates, 2)) cycle
            call raise(error, status_input_error, 'mesh: element '//text_of(e)//' refers to node '//text_of(t(k)) &
               //'; node numbers run from 1 to '//text_of(size(mesh%coordinates, 2)))
            return
         end do
         longest = 0.0_wp
         do k = 1, 3
            longest = max(longest, norm2(mesh%coordinates(:, t(mod(k, 3) + 1)) - mesh%coordinates(:, t(k))))
         end do
         if (norm2(twice_area_vector(mesh, e)) > flatness*longest**2) cycle
         call raise(error, status_degenerate_reference, 'mesh: element '//text_of(e)//' (nodes '//text_of(t(1))//', ' &
            //text_of(t(2))//', '//text_of(t(3))//') is degenerate: its nodes coincide or lie on a line')
         return
      end do
   end subroutine check_triangles

   pure subroutine check_used(mesh, error)
      type(mesh_t), intent(in) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      logical :: used(size(mesh%coordinates, 2))
      integer :: e, i

      used = .false.
      do e = 1, size(mesh%triangles, 2)
         used(mesh%triangles(:, e)) = .true.
      end do
      if (all(used)) return
      i = findloc(used, .false., dim=1)
      call raise(error, status_input_error, 'mesh: node '//text_of(i)//' belongs to no element ('//text_of(count(.not. used)) &
         //' such nodes); remove it')
   end subroutine check_used

   !> Nodes are sorted along a direction in which regular meshes have no ties, so only true neighbours are compared.
   pure subroutine check_duplicates(mesh, error)
      type(mesh_t), intent(in) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      real(wp), parameter :: direction(3) = [0.563157_wp, 0.618034_wp, 0.548583_wp]
      real(wp), allocatable :: along(:)
      integer, allocatable :: order(:)
      real(wp) :: tolerance
      integer :: n, i, j, a, b

      n = size(mesh%coordinates, 2)
      tolerance = coincidence*mesh_size(mesh)
      along = matmul(direction, mesh%coordinates)
      order = sorted_order(along)
      do i = 1, n
         do j = i + 1, n
            if (along(order(j)) - along(order(i)) > tolerance) exit
            a = min(order(i), order(j))
            b = max(order(i), order(j))
            if (norm2(mesh%coordinates(:, a) - mesh%coordinates(:, b)) > tolerance) cycle
            call raise(error, status_input_error, 'mesh: nodes '//text_of(a)//' and '//text_of(b)//' are duplicates, both at (' &
               //text_of(real(mesh%coordinates(1, a), dp))//', '//text_of(real(mesh%coordinates(2, a), dp))//', ' &
               //text_of(real(mesh%coordinates(3, a), dp))//'); merge them, or allow coincident nodes if a slit is meant')
            return
         end do
      end do
   end subroutine check_duplicates

   !> Neighbours must run through their common edge in opposite directions, and an edge has at most two triangles.
   pure subroutine check_edges(mesh, error)
      type(mesh_t), intent(in) :: mesh
      type(error_t), allocatable, intent(inout) :: error
      integer(i8), allocatable :: key(:)
      integer, allocatable :: order(:)
      integer :: i, k, e, a, b, first, second

      allocate (key(3*size(mesh%triangles, 2)))
      do e = 1, size(mesh%triangles, 2)
         do k = 1, 3
            a = mesh%triangles(k, e)
            b = mesh%triangles(mod(k, 3) + 1, e)
            key(3*(e - 1) + k) = int(min(a, b), i8)*(size(mesh%coordinates, 2) + 1_i8) + max(a, b)
         end do
      end do
      order = sorted_order(key)
      do i = 2, size(order)
         first = order(i - 1)
         second = order(i)
         if (key(first) /= key(second)) cycle
         a = start_of(first)
         b = mesh%triangles(mod(mod(first - 1, 3) + 1, 3) + 1, element_of(first))
         if (i > 2) then
            if (key(order(i - 2)) == key(second)) then
               call raise(error, status_input_error, 'mesh: the edge between nodes '//text_of(a)//' and '//text_of(b) &
                  //' is shared by more than two elements: '//text_of(element_of(order(i - 2)))//', ' &
                  //text_of(element_of(first))//', '//text_of(element_of(second)))
               return
            end if
         end if
         if (start_of(first) == start_of(second)) then
            call raise(error, status_input_error, 'mesh: elements '//text_of(element_of(first))//' and ' &
               //text_of(element_of(second))//' have opposite orientation (both run through their common edge from node ' &
               //text_of(a)//' to node '//text_of(b)//'); swap two nodes of the inverted one')
            return
         end if
      end do

   contains

      pure integer function element_of(position)
         integer, intent(in) :: position
         element_of = (position - 1)/3 + 1
      end function element_of

      pure integer function start_of(position)
         integer, intent(in) :: position
         start_of = mesh%triangles(mod(position - 1, 3) + 1, element_of(position))
      end function start_of
   end subroutine check_edges

   pure subroutine check_sets(sets, kind_of_set, largest, error)
      type(set_t), intent(in) :: sets(:)
      character(len=*), intent(in) :: kind_of_set
      integer, intent(in) :: largest
      type(error_t), allocatable, intent(inout) :: error
      integer :: i

      do i = 1, size(sets)
         if (size(sets(i)%members) == 0) then
            call raise(error, status_input_error, 'mesh: the '//kind_of_set//" set '"//sets(i)%name//"' is empty")
            return
         else if (sets(i)%members(1) < 1 .or. sets(i)%members(size(sets(i)%members)) > largest) then
            call raise(error, status_input_error, 'mesh: the '//kind_of_set//" set '"//sets(i)%name//"' contains number " &
               //text_of(merge(sets(i)%members(1), sets(i)%members(size(sets(i)%members)), sets(i)%members(1) < 1)) &
               //'; numbers run from 1 to '//text_of(largest))
            return
         end if
      end do
   end subroutine check_sets
end module finshell_mesh
