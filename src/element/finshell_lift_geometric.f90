!> Second variations of the core variables along straight nodal paths and constant spins (theory in finshell_lift).
module finshell_lift_geometric
   use finshell_kinds, only: wp, lanes, rows_3
   use finshell_core_strain, only: n_core
   use finshell_filter, only: filter_t
   implicit none
   private
   public :: geometric_part, n_lift, rows_6, rows_15

   integer, parameter :: n_lift = 15 !< df_1, df_2, w_1, w_2, w_3
   !> As rows_3 (finshell_kinds) for matrices with 6 and 15 rows.
   integer, parameter :: rows_6 = merge(8, 6, lanes == 1), rows_15 = merge(16, 15, lanes == 1)

contains

   !> Second variations of the core variables at fixed gradient, added to the upper triangle.
   pure subroutine geometric_part(filter, gradient, h, f, k)
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: gradient(lanes, n_core), h(lanes, rows_3, 3, 3)
      real(wp), intent(in) :: f(lanes, rows_15) !< f(7:15): moments conjugate to the spins
      real(wp), intent(inout) :: k(lanes, rows_15, n_lift)
      real(wp), dimension(lanes, rows_3, 6) :: w, wz, r, total
      real(wp) :: l(lanes, rows_3, 3)
      real(wp) :: z(lanes, 3, 6), q(lanes, 6, 6), moment(lanes, 3), v(lanes, 2), m(lanes, 3)
      real(wp), dimension(lanes) :: p11, p22, p12, sigma, inverse, rho, s1, s3
      integer :: c, d, i

      associate (u11 => filter%u(:, 1), u22 => filter%u(:, 2), u12 => filter%u(:, 3), &
                 v11 => filter%u_inverse(:, 1), v22 => filter%u_inverse(:, 2), v12 => filter%u_inverse(:, 3))
         inverse = 1/filter%trace_u
         ! (dU11, dU22, dU12) as functions of y
         z = 0
         z(:, 1, 1) = 1
         z(:, 1, 2) = u12*inverse
         z(:, 1, 4) = -u12*inverse
         z(:, 2, 5) = 1
         z(:, 2, 2) = -u12*inverse
         z(:, 2, 4) = u12*inverse
         z(:, 3, 4) = 1 - u22*inverse
         z(:, 3, 2) = u22*inverse

         ! nodes: x' L x + 2 x' W z, with x = w - psi
         moment = 0
         total = 0
         p11 = 0
         p22 = 0
         p12 = 0
         do i = 1, 3
            associate (t => filter%theta(:, :, i), q1 => gradient(:, 2 + 2*i), q2 => gradient(:, 3 + 2*i), &
                       mu => f(:, 4 + 3*i:6 + 3*i))
               m(:, 1) = q1*u12 + q2*u22
               m(:, 2) = -q1*u11 - q2*u12
               m(:, 3) = gradient(:, 9 + i)
               call rotation_hessian(t, filter%eta(:, i), filter%mu(:, i), m, h(:, :, :, i), l)
               moment = moment + mu
               p11 = p11 - q1*t(:, 2)
               p22 = p22 + q2*t(:, 1)
               p12 = p12 + q1*t(:, 1) - q2*t(:, 2)
               w = 0
               w(:, 1, 2) = 0.5_wp*mu(:, 3)
               w(:, 2, 1) = -0.5_wp*mu(:, 3)
               w(:, 1, 3) = -0.5_wp*mu(:, 2)
               w(:, 3, 1) = 0.5_wp*mu(:, 2)
               w(:, 2, 3) = 0.5_wp*mu(:, 1)
               w(:, 3, 2) = -0.5_wp*mu(:, 1)
               do c = 1, rows_3
                  w(:, c, 4) = -h(:, c, 2, i)*q1
                  w(:, c, 5) = h(:, c, 1, i)*q2
                  w(:, c, 6) = h(:, c, 1, i)*q1 - h(:, c, 2, i)*q2
               end do
               do c = 1, rows_3
                  ! z is sparse: columns 1 (dU11), 5 (dU22), 3 and 6 (psi_1, psi_2), 2 and 4 (psi_3 and the stretch)
                  wz(:, c, 1) = w(:, c, 4)
                  wz(:, c, 5) = w(:, c, 5)
                  wz(:, c, 2) = inverse*(w(:, c, 3) + u12*(w(:, c, 4) - w(:, c, 5)) + u22*w(:, c, 6))
                  wz(:, c, 4) = w(:, c, 6) - wz(:, c, 2)
                  wz(:, c, 3) = w(:, c, 1)*v12 - w(:, c, 2)*v11
                  wz(:, c, 6) = w(:, c, 1)*v22 - w(:, c, 2)*v12
                  r(:, c, 1) = wz(:, c, 1)
                  r(:, c, 5) = wz(:, c, 5)
                  r(:, c, 2) = wz(:, c, 2) - l(:, c, 3)*inverse
                  r(:, c, 4) = wz(:, c, 4) + l(:, c, 3)*inverse
                  r(:, c, 3) = wz(:, c, 3) - l(:, c, 1)*v12 + l(:, c, 2)*v11
                  r(:, c, 6) = wz(:, c, 6) - l(:, c, 1)*v22 + l(:, c, 2)*v12
               end do
