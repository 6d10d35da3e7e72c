!> Hessian of the core element: the parts that the bending fields share in (S) and (P).
module finshell_core_hessian
   use finshell_kinds, only: wp, lanes, rows_3
   use finshell_bending, only: bending_t
   use finshell_core_force, only: work_t
   use finshell_core_derivatives, only: strain_derivatives_t, side_derivatives
   use finshell_core_strain, only: n_core, rows_9
   use finshell_reference, only: reference_t
   use finshell_resultants, only: resultants_t
   use finshell_voigt, only: row, column, pack
   implicit none
   private
   public :: bending_hessian, curvature_hessian, membrane_hessian, bow_hessian

   !> Rows of the upper triangle that are formed together: the four of a register, in a block all.
   integer, parameter :: rows = merge(4, 9, lanes == 1)

contains

   !> First derivatives of the curvature times section tangent times themselves; second derivatives of the slope strain on the
   !> nodal slopes at fixed mid-side coefficients. First of the parts: sets h.
   pure subroutine bending_hessian(weight, r, w, der, h)
      real(wp), intent(in) :: weight(lanes)
      type(resultants_t), intent(in) :: r
      type(work_t), intent(in) :: w
      type(strain_derivatives_t), intent(in) :: der
      real(wp), intent(out) :: h(lanes, n_core, n_core) !< upper triangle
      real(wp) :: d(lanes, 6, 3), s(lanes, rows_9, 3, 3), t(lanes, rows_9, 2, 3)
      integer :: first, g, i, j, k, v
      h(:, :, 10:12) = 0
      do g = 1, 3
         k = lanes*(g - 1)
!GCC$ unroll 6
         do v = 1, 6
            d(:, v, g) = weight*r%d(k + 1:k + lanes, v)
         end do
      end do
      associate (dk => der%curvature, ds => der%slope)
         do g = 1, 3
            do j = 1, rows_9
               s(:, j, 1, g) = d(:, 1, g)*dk(:, j, 1, g) + d(:, 4, g)*dk(:, j, 2, g) + d(:, 5, g)*dk(:, j, 3, g)
               s(:, j, 2, g) = d(:, 4, g)*dk(:, j, 1, g) + d(:, 2, g)*dk(:, j, 2, g) + d(:, 6, g)*dk(:, j, 3, g)
               s(:, j, 3, g) = d(:, 5, g)*dk(:, j, 1, g) + d(:, 6, g)*dk(:, j, 2, g) + d(:, 3, g)*dk(:, j, 3, g)
               t(:, j, 1, g) = w%slope_n(:, 1, g)*ds(:, j, 1, g) + w%slope_n(:, 3, g)*ds(:, j, 2, g)
               t(:, j, 2, g) = w%slope_n(:, 3, g)*ds(:, j, 1, g) + w%slope_n(:, 2, g)*ds(:, j, 2, g)
            end do
         end do
         do first = 1, 9, rows
            do j = first, 9
               do i = first, merge(first + rows - 1, j, lanes == 1)
                  h(:, i, j) = &
                     (dk(:, i, 1, 1)*s(:, j, 1, 1) + dk(:, i, 2, 1)*s(:, j, 2, 1) + dk(:, i, 3, 1)*s(:, j, 3, 1) &
                      + ds(:, i, 1, 1)*t(:, j, 1, 1) + ds(:, i, 2, 1)*t(:, j, 2, 1)) &
                     + (dk(:, i, 1, 2)*s(:, j, 1, 2) + dk(:, i, 2, 2)*s(:, j, 2, 2) + dk(:, i, 3, 2)*s(:, j, 3, 2) &
                        + ds(:, i, 1, 2)*t(:, j, 1, 2) + ds(:, i, 2, 2)*t(:, j, 2, 2)) &
                     + (dk(:, i, 1, 3)*s(:, j, 1, 3) + dk(:, i, 2, 3)*s(:, j, 2, 3) + dk(:, i, 3, 3)*s(:, j, 3, 3) &
                        + ds(:, i, 1, 3)*t(:, j, 1, 3) + ds(:, i, 2, 3)*t(:, j, 2, 3))
               end do
            end do
         end do
      end associate
   end subroutine bending_hessian

   !> First derivatives of the membrane strain times section tangent times those of membrane strain and curvature.
   pure subroutine membrane_hessian(weight, r, der, arc, curved, h)
      real(wp), intent(in) :: weight(lanes)
      type(resultants_t), intent(in) :: r
      type(strain_derivatives_t), intent(in) :: der
      real(wp), intent(in) :: arc(lanes, rows_9, 3) !< what the derivatives of V/2 meet through M
      logical, intent(in) :: curved !< the reference
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: a(lanes, 6), b(lanes, 6), y(lanes, rows_9, 3)
      integer :: g, j, k, v

      y = 0
      a = 0
      do g = 1, 3
         k = lanes*(g - 1)
