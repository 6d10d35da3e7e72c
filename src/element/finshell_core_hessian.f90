!> Strain derivatives and Hessian of the core element; resultants predicted for the next iteration.
module finshell_core_hessian
   use finshell_kinds, only: wp, lanes
   use finshell_bending, only: bending_t
   use finshell_core_force, only: work_t
   use finshell_core_strain, only: n_core, variable, row, column, pack, total_drilling_matrix, jacobian_gradient
   use finshell_drilling, only: drilling_t, add_drilling_hessian
   use finshell_filter, only: filter_t
   use finshell_kink, only: kink_t, add_kink_hessian
   use finshell_reference, only: reference_t, zeta, n_side
   use finshell_section, only: resultants_t, points_per_block
   implicit none
   private
   public :: stress_t, strain_derivatives_t, strain_derivatives, strain_variation, predict, bending_hessian, curvature_hessian, &
      membrane_hessian, bow_hessian, add_side_terms, stabilised_geometric, paper_geometric

   !> Resultants at the points, kept by mixed-integration-point Newton from one iteration to the next.
   type :: stress_t
      real(wp) :: n(points_per_block, 3), m(points_per_block, 3)
   end type stress_t

   !> First derivatives of the fields; the nine variables that bend are midsurface strain and slopes.
   type :: strain_derivatives_t
      integer :: groups !< points with a membrane strain of their own: 1 in (S), 3 in (P)
      real(wp) :: slope(lanes, 2, 9, 3) !< of H (component, variable, point)
      real(wp) :: slope_side(lanes, 2, 3, 3) !< of H, with respect to beta_k p_k (component, side, point)
      real(wp) :: slope_strain(lanes, 3, 9) !< of V/2, Voigt
      real(wp) :: metric(lanes, 2, 2, 3) !< (S): 1/2 V dC^-1 (a, c, strain)
      real(wp) :: membrane(lanes, 3, n_core, 3) !< of the membrane strain (component, variable, group)
      real(wp) :: curvature(lanes, 3, 9, 3) !< of l sym(M grad G), minus the curvature (component, variable, point)
   end type strain_derivatives_t