!GCC$ unroll 6
               do d = 1, 6
                  do c = 1, rows_3
                     total(:, c, d) = total(:, c, d) + r(:, c, d) + wz(:, c, d)
                     k(:, 3 + 3*i + c, d) = k(:, 3 + 3*i + c, d) + r(:, c, d)
                  end do
               end do
               do d = 1, 3
                  do c = 1, merge(rows_3, d, lanes == 1)
                     k(:, 3 + 3*i + c, 3 + 3*i + d) = k(:, 3 + 3*i + c, 3 + 3*i + d) + l(:, c, d)
                  end do
               end do
            end associate
         end do

         ! frame: quadratic form q(y) of psi', U'' and the nodal terms carried by psi; only q + q' matters
!GCC$ unroll 6
         do d = 1, 6
            q(:, 1, d) = 0
            q(:, 2, d) = -inverse*total(:, 3, d)
            q(:, 3, d) = v11*total(:, 2, d) - v12*total(:, 1, d)
            q(:, 4, d) = inverse*total(:, 3, d)
            q(:, 5, d) = 0
            q(:, 6, d) = v12*total(:, 2, d) - v22*total(:, 1, d)
         end do
         sigma = -moment(:, 3) + (p11 - p22)*u12 + p12*u22
         ! in-plane: psi_3 times a linear function of y
         rho = (p11 - p22)*u22 - p12*u12
         s1 = -2*sigma*inverse
         do c = 2, 4, 2
            s3 = merge(1, -1, c == 2)*inverse
            q(:, c, 1) = q(:, c, 1) + s3*s1
            q(:, c, 2) = q(:, c, 2) + s3*(p11 + rho*inverse)
            q(:, c, 4) = q(:, c, 4) + s3*(p11 - 2*p22 - rho*inverse)
            q(:, c, 5) = q(:, c, 5) + s3*(s1 + 2*p12)
         end do
         ! out-of-plane: phi_1 = -(v11 y3 + v12 y6), phi_2 = -(v12 y3 + v22 y6)
         s1 = sigma*inverse
         q(:, 3, 3) = q(:, 3, 3) + s1*v12 + p11*v11
         q(:, 6, 6) = q(:, 6, 6) - s1*v12 + p22*v22 + p12*v12
         q(:, 3, 6) = q(:, 3, 6) + s1*(v22 - v11) + p11*v12 + p22*v12 + p12*v11
         ! in-plane times out-of-plane: work of the moments on phi', with v = U^-1 (moment_2, -moment_1)
         v(:, 1) = v11*moment(:, 2) - v12*moment(:, 1)
         v(:, 2) = v12*moment(:, 2) - v22*moment(:, 1)
         do d = 1, 5
            if (d == 3) cycle
            s1 = v(:, 1)*z(:, 1, d) + v(:, 2)*z(:, 3, d)
            s3 = v(:, 1)*z(:, 3, d) + v(:, 2)*z(:, 2, d)
            if (d == 1) s1 = s1 + v(:, 1)
            if (d == 4) s1 = s1 + v(:, 2)
            if (d == 2) s3 = s3 + v(:, 1)
            if (d == 5) s3 = s3 + v(:, 2)
            q(:, 3, d) = q(:, 3, d) - v11*s1 - v12*s3
            q(:, 6, d) = q(:, 6, d) - v12*s1 - v22*s3
         end do
         do d = 1, 6
            do c = 1, d
               k(:, c, d) = k(:, c, d) + 0.5_wp*(q(:, c, d) + q(:, d, c))
            end do
         end do
      end associate
      ! stress on df . df
      do c = 1, 3
         k(:, c, c) = k(:, c, c) + gradient(:, 1)
         k(:, 3 + c, 3 + c) = k(:, 3 + c, 3 + c) + gradient(:, 2)
         k(:, c, 3 + c) = k(:, c, 3 + c) + gradient(:, 3)
      end do
   end subroutine geometric_part

   !> Symmetric part of d(H' m)/dtheta H: the second derivative of m . theta with respect to the spin (theory A4).
   pure subroutine rotation_hessian(theta, eta, mu, moment, h, l)
      real(wp), intent(in) :: theta(lanes, 3), eta(lanes), mu(lanes), moment(lanes, 3), h(lanes, rows_3, 3)
      real(wp), intent(out) :: l(lanes, rows_3, 3)
      real(wp), dimension(lanes, rows_3) :: b, t, m
      real(wp), dimension(lanes, rows_3, 3) :: d, p
      real(wp), dimension(lanes) :: tm, t2
      integer :: c, r
      t(:, rows_3) = 0
      m(:, rows_3) = 0
      t(:, 1:3) = theta
      m(:, 1:3) = moment
      tm = t(:, 1)*m(:, 1) + t(:, 2)*m(:, 2) + t(:, 3)*m(:, 3)
      t2 = t(:, 1)**2 + t(:, 2)**2 + t(:, 3)**2
      do c = 1, rows_3
         ! K^2 m = t (t.m) - t2 m
         b(:, c) = mu*(t(:, c)*tm - t2*m(:, c)) - 2*eta*m(:, c)
      end do
      do c = 1, 3
         do r = 1, rows_3
            d(:, r, c) = b(:, r)*t(:, c) + eta*t(:, r)*m(:, c)
         end do
         d(:, c, c) = d(:, c, c) + eta*tm
      end do
      d(:, 1, 2) = d(:, 1, 2) + 0.5_wp*m(:, 3)
      d(:, 2, 1) = d(:, 2, 1) - 0.5_wp*m(:, 3)
      d(:, 1, 3) = d(:, 1, 3) - 0.5_wp*m(:, 2)
      d(:, 3, 1) = d(:, 3, 1) + 0.5_wp*m(:, 2)
      d(:, 2, 3) = d(:, 2, 3) + 0.5_wp*m(:, 1)
      d(:, 3, 2) = d(:, 3, 2) - 0.5_wp*m(:, 1)
      do c = 1, 3
         do r = 1, rows_3
            p(:, r, c) = d(:, r, 1)*h(:, c, 1) + d(:, r, 2)*h(:, c, 2) + d(:, r, 3)*h(:, c, 3)
         end do
      end do
      if (rows_3 > 3) l(:, rows_3, :) = 0
      do c = 1, 3
         l(:, c, c) = p(:, c, c)
         do r = 1, c - 1
            l(:, r, c) = 0.5_wp*(p(:, r, c) + p(:, c, r))
            l(:, c, r) = l(:, r, c)
         end do
      end do
   end subroutine rotation_hessian
end module finshell_lift_geometric
