!> Logarithm near one and exponential near zero, with full relative accuracy (Fortran has no log1p and no expm1).
!>
!> Both are offered as remainders, z - ln(1 + z) and e^z - 1 - z: stored energies are made of these, and
!> ln(1 + z) = z - log_remainder, e^z = 1 + (z + exp_remainder) follow without loss.
module finshell_elementary
   use finshell_kinds, only: wp
   implicit none
   private
   public :: exp_remainder, log_remainder

   integer, parameter :: order(0:40) = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 20, &
                                        21, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32, 33, 34, 35, 36, 37, 38, 39, 40]
   !> atanh(s) = s + s^3 (1/3 + s^2/5 + ...)
   real(wp), parameter :: atanh_series(0:40) = 1.0_wp/real(2*order + 3, wp)
   !> e^z = 1 + z + z^2 (1/2 + z/6 + ...)
   real(wp), parameter :: exp_series(0:40) = 1.0_wp/gamma(real(order + 3, wp))
   ! last terms, odd because the series are summed in two chains
   integer, parameter :: atanh_terms = merge(35, 15, digits(1.0_wp) > 53)
   integer, parameter :: exp_terms = merge(31, 17, digits(1.0_wp) > 53)

contains

   !> m = z - ln(1 + z) for z > -1: quadratic in z and accurate however small z is; ln(1 + z) as well, accurate for z >> 1, too.
   pure subroutine log_remainder(n, z, m, whole)
      integer, intent(in) :: n
      real(wp), intent(in) :: z(n) !< > -1
      real(wp), intent(out) :: m(n)
      real(wp), intent(out), optional :: whole(n) !< ln(1 + z)
      real(wp) :: s, s2, s4, even, odd
      integer :: i, j
      do i = 1, n
         s = z(i)/(2.0_wp + z(i)) ! ln(1 + z) = 2 atanh(s)
         s2 = s*s
         s4 = s2*s2
         ! two chains of half the length: the loop waits for them
         even = atanh_series(atanh_terms - 1)
         odd = atanh_series(atanh_terms)
!GCC$ unroll 40
         do j = atanh_terms - 3, 0, -2
            even = even*s4 + atanh_series(j)
            odd = odd*s4 + atanh_series(j + 1)
         end do
         m(i) = z(i)*s - 2.0_wp*s*s2*(even + s2*odd)
      end do
      if (present(whole)) then
         do i = 1, n
            whole(i) = z(i) - m(i)
         end do
      end if
      if (all(abs(z) <= 0.5_wp)) return
      do i = 1, n
         if (abs(z(i)) <= 0.5_wp) cycle
         s = log(1.0_wp + z(i))
         m(i) = z(i) - s
         if (present(whole)) whole(i) = s
      end do
   end subroutine log_remainder

   !> r = e^z - 1 - z: quadratic in z and accurate however small z is; e^z as well, to full relative accuracy for z << 0, too.
   pure subroutine exp_remainder(n, z, r, whole)
      integer, intent(in) :: n
      real(wp), intent(in) :: z(n)
      real(wp), intent(out) :: r(n)
      real(wp), intent(out), optional :: whole(n) !< e^z
      real(wp) :: z1, z2, even, odd
      integer :: i, j
      do i = 1, n
         z1 = merge(z(i), 0.0_wp, abs(z(i)) <= 1.0_wp)
         z2 = z1*z1
         even = exp_series(exp_terms - 1)
         odd = exp_series(exp_terms)
!GCC$ unroll 40
         do j = exp_terms - 3, 0, -2
            even = even*z2 + exp_series(j)
            odd = odd*z2 + exp_series(j + 1)
         end do
         r(i) = z2*(even + z1*odd)
      end do
      if (present(whole)) then
         do i = 1, n
            whole(i) = 1.0_wp + (z(i) + r(i))
         end do
      end if
      if (all(abs(z) <= 1.0_wp)) return
      do i = 1, n
         if (abs(z(i)) <= 1.0_wp) cycle
         z1 = exp(z(i))
         r(i) = (z1 - 1.0_wp) - z(i)
         if (present(whole)) whole(i) = z1
      end do
   end subroutine exp_remainder
end module finshell_elementary
