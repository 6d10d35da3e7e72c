!> The sides of elements that lie on edges, for loads on edges.
module finshell_sides
   use finshell_kinds, only: wp, i8
   use finshell_mesh, only: mesh_t
   use finshell_mesh_sorting, only: position_in_sorted, sorted_order
   implicit none
   private
   public :: side_list_t, sides_on

   type :: side_list_t
      integer, allocatable :: element(:), side(:) !< and which of its sides: from its node `side` to the next
      integer, allocatable :: nodes(:, :) !< (3, sides) ends of the side and the third node, counter-clockwise
      integer, allocatable :: shared(:) !< elements at the edge
      logical, allocatable :: first(:) !< is it the first of its edge?
      real(wp), allocatable :: sense(:) !< 1, or -1 where the first of its edge runs the other way
      real(wp), allocatable :: length(:) !< reference length
   end type side_list_t

contains

   pure subroutine sides_on(mesh, edges, list)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: edges(:, :) !< (2, :)
      type(side_list_t), intent(out) :: list
      integer(i8) :: key(size(edges, 2))
      integer :: shared(size(edges, 2)), begins(size(edges, 2)), at(3, size(mesh%triangles, 2)), e, i, k, n
      logical :: marked(size(mesh%coordinates, 2))
      marked = .false.
      do i = 1, size(edges, 2)
         marked(edges(:, i)) = .true.
         key(i) = edge_key(edges(:, i))
      end do
      key = key(sorted_order(key))
      shared = 0
      at = 0
      do e = 1, size(mesh%triangles, 2)
         do k = 1, 3
            if (.not. all(marked(mesh%triangles([k, 1 + mod(k, 3)], e)))) cycle
            at(k, e) = position_in_sorted(key, edge_key(mesh%triangles([k, 1 + mod(k, 3)], e)))
            if (at(k, e) > 0) shared(at(k, e)) = shared(at(k, e)) + 1
         end do
      end do
      n = count(at > 0)
      allocate (list%element(n), list%side(n), list%nodes(3, n), list%shared(n), list%first(n), list%sense(n), list%length(n))
      begins = 0
      n = 0
      do e = 1, size(mesh%triangles, 2)
         do k = 1, 3
            if (at(k, e) == 0) cycle
            n = n + 1
            list%element(n) = e
            list%side(n) = k
            list%nodes(:, n) = mesh%triangles([k, 1 + mod(k, 3), 1 + mod(k + 1, 3)], e)
            list%shared(n) = shared(at(k, e))
            list%first(n) = begins(at(k, e)) == 0
            if (list%first(n)) begins(at(k, e)) = list%nodes(1, n)
            list%sense(n) = merge(1.0_wp, -1.0_wp, begins(at(k, e)) == list%nodes(1, n))
            list%length(n) = norm2(mesh%coordinates(:, list%nodes(2, n)) - mesh%coordinates(:, list%nodes(1, n)))
         end do
      end do

   contains

      pure integer(i8) function edge_key(nodes)
         integer, intent(in) :: nodes(2)
         edge_key = int(minval(nodes), i8)*(size(mesh%coordinates, 2) + 1_i8) + maxval(nodes)
      end function edge_key
   end subroutine sides_on
end module finshell_sides
