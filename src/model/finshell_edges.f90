!> The edges of a mesh: each once, with what lies at its sides.
module finshell_edges
   use finshell_kinds, only: i8
   use finshell_mesh_sorting, only: sorted_order
   implicit none
   private
   public :: edges_t, new_edges, find_edge, edge_key, has_junctions

   type :: edges_t
      integer, allocatable :: nodes(:, :) !< (2, edges) the smaller number first, in ascending order
      integer, allocatable :: of_side(:, :) !< (3, elements) edge of the side from node k to node k + 1
      !> (2, edges) at the edge; the second is 0 at the boundary, and at a junction: there sheets meet that each end.
      integer, allocatable :: elements(:, :)
      logical, allocatable :: junction(:) !< (edges) more than two triangles meet
   end type edges_t

contains

   !> Of triangles (3, elements).
   pure subroutine new_edges(edges, triangles)
      type(edges_t), intent(out) :: edges
      integer, intent(in) :: triangles(:, :)
      integer(i8), allocatable :: ends(:)
      integer, allocatable :: order(:)
      integer :: e, i, k, n, side
      allocate (ends(size(triangles)))
      do e = 1, size(triangles, 2)
         do k = 1, 3
            ends(3*(e - 1) + k) = edge_key(triangles(k, e), triangles(1 + mod(k, 3), e))
         end do
      end do
      order = sorted_order(ends)
      allocate (edges%nodes(2, size(ends)), edges%of_side(3, size(triangles, 2)))
      allocate (edges%elements(2, size(ends)), source=0)
      allocate (edges%junction(size(ends)), source=.false.)
      n = 0
      do i = 1, size(order)
         side = order(i)
         e = (side + 2)/3
         k = side - 3*(e - 1)
         if (i == 1) then
            n = 1
         else if (ends(side) /= ends(order(i - 1))) then
            n = n + 1
         end if
         edges%nodes(:, n) = [min(triangles(k, e), triangles(1 + mod(k, 3), e)), max(triangles(k, e), triangles(1 + mod(k, 3), e))]
         edges%of_side(k, e) = n
         if (edges%elements(1, n) == 0) then
            edges%elements(1, n) = e
         else if (edges%elements(2, n) == 0 .and. .not. edges%junction(n)) then
            edges%elements(2, n) = e
         else
            edges%elements(2, n) = 0
            edges%junction(n) = .true.
         end if
      end do
      edges%nodes = edges%nodes(:, :n)
      edges%elements = edges%elements(:, :n)
      edges%junction = edges%junction(:n)
   end subroutine new_edges

   !> Whether more than two triangles meet at an edge of a mesh.
   pure logical function has_junctions(triangles)
      integer, intent(in) :: triangles(:, :)
      type(edges_t) :: edges
      call new_edges(edges, triangles)
      has_junctions = any(edges%junction)
   end function has_junctions

   !> Number of the edge between two nodes, 0 where there is none (bisection).
   pure integer function find_edge(edges, i, j) result(edge)
      type(edges_t), intent(in) :: edges
      integer, intent(in) :: i, j
      integer(i8) :: wanted, here
      integer :: low, high
      wanted = edge_key(i, j)
      low = 1
      high = size(edges%nodes, 2)
      do while (low <= high)
         edge = low + (high - low)/2
         here = edge_key(edges%nodes(1, edge), edges%nodes(2, edge))
         if (here == wanted) return
         if (here < wanted) low = edge + 1
         if (here > wanted) high = edge - 1
      end do
      edge = 0
   end function find_edge

   !> A number for each pair of nodes, whatever their order.
   pure integer(i8) function edge_key(i, j)
      integer, intent(in) :: i, j
      edge_key = ishft(int(min(i, j), i8), 31) + max(i, j)
   end function edge_key
end module finshell_edges
