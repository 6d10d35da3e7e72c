!> What every mesh must pass before it is computed on.
module finshell_mesh_check
   use finshell_kinds, only: wp, dp, i8
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_input_error, status_degenerate_reference, status_not_a_number
   use finshell_edges, only: edge_key
   use finshell_mesh, only: mesh_t, set_t, edge_set_t, mesh_size, twice_area_vector, node_text, element_text
   use finshell_mesh_sorting, only: sorted_order, position_in_sorted
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   implicit none
   private
   public :: check_mesh

   !> Nodes closer than this, relative to the size of the mesh, coincide.
   real(wp), parameter :: coincidence = 1.0e-9_wp
   !> A triangle whose height over its longest side is below this fraction of that side is degenerate.
   real(wp), parameter :: flatness = 1.0e-8_wp
   !> Elements refuse triangles with a longest side beyond this, or below its inverse (finshell_triangle).
   real(wp), parameter :: longest_side = 1.0e60_wp

contains

   !> Refuse a mesh that cannot be computed on; the message names the nodes and elements concerned.
   !>
   !> Found: no nodes or elements; a node number out of range; a coordinate that is not a number; a degenerate triangle, or one
   !> of a size that cannot be computed with; a node without element; two nodes at one place (unless
   !> mesh%coincident_nodes_allowed); two neighbours with opposite normals; two elements of the same
   !> nodes; an empty set or a member out of range; a pair of nodes in an edge set that is no edge of an element, or that is there
   !> twice.
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
            call raise(error, status_not_a_number, 'mesh: a coordinate of '//node_text(mesh, i)//' is NaN or infinite')
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
            call raise(error, status_input_error, 'mesh: '//element_text(mesh, e)//' refers to node '//text_of(t(k)) &
               //'; node numbers run from 1 to '//text_of(size(mesh%coordinates, 2)))
            return
         end do
         longest = 0.0_wp
         do k = 1, 3
            longest = max(longest, norm2(mesh%coordinates(:, t(mod(k, 3) + 1)) - mesh%coordinates(:, t(k))))
         end do
         if (longest >= longest_side .or. (longest > 0 .and. longest <= 1/longest_side)) then
            call raise(error, status_degenerate_reference, 'mesh: the longest side of '//element_text(mesh, e)//' measures ' &
               //text_of(real(longest, dp))//'; more than 1e-60 and less than 1e60 is expected: take another unit of length')
            return
         end if
         if (norm2(twice_area_vector(mesh, e)) > flatness*longest**2) cycle
         call raise(error, status_degenerate_reference, 'mesh: '//element_text(mesh, e)//' (nodes '//text_of(t(1))//', ' &
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
      used(size(used) - mesh%loose + 1:) = .true.
      if (all(used)) return
      i = findloc(used, .false., dim=1)
      call raise(error, status_input_error, 'mesh: '//node_text(mesh, i)//' belongs to no element ('//text_of(count(.not. used)) &
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
            call raise(error, status_input_error, 'mesh: '//node_text(mesh, a)//' and '//node_text(mesh, b) &
               //' are duplicates, both at ('//text_of(real(mesh%coordinates(1, a), dp))//', ' &
               //text_of(real(mesh%coordinates(2, a), dp))//', '//text_of(real(mesh%coordinates(3, a), dp)) &
               //'); merge them, or allow coincident nodes if a slit is meant; &tie joins them')
            return
         end do
      end do
   end subroutine check_duplicates

   !> Two neighbours must run through their common edge in opposite directions. More triangles may meet at an edge, each with a
   !> side of its own.
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
            key(3*(e - 1) + k) = edge_key(a, b)
         end do
      end do
      order = sorted_order(key)
      do i = 2, size(order)
         first = order(i - 1)
         second = order(i)
         if (key(first) /= key(second)) cycle
         do k = i - 1, 1, -1
            if (key(order(k)) /= key(second)) exit
            if (.not. same_nodes(element_of(order(k)), element_of(second))) cycle
            call raise(error, status_input_error, 'mesh: '//element_text(mesh, element_of(order(k)))//' and ' &
               //element_text(mesh, element_of(second))//' are the same triangle: remove one of them')
            return
         end do
         if (same_edge(i - 2) .or. same_edge(i + 1)) cycle ! a junction
         a = start_of(first)
         b = mesh%triangles(mod(mod(first - 1, 3) + 1, 3) + 1, element_of(first))
         if (start_of(first) == start_of(second)) then
            call raise(error, status_input_error, 'mesh: '//element_text(mesh, element_of(first))//' and ' &
               //element_text(mesh, element_of(second))//' have opposite orientation (both run through their common edge from ' &
               //node_text(mesh, a)//' to '//node_text(mesh, b)//'), so their normals point to opposite sides; orient = .true. ' &
               //'in &mesh turns all triangles alike')
            return
         end if
      end do
      key = key(order)
      do i = 1, size(mesh%edge_sets)
         call check_edge_set(mesh, mesh%edge_sets(i), key, error)
         if (allocated(error)) return
      end do

   contains

      !> Whether the side in another place of the order has the edge of `second`.
      pure logical function same_edge(place)
         integer, intent(in) :: place
         same_edge = .false.
         if (place >= 1 .and. place <= size(order)) same_edge = key(order(place)) == key(second)
      end function same_edge

      pure integer function element_of(position)
         integer, intent(in) :: position
         element_of = (position - 1)/3 + 1
      end function element_of

      pure integer function start_of(position)
         integer, intent(in) :: position
         start_of = mesh%triangles(mod(position - 1, 3) + 1, element_of(position))
      end function start_of

      pure logical function same_nodes(a, b)
         integer, intent(in) :: a, b
         integer :: i
         same_nodes = all([(any(mesh%triangles(i, a) == mesh%triangles(:, b)), i=1, 3)])
      end function same_nodes
   end subroutine check_edges

   !> What carries a line load must be an edge of the shell, and be there once.
   pure subroutine check_edge_set(mesh, set, key, error)
      type(mesh_t), intent(in) :: mesh
      type(edge_set_t), intent(in) :: set
      integer(i8), intent(in) :: key(:) !< of the edges of all elements, ascending
      type(error_t), allocatable, intent(inout) :: error
      integer(i8) :: own(size(set%edges, 2))
      integer, allocatable :: order(:)
      integer :: i, bad

      do i = 1, size(own)
         own(i) = edge_key(set%edges(1, i), set%edges(2, i))
         if (position_in_sorted(key, own(i)) > 0) cycle
         call raise(error, status_input_error, 'mesh: '//pair(i)//', which is no edge of an element')
         return
      end do
      order = sorted_order(own)
      do i = 2, size(own)
         if (own(order(i)) /= own(order(i - 1))) cycle
         bad = order(i)
         call raise(error, status_input_error, 'mesh: '//pair(bad)//', twice: a line load would count twice there')
         return
      end do

   contains

      pure function pair(i) result(text)
         integer, intent(in) :: i
         character(len=:), allocatable :: text
         text = "the edge set '"//set%name//"' contains the line from "//node_text(mesh, set%edges(1, i))//' to ' &
            //node_text(mesh, set%edges(2, i))
      end function pair
   end subroutine check_edge_set

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
end module finshell_mesh_check
