!> Crossed cells longer than wide: quadrilaterals of four triangles about a middle node.
!>
!> Bent along their length, their middle nodes leave the surface, which corrugates and locks: a cantilever of 8x16 cells, twenty
!> times longer than wide, deflects 14 % of what it should, of 16x8 cells, five times longer, 89 %; other diagonals 99.9 %.
module finshell_crossed_cells
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t
   implicit none
   private
   public :: crossed_cells

   real(wp), parameter :: long = 3 !< length over width from which a cell counts

contains

   !> How many elements lie in such cells, and how much longer than wide the longest of these is.
   pure subroutine crossed_cells(mesh, elements, aspect)
      type(mesh_t), intent(in) :: mesh
      integer, intent(out) :: elements
      real(wp), intent(out) :: aspect
      integer, allocatable :: number(:), ring(:, :)
      real(wp), allocatable :: shortest(:), longest(:)
      real(wp) :: side
      integer :: e, k, node

      associate (n => size(mesh%coordinates, 2))
         allocate (number(n), ring(8, n), source=0)
         allocate (shortest(n), source=huge(side))
         allocate (longest(n), source=0.0_wp)
      end associate
      do e = 1, size(mesh%triangles, 2)
         do k = 1, 3
            node = mesh%triangles(k, e)
            number(node) = number(node) + 1
            if (number(node) > 4) cycle
            associate (others => mesh%triangles([1 + mod(k, 3), 1 + mod(k + 1, 3)], e))
               ring(2*number(node) - 1:2*number(node), node) = others
               side = norm2(mesh%coordinates(:, others(1)) - mesh%coordinates(:, others(2)))
            end associate
            shortest(node) = min(shortest(node), side)
            longest(node) = max(longest(node), side)
         end do
      end do
      elements = 0
      aspect = 0
      do node = 1, size(number)
         if (number(node) /= 4 .or. longest(node) < long*shortest(node)) cycle
         ! a closed ring: each of its nodes belongs to two of the triangles
         if (any([(count(ring(:, node) == ring(k, node)), k=1, 8)] /= 2)) cycle
         elements = elements + 4
         aspect = max(aspect, longest(node)/shortest(node))
      end do
   end subroutine crossed_cells
end module finshell_crossed_cells
