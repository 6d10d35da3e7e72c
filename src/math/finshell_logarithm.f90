!> The logarithm near one, with full relative accuracy (Fortran has no log1p).
module finshell_logarithm
   use finshell_kinds, only: wp
   implicit none
   private
   public :: log1p, log_remainder

   integer, parameter :: order(0:40) = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, &
                                        21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38, 39, 40]
   !> atanh(s) = s + s^3 (1/3 + s^2/5 + ...)
   real(wp), parameter :: atanh_series(0:40) = 1.0_wp/real(2*order + 3, wp)
   integer, parameter :: terms = merge(35, 15, digits(1.0_wp) > 53) ! odd

contains

   !> m = z - ln(1 + z) for z > -1: quadratic in z and accurate however small z is; ln(1 + z) = z - m then is accurate too.
   !>
   !> Vectorises, without a call of the library's logarithm, while all |z| <= 1/2.
   pure subroutine log_remainder(n, z, m)
      integer, intent(in) :: n
      real(wp), intent(in) :: z(n) !< > -1
      real(wp), intent(out) :: m(n)
      real(wp) :: s, s2, s4, even, odd
      integer :: i, j
      do i = 1, n
         s = z(i)/(2.0_wp + z(i)) ! ln(1 + z) = 2 atanh(s)
         s2 = s*s
         s4 = s2*s2
         ! two chains of half the length: the loop waits for them
         even = atanh_series(terms - 1)
         odd = atanh_series(terms)
!GCC$ unroll 40
         do j = terms - 3, 0, -2
            even = even*s4 + atanh_series(j)
            odd = odd*s4 + atanh_series(j + 1)
         end do
         m(i) = z(i)*s - 2.0_wp*s*s2*(even + s2*odd)
      end do
      if (all(abs(z) <= 0.5_wp)) return
      do i = 1, n
         if (abs(z(i)) > 0.5_wp) m(i) = z(i) - log(1.0_wp + z(i))
      end do
   end subroutine log_remainder

   !> ln(1 + z), z > -1.
   elemental function log1p(z) result(l)
      real(wp), intent(in) :: z
      real(wp) :: l
      real(wp) :: one_plus
      one_plus = 1.0_wp + z
      ! the second term makes good what rounding 1 + z has lost
      l = log(one_plus) + (z - (one_plus - 1.0_wp))/one_plus
   end function log1p
end module finshell_logarithm
