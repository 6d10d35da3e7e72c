!> Hessian of the core element: the parts that the bending fields share in (S) and (P).
module finshell_core_hessian
   use finshell_kinds, only: wp, lanes
   use finshell_bending, only: bending_t
   use finshell_core_force, only: work_t
   use finshell_core_derivatives, only: strain_derivatives_t
   use finshell_core_strain, only: n_core, variable
   use finshell_reference, only: reference_t
   use finshell_resultants, only: resultants_t
   use finshell_voigt, only: row, column, pack
   implicit none
   private
   public :: bending_hessian, curvature_hessian, membrane_hessian, bow_hessian

contains

   !> First derivatives of the curvature times section tangent times themselves; second derivatives of the slope strain on the
   !> nodal slopes at fixed mid-side coefficients. First of the parts: sets h.
   pure subroutine bending_hessian(weight, r, w, der, h)
      real(wp), intent(in) :: weight(lanes)
      type(resultants_t), intent(in) :: r
      type(work_t), intent(in) :: w
      type(strain_derivatives_t), intent(in) :: der
      real(wp), intent(out) :: h(lanes, n_core, n_core) !< upper triangle
      real(wp) :: d(lanes, 6, 3), s(lanes, 3, 3), t(lanes, 2, 3)
      integer :: g, i, j, k, v
      h(:, :, 4:6) = 0
      h(:, 4:6, :) = 0
      do g = 1, 3
         k = lanes*(g - 1)
         do v = 1, 6
            d(:, v, g) = weight*r%d(k + 1:k + lanes, v)
         end do
      end do
      associate (dk => der%curvature, ds => der%slope)
         do j = 1, 9
            do g = 1, 3
               s(:, 1, g) = d(:, 1, g)*dk(:, 1, j, g) + d(:, 4, g)*dk(:, 2, j, g) + d(:, 5, g)*dk(:, 3, j, g)
               s(:, 2, g) = d(:, 4, g)*dk(:, 1, j, g) + d(:, 2, g)*dk(:, 2, j, g) + d(:, 6, g)*dk(:, 3, j, g)
               s(:, 3, g) = d(:, 5, g)*dk(:, 1, j, g) + d(:, 6, g)*dk(:, 2, j, g) + d(:, 3, g)*dk(:, 3, j, g)
               t(:, 1, g) = w%slope_n(:, 1, g)*ds(:, 1, j, g) + w%slope_n(:, 3, g)*ds(:, 2, j, g)
               t(:, 2, g) = w%slope_n(:, 3, g)*ds(:, 1, j, g) + w%slope_n(:, 2, g)*ds(:, 2, j, g)
            end do
            do i = 1, j
               h(:, variable(i), variable(j)) = &
                  (dk(:, 1, i, 1)*s(:, 1, 1) + dk(:, 2, i, 1)*s(:, 2, 1) + dk(:, 3, i, 1)*s(:, 3, 1) &
                   + ds(:, 1, i, 1)*t(:, 1, 1) + ds(:, 2, i, 1)*t(:, 2, 1)) &
                  + (dk(:, 1, i, 2)*s(:, 1, 2) + dk(:, 2, i, 2)*s(:, 2, 2) + dk(:, 3, i, 2)*s(:, 3, 2) &
                     + ds(:, 1, i, 2)*t(:, 1, 2) + ds(:, 2, i, 2)*t(:, 2, 2)) &
                  + (dk(:, 1, i, 3)*s(:, 1, 3) + dk(:, 2, i, 3)*s(:, 2, 3) + dk(:, 3, i, 3)*s(:, 3, 3) &
                     + ds(:, 1, i, 3)*t(:, 1, 3) + ds(:, 2, i, 3)*t(:, 2, 3))
            end do
         end do
      end associate
   end subroutine bending_hessian

   !> First derivatives of the membrane strain times section tangent times those of membrane strain and curvature.
   pure subroutine membrane_hessian(weight, r, der, arc, curved, h)
      real(wp), intent(in) :: weight(lanes)
      type(resultants_t), intent(in) :: r
      type(strain_derivatives_t), intent(in) :: der
      real(wp), intent(in) :: arc(lanes, 3, 9) !< what the derivatives of V/2 meet through M
      logical, intent(in) :: curved !< the reference
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: a(lanes, 6), b(lanes, 6), y(lanes, 3, 9)
      integer :: g, j, k, v

      y = 0
      a = 0
      do g = 1, 3
         k = lanes*(g - 1)
         do v = 1, 6
            a(:, v) = a(:, v) + weight*r%a(k + 1:k + lanes, v)
            b(:, v) = weight*r%b(k + 1:k + lanes, v)
         end do
         associate (dk => der%curvature(:, :, :, g))
            do j = 1, 9
               y(:, 1, j) = y(:, 1, j) - (b(:, 1)*dk(:, 1, j) + b(:, 4)*dk(:, 2, j) + b(:, 5)*dk(:, 3, j))
               y(:, 2, j) = y(:, 2, j) - (b(:, 4)*dk(:, 1, j) + b(:, 2)*dk(:, 2, j) + b(:, 6)*dk(:, 3, j))
               y(:, 3, j) = y(:, 3, j) - (b(:, 5)*dk(:, 1, j) + b(:, 6)*dk(:, 2, j) + b(:, 3)*dk(:, 3, j))
            end do
         end associate
         if (g < 3 .and. der%groups == 1) cycle
         call membrane_products(a, y, der%membrane(:, :, :, min(g, der%groups)), der%slope_strain, arc, curved, h)
         a = 0
         y = 0
      end do
   end subroutine membrane_hessian

   !> dm A dm + dm y + y dm + dv s + s dv, m the membrane strain, v = V/2; with respect to the slopes dm = dv on a flat reference.
   pure subroutine membrane_products(a, y, dm, dv, s, curved, h)
      real(wp), intent(in) :: a(lanes, 6), y(lanes, 3, 9), dm(lanes, 3, n_core), dv(lanes, 3, 9), s(lanes, 3, 9)
      logical, intent(in) :: curved
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: t(lanes, 3, n_core), ts(lanes, 3), ys(lanes, 3, 9), beside(lanes, 3, 9)
      integer :: i, j
      do j = 1, n_core
         t(:, 1, j) = a(:, 1)*dm(:, 1, j) + a(:, 4)*dm(:, 2, j) + a(:, 5)*dm(:, 3, j)
         t(:, 2, j) = a(:, 4)*dm(:, 1, j) + a(:, 2)*dm(:, 2, j) + a(:, 6)*dm(:, 3, j)
         t(:, 3, j) = a(:, 5)*dm(:, 1, j) + a(:, 6)*dm(:, 2, j) + a(:, 3)*dm(:, 3, j)
      end do
      do j = 1, 9
         t(:, :, variable(j)) = t(:, :, variable(j)) + y(:, :, j)
         ys(:, :, j) = y(:, :, j) + s(:, :, j)
      end do
      do j = 1, 3
         do i = 1, j
            h(:, i, j) = h(:, i, j) + (dm(:, 1, i)*t(:, 1, j) + dm(:, 2, i)*t(:, 2, j) + dm(:, 3, i)*t(:, 3, j)) &
               + (y(:, 1, i)*dm(:, 1, j) + y(:, 2, i)*dm(:, 2, j) + y(:, 3, i)*dm(:, 3, j)) &
               + (dv(:, 1, i)*s(:, 1, j) + dv(:, 2, i)*s(:, 2, j) + dv(:, 3, i)*s(:, 3, j)) &
               + (s(:, 1, i)*dv(:, 1, j) + s(:, 2, i)*dv(:, 2, j) + s(:, 3, i)*dv(:, 3, j))
         end do
      end do
      do j = 4, 6
         do i = 1, 3
            h(:, i, j) = h(:, i, j) + (dm(:, 1, i)*t(:, 1, j) + dm(:, 2, i)*t(:, 2, j) + dm(:, 3, i)*t(:, 3, j)) &
               + (y(:, 1, i)*dm(:, 1, j) + y(:, 2, i)*dm(:, 2, j) + y(:, 3, i)*dm(:, 3, j))
         end do
         do i = 4, j
            h(:, i, j) = h(:, i, j) + dm(:, 1, i)*t(:, 1, j) + dm(:, 2, i)*t(:, 2, j) + dm(:, 3, i)*t(:, 3, j)
         end do
      end do
      do j = 7, n_core
         do i = 1, 3
            h(:, i, j) = h(:, i, j) + (dm(:, 1, i)*t(:, 1, j) + dm(:, 2, i)*t(:, 2, j) + dm(:, 3, i)*t(:, 3, j)) &
               + (ys(:, 1, i)*dm(:, 1, j) + ys(:, 2, i)*dm(:, 2, j) + ys(:, 3, i)*dm(:, 3, j)) &
               + (dv(:, 1, i)*s(:, 1, j - 3) + dv(:, 2, i)*s(:, 2, j - 3) + dv(:, 3, i)*s(:, 3, j - 3))
         end do
         do i = 4, 6
            h(:, i, j) = h(:, i, j) + dm(:, 1, i)*t(:, 1, j) + dm(:, 2, i)*t(:, 2, j) + dm(:, 3, i)*t(:, 3, j)
         end do
         ts = t(:, :, j) + s(:, :, j - 3)
         do i = 7, j
            h(:, i, j) = h(:, i, j) + (dm(:, 1, i)*ts(:, 1) + dm(:, 2, i)*ts(:, 2) + dm(:, 3, i)*ts(:, 3)) &
               + (ys(:, 1, i - 3)*dm(:, 1, j) + ys(:, 2, i - 3)*dm(:, 2, j) + ys(:, 3, i - 3)*dm(:, 3, j))
         end do
      end do
      if (.not. curved) return
      ! s has met dm where it should have met dv
      beside(:, :, 4:9) = dm(:, :, 7:12) - dv(:, :, 4:9)
      do j = 4, 9
         do i = 1, j
            h(:, variable(i), variable(j)) = h(:, variable(i), variable(j)) &
               - (s(:, 1, i)*beside(:, 1, j) + s(:, 2, i)*beside(:, 2, j) + s(:, 3, i)*beside(:, 3, j))
            if (i > 3) h(:, variable(i), variable(j)) = h(:, variable(i), variable(j)) &
               - (beside(:, 1, i)*s(:, 1, j) + beside(:, 2, i)*s(:, 2, j) + beside(:, 3, i)*s(:, 3, j))
         end do
      end do
   end subroutine membrane_products

   !> Second derivatives of l sym(M grad G) at fixed moments, but for those of V (with `arc` its product with dV/2) and of
   !> beta_k p_k.
   pure subroutine curvature_hessian(ref, bend, w, l, dl, ddl, d, arc, h)
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      type(work_t), intent(in) :: w
      real(wp), intent(in) :: l(lanes), dl(lanes, 3), ddl(lanes, 6)
      type(strain_derivatives_t), intent(in) :: d
      real(wp), intent(out) :: arc(lanes, 3, 9) !< l d sym(T C^-1): what the derivatives of V/2 meet
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: bending(lanes, 9), relative(lanes, 3)
      integer :: i, j, k
      do i = 1, 9
         bending(:, i) = (w%moment(:, 1, 1)*d%curvature(:, 1, i, 1) + w%moment(:, 2, 1)*d%curvature(:, 2, i, 1) &
                          + w%moment(:, 3, 1)*d%curvature(:, 3, i, 1)) &
            + (w%moment(:, 1, 2)*d%curvature(:, 1, i, 2) + w%moment(:, 2, 2)*d%curvature(:, 2, i, 2) &
               + w%moment(:, 3, 2)*d%curvature(:, 3, i, 2)) &
            + (w%moment(:, 1, 3)*d%curvature(:, 1, i, 3) + w%moment(:, 2, 3)*d%curvature(:, 2, i, 3) &
               + w%moment(:, 3, 3)*d%curvature(:, 3, i, 3))
      end do
      do i = 1, 3
         relative(:, i) = dl(:, i)/l
         bending(:, i) = bending(:, i) - dl(:, i)*w%bending
      end do
      do k = 1, 6
         i = row(k)
         j = column(k)
         h(:, i, j) = h(:, i, j) + ddl(:, k)*w%bending + relative(:, i)*bending(:, j) + relative(:, j)*bending(:, i)
      end do
      do j = 4, 9
         do i = 1, 3
            h(:, i, variable(j)) = h(:, i, variable(j)) + relative(:, i)*bending(:, j)
         end do
      end do
      if (bend%arc) then
         call arc_hessian(ref, bend, w, l, d, arc, h)
      else
         arc = 0
      end if
   end subroutine curvature_hessian

   !> Second derivatives of l (1/2 V C^-1):T but for those of V, its product with dV/2, and of beta_k p_k.
   pure subroutine arc_hessian(ref, bend, w, l, d, s, h)
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      type(work_t), intent(in) :: w
      real(wp), intent(in) :: l(lanes)
      type(strain_derivatives_t), intent(in) :: d
      real(wp), intent(out) :: s(lanes, 3, 9) !< l d sym(T C^-1): what the derivatives of V/2 meet
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: dt(lanes, 2, 2, 9) !< l dT
      real(wp) :: x(lanes, 2, 2), lz(lanes, 3)
      integer :: a, i, j

      call work_derivatives(ref, bend, w, l, dt)
      associate (ci => bend%c_inverse, k => d%metric)
         do i = 1, 9
            s(:, 1, i) = dt(:, 1, 1, i)*ci(:, 1) + dt(:, 1, 2, i)*ci(:, 3)
            s(:, 2, i) = dt(:, 2, 1, i)*ci(:, 3) + dt(:, 2, 2, i)*ci(:, 2)
            s(:, 3, i) = 0.5_wp*(dt(:, 1, 1, i)*ci(:, 3) + dt(:, 1, 2, i)*ci(:, 2) &
                                 + dt(:, 2, 1, i)*ci(:, 1) + dt(:, 2, 2, i)*ci(:, 3))
         end do
         ! T dC^-1 = -X dC C^-1, X = T C^-1
         do a = 1, 2
            x(:, a, 1) = l*(w%t(:, a, 1)*ci(:, 1) + w%t(:, a, 2)*ci(:, 3))
            x(:, a, 2) = l*(w%t(:, a, 1)*ci(:, 3) + w%t(:, a, 2)*ci(:, 2))
         end do
         s(:, 1, 1) = s(:, 1, 1) - 2*x(:, 1, 1)*ci(:, 1)
         s(:, 2, 1) = s(:, 2, 1) - 2*x(:, 2, 1)*ci(:, 3)
         s(:, 3, 1) = s(:, 3, 1) - x(:, 1, 1)*ci(:, 3) - x(:, 2, 1)*ci(:, 1)
         s(:, 1, 2) = s(:, 1, 2) - 2*x(:, 1, 2)*ci(:, 3)
         s(:, 2, 2) = s(:, 2, 2) - 2*x(:, 2, 2)*ci(:, 2)
         s(:, 3, 2) = s(:, 3, 2) - x(:, 1, 2)*ci(:, 2) - x(:, 2, 2)*ci(:, 3)
         s(:, 1, 3) = s(:, 1, 3) - x(:, 1, 1)*ci(:, 3) - x(:, 1, 2)*ci(:, 1)
         s(:, 2, 3) = s(:, 2, 3) - x(:, 2, 1)*ci(:, 2) - x(:, 2, 2)*ci(:, 3)
         s(:, 3, 3) = s(:, 3, 3) - 0.5_wp*(x(:, 1, 1)*ci(:, 2) + (x(:, 1, 2) + x(:, 2, 1))*ci(:, 3) + x(:, 2, 2)*ci(:, 1))
         ! 1/2 V dC^-1 and dT
         do j = 1, 9
            do i = 1, 3
               x(:, 1, 1) = k(:, 1, 1, i)*dt(:, 1, 1, j) + k(:, 2, 1, i)*dt(:, 2, 1, j) + k(:, 1, 2, i)*dt(:, 1, 2, j) &
                  + k(:, 2, 2, i)*dt(:, 2, 2, j)
               if (j > 3 .or. i <= j) h(:, i, variable(j)) = h(:, i, variable(j)) + x(:, 1, 1)
               if (j <= i) h(:, j, i) = h(:, j, i) + x(:, 1, 1)
            end do
         end do
         ! 1/2 V T: ddC^-1 = Z: dC C^-1 dC
         lz(:, 1) = l*w%arc(:, 1)
         lz(:, 2) = l*w%arc(:, 2)
         lz(:, 3) = l*w%arc(:, 3)
         h(:, 1, 1) = h(:, 1, 1) + 4*lz(:, 1)*ci(:, 1)
         h(:, 2, 2) = h(:, 2, 2) + 4*lz(:, 2)*ci(:, 2)
         h(:, 1, 2) = h(:, 1, 2) + 4*lz(:, 3)*ci(:, 3)
         h(:, 1, 3) = h(:, 1, 3) + 2*(lz(:, 3)*ci(:, 1) + lz(:, 1)*ci(:, 3))
         h(:, 2, 3) = h(:, 2, 3) + 2*(lz(:, 3)*ci(:, 2) + lz(:, 2)*ci(:, 3))
         h(:, 3, 3) = h(:, 3, 3) + 2*lz(:, 3)*ci(:, 3) + lz(:, 1)*ci(:, 2) + lz(:, 2)*ci(:, 1)
      end associate
   end subroutine arc_hessian

   !> l dT at fixed moments.
   pure subroutine work_derivatives(ref, bend, w, l, dt)
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      type(work_t), intent(in) :: w
      real(wp), intent(in) :: l(lanes)
      real(wp), intent(out) :: dt(lanes, 2, 2, 9)
      real(wp) :: mid(lanes, 2, 2, 3), turned(lanes, 2, 2, 3), r(lanes), p(lanes, 3)
      integer :: a, c, i, k, node
      do k = 1, 3
         do a = 1, 2
            r = l*w%side(:, a, k)
            do c = 1, 2
               mid(:, a, c, k) = r*bend%mid(:, c, k)
               turned(:, a, c, k) = r*bend%turned(:, c, k)
            end do
         end do
      end do
      do node = 1, 3
         k = 1 + mod(node + 1, 3)
         do c = 1, 2
            i = 1 + 2*node + c
            do a = 1, 2
               dt(:, a, 1, i) = mid(:, a, 1, node)*ref%side(:, c, node) + mid(:, a, 1, k)*ref%side(:, c, k)
               dt(:, a, 2, i) = mid(:, a, 2, node)*ref%side(:, c, node) + mid(:, a, 2, k)*ref%side(:, c, k)
               dt(:, a, c, i) = dt(:, a, c, i) + l*w%vertex(:, a, node)
            end do
         end do
      end do
      do i = 1, 3
         do k = 1, 3
            p(:, k) = bend%p(:, k)*bend%dbeta(:, i, k)
         end do
         do c = 1, 2
            do a = 1, 2
               dt(:, a, c, i) = turned(:, a, c, 1)*p(:, 1) + turned(:, a, c, 2)*p(:, 2) + turned(:, a, c, 3)*p(:, 3)
            end do
         end do
      end do
   end subroutine work_derivatives

   !> Second derivatives of 3/8 <G_b (x) G_b> at fixed membrane force: constant, of rank three.
   pure subroutine bow_hessian(ref, w, h)
      type(reference_t), intent(in) :: ref
      type(work_t), intent(in) :: w
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp), parameter :: factor = 3*0.75_wp/64
      real(wp) :: n(lanes, 6), q(lanes, 3)
      integer :: a, before, c, i, j, k, last, node
      do k = 1, 6
         n(:, k) = factor*(w%slope_n(:, 1, 1)*ref%bubble_mean(:, 1, k) + w%slope_n(:, 2, 1)*ref%bubble_mean(:, 2, k) &
                           + w%slope_n(:, 3, 1)*ref%bubble_mean(:, 3, k))
      end do
      do node = 1, 3
         last = 1 + mod(node + 1, 3)
         do c = 1, 2
            j = 4 + 2*node + c
            do k = 1, 3
               q(:, k) = n(:, pack(k, node))*ref%side(:, c, node) - n(:, pack(k, last))*ref%side(:, c, last)
            end do
            do k = 1, node
               before = 1 + mod(k + 1, 3)
               do a = 1, 2
                  i = 4 + 2*k + a
                  if (i > j) cycle
                  h(:, i, j) = h(:, i, j) + q(:, k)*ref%side(:, a, k) - q(:, before)*ref%side(:, a, before)
               end do
            end do
         end do
      end do
   end subroutine bow_hessian
end module finshell_core_hessian
