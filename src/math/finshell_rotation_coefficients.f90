!> The analytic functions behind finite rotations, in one place and with full relative accuracy.
!>
!> Each procedure takes n angles, for n = `lanes` in the element kernel and n = 1 elsewhere: its loop is free of branches and
!> vectorises, which an elemental procedure called from another file would not. No function
!> switches between a cancelling closed form and a short series: the partial fractions of the cotangent and the power
!> series of the sine family are used where they have no cancellation at all.
module finshell_rotation_coefficients
   use finshell_kinds, only: wp
   implicit none
   private
   public :: log_coefficients, inverse_tangent_coefficients, tangent_coefficients, pi

   real(wp), parameter :: pi = 3.1415926535897932384626433832795028841971694_wp

   logical, parameter :: quadruple = digits(1.0_wp) > 53
   !> Terms kept, for double and quadruple precision (the double counts stay below gfortran's complete-unrolling limit).
   integer, parameter :: atan_terms = merge(25, 12, quadruple)
   integer, parameter :: cot_terms = merge(29, 14, quadruple)
   integer, parameter :: sine_terms = merge(23, 13, quadruple)

   !> zeta(2j+2) - 1: what the partial fractions of the cotangent leave once the pole nearest to zero is taken out.
   real(wp), parameter :: zeta_tail(0:29) = [ &
      0.64493406684822643647241516664602518922_wp, 0.082323233711138191516003696541167902775_wp, &
      0.017343061984449139714517929790920527902_wp, 0.004077356197944339378685238508652465259_wp, &
      0.00099457512781808533714595890031901700602_wp, 0.00024608655330804829863799804773967096042_wp, &
      0.000061248135058704829258545105135333747482_wp, 0.000015282259408651871732571487636722023237_wp, &
      3.8172932649998398564616446219397304547e-6_wp, 9.5396203387279611315203868344934594379e-7_wp, &
      2.3845050272773299000364818675249493504e-7_wp, 5.9608189051259479612440207935801227504e-8_wp, &
      1.4901554828365041234658506630698628865e-8_wp, 3.7253340247884570548192040184024232329e-9_wp, &
      9.3132743241966818287176473502121981357e-10_wp, 2.3283118336765054920014559759404950248e-10_wp, &
      5.8207720879027008892436859891063054173e-11_wp, 1.4551921891041984235929632245318420984e-11_wp, &
      3.6379795473786511902372363558732735126e-12_wp, 9.0949478402638892825331183869490875386e-13_wp, &
      2.2737368458246525152268215779786912138e-13_wp, 5.6843419876275856092771829675240685531e-14_wp, &
      1.4210854828031606769834307141739537679e-14_wp, 3.5527136913371136732984695340593429921e-15_wp, &
      8.8817842109308159030960913863913863256e-16_wp, 2.2204460507980419839993200942046539642e-16_wp, &
      5.5511151248454812437237365905094302817e-17_wp, 1.3877787809725232762839094906500221908e-17_wp, &
      3.469446952165922624744271496109334622e-18_wp, 8.6736173801199337283420550673429514879e-19_wp]
   !> Coefficients of atan(x)/x and of the sine family, (-1)^k/(2k+1) and (-1)^k/(2k+n)!.
   integer, parameter :: order(0:25) = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, &
                                        13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25]
   real(wp), parameter :: atan_series(0:25) = (-1)**order/real(2*order + 1, wp)
   real(wp), parameter :: series_3(0:25) = (-1)**order/gamma(real(2*order + 4, wp))
   real(wp), parameter :: series_4(0:25) = (-1)**order/gamma(real(2*order + 5, wp))
   real(wp), parameter :: series_5(0:25) = (-1)**order/gamma(real(2*order + 6, wp))

contains

   !> The factors c in theta = c qv that turn the vector part of a quaternion into the rotation vector.
   !>
   !> c = 2 atan2(|qv|, q0)/|qv|, for q0 >= 0 (|theta| <= pi); exact limit 2/q0 for qv = 0, also when |qv|^2 underflows.
   !> The quaternion need not be normalised. The angle is halved three times by square roots, then the arctangent's
   !> series is short.
   pure subroutine log_coefficients(n, qv2, q0, c)
      integer, intent(in) :: n
      real(wp), intent(in) :: qv2(n) !< qv . qv
      real(wp), intent(in) :: q0(n) !< scalar part, >= 0
      real(wp), intent(out) :: c(n)
      real(wp) :: d, r, t2, p
      integer :: i, j
      do i = 1, n
         ! tan(x/2) = s/(d + hypotenuse) from tan x = s/d
         d = q0(i) + sqrt(q0(i)*q0(i) + qv2(i))
         d = d + sqrt(d*d + qv2(i))
         d = d + sqrt(d*d + qv2(i))
         r = 1.0_wp/d
         t2 = (qv2(i)*r)*r
         p = atan_series(atan_terms)
