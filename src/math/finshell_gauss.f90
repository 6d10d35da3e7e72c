!> Gauss-Legendre points and weights on [-1, 1], computed to the working precision.
module finshell_gauss
   use finshell_kinds, only: wp
   implicit none
   private
   public :: gauss_legendre, max_gauss_points

   integer, parameter :: max_gauss_points = 12

contains

   !> Points in ascending order and weights that sum to 2; n = size(x) = size(w) points are exact to degree 2n - 1.
   pure subroutine gauss_legendre(x, w)
      real(wp), intent(out) :: x(:), w(:)
      real(wp) :: p0, p1, p2, dp, z
      integer :: i, iteration, j, n
      n = size(x)
      do i = 1, (n + 1)/2
         z = -cos(acos(-1.0_wp)*(i - 0.25_wp)/(n + 0.5_wp))
         ! Newton from Tricomi's estimate converges quadratically: a handful of steps reaches rounding
         do iteration = 1, 8
            p1 = 1
            p0 = 0
            do j = 1, n
               p2 = p0
               p0 = p1
               p1 = ((2*j - 1)*z*p0 - (j - 1)*p2)/j
            end do
            dp = n*(z*p1 - p0)/(z*z - 1)
            if (iteration < 8) z = z - p1/dp
         end do
         if (2*i == n + 1) z = 0
         x(i) = z
         x(n + 1 - i) = -z
         w(i) = 2/((1 - z*z)*dp*dp)
         w(n + 1 - i) = w(i)
      end do
   end subroutine gauss_legendre
end module finshell_gauss
