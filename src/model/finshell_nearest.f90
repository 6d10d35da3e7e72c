!> The points of a surface of triangles that are nearest to given points.
module finshell_nearest
   use finshell_kinds, only: wp
   implicit none
   private
   public :: place_t, find_nearest, nearest_on_triangle

   !> A point of a triangle.
   type :: place_t
      integer :: element = 0 !< 0: not known yet
      real(wp) :: weights(3) = 0 !< of its nodes, which add up to 1
      real(wp) :: distance = 0 !< from the given point
   end type place_t

contains

   !> For each point the place nearest to it. A triangle is looked at only where the sphere around it reaches within the best
   !> distance so far, and the places found before are tried first: those of a motion hardly change.
   subroutine find_nearest(x, triangles, points, places)
      real(wp), intent(in) :: x(:, :) !< (3, nodes)
      integer, intent(in) :: triangles(:, :) !< (3, elements)
      real(wp), intent(in) :: points(:, :) !< (3, points)
      type(place_t), intent(inout) :: places(:) !< (points)
      real(wp) :: centre(3), radius, best(size(places))
      integer :: e, k
      do k = 1, size(places)
         call look_at(merge(places(k)%element, 1, places(k)%element > 0), k, .true.)
      end do
      do e = 1, size(triangles, 2)
         associate (a => x(:, triangles(1, e)), b => x(:, triangles(2, e)), c => x(:, triangles(3, e)))
            centre = (a + b + c)/3
            radius = sqrt(max(sum((a - centre)**2), sum((b - centre)**2), sum((c - centre)**2)))
         end associate
         do k = 1, size(places)
            if (sum((points(:, k) - centre)**2) < (best(k) + radius)**2 .and. e /= places(k)%element) call look_at(e, k, .false.)
         end do
      end do

   contains

      subroutine look_at(element, point, first)
         integer, intent(in) :: element, point
         logical, intent(in) :: first !< whatever was known before
         real(wp) :: weights(3), distance
         weights = nearest_on_triangle(x(:, triangles(:, element)), points(:, point))
         distance = norm2(matmul(x(:, triangles(:, element)), weights) - points(:, point))
         ! of equals the first one, whatever was tried first
         if (.not. first) then
            if (.not. (distance < best(point) .or. (distance <= best(point) .and. element < places(point)%element))) return
         end if
         best(point) = distance
         places(point) = place_t(element, weights, distance)
      end subroutine look_at
   end subroutine find_nearest

   !> Weights of the corners of a triangle in its point nearest to p (by the regions of corners, sides and face: Ericson, Real-Time
   !> Collision Detection, 5.1.5).
   pure function nearest_on_triangle(corner, p) result(weights)
      real(wp), intent(in) :: corner(3, 3) !< (coordinate, corner)
      real(wp), intent(in) :: p(3)
      real(wp) :: weights(3)
      real(wp) :: ab(3), ac(3), d(2, 3), va, vb, vc, t
      integer :: k
      ab = corner(:, 2) - corner(:, 1)
      ac = corner(:, 3) - corner(:, 1)
      do k = 1, 3
         d(:, k) = [dot_product(ab, p - corner(:, k)), dot_product(ac, p - corner(:, k))]
      end do
      vc = d(1, 1)*d(2, 2) - d(1, 2)*d(2, 1)
      vb = d(1, 3)*d(2, 1) - d(1, 1)*d(2, 3)
      va = d(1, 2)*d(2, 3) - d(1, 3)*d(2, 2)
      if (d(1, 1) <= 0 .and. d(2, 1) <= 0) then
         weights = [1, 0, 0]
      else if (d(1, 2) >= 0 .and. d(2, 2) <= d(1, 2)) then
         weights = [0, 1, 0]
      else if (d(2, 3) >= 0 .and. d(1, 3) <= d(2, 3)) then
         weights = [0, 0, 1]
      else if (vc <= 0 .and. d(1, 1) >= 0 .and. d(1, 2) <= 0) then
         t = d(1, 1)/(d(1, 1) - d(1, 2))
         weights = [1 - t, t, 0.0_wp]
      else if (vb <= 0 .and. d(2, 1) >= 0 .and. d(2, 3) <= 0) then
         t = d(2, 1)/(d(2, 1) - d(2, 3))
         weights = [1 - t, 0.0_wp, t]
      else if (va <= 0 .and. d(2, 2) - d(1, 2) >= 0 .and. d(1, 3) - d(2, 3) >= 0) then
         t = (d(2, 2) - d(1, 2))/((d(2, 2) - d(1, 2)) + (d(1, 3) - d(2, 3)))
         weights = [0.0_wp, 1 - t, t]
      else
         t = 1/(va + vb + vc)
         weights = [1 - (vb + vc)*t, vb*t, vc*t]
      end if
   end function nearest_on_triangle
end module finshell_nearest
