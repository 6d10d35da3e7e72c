!> Where a refined mesh comes from: the mesh before, whose every triangle became `cuts**2` triangles in a row.
!>
!> Nodes of the mesh before keep their numbers; behind them come those on its edges, then those inside its triangles.
module finshell_lineage
   use finshell_edges, only: edges_t
   implicit none
   private
   public :: lineage_t, edge_node, inner_node, node_count, parent_element, children_of
   public :: inherited_nodes, inherited_by_place

   type :: lineage_t
      integer :: cuts = 1 !< parts of every side
      integer :: nodes = 0 !< of the mesh before
      integer, allocatable :: triangles(:, :) !< (3, elements before)
      type(edges_t) :: edges !< of the mesh before
   end type lineage_t

contains

   !> Node number `s` (1 to cuts - 1) of edge `i`, from its first node to its second.
   elemental integer function edge_node(lineage, i, s)
      type(lineage_t), intent(in) :: lineage
      integer, intent(in) :: i, s
      edge_node = lineage%nodes + (i - 1)*(lineage%cuts - 1) + s
   end function edge_node

   !> Node inside of element `e` at a, b > 0, a + b < cuts parts from its first node towards its second and third.
   elemental integer function inner_node(lineage, e, a, b)
      type(lineage_t), intent(in) :: lineage
      integer, intent(in) :: e, a, b
      associate (m => lineage%cuts)
         inner_node = lineage%nodes + size(lineage%edges%nodes, 2)*(m - 1) + (e - 1)*((m - 1)*(m - 2)/2) &
            + (a - 1)*(m - 2) - (a - 1)*(a - 2)/2 + b
      end associate
   end function inner_node

   !> Of the refined mesh.
   elemental integer function node_count(lineage)
      type(lineage_t), intent(in) :: lineage
      associate (m => lineage%cuts)
         node_count = lineage%nodes + size(lineage%edges%nodes, 2)*(m - 1) + size(lineage%triangles, 2)*((m - 1)*(m - 2)/2)
      end associate
   end function node_count

   !> Element of the mesh before that a refined one is part of.
   elemental integer function parent_element(lineage, e)
      type(lineage_t), intent(in) :: lineage
      integer, intent(in) :: e
      parent_element = (e - 1)/lineage%cuts**2 + 1
   end function parent_element

   !> Parts of some elements of the mesh before, ascending if they are.
   pure function children_of(lineage, elements) result(children)
      type(lineage_t), intent(in) :: lineage
      integer, intent(in) :: elements(:)
      integer, allocatable :: children(:)
      integer :: i, k
      associate (parts => lineage%cuts**2)
         allocate (children(parts*size(elements)))
         do i = 1, size(elements)
            children(parts*(i - 1) + 1:parts*i) = [(parts*(elements(i) - 1) + k, k=1, parts)]
         end do
      end associate
   end function children_of

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
      integer :: first, i, each
      allocate (chosen(node_count(lineage)), source=.false.)
      chosen(:lineage%nodes) = nodes
      each = lineage%cuts - 1
      do i = 1, size(edges)
         first = lineage%nodes + (i - 1)*each
         chosen(first + 1:first + each) = edges(i)
      end do
      first = lineage%nodes + size(edges)*each
      each = each*(lineage%cuts - 2)/2
      do i = 1, size(elements)
         chosen(first + (i - 1)*each + 1:first + i*each) = elements(i)
      end do
   end function spread_out
end module finshell_lineage