contains

   !> Derivatives of membrane strain and curvature.
   pure subroutine strain_derivatives(stabilised, ref, filter, tau, bend, drill, higher, l, dl, d, kink)
      logical, intent(in) :: stabilised
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: tau(lanes, 3), higher(lanes, 3, 3, 3), l(lanes), dl(lanes, 3)
      type(bending_t), intent(in) :: bend
      type(drilling_t), intent(in) :: drill
      type(strain_derivatives_t), intent(inout) :: d
      type(kink_t), intent(in) :: kink
      real(wp) :: y(lanes, 2, 2, 9)
      integer :: i, j, point, v

      d%groups = merge(1, 3, stabilised)
      call slope_derivatives(ref, bend, d)
      if (stabilised) then
         call slope_strain_derivatives(ref, bend, d)
         do i = 1, 3
            d%membrane(:, :, i, 1) = d%slope_strain(:, :, i) + drill%strain_e(:, :, i)
            d%membrane(:, i, i, 1) = d%membrane(:, i, i, 1) + 1
         end do
         d%membrane(:, :, 4, 1) = drill%strain_a(:, :, 1)
         d%membrane(:, :, 5, 1) = drill%strain_a(:, :, 2)
         d%membrane(:, :, 6, 1) = -drill%strain_a(:, :, 1) - drill%strain_a(:, :, 2)
         d%membrane(:, :, 7:12, 1) = d%slope_strain(:, :, 4:9)
         if (kink%any) then
            do i = 1, 9
               do v = 1, 3
                  do j = 1, 3
                     d%membrane(:, v, variable(i), 1) = d%membrane(:, v, variable(i), 1) &
                        + drill%strain_a(:, v, j)*kink%derivative(:, j, i)
                  end do
               end do
            end do
         end if
      else
         d%slope_strain = 0
         call paper_derivatives(ref, filter, tau, bend, higher, d)
      end if

      call bare_derivatives(ref, bend, l, d)
      if (bend%arc) then
         call arc_derivatives(bend, l, d, y)
         do point = 1, 3
            associate (g => bend%gradient(:, :, :, point), dk => d%curvature(:, :, :, point))
               do i = 1, 9
                  dk(:, 1, i) = dk(:, 1, i) + (y(:, 1, 1, i)*g(:, 1, 1) + y(:, 1, 2, i)*g(:, 2, 1))
                  dk(:, 2, i) = dk(:, 2, i) + (y(:, 2, 1, i)*g(:, 1, 2) + y(:, 2, 2, i)*g(:, 2, 2))
                  dk(:, 3, i) = dk(:, 3, i) + (y(:, 1, 1, i)*g(:, 1, 2) + y(:, 1, 2, i)*g(:, 2, 2) &
                                               + y(:, 2, 1, i)*g(:, 1, 1) + y(:, 2, 2, i)*g(:, 2, 1))
               end do
            end associate
         end do
      end if
      do i = 1, 3
         do point = 1, 3
            do v = 1, 3
               d%curvature(:, v, i, point) = d%curvature(:, v, i, point) + dl(:, i)*bend%curvature(:, v, point)
            end do
         end do
      end do
   end subroutine strain_derivatives

   !> Derivatives of H.
   pure subroutine slope_derivatives(ref, bend, d)
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      type(strain_derivatives_t), intent(inout) :: d
      real(wp) :: here(lanes, 2), before(lanes, 2), p(lanes, 3)
      integer :: a, c, i, k, node, point, v
      do point = 1, 3
         do k = 1, 3
            d%slope_side(:, 1, k, point) = n_side(k, point)*bend%turned(:, 1, k)
            d%slope_side(:, 2, k, point) = n_side(k, point)*bend%turned(:, 2, k)
         end do
         ! node i begins side i and ends the side before it
         do node = 1, 3
            k = 1 + mod(node + 1, 3)
            do v = 1, 2
               here(:, v) = n_side(node, point)*bend%mid(:, v, node) - (0.125_wp*bend%share)*ref%bubble(:, v, node, point)
               before(:, v) = n_side(k, point)*bend%mid(:, v, k) + (0.125_wp*bend%share)*ref%bubble(:, v, k, point)
            end do
            do a = 1, 2
               i = 1 + 2*node + a
               do v = 1, 2
                  d%slope(:, v, i, point) = here(:, v)*ref%side(:, a, node) + before(:, v)*ref%side(:, a, k)
               end do
               d%slope(:, a, i, point) = d%slope(:, a, i, point) + zeta(node, point)
            end do
         end do
      end do
      do c = 1, 3
         do k = 1, 3
            p(:, k) = bend%p(:, k)*bend%dbeta(:, c, k)
         end do
         do point = 1, 3
            do v = 1, 2
               d%slope(:, v, c, point) = d%slope_side(:, v, 1, point)*p(:, 1) + d%slope_side(:, v, 2, point)*p(:, 2) &
                  + d%slope_side(:, v, 3, point)*p(:, 3)
            end do
         end do
      end do
   end subroutine slope_derivatives

   !> Derivatives of V/2 in (S).
   pure subroutine slope_strain_derivatives(ref, bend, d)
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      type(strain_derivatives_t), intent(inout) :: d
      real(wp), parameter :: third = 1.0_wp/3
      integer :: a, i, k, node, v
      associate (h => bend%slope, dh => d%slope)
         do i = 1, 9
            d%slope_strain(:, 1, i) = third*(h(:, 1, 1)*dh(:, 1, i, 1) + h(:, 1, 2)*dh(:, 1, i, 2) + h(:, 1, 3)*dh(:, 1, i, 3))
            d%slope_strain(:, 2, i) = third*(h(:, 2, 1)*dh(:, 2, i, 1) + h(:, 2, 2)*dh(:, 2, i, 2) + h(:, 2, 3)*dh(:, 2, i, 3))
            d%slope_strain(:, 3, i) = third*(h(:, 1, 1)*dh(:, 2, i, 1) + h(:, 2, 1)*dh(:, 1, i, 1) &
                                             + h(:, 1, 2)*dh(:, 2, i, 2) + h(:, 2, 2)*dh(:, 1, i, 2) &
                                             + h(:, 1, 3)*dh(:, 2, i, 3) + h(:, 2, 3)*dh(:, 1, i, 3))
         end do
      end associate
      do node = 1, 3
         k = 1 + mod(node + 1, 3)
         do a = 1, 2
            i = 1 + 2*node + a
            do v = 1, 3
               d%slope_strain(:, v, i) = d%slope_strain(:, v, i) &
                  + 0.125_wp*(bend%bow_strain(:, v, node)*ref%side(:, a, node) - bend%bow_strain(:, v, k)*ref%side(:, a, k))
            end do
         end do
      end do
   end subroutine slope_strain_derivatives

   !> Derivatives of the membrane strain of (P).
   pure subroutine paper_derivatives(ref, filter, tau, bend, higher, d)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: tau(lanes, 3), higher(lanes, 3, 3, 3)
      type(bending_t), intent(in) :: bend
      type(strain_derivatives_t), intent(inout) :: d
      real(wp) :: b(lanes, 3, 3), dj(lanes, 3)
      integer :: i, point, v
      call jacobian_gradient(filter, dj)
      do point = 1, 3
         associate (h => bend%slope(:, :, point), dh => d%slope(:, :, :, point))
            do i = 1, 9
               d%membrane(:, 1, variable(i), point) = h(:, 1)*dh(:, 1, i)
               d%membrane(:, 2, variable(i), point) = h(:, 2)*dh(:, 2, i)
               d%membrane(:, 3, variable(i), point) = h(:, 1)*dh(:, 2, i) + h(:, 2)*dh(:, 1, i)
            end do
         end associate
         call total_drilling_matrix(ref, higher(:, :, :, point), b)
         do i = 1, 3
            d%membrane(:, i, i, point) = d%membrane(:, i, i, point) + 1
            do v = 1, 3
               d%membrane(:, v, i, point) = d%membrane(:, v, i, point) &
                  + dj(:, i)*(b(:, v, 1)*tau(:, 1) + b(:, v, 2)*tau(:, 2) + b(:, v, 3)*tau(:, 3))
               d%membrane(:, v, 3 + i, point) = filter%jacobian*b(:, v, i)
            end do
         end do
      end do
   end subroutine paper_derivatives

   !> l times the derivatives of sym(M grad G) at fixed M.
   pure subroutine bare_derivatives(ref, bend, l, d)
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: l(lanes)
      type(strain_derivatives_t), intent(inout) :: d
      real(wp) :: lm(lanes, 2, 2), mid(lanes, 2, 3), turned(lanes, 2, 3), vertex(lanes, 3, 2, 3), side(lanes, 3, 3)
      real(wp) :: beta(lanes, 3, 3), p(lanes, 3)
      integer :: a, c, i, k, node, point, v
      do c = 1, 2
         do a = 1, 2
            lm(:, a, c) = l*bend%m(:, a, c)
         end do
      end do
      do k = 1, 3
         do a = 1, 2
            mid(:, a, k) = lm(:, a, 1)*bend%mid(:, 1, k) + lm(:, a, 2)*bend%mid(:, 2, k)
            turned(:, a, k) = lm(:, a, 1)*bend%turned(:, 1, k) + lm(:, a, 2)*bend%turned(:, 2, k)
         end do
         do c = 1, 2
            call symmetric_product(lm(:, :, c), ref%gradient(:, :, k), vertex(:, :, c, k))
         end do
      end do
      do point = 1, 3
         do k = 1, 3
            call symmetric_product(mid(:, :, k), ref%bubble(:, :, k, point), side(:, :, k))
            call symmetric_product(turned(:, :, k), ref%bubble(:, :, k, point), beta(:, :, k))
         end do
         do node = 1, 3
            k = 1 + mod(node + 1, 3)
            do c = 1, 2
               i = 1 + 2*node + c
               do v = 1, 3
                  d%curvature(:, v, i, point) = vertex(:, v, c, node) + side(:, v, node)*ref%side(:, c, node) &
                     + side(:, v, k)*ref%side(:, c, k)
               end do
            end do
         end do
         do c = 1, 3
            do k = 1, 3
               p(:, k) = bend%p(:, k)*bend%dbeta(:, c, k)
            end do
            do v = 1, 3
               d%curvature(:, v, c, point) = beta(:, v, 1)*p(:, 1) + beta(:, v, 2)*p(:, 2) + beta(:, v, 3)*p(:, 3)
            end do
         end do
      end do
   end subroutine bare_derivatives

   !> 2 sym(a (x) b), Voigt as a strain.
   pure subroutine symmetric_product(a, b, s)
      real(wp), intent(in) :: a(lanes, 2), b(lanes, 2)
      real(wp), intent(out) :: s(lanes, 3)
      s(:, 1) = a(:, 1)*b(:, 1)
      s(:, 2) = a(:, 2)*b(:, 2)
      s(:, 3) = a(:, 1)*b(:, 2) + a(:, 2)*b(:, 1)
   end subroutine symmetric_product

   !> l times the derivatives y of M = I + 1/2 V C^-1.
   pure subroutine arc_derivatives(bend, l, d, y)
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: l(lanes)
      type(strain_derivatives_t), intent(inout) :: d
      real(wp), intent(out) :: y(lanes, 2, 2, 9)
      real(wp) :: m(lanes, 2), lc(lanes, 3)
      integer :: a, i
      do i = 1, 3
         lc(:, i) = l*bend%c_inverse(:, i)
      end do
      associate (ci => bend%c_inverse, v => d%slope_strain)
         do i = 1, 9
            y(:, 1, 1, i) = v(:, 1, i)*lc(:, 1) + 0.5_wp*v(:, 3, i)*lc(:, 3)
            y(:, 1, 2, i) = v(:, 1, i)*lc(:, 3) + 0.5_wp*v(:, 3, i)*lc(:, 2)
            y(:, 2, 1, i) = 0.5_wp*v(:, 3, i)*lc(:, 1) + v(:, 2, i)*lc(:, 3)
            y(:, 2, 2, i) = 0.5_wp*v(:, 3, i)*lc(:, 3) + v(:, 2, i)*lc(:, 2)
         end do
         ! 1/2 V dC^-1 = -(M - I) dC C^-1
         do a = 1, 2
            m = bend%m(:, a, :)
            m(:, a) = m(:, a) - 1
            d%metric(:, a, 1, 1) = -2*m(:, 1)*ci(:, 1)
            d%metric(:, a, 2, 1) = -2*m(:, 1)*ci(:, 3)
            d%metric(:, a, 1, 2) = -2*m(:, 2)*ci(:, 3)
            d%metric(:, a, 2, 2) = -2*m(:, 2)*ci(:, 2)
            d%metric(:, a, 1, 3) = -m(:, 1)*ci(:, 3) - m(:, 2)*ci(:, 1)
            d%metric(:, a, 2, 3) = -m(:, 1)*ci(:, 2) - m(:, 2)*ci(:, 3)
         end do
      end associate
      do i = 1, 3
         do a = 1, 2
            y(:, a, 1, i) = y(:, a, 1, i) + l*d%metric(:, a, 1, i)
            y(:, a, 2, i) = y(:, a, 2, i) + l*d%metric(:, a, 2, i)
         end do
      end do
   end subroutine arc_derivatives

   !> Changes of membrane strain and curvature at the points for a variation of the core variables.
   pure subroutine strain_variation(d, variation, membrane, curvature)
      type(strain_derivatives_t), intent(in) :: d
      real(wp), intent(in) :: variation(lanes, n_core)
      real(wp), intent(out) :: membrane(points_per_block, 3), curvature(points_per_block, 3)
      real(wp) :: de(lanes, 3), dk(lanes, 3)
      integer :: g, i, k, v
      do g = 1, 3
         if (g <= d%groups) then
            de = 0
            do i = 1, n_core
               do v = 1, 3
                  de(:, v) = de(:, v) + d%membrane(:, v, i, g)*variation(:, i)
               end do
            end do
         end if
         dk = 0
         do i = 1, 9
            do v = 1, 3
               dk(:, v) = dk(:, v) - d%curvature(:, v, i, g)*variation(:, variable(i))
            end do
         end do
         k = lanes*(g - 1)
         membrane(k + 1:k + lanes, :) = de
         curvature(k + 1:k + lanes, :) = dk
      end do
   end subroutine strain_variation

   !> Resultants, linearised: those of this state plus tangent times changes of the strains.
   pure subroutine predict(r, membrane, curvature, predicted)
      type(resultants_t), intent(in) :: r
      real(wp), intent(in) :: membrane(points_per_block, 3), curvature(points_per_block, 3)
      type(stress_t), intent(out) :: predicted
      integer :: i, v
      do v = 1, 3
         predicted%n(:, v) = r%n(:, v)
         predicted%m(:, v) = r%m(:, v)
         do i = 1, 3
            predicted%n(:, v) = predicted%n(:, v) + r%a(:, pack(v, i))*membrane(:, i) + r%b(:, pack(v, i))*curvature(:, i)
            predicted%m(:, v) = predicted%m(:, v) + r%b(:, pack(v, i))*membrane(:, i) + r%d(:, pack(v, i))*curvature(:, i)
         end do
      end do
   end subroutine predict

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
               h(:, i, variable(j)) = h(:, i, variable(j)) + x(:, 1, 1)
               if (j <= 3) h(:, j, i) = h(:, j, i) + x(:, 1, 1)
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

   !> Second derivatives of beta_k p_k, at fixed work conjugate: p_k is linear in the slopes of the side's two nodes.
   pure subroutine add_side_terms(ref, bend, side, h)
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: side(lanes, 3) !< conjugate to beta_k p_k
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: p(lanes, 3)
      integer :: i, k, m, node
      p = side*bend%p
      do k = 1, 6
         h(:, row(k), column(k)) = h(:, row(k), column(k)) + p(:, 1)*bend%ddbeta(:, k, 1) + p(:, 2)*bend%ddbeta(:, k, 2) &
            + p(:, 3)*bend%ddbeta(:, k, 3)
      end do
      do k = 1, 3
         do m = 0, 1
            node = 1 + mod(k - 1 + m, 3)
            do i = 1, 3
               h(:, i, 5 + 2*node) = h(:, i, 5 + 2*node) + side(:, k)*bend%dbeta(:, i, k)*ref%side(:, 1, k)
               h(:, i, 6 + 2*node) = h(:, i, 6 + 2*node) + side(:, k)*bend%dbeta(:, i, k)*ref%side(:, 2, k)
            end do
         end do
      end do
   end subroutine add_side_terms

   !> Second derivatives of the drilling strain of (S) at fixed membrane force.
   pure subroutine stabilised_geometric(ref, filter, bend, drill, w, h, kink)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      type(bending_t), intent(in) :: bend
      type(drilling_t), intent(in) :: drill
      type(work_t), intent(in) :: w
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      type(kink_t), intent(in) :: kink
      real(wp) :: n(lanes, 3), ee(lanes, 6), ea(lanes, 3, 3), aa(lanes, 6)
      integer :: i, k
      n = 3*w%n(:, :, 1)
      call add_drilling_hessian(ref, filter%c, filter%jacobian, drill, n, ee, ea, aa)
      do k = 1, 6
         h(:, row(k), column(k)) = h(:, row(k), column(k)) + ee(:, k)
      end do
      do i = 1, 3
         h(:, i, 4) = h(:, i, 4) + ea(:, i, 1)
         h(:, i, 5) = h(:, i, 5) + ea(:, i, 2)
         h(:, i, 6) = h(:, i, 6) - ea(:, i, 1) - ea(:, i, 2)
      end do
      h(:, 4, 4) = h(:, 4, 4) + aa(:, 1)
      h(:, 5, 5) = h(:, 5, 5) + aa(:, 2)
      h(:, 4, 5) = h(:, 4, 5) + aa(:, 3)
      h(:, 4, 6) = h(:, 4, 6) - aa(:, 1) - aa(:, 3)
      h(:, 5, 6) = h(:, 5, 6) - aa(:, 2) - aa(:, 3)
      h(:, 6, 6) = h(:, 6, 6) + aa(:, 1) + aa(:, 2) + 2*aa(:, 3)
      if (kink%any) call kinked(ref, filter, bend, kink, ea, aa, w%drilling, h)
   end subroutine stabilised_geometric

   !> What a kink adds to that: the differences depend on midsurface strain and slopes too.
   pure subroutine kinked(ref, filter, bend, kink, ea, aa, conjugate, h)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      type(bending_t), intent(in) :: bend
      type(kink_t), intent(in) :: kink
      real(wp), intent(in) :: ea(lanes, 3, 3), aa(lanes, 6), conjugate(lanes, 3)
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      integer, parameter :: pair(3, 3) = reshape([1, 3, 4, 3, 2, 5, 4, 5, 6], [3, 3])
      real(wp) :: second(lanes, 9, 9), t(lanes, 3), e(lanes)
      integer :: a, b, i, j
      second = 0
      call add_kink_hessian(ref, filter, bend, kink, conjugate, second)
      associate (da => kink%derivative)
         do j = 1, 9
            t = 0
            do a = 1, 3
               do b = 1, 3
                  t(:, a) = t(:, a) + aa(:, pair(a, b))*da(:, b, j)
               end do
            end do
            do i = 1, j
               second(:, i, j) = second(:, i, j) + da(:, 1, i)*t(:, 1) + da(:, 2, i)*t(:, 2) + da(:, 3, i)*t(:, 3)
            end do
            do i = 1, 3
               e = ea(:, i, 1)*da(:, 1, j) + ea(:, i, 2)*da(:, 2, j) + ea(:, i, 3)*da(:, 3, j)
               if (i <= j) second(:, i, j) = second(:, i, j) + e
               if (j <= i) second(:, j, i) = second(:, j, i) + e
            end do
            ! with the drilling angles
            t(:, 3) = -t(:, 1) - t(:, 2)
            do i = 1, 3
               a = min(3 + i, variable(j))
               b = max(3 + i, variable(j))
               h(:, a, b) = h(:, a, b) + t(:, i)
            end do
            do i = 1, j
               h(:, variable(i), variable(j)) = h(:, variable(i), variable(j)) + second(:, i, j)
            end do
         end do
      end associate
   end subroutine kinked

   !> Second derivatives of J B tau, formulation (P).
   pure subroutine paper_geometric(ref, filter, tau, higher, work, h)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: tau(lanes, 3), higher(lanes, 3, 3, 3)
      type(work_t), intent(in) :: work
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: b(lanes, 3, 3), dj(lanes, 3), w(lanes, 3), total(lanes)
      integer :: g, i, j, k
      call jacobian_gradient(filter, dj)
      w = 0
      do g = 1, 3
         call total_drilling_matrix(ref, higher(:, :, :, g), b)
         do i = 1, 3
            w(:, i) = w(:, i) + work%n(:, 1, g)*b(:, 1, i) + work%n(:, 2, g)*b(:, 2, i) + work%n(:, 3, g)*b(:, 3, i)
         end do
      end do
      do j = 1, 3
         do i = 1, 3
            h(:, i, 3 + j) = h(:, i, 3 + j) + dj(:, i)*w(:, j)
         end do
      end do
      ! J J,ab = (J^2),ab/2 - J,a J,b with (J^2),12 = 4 and (J^2),33 = -2
      total = (w(:, 1)*tau(:, 1) + w(:, 2)*tau(:, 2) + w(:, 3)*tau(:, 3))/filter%jacobian
      do k = 1, 6
         i = row(k)
         j = column(k)
         h(:, i, j) = h(:, i, j) - total*dj(:, i)*dj(:, j)
      end do
      h(:, 1, 2) = h(:, 1, 2) + 2*total
      h(:, 3, 3) = h(:, 3, 3) - total
   end subroutine paper_geometric
end module finshell_core_hessian