!GCC$ unroll 6
         do v = 1, 6
            a(:, v) = a(:, v) + weight*r%a(k + 1:k + lanes, v)
            b(:, v) = weight*r%b(k + 1:k + lanes, v)
         end do
         associate (dk => der%curvature(:, :, :, g))
            do j = 1, rows_9
               y(:, j, 1) = y(:, j, 1) - (b(:, 1)*dk(:, j, 1) + b(:, 4)*dk(:, j, 2) + b(:, 5)*dk(:, j, 3))
               y(:, j, 2) = y(:, j, 2) - (b(:, 4)*dk(:, j, 1) + b(:, 2)*dk(:, j, 2) + b(:, 6)*dk(:, j, 3))
               y(:, j, 3) = y(:, j, 3) - (b(:, 5)*dk(:, j, 1) + b(:, 6)*dk(:, j, 2) + b(:, 3)*dk(:, j, 3))
            end do
         end associate
         if (g < 3 .and. der%groups == 1) cycle
         call membrane_products(a, y, der%membrane(:, :, :, min(g, der%groups)), der%slope_strain, arc, curved, h)
         if (g == 3) exit
         a = 0
         y = 0
      end do
   end subroutine membrane_hessian

   !> dm A dm + dm y + y dm + dv s + s dv, m the membrane strain, v = V/2; with respect to the slopes dm = dv on a flat reference.
   pure subroutine membrane_products(a, y, dm, dv, s, curved, h)
      real(wp), intent(in) :: a(lanes, 6), y(lanes, rows_9, 3), dm(lanes, n_core, 3), dv(lanes, rows_9, 3), s(lanes, rows_9, 3)
      logical, intent(in) :: curved
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: t(lanes, n_core, 3), ts(lanes, 3), ys(lanes, rows_9, 3), beside(lanes, rows_9, 3)
      !> Variables for which all four terms are formed: the strains, of a single element all, as its rows are formed together.
      integer, parameter :: in_full = merge(9, 3, lanes == 1)
      integer :: first, i, j, v
      do j = 1, n_core
         t(:, j, 1) = a(:, 1)*dm(:, j, 1) + a(:, 4)*dm(:, j, 2) + a(:, 5)*dm(:, j, 3)
         t(:, j, 2) = a(:, 4)*dm(:, j, 1) + a(:, 2)*dm(:, j, 2) + a(:, 6)*dm(:, j, 3)
         t(:, j, 3) = a(:, 5)*dm(:, j, 1) + a(:, 6)*dm(:, j, 2) + a(:, 3)*dm(:, j, 3)
      end do
      do v = 1, 3
         do j = 1, 9
            t(:, j, v) = t(:, j, v) + y(:, j, v)
         end do
      end do
      do j = 10, n_core
         do i = 1, merge(n_core, j, lanes == 1)
            h(:, i, j) = h(:, i, j) + t(:, i, 1)*dm(:, j, 1) + t(:, i, 2)*dm(:, j, 2) + t(:, i, 3)*dm(:, j, 3)
         end do
      end do
      do first = 1, in_full, rows
         do j = first, in_full
            do i = first, merge(first + rows - 1, j, lanes == 1)
               h(:, i, j) = h(:, i, j) + (dm(:, i, 1)*t(:, j, 1) + dm(:, i, 2)*t(:, j, 2) + dm(:, i, 3)*t(:, j, 3)) &
                  + (y(:, i, 1)*dm(:, j, 1) + y(:, i, 2)*dm(:, j, 2) + y(:, i, 3)*dm(:, j, 3)) &
                  + (dv(:, i, 1)*s(:, j, 1) + dv(:, i, 2)*s(:, j, 2) + dv(:, i, 3)*s(:, j, 3)) &
                  + (s(:, i, 1)*dv(:, j, 1) + s(:, i, 2)*dv(:, j, 2) + s(:, i, 3)*dv(:, j, 3))
            end do
         end do
      end do
      if (lanes == 1) return
      ys = y + s
      do j = 4, 9
         do i = 1, 3
            h(:, i, j) = h(:, i, j) + (dm(:, i, 1)*t(:, j, 1) + dm(:, i, 2)*t(:, j, 2) + dm(:, i, 3)*t(:, j, 3)) &
               + (ys(:, i, 1)*dm(:, j, 1) + ys(:, i, 2)*dm(:, j, 2) + ys(:, i, 3)*dm(:, j, 3)) &
               + (dv(:, i, 1)*s(:, j, 1) + dv(:, i, 2)*s(:, j, 2) + dv(:, i, 3)*s(:, j, 3))
         end do
         ts = t(:, j, :) + s(:, j, :)
         do i = 4, j
            h(:, i, j) = h(:, i, j) + (dm(:, i, 1)*ts(:, 1) + dm(:, i, 2)*ts(:, 2) + dm(:, i, 3)*ts(:, 3)) &
               + (ys(:, i, 1)*dm(:, j, 1) + ys(:, i, 2)*dm(:, j, 2) + ys(:, i, 3)*dm(:, j, 3))
         end do
      end do
      if (.not. curved) return
      ! s has met dm where it should have met dv
      beside(:, 4:9, :) = dm(:, 4:9, :) - dv(:, 4:9, :)
      do j = 4, 9
         do i = 1, j
            h(:, i, j) = h(:, i, j) &
               - (s(:, i, 1)*beside(:, j, 1) + s(:, i, 2)*beside(:, j, 2) + s(:, i, 3)*beside(:, j, 3))
            if (i > 3) h(:, i, j) = h(:, i, j) &
               - (beside(:, i, 1)*s(:, j, 1) + beside(:, i, 2)*s(:, j, 2) + beside(:, i, 3)*s(:, j, 3))
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
      real(wp), intent(out) :: arc(lanes, rows_9, 3) !< l d sym(T C^-1): what the derivatives of V/2 meet
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: bending(lanes, rows_9), relative(lanes, rows_3)
      integer :: i, j, k
      do i = 1, rows_9
         bending(:, i) = (w%moment(:, 1, 1)*d%curvature(:, i, 1, 1) + w%moment(:, 2, 1)*d%curvature(:, i, 2, 1) &
                          + w%moment(:, 3, 1)*d%curvature(:, i, 3, 1)) &
            + (w%moment(:, 1, 2)*d%curvature(:, i, 1, 2) + w%moment(:, 2, 2)*d%curvature(:, i, 2, 2) &
               + w%moment(:, 3, 2)*d%curvature(:, i, 3, 2)) &
            + (w%moment(:, 1, 3)*d%curvature(:, i, 1, 3) + w%moment(:, 2, 3)*d%curvature(:, i, 2, 3) &
               + w%moment(:, 3, 3)*d%curvature(:, i, 3, 3))
      end do
      relative(:, rows_3) = 0
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
         do i = 1, rows_3
            h(:, i, j) = h(:, i, j) + relative(:, i)*bending(:, j)
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
      real(wp), intent(out) :: s(lanes, rows_9, 3) !< l d sym(T C^-1): what the derivatives of V/2 meet
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: dt(lanes, rows_9, 2, 2) !< l dT
      real(wp) :: x(lanes, 2, 2), z(lanes, rows_3), lz(lanes, 3)
      integer :: a, i, j

      call work_derivatives(ref, bend, w, l, dt)
      associate (ci => bend%c_inverse, k => d%metric)
         do i = 1, rows_9
            s(:, i, 1) = dt(:, i, 1, 1)*ci(:, 1) + dt(:, i, 1, 2)*ci(:, 3)
            s(:, i, 2) = dt(:, i, 2, 1)*ci(:, 3) + dt(:, i, 2, 2)*ci(:, 2)
            s(:, i, 3) = 0.5_wp*(dt(:, i, 1, 1)*ci(:, 3) + dt(:, i, 1, 2)*ci(:, 2) &
                                 + dt(:, i, 2, 1)*ci(:, 1) + dt(:, i, 2, 2)*ci(:, 3))
         end do
         ! T dC^-1 = -X dC C^-1, X = T C^-1
         do a = 1, 2
            x(:, a, 1) = l*(w%t(:, a, 1)*ci(:, 1) + w%t(:, a, 2)*ci(:, 3))
            x(:, a, 2) = l*(w%t(:, a, 1)*ci(:, 3) + w%t(:, a, 2)*ci(:, 2))
         end do
         s(:, 1, 1) = s(:, 1, 1) - 2*x(:, 1, 1)*ci(:, 1)
         s(:, 1, 2) = s(:, 1, 2) - 2*x(:, 2, 1)*ci(:, 3)
         s(:, 1, 3) = s(:, 1, 3) - x(:, 1, 1)*ci(:, 3) - x(:, 2, 1)*ci(:, 1)
         s(:, 2, 1) = s(:, 2, 1) - 2*x(:, 1, 2)*ci(:, 3)
         s(:, 2, 2) = s(:, 2, 2) - 2*x(:, 2, 2)*ci(:, 2)
         s(:, 2, 3) = s(:, 2, 3) - x(:, 1, 2)*ci(:, 2) - x(:, 2, 2)*ci(:, 3)
         s(:, 3, 1) = s(:, 3, 1) - x(:, 1, 1)*ci(:, 3) - x(:, 1, 2)*ci(:, 1)
         s(:, 3, 2) = s(:, 3, 2) - x(:, 2, 1)*ci(:, 2) - x(:, 2, 2)*ci(:, 3)
         s(:, 3, 3) = s(:, 3, 3) - 0.5_wp*(x(:, 1, 1)*ci(:, 2) + (x(:, 1, 2) + x(:, 2, 1))*ci(:, 3) + x(:, 2, 2)*ci(:, 1))
         ! 1/2 V dC^-1 and dT
         do j = 1, 9
            do i = 1, rows_3
               z(:, i) = k(:, i, 1, 1)*dt(:, j, 1, 1) + k(:, i, 2, 1)*dt(:, j, 2, 1) + k(:, i, 1, 2)*dt(:, j, 1, 2) &
                  + k(:, i, 2, 2)*dt(:, j, 2, 2)
            end do
            if (j > 3) then
               do i = 1, rows_3
                  h(:, i, j) = h(:, i, j) + z(:, i)
               end do
            else
               do i = 1, j
                  h(:, i, j) = h(:, i, j) + z(:, i)
               end do
               do i = j, 3
                  h(:, j, i) = h(:, j, i) + z(:, i)
               end do
            end if
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
      real(wp), intent(out) :: dt(lanes, rows_9, 2, 2)
      real(wp) :: mid(lanes, 2, 2, 3), turned(lanes, 2, 2, 3), r(lanes), p(lanes, rows_3, 3)
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
      call side_derivatives(bend, p)
      do c = 1, 2
         do a = 1, 2
            if (rows_9 > 9) dt(:, 10:rows_9, a, c) = 0
            do i = 1, rows_3
               dt(:, i, a, c) = turned(:, a, c, 1)*p(:, i, 1) + turned(:, a, c, 2)*p(:, i, 2) + turned(:, a, c, 3)*p(:, i, 3)
            end do
         end do
      end do
      do node = 1, 3
         k = 1 + mod(node + 1, 3)
         do a = 1, 2
            do c = 1, 2
               i = 1 + 2*node + c
               dt(:, i, a, 1) = mid(:, a, 1, node)*ref%side(:, c, node) + mid(:, a, 1, k)*ref%side(:, c, k)
               dt(:, i, a, 2) = mid(:, a, 2, node)*ref%side(:, c, node) + mid(:, a, 2, k)*ref%side(:, c, k)
               dt(:, i, a, c) = dt(:, i, a, c) + l*w%vertex(:, a, node)
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
            j = 1 + 2*node + c
            do k = 1, 3
               q(:, k) = n(:, pack(k, node))*ref%side(:, c, node) - n(:, pack(k, last))*ref%side(:, c, last)
            end do
            do k = 1, node
               before = 1 + mod(k + 1, 3)
               do a = 1, 2
                  i = 1 + 2*k + a
                  if (i > j) cycle
                  h(:, i, j) = h(:, i, j) + q(:, k)*ref%side(:, a, k) - q(:, before)*ref%side(:, a, before)
               end do
            end do
         end do
      end do
   end subroutine bow_hessian
end module finshell_core_hessian
