!> The flat reference triangle: frame, sides, gradients of the area coordinates. Shell and membrane start from it.
!>
!> First index of every array: the element within the block (`lanes` of them side by side). Source: paper eq. (20).
module finshell_triangle
   use finshell_kinds, only: wp, i4, lanes
   use finshell_status, only: status_degenerate_reference
   implicit none
   private
   public :: triangle_t, new_triangle, judge_triangles, side_from, side_to, opposite_of_side

   !> Side k runs from node side_from(k) to node side_to(k).
   integer, parameter :: side_from(3) = [1, 2, 3], side_to(3) = [2, 3, 1], opposite_of_side(3) = [3, 1, 2]

   !> A triangle whose height is this part of its longest side has lost six digits of its normal.
   real(wp), parameter :: flattest = 1.0e-10_wp
   !> Lengths beyond this, or below its inverse, are refused: the element multiplies four of them.
   real(wp), parameter :: longest_side = 1.0e60_wp

   type :: triangle_t
      real(wp) :: frame(lanes, 3, 3) !< columns e, h, n0 (global components), paper eq. (20)
      real(wp) :: area(lanes)
      real(wp) :: x(lanes, 2, 3) !< nodes in the frame, origin at the centroid
      real(wp) :: side(lanes, 2, 3) !< side vectors L_k
      real(wp) :: side2(lanes, 3) !< |L_k|^2
      real(wp) :: gradient(lanes, 2, 3) !< gradient of the area coordinate of each node
   end type triangle_t

contains

   !> Geometry of a block of triangles.
   pure subroutine new_triangle(nodes, triangle, status)
      real(wp), intent(in) :: nodes(lanes, 3, 3) !< (element, component, node)
      type(triangle_t), intent(out) :: triangle
      integer(i4), intent(inout) :: status(lanes) !< status_degenerate_reference, see judge_triangles
      real(wp), dimension(lanes, 3) :: a, b, c
      real(wp), dimension(lanes) :: length, twice_area, inverse
      real(wp), parameter :: third = 1.0_wp/3
      integer :: i, k

      a = nodes(:, :, 2) - nodes(:, :, 1)
      b = nodes(:, :, 3) - nodes(:, :, 1)
      c(:, 1) = a(:, 2)*b(:, 3) - a(:, 3)*b(:, 2)
      c(:, 2) = a(:, 3)*b(:, 1) - a(:, 1)*b(:, 3)
      c(:, 3) = a(:, 1)*b(:, 2) - a(:, 2)*b(:, 1)
      length = sqrt(a(:, 1)**2 + a(:, 2)**2 + a(:, 3)**2)
      twice_area = sqrt(c(:, 1)**2 + c(:, 2)**2 + c(:, 3)**2)
      inverse = 1/length
      do i = 1, 3
         triangle%frame(:, i, 1) = a(:, i)*inverse
      end do
      inverse = 1/twice_area
      do i = 1, 3
         triangle%frame(:, i, 3) = c(:, i)*inverse
      end do
      triangle%frame(:, 1, 2) = triangle%frame(:, 2, 3)*triangle%frame(:, 3, 1) - triangle%frame(:, 3, 3)*triangle%frame(:, 2, 1)
      triangle%frame(:, 2, 2) = triangle%frame(:, 3, 3)*triangle%frame(:, 1, 1) - triangle%frame(:, 1, 3)*triangle%frame(:, 3, 1)
      triangle%frame(:, 3, 2) = triangle%frame(:, 1, 3)*triangle%frame(:, 2, 1) - triangle%frame(:, 2, 3)*triangle%frame(:, 1, 1)
      triangle%area = 0.5_wp*twice_area

      ! in-plane coordinates relative to node 1, then to the centroid
      triangle%x(:, :, 1) = 0
      triangle%x(:, 1, 2) = length
      triangle%x(:, 2, 2) = 0
      do i = 1, 2
         triangle%x(:, i, 3) = b(:, 1)*triangle%frame(:, 1, i) + b(:, 2)*triangle%frame(:, 2, i) + b(:, 3)*triangle%frame(:, 3, i)
      end do
      do k = 1, 3
         do i = 1, 2
            triangle%side(:, i, k) = triangle%x(:, i, side_to(k)) - triangle%x(:, i, side_from(k))
         end do
         triangle%side2(:, k) = triangle%side(:, 1, k)**2 + triangle%side(:, 2, k)**2
      end do
      call judge_triangles(lanes, twice_area, max(triangle%side2(:, 1), triangle%side2(:, 2), triangle%side2(:, 3)), status)
      do i = 1, 2
         a(:, i) = third*(triangle%x(:, i, 2) + triangle%x(:, i, 3))
         do k = 1, 3
            triangle%x(:, i, k) = triangle%x(:, i, k) - a(:, i)
         end do
      end do
      ! grad zeta_i = n0 x (opposite side) / (2A); the side opposite to node i is side i+1
      do k = 1, 3
         i = opposite_of_side(k)
         triangle%gradient(:, 1, i) = -triangle%side(:, 2, k)*inverse
         triangle%gradient(:, 2, i) = triangle%side(:, 1, k)*inverse
      end do
   end subroutine new_triangle

   !> Whether triangles are ones to compute with, by the same measure for every numbering and unit of length; NaN are not.
   pure subroutine judge_triangles(n, twice_area, longest2, status)
      integer, intent(in) :: n
      real(wp), intent(in) :: twice_area(n)
      real(wp), intent(in) :: longest2(n) !< longest sides, squared
      integer(i4), intent(inout) :: status(n) !< status_degenerate_reference where they are not
      integer :: i
      logical :: sound
      do i = 1, n
         sound = twice_area(i) > flattest*longest2(i) .and. longest2(i) < longest_side**2 .and. longest2(i) > longest_side**(-2)
         status(i) = merge(status(i), status_degenerate_reference, sound)
      end do
   end subroutine judge_triangles
end module finshell_triangle