!GCC$ unroll 32
         do j = atan_terms - 1, 0, -1
            p = p*t2 + atan_series(j)
         end do
         c(i) = 16.0_wp*r*p
      end do
   end subroutine log_coefficients

   !> eta = (1 - (a/2) cot(a/2))/a^2 and mu = (d eta/d a)/a for rotations of angle a, 0 <= a <= pi, from a^2.
   !>
   !> They belong to the inverse tangent operator (`inverse_tangent_operator` in finshell_rotation) and its derivative.
   !> Partial fractions: eta = 1/(2 pi^2) sum_k 1/(k^2 - u), mu = 1/(4 pi^4) sum_k 1/(k^2 - u)^2, u = (a/2 pi)^2; the
   !> first pole is kept, the others are summed as power series with positive terms only. Beyond pi the accuracy
   !> falls.
   pure subroutine inverse_tangent_coefficients(n, a2, eta, mu)
      integer, intent(in) :: n
      real(wp), intent(in) :: a2(n) !< angle squared
      real(wp), intent(out) :: eta(n), mu(n)
      real(wp) :: u, p, dp, r
      integer :: i, j
      do i = 1, n
         u = a2(i)*(0.25_wp/pi**2)
         p = zeta_tail(cot_terms)
         dp = 0.0_wp
!GCC$ unroll 32
         do j = cot_terms - 1, 0, -1
            dp = dp*u + p
            p = p*u + zeta_tail(j)
         end do
         r = 1.0_wp/(1.0_wp - u)
         eta(i) = (r + p)*(0.5_wp/pi**2)
         mu(i) = (r*r + dp)*(0.25_wp/pi**4)
      end do
   end subroutine inverse_tangent_coefficients

   !> Coefficients of the exponential and of its tangent operator for angles a >= 0 (any number of turns).
   !>
   !> c1 = sin(a)/a, c2 = (1 - cos a)/a^2, c3 = (a - sin a)/a^3, dc2 = c2'/a, dc3 = c3'/a (a prime is d/da).
   !> Sine and cosine of the half angle are arguments because the caller usually has them (they are the quaternion).
   pure subroutine tangent_coefficients(n, a, sine_half, cosine_half, c1, c2, c3, dc2, dc3)
      integer, intent(in) :: n
      real(wp), intent(in) :: a(n) !< angle
      real(wp), intent(in) :: sine_half(n), cosine_half(n) !< sin(a/2), cos(a/2)
      real(wp), intent(out) :: c1(n), c2(n), c3(n), dc2(n), dc3(n)
      real(wp) :: a2, p3, p4, p5, r, r2, sine
      integer :: i, j
      do i = 1, n
         a2 = merge(a(i)*a(i), 0.0_wp, a(i) < 3.0_wp)
         ! p_n = sum_k (-1)^k a^(2k)/(2k+n)!; terms fall monotonically and their sum is of the order of the first
         p3 = series_3(sine_terms)
         p4 = series_4(sine_terms)
         p5 = series_5(sine_terms)
!GCC$ unroll 32
         do j = sine_terms - 1, 0, -1
            p3 = p3*a2 + series_3(j)
            p4 = p4*a2 + series_4(j)
            p5 = p5*a2 + series_5(j)
         end do
         r = 1.0_wp/max(1.0_wp, a(i)) ! not merge: the compiler would divide by a
         r2 = r*r
         sine = 2.0_wp*sine_half(i)*cosine_half(i)
         c1(i) = merge(1.0_wp - a2*p3, sine*r, a(i) < 1.0_wp)
         c2(i) = merge(0.5_wp - a2*p4, 2.0_wp*(sine_half(i)*r)**2, a(i) < 1.0_wp)
         c3(i) = merge(p3, (a(i) - sine)*(r*r2), a(i) < 3.0_wp)
         dc2(i) = merge(2.0_wp*p4 - p3, (c1(i) - 2.0_wp*c2(i))*r2, a(i) < 3.0_wp)
         dc3(i) = merge(3.0_wp*p5 - p4, (c2(i) - 3.0_wp*c3(i))*r2, a(i) < 3.0_wp)
      end do
   end subroutine tangent_coefficients
end module finshell_rotation_coefficients
