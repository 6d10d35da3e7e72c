!> Where a refined mesh comes from: the elements, edges and nodes of the mesh before, and what of the refined one lies on them.
!>
!> Nodes of the mesh before keep their numbers. Each new one lies on an edge of the mesh before or inside of an element.
module finshell_lineage
   use finshell_edges, only: edges_t, find_edge, new_edges
   use finshell_kinds, only: wp
   implicit none
   private
   public :: lineage_t, unrefined, node_count, parent_element, children_of, nodes_of_edges
   public :: inherited_nodes, inherited_by_place, nodal_values, add_middles

   type :: lineage_t
      integer :: nodes = 0 !< of the mesh before
      integer, allocatable :: triangles(:, :) !< (3, elements before)
      type(edges_t) :: edges !< of the mesh before
      integer, allocatable :: parent(:) !< (elements) element before that it is part of
      integer, allocatable :: edge(:) !< (new nodes) edge before that it lies on, or 0
      real(wp), allocatable :: share(:) !< (new nodes) of the way from the first to the second node of that edge
      integer, allocatable :: element(:) !< (new nodes) where `edge` is 0: element before that it lies in
   end type lineage_t

contains

   !> The lineage of a mesh that is not refined.
   pure subroutine unrefined(lineage, nodes, triangles)
      type(lineage_t), intent(out) :: lineage
      integer, intent(in) :: nodes
      integer, intent(in) :: triangles(:, :)
      integer :: e
      lineage%nodes = nodes
      lineage%triangles = triangles
      call new_edges(lineage%edges, triangles)
      lineage%parent = [(e, e=1, size(triangles, 2))]
      allocate (lineage%edge(0), lineage%share(0), lineage%element(0))
   end subroutine unrefined

   !> Of the refined mesh.
   pure integer function node_count(lineage)
      type(lineage_t), intent(in) :: lineage
      node_count = lineage%nodes + size(lineage%edge)
   end function node_count

   !> Element of the mesh before that a refined one is part of.
   elemental integer function parent_element(lineage, e)
      type(lineage_t), intent(in) :: lineage
      integer, intent(in) :: e
      parent_element = lineage%parent(e)
   end function parent_element

   !> Parts of some elements of the mesh before, ascending.
   pure function children_of(lineage, elements) result(children)
      type(lineage_t), intent(in) :: lineage
      integer, intent(in) :: elements(:)
      integer, allocatable :: children(:)
      logical :: wanted(size(lineage%triangles, 2))
      integer :: e
      wanted = .false.
      wanted(elements) = .true.
      children = pack([(e, e=1, size(lineage%parent))], wanted(lineage%parent))
   end function children_of

   !> New nodes on each edge before, from its first node to its second: of edge i they are list(first(i):first(i + 1) - 1).
   pure subroutine nodes_of_edges(lineage, first, list)
      type(lineage_t), intent(in) :: lineage
      integer, allocatable, intent(out) :: first(:), list(:)
      integer, allocatable :: filled(:)
      integer :: i, k, n
      n = size(lineage%edges%nodes, 2)
      allocate (first(n + 1), source=0)
      do i = 1, size(lineage%edge)
         if (lineage%edge(i) > 0) first(lineage%edge(i) + 1) = first(lineage%edge(i) + 1) + 1
      end do
      first(1) = 1
      do i = 1, n
         first(i + 1) = first(i + 1) + first(i)
      end do
      allocate (list(first(n + 1) - 1), filled(n))
      filled = 0
      do i = 1, size(lineage%edge)
         associate (edge => lineage%edge(i))
            if (edge == 0) cycle
            ! few nodes on an edge: put each in its place
            k = first(edge) + filled(edge)
            do while (k > first(edge))
               if (lineage%share(list(k - 1) - lineage%nodes) < lineage%share(i)) exit
               list(k) = list(k - 1)
               k = k - 1
            end do
            list(k) = lineage%nodes + i
            filled(edge) = filled(edge) + 1
         end associate
      end do
   end subroutine nodes_of_edges

   !> Nodes of the refined mesh in a set that was named node by node: with two ends of an edge of the boundary, or of a line inside,
   !> its nodes; with three of an element in a region, all of it. (Three nodes at a corner of the boundary are no region.)
   pure function inherited_nodes(lineage, before) result(chosen)
      type(lineage_t), intent(in) :: lineage
      logical, intent(in) :: before(:) !< (nodes before)
      logical, allocatable :: chosen(:)
      logical :: region(size(lineage%triangles, 2)), whole(size(lineage%edges%nodes, 2))
      integer :: e, i
      logical :: boundary(3)
      whole = [(all(before(lineage%edges%nodes(:, i))), i=1, size(whole))]
      do e = 1, size(region)
         boundary = lineage%edges%elements(2, lineage%edges%of_side(:, e)) == 0
         region(e) = all(before(lineage%triangles(:, e))) .and. count(boundary) < 2
      end do
      do i = 1, size(whole)
         associate (at => lineage%edges%elements(:, i))
            if (.not. whole(i) .or. at(2) == 0) cycle
            ! across a corner of the boundary: an edge of a triangle in the set that is no region
            whole(i) = any(region(at)) .or. .not. (all(before(lineage%triangles(:, at(1)))) &
                                                   .or. all(before(lineage%triangles(:, at(2)))))
         end associate
      end do
      chosen = spread_out(lineage, before, whole, region)
   end function inherited_nodes

   !> The same of a set of all nodes in a convex part of space.
   pure function inherited_by_place(lineage, before) result(chosen)
      type(lineage_t), intent(in) :: lineage
      logical, intent(in) :: before(:)
      logical, allocatable :: chosen(:)
      integer :: i
      chosen = spread_out(lineage, before, [(all(before(lineage%edges%nodes(:, i))), i=1, size(lineage%edges%nodes, 2))], &
                          [(all(before(lineage%triangles(:, i))), i=1, size(lineage%triangles, 2))])
   end function inherited_by_place

   !> Nodes, with those of whole edges and elements.
   pure function spread_out(lineage, nodes, edges, elements) result(chosen)
      type(lineage_t), intent(in) :: lineage
      logical, intent(in) :: nodes(:), edges(:), elements(:)
      logical, allocatable :: chosen(:)
      integer :: i
      allocate (chosen(node_count(lineage)))
      chosen(:lineage%nodes) = nodes
      do i = 1, size(lineage%edge)
         if (lineage%edge(i) > 0) then
            chosen(lineage%nodes + i) = edges(lineage%edge(i))
         else
            chosen(lineage%nodes + i) = elements(lineage%element(i))
         end if
      end do
   end function spread_out

   !> Values at the nodes of the refined mesh from those at the nodes before: on edges along straight lines, inside of elements the
   !> mean of the corners.
   pure function nodal_values(lineage, before) result(values)
      type(lineage_t), intent(in) :: lineage
      real(wp), intent(in) :: before(:, :) !< (numbers, nodes before)
      real(wp), allocatable :: values(:, :) !< (numbers, nodes)
      integer :: i
      allocate (values(size(before, 1), node_count(lineage)))
      values(:, :lineage%nodes) = before
      do i = 1, size(lineage%edge)
         if (lineage%edge(i) > 0) then
            associate (ends => lineage%edges%nodes(:, lineage%edge(i)))
               values(:, lineage%nodes + i) = (1 - lineage%share(i))*before(:, ends(1)) + lineage%share(i)*before(:, ends(2))
            end associate
         else
            values(:, lineage%nodes + i) = sum(before(:, lineage%triangles(:, lineage%element(i))), dim=2)/3
         end if
      end do
   end function nodal_values

   !> Go on to a mesh with new nodes in the middle of some of the edges of the refined one.
   pure subroutine add_middles(lineage, ends, elements)
      type(lineage_t), intent(inout) :: lineage
      integer, intent(in) :: ends(:, :) !< (2, new nodes) nodes of the refined mesh
      integer, intent(in) :: elements(:) !< (new nodes) an element of the refined mesh at that edge
      integer :: edge(size(elements)), i
      real(wp) :: share(size(elements))
      do i = 1, size(elements)
         call place_middle(lineage, ends(:, i), edge(i), share(i))
      end do
      lineage%edge = [lineage%edge, edge]
      lineage%share = [lineage%share, share]
      lineage%element = [lineage%element, merge(lineage%parent(elements), 0, edge == 0)]
   end subroutine add_middles

   !> The edge before on which two nodes lie, 0 if there is none, and where their middle lies.
   pure subroutine place_middle(lineage, ends, edge, share)
      type(lineage_t), intent(in) :: lineage
      integer, intent(in) :: ends(2)
      integer, intent(out) :: edge
      real(wp), intent(out) :: share
      integer :: k, node
      edge = 0
      share = 0
      if (all(ends <= lineage%nodes)) then
         edge = find_edge(lineage%edges, ends(1), ends(2))
         share = 0.5_wp
         return
      end if
      edge = lineage%edge(maxval(ends) - lineage%nodes)
      if (edge == 0) return
      do k = 1, 2
         node = ends(k)
         if (node > lineage%nodes) then
            if (lineage%edge(node - lineage%nodes) /= edge) exit
            share = share + 0.5_wp*lineage%share(node - lineage%nodes)
         else
            if (all(lineage%edges%nodes(:, edge) /= node)) exit
            if (lineage%edges%nodes(2, edge) == node) share = share + 0.5_wp
         end if
      end do
      if (k <= 2) edge = 0
   end subroutine place_middle
end module finshell_lineage
