!> Points at one place become one node.
module finshell_weld
   use finshell_kinds, only: wp
   use finshell_mesh_sorting, only: sorted_order
   use finshell_union_find, only: join, new_forest, root_of
   implicit none
   private
   public :: weld

   !> Points nearer than this, relative to the size of all, are one: numbers of single precision in files have 1e-7.
   real(wp), parameter :: nearness = 1.0e-6_wp
   !> A direction in which regular meshes have no ties, so only true neighbours are compared.
   real(wp), parameter :: direction(3) = [0.563157_wp, 0.618034_wp, 0.548583_wp]

contains

   !> Number the places of points, in the order of the first point at each.
   subroutine weld(points, number, nodes)
      real(wp), intent(in) :: points(:, :) !< (3, n)
      integer, allocatable, intent(out) :: number(:) !< (n)
      integer, intent(out) :: nodes
      real(wp), allocatable :: along(:)
      integer, allocatable :: order(:), first(:)
      real(wp) :: tolerance
      integer :: a, b, i, j, n

      n = size(points, 2)
      tolerance = nearness*norm2(maxval(points, dim=2) - minval(points, dim=2))
      along = matmul(direction, points)
      order = sorted_order(along)
      first = new_forest(n)
      do i = 1, n
         a = order(i)
         do j = i + 1, n
            b = order(j)
            if (along(b) - along(a) > tolerance) exit
            if (sum((points(:, a) - points(:, b))**2) > tolerance**2) cycle
            call join(first, a, b)
         end do
      end do
      allocate (number(n))
      nodes = 0
      do i = 1, n
         if (first(i) == i) then
            nodes = nodes + 1
            number(i) = nodes
         else
            number(i) = number(root_of(first, i))
         end if
      end do
   end subroutine weld
end module finshell_weld
