!> Rotation vectors: exponential, logarithm, tangent operators and their derivatives.
!>
!> A spatial spin omega turns R into exp(omega) R. With R = exp(theta), omega = T(theta) d theta.
!> Felippa & Haugen 2005; Nour-Omid & Rankin 1991 (formulas re-derived, derivatives checked in quadruple precision by the tests).
module finshell_rotation
   use finshell_kinds, only: wp
   use finshell_quaternion, only: matrix_to_quaternion, quaternion_to_rotation_vector
   use finshell_rotation_coefficients, only: inverse_tangent_coefficients, pi, tangent_coefficients
   implicit none
   private
   public :: spin, axial, cross_product, exp_rotation, log_rotation
   public :: tangent_operator, inverse_tangent_operator, tangent_transpose_derivative, inverse_tangent_transpose_derivative
   public :: complement_rotation

   !> What 2 pi loses when rounded.
   real(wp), parameter :: two_pi_rest = merge(1.73436202602475620495e-34_wp, 2.449293598294706354452e-16_wp, digits(1.0_wp) > 53)

contains

   !> Skew matrix of a vector: spin(v) x = v cross x.
   pure function spin(v) result(k)
      real(wp), intent(in) :: v(3)
      real(wp) :: k(3, 3)
      k(:, 1) = [0.0_wp, v(3), -v(2)]
      k(:, 2) = [-v(3), 0.0_wp, v(1)]
      k(:, 3) = [v(2), -v(1), 0.0_wp]
   end function spin

   !> Axial vector of the skew part of a matrix.
   pure function axial(k) result(v)
      real(wp), intent(in) :: k(3, 3)
      real(wp) :: v(3)
      v = 0.5_wp*[k(3, 2) - k(2, 3), k(1, 3) - k(3, 1), k(2, 1) - k(1, 2)]
   end function axial

   !> a cross b.
   pure function cross_product(a, b) result(c)
      real(wp), intent(in) :: a(3), b(3)
      real(wp) :: c(3)
      c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
   end function cross_product

   !> Rotation matrix of a rotation vector, any number of turns.
   pure function exp_rotation(theta) result(r)
      real(wp), intent(in) :: theta(3)
      real(wp) :: r(3, 3)
      real(wp) :: c(5)
      c = coefficients(norm2(theta))
      r = polynomial(theta, c(1), c(2))
   end function exp_rotation

   !> Rotation vector, |theta| <= pi, of a rotation matrix.
   pure function log_rotation(r) result(theta)
      real(wp), intent(in) :: r(3, 3)
      real(wp) :: theta(3)
      theta = quaternion_to_rotation_vector(matrix_to_quaternion(r))
   end function log_rotation

   !> T(theta) = I + c2 K + c3 K^2, K = spin(theta): spatial spin = T d theta.
   pure function tangent_operator(theta) result(t)
      real(wp), intent(in) :: theta(3)
      real(wp) :: t(3, 3)
      real(wp) :: c(5)
      c = coefficients(norm2(theta))
      t = polynomial(theta, c(2), c(3))
   end function tangent_operator

   !> H(theta) = T^-1 = I - K/2 + eta K^2: d theta = H spin. Singular at 2 pi, 4 pi, ... only.
   pure function inverse_tangent_operator(theta) result(h)
      real(wp), intent(in) :: theta(3)
      real(wp) :: h(3, 3)
      real(wp) :: eta, mu
      call inverse_coefficients(norm2(theta), eta, mu)
      h = polynomial(theta, -0.5_wp, eta)
   end function inverse_tangent_operator

   !> d(T^T m)/d theta for constant m: the extra stiffness of a moment m when total rotation vectors are the unknowns.
   pure function tangent_transpose_derivative(theta, m) result(d)
      real(wp), intent(in) :: theta(3), m(3)
      real(wp) :: d(3, 3)
      real(wp) :: c(5), km(3)
      c = coefficients(norm2(theta))
      km = cross_product(theta, m)
      d = c(2)*spin(m) + c(3)*double_product_derivative(theta, m) &
          + outer(-c(4)*km + c(5)*cross_product(theta, km), theta)
   end function tangent_transpose_derivative

   !> d(H^T m)/d theta for constant m.
   pure function inverse_tangent_transpose_derivative(theta, m) result(d)
      real(wp), intent(in) :: theta(3), m(3)
      real(wp) :: d(3, 3)
      real(wp) :: eta, mu, km(3)
      call inverse_coefficients(norm2(theta), eta, mu)
      km = cross_product(theta, m)
      d = eta*double_product_derivative(theta, m) + mu*outer(cross_product(theta, km), theta) - 0.5_wp*spin(m)
   end function inverse_tangent_transpose_derivative

   !> The rotation vector of the same rotation with |theta| <= pi: theta - 2 pi n theta/|theta|.
   pure function complement_rotation(theta) result(complement)
      real(wp), intent(in) :: theta(3)
      real(wp) :: complement(3)
      real(wp) :: a, turns
      a = norm2(theta)
      complement = theta
      if (a <= pi) return
      turns = anint(a/(2.0_wp*pi))
      complement = (((a - turns*(2.0_wp*pi)) - turns*two_pi_rest)/a)*theta
   end function complement_rotation

   !> c1, c2, c3, dc2, dc3 of `tangent_coefficients`.
   pure function coefficients(a) result(c)
      real(wp), intent(in) :: a
      real(wp) :: c(5)
      call tangent_coefficients(1, [a], [sin(0.5_wp*a)], [cos(0.5_wp*a)], c(1), c(2), c(3), c(4), c(5))
   end function coefficients

   !> eta and mu for any angle: the closed form does not cancel beyond pi.
   pure subroutine inverse_coefficients(a, eta, mu)
      real(wp), intent(in) :: a
      real(wp), intent(out) :: eta, mu
      real(wp) :: sine, x, e(1), m(1)
      if (a <= pi) then
         call inverse_tangent_coefficients(1, [a*a], e, m)
         eta = e(1)
         mu = m(1)
      else
         sine = sin(0.5_wp*a)
         x = 0.5_wp*a*cos(0.5_wp*a)/sine
         eta = (1.0_wp - x)/a**2
         mu = ((0.5_wp*a/sine)**2 - 2.0_wp + x)/a**4
      end if
   end subroutine inverse_coefficients

   !> I + p K + q K^2, K = spin(theta).
   pure function polynomial(theta, p, q) result(r)
      real(wp), intent(in) :: theta(3), p, q
      real(wp) :: r(3, 3)
      associate (x => theta(1), y => theta(2), z => theta(3))
         r(1, 1) = 1.0_wp - q*(y*y + z*z)
         r(2, 2) = 1.0_wp - q*(z*z + x*x)
         r(3, 3) = 1.0_wp - q*(x*x + y*y)
         r(2, 1) = p*z + q*x*y
         r(1, 2) = q*x*y - p*z
         r(3, 1) = q*x*z - p*y
         r(1, 3) = p*y + q*x*z
         r(3, 2) = p*x + q*y*z
         r(2, 3) = q*y*z - p*x
      end associate
   end function polynomial

   !> d(K^2 m)/d theta = (theta.m) I + theta m^T - 2 m theta^T.
   pure function double_product_derivative(theta, m) result(d)
      real(wp), intent(in) :: theta(3), m(3)
      real(wp) :: d(3, 3)
      integer :: i
      d = outer(theta, m) - 2.0_wp*outer(m, theta)
      do i = 1, 3
         d(i, i) = d(i, i) + dot_product(theta, m)
      end do
   end function double_product_derivative

   pure function outer(a, b) result(c)
      real(wp), intent(in) :: a(3), b(3)
      real(wp) :: c(3, 3)
      integer :: j
      do j = 1, 3
         c(:, j) = a*b(j)
      end do
   end function outer
end module finshell_rotation
