!> Strain derivatives of the core element; changes of strains and resultants that follow from them.
module finshell_core_derivatives
   use finshell_kinds, only: wp, lanes, rows_3
   use finshell_bending, only: bending_t
   use finshell_core_strain, only: n_core, rows_9, total_drilling_matrix
   use finshell_drilling, only: drilling_t
   use finshell_filter, only: filter_t, jacobian_gradient
   use finshell_kink, only: kink_t
   use finshell_reference, only: reference_t, zeta, n_side
   use finshell_resultants, only: resultants_t, points_per_block
   use finshell_voigt, only: pack
   implicit none
   private
   public :: stress_t, strain_derivatives_t, strain_derivatives, side_derivatives, strain_variation, predict

   !> Resultants at the points, kept by mixed-integration-point Newton from one iteration to the next.
   type :: stress_t
      real(wp) :: n(points_per_block, 3), m(points_per_block, 3)
   end type stress_t

   !> First derivatives of the fields; the nine variables that bend are midsurface strain and slopes.
   type :: strain_derivatives_t
      integer :: groups !< points with a membrane strain of their own: 1 in (S), 3 in (P)
      real(wp) :: slope(lanes, rows_9, 2, 3) !< of H (variable, component, point)
      real(wp) :: slope_side(lanes, 2, 3, 3) !< of H, with respect to beta_k p_k (component, side, point)
      real(wp) :: slope_strain(lanes, rows_9, 3) !< of V/2, Voigt
      real(wp) :: metric(lanes, rows_3, 2, 2) !< (S): 1/2 V dC^-1 (strain, a, c)
      real(wp) :: membrane(lanes, n_core, 3, 3) !< of the membrane strain (variable, component, group)
      real(wp) :: curvature(lanes, rows_9, 3, 3) !< of l sym(M grad G), minus the curvature (variable, component, point)
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
      real(wp) :: y(lanes, rows_9, 2, 2)
      integer :: i, j, point, v

      d%groups = merge(1, 3, stabilised)
      call slope_derivatives(ref, bend, d)
      if (stabilised) then
         call slope_strain_derivatives(ref, bend, d)
         do v = 1, 3
            do i = 1, 3
               d%membrane(:, i, v, 1) = d%slope_strain(:, i, v) + drill%strain_e(:, v, i)
            end do
            d%membrane(:, v, v, 1) = d%membrane(:, v, v, 1) + 1
            d%membrane(:, 10, v, 1) = drill%strain_a(:, v, 1)
            d%membrane(:, 11, v, 1) = drill%strain_a(:, v, 2)
            d%membrane(:, 12, v, 1) = -drill%strain_a(:, v, 1) - drill%strain_a(:, v, 2)
            do i = 4, 9
               d%membrane(:, i, v, 1) = d%slope_strain(:, i, v)
            end do
         end do
         if (kink%any) then
            do i = 1, 9
               do v = 1, 3
                  do j = 1, 3
                     d%membrane(:, i, v, 1) = d%membrane(:, i, v, 1) &
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
               do i = 1, rows_9
                  dk(:, i, 1) = dk(:, i, 1) + (y(:, i, 1, 1)*g(:, 1, 1) + y(:, i, 1, 2)*g(:, 2, 1))
                  dk(:, i, 2) = dk(:, i, 2) + (y(:, i, 2, 1)*g(:, 1, 2) + y(:, i, 2, 2)*g(:, 2, 2))
                  dk(:, i, 3) = dk(:, i, 3) + (y(:, i, 1, 1)*g(:, 1, 2) + y(:, i, 1, 2)*g(:, 2, 2) &
                                               + y(:, i, 2, 1)*g(:, 1, 1) + y(:, i, 2, 2)*g(:, 2, 1))
               end do
            end associate
         end do
      end if
      do point = 1, 3
         do v = 1, 3
            do i = 1, 3
               d%curvature(:, i, v, point) = d%curvature(:, i, v, point) + dl(:, i)*bend%curvature(:, v, point)
            end do
         end do
      end do
   end subroutine strain_derivatives

   !> Derivatives of H.
   pure subroutine slope_derivatives(ref, bend, d)
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      type(strain_derivatives_t), intent(inout) :: d
      real(wp) :: here(lanes, 2), before(lanes, 2), p(lanes, rows_3, 3)
      integer :: a, c, i, k, node, point, v
      call side_derivatives(bend, p)
      do point = 1, 3
         do k = 1, 3
            d%slope_side(:, 1, k, point) = n_side(k, point)*bend%turned(:, 1, k)
            d%slope_side(:, 2, k, point) = n_side(k, point)*bend%turned(:, 2, k)
         end do
         do v = 1, 2
            if (rows_9 > 9) d%slope(:, 10:rows_9, v, point) = 0
            do c = 1, rows_3
               d%slope(:, c, v, point) = d%slope_side(:, v, 1, point)*p(:, c, 1) + d%slope_side(:, v, 2, point)*p(:, c, 2) &
                  + d%slope_side(:, v, 3, point)*p(:, c, 3)
            end do
         end do
         ! node i begins side i and ends the side before it
         do node = 1, 3
            k = 1 + mod(node + 1, 3)
            do v = 1, 2
               here(:, v) = n_side(node, point)*bend%mid(:, v, node) - (bend%share*ref%bow(:, node))*ref%bubble(:, v, node, point)
               before(:, v) = n_side(k, point)*bend%mid(:, v, k) + (bend%share*ref%bow(:, k))*ref%bubble(:, v, k, point)
            end do
            do v = 1, 2
               do a = 1, 2
                  i = 1 + 2*node + a
                  d%slope(:, i, v, point) = here(:, v)*ref%side(:, a, node) + before(:, v)*ref%side(:, a, k)
               end do
               i = 1 + 2*node + v
               d%slope(:, i, v, point) = d%slope(:, i, v, point) + zeta(node, point)
            end do
         end do
      end do
   end subroutine slope_derivatives

   !> Derivatives of the mid-side excesses beta_k p_k with respect to the midsurface strain.
   pure subroutine side_derivatives(bend, p)
      type(bending_t), intent(in) :: bend
      real(wp), intent(out) :: p(lanes, rows_3, 3) !< (strain, side)
      integer :: c, k
      do k = 1, 3
         p(:, rows_3, k) = 0
         do c = 1, 3
            p(:, c, k) = bend%p(:, k)*bend%dbeta(:, c, k)
         end do
      end do
   end subroutine side_derivatives

   !> Derivatives of V/2 in (S).
   pure subroutine slope_strain_derivatives(ref, bend, d)
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      type(strain_derivatives_t), intent(inout) :: d
      real(wp), parameter :: third = 1.0_wp/3
      integer :: a, i, k, node, v
      associate (h => bend%slope, dh => d%slope)
         do i = 1, rows_9
            d%slope_strain(:, i, 1) = third*(h(:, 1, 1)*dh(:, i, 1, 1) + h(:, 1, 2)*dh(:, i, 1, 2) + h(:, 1, 3)*dh(:, i, 1, 3))
            d%slope_strain(:, i, 2) = third*(h(:, 2, 1)*dh(:, i, 2, 1) + h(:, 2, 2)*dh(:, i, 2, 2) + h(:, 2, 3)*dh(:, i, 2, 3))
            d%slope_strain(:, i, 3) = third*(h(:, 1, 1)*dh(:, i, 2, 1) + h(:, 2, 1)*dh(:, i, 1, 1) &
                                             + h(:, 1, 2)*dh(:, i, 2, 2) + h(:, 2, 2)*dh(:, i, 1, 2) &
                                             + h(:, 1, 3)*dh(:, i, 2, 3) + h(:, 2, 3)*dh(:, i, 1, 3))
         end do
      end associate
      do node = 1, 3
         k = 1 + mod(node + 1, 3)
         do v = 1, 3
            do a = 1, 2
               i = 1 + 2*node + a
               d%slope_strain(:, i, v) = d%slope_strain(:, i, v) &
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
               d%membrane(:, i, 1, point) = h(:, 1)*dh(:, i, 1)
               d%membrane(:, i, 2, point) = h(:, 2)*dh(:, i, 2)
               d%membrane(:, i, 3, point) = h(:, 1)*dh(:, i, 2) + h(:, 2)*dh(:, i, 1)
            end do
         end associate
         call total_drilling_matrix(ref, higher(:, :, :, point), b)
         do i = 1, 3
            d%membrane(:, i, i, point) = d%membrane(:, i, i, point) + 1
            do v = 1, 3
               d%membrane(:, i, v, point) = d%membrane(:, i, v, point) &
                  + dj(:, i)*(b(:, v, 1)*tau(:, 1) + b(:, v, 2)*tau(:, 2) + b(:, v, 3)*tau(:, 3))
               d%membrane(:, 9 + i, v, point) = filter%jacobian*b(:, v, i)
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
      real(wp) :: beta(lanes, 3, 3), p(lanes, rows_3, 3)
      integer :: a, c, i, k, node, point, v
      call side_derivatives(bend, p)
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
         do v = 1, 3
            if (rows_9 > 9) d%curvature(:, 10:rows_9, v, point) = 0
            do c = 1, rows_3
               d%curvature(:, c, v, point) = beta(:, v, 1)*p(:, c, 1) + beta(:, v, 2)*p(:, c, 2) + beta(:, v, 3)*p(:, c, 3)
            end do
         end do
         do node = 1, 3
            k = 1 + mod(node + 1, 3)
            do v = 1, 3
               do c = 1, 2
                  i = 1 + 2*node + c
                  d%curvature(:, i, v, point) = vertex(:, v, c, node) + side(:, v, node)*ref%side(:, c, node) &
                     + side(:, v, k)*ref%side(:, c, k)
               end do
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
      real(wp), intent(out) :: y(lanes, rows_9, 2, 2)
      real(wp) :: m(lanes, 2), lc(lanes, 3)
      integer :: a, i
      do i = 1, 3
         lc(:, i) = l*bend%c_inverse(:, i)
      end do
      associate (ci => bend%c_inverse, v => d%slope_strain)
         do i = 1, rows_9
            y(:, i, 1, 1) = v(:, i, 1)*lc(:, 1) + 0.5_wp*v(:, i, 3)*lc(:, 3)
            y(:, i, 1, 2) = v(:, i, 1)*lc(:, 3) + 0.5_wp*v(:, i, 3)*lc(:, 2)
            y(:, i, 2, 1) = 0.5_wp*v(:, i, 3)*lc(:, 1) + v(:, i, 2)*lc(:, 3)
            y(:, i, 2, 2) = 0.5_wp*v(:, i, 3)*lc(:, 3) + v(:, i, 2)*lc(:, 2)
         end do
         ! 1/2 V dC^-1 = -(M - I) dC C^-1
         do a = 1, 2
            m = bend%m(:, a, :)
            m(:, a) = m(:, a) - 1
            d%metric(:, rows_3, a, :) = 0
            d%metric(:, 1, a, 1) = -2*m(:, 1)*ci(:, 1)
            d%metric(:, 1, a, 2) = -2*m(:, 1)*ci(:, 3)
            d%metric(:, 2, a, 1) = -2*m(:, 2)*ci(:, 3)
            d%metric(:, 2, a, 2) = -2*m(:, 2)*ci(:, 2)
            d%metric(:, 3, a, 1) = -m(:, 1)*ci(:, 3) - m(:, 2)*ci(:, 1)
            d%metric(:, 3, a, 2) = -m(:, 1)*ci(:, 2) - m(:, 2)*ci(:, 3)
         end do
      end associate
      do a = 1, 2
         do i = 1, rows_3
            y(:, i, a, 1) = y(:, i, a, 1) + l*d%metric(:, i, a, 1)
            y(:, i, a, 2) = y(:, i, a, 2) + l*d%metric(:, i, a, 2)
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
                  de(:, v) = de(:, v) + d%membrane(:, i, v, g)*variation(:, i)
               end do
            end do
         end if
         dk = 0
         do i = 1, 9
            do v = 1, 3
               dk(:, v) = dk(:, v) - d%curvature(:, i, v, g)*variation(:, i)
            end do
         end do
         k = lanes*(g - 1)
         membrane(k + 1:k + lanes, :) = de
         curvature(k + 1:k + lanes, :) = dk
      end do
      membrane(3*lanes + 1:, :) = 0
      curvature(3*lanes + 1:, :) = 0
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
end module finshell_core_derivatives
