!> Discrete-Kirchhoff bending of the deformed triangle, pulled back to the reference (theory: G, V and M).
!>
!> The covariant slope field G is quadratic: nodal values G_i and mid-side values 1/2 (G_i + G_j) - 3/4 m_k p_k with
!> p_k = L_k.(G_i + G_j) and m_k = C L_k/(L_k.C L_k) = (L_k + beta_k L_k^)/|L_k|^2, where L^ is L turned by 90 degrees. So the
!> deformation enters through one scalar per side, beta_k(C) = (L^.C L)/(L.C L). This is Batoz, Bathe & Ho's DKT on the
!> intermediate triangle, exactly. Nodal slopes are ordered G = (G_11, G_12, G_21, G_22, G_31, G_32).
!>
!> The slope strain of (S) is 1/2 V, V = <H (x) H> + 3/4 <G_b (x) G_b>, with the gradient G_b = sum w_k grad N_k of the side bubbles
!> w_k = L_k.(G_i - G_j)/8 and H = G - G_b/2: the cross term of G_b and the rest of G counts half, which keeps flat sheets in
!> tension stable on any mesh. G_b does not depend on C, and does not count sides that supports hold in place. In (P) H = G.
!>
!> The curvature is sym(M grad G), M = I + 1/2 V C^-1: slopes are covariant with the chord of an arc, its tangent is longer.
module finshell_bending
   use finshell_kinds, only: wp, lanes
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_reference, only: reference_t, side_from, side_to, zeta, n_side
   use finshell_section, only: section_t, formulation_s
   use finshell_voigt, only: pack
   implicit none
   private
   public :: bending_t, new_bending

   type :: bending_t
      logical :: arc !< M differs from I
      real(wp) :: share !< of G_b in H: G - share G_b
      real(wp) :: g(lanes, 6) !< nodal slopes
      real(wp) :: p(lanes, 3) !< p_k of each side
      real(wp) :: beta(lanes, 3) !< beta_k
      real(wp) :: dbeta(lanes, 3, 3), ddbeta(lanes, 6, 3) !< with respect to the midsurface strain (strain, side)
      real(wp) :: mid(lanes, 2, 3) !< -3/4 m_k: mid-side excess of G per unit p_k
      real(wp) :: turned(lanes, 2, 3) !< its derivative with respect to beta_k
      real(wp) :: bow(lanes, 3) !< w_k
      real(wp) :: bow_strain(lanes, 3, 3) !< (S): 3/4 <grad N_k (x) grad N_l> w_l of each side (component, side)
      real(wp) :: slope(lanes, 2, 3) !< H at the in-plane points
      real(wp) :: gradient(lanes, 2, 2, 3) !< dG_c/dX_b (c, b, point)
      real(wp) :: c_inverse(lanes, 3) !< C^-1: 11, 22, 12
      real(wp) :: v(lanes, 3) !< V: 11, 22, 12
      real(wp) :: m(lanes, 2, 2) !< M
      real(wp) :: curvature(lanes, 3, 3) !< sym(M grad G), Voigt, at the in-plane points
   end type bending_t

contains

   !> Slopes, slope strain and curvatures of a block of elements.
   pure subroutine new_bending(section, level, ref, c, jacobian, g, b)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: c(lanes, 3) !< C11, C22, C12
      real(wp), intent(in) :: jacobian(lanes) !< sqrt(det C)
      real(wp), intent(in) :: g(lanes, 6) !< nodal slopes
      type(bending_t), intent(inout) :: b
      real(wp), dimension(lanes) :: inverse
      real(wp) :: vertex(lanes, 2, 2)
      integer :: a, i, k, point

      b%arc = section%formulation == formulation_s .and. section%arc
      b%share = merge(0.5_wp, 0.0_wp, section%formulation == formulation_s)
      b%g = g
      call side_slopes(level, ref, c, b)
      do point = 1, 3
         do a = 1, 2
            b%slope(:, a, point) = zeta(1, point)*g(:, a) + zeta(2, point)*g(:, 2 + a) + zeta(3, point)*g(:, 4 + a)
            do k = 1, 3
               b%slope(:, a, point) = b%slope(:, a, point) + n_side(k, point)*(b%mid(:, a, k)*b%p(:, k)) &
                  - b%share*(b%bow(:, k)*ref%bubble(:, a, k, point))
            end do
         end do
      end do
      do i = 1, 2
         do a = 1, 2
            vertex(:, a, i) = ref%gradient(:, i, 1)*g(:, a) + ref%gradient(:, i, 2)*g(:, 2 + a) + ref%gradient(:, i, 3)*g(:, 4 + a)
            do point = 1, 3
               b%gradient(:, a, i, point) = vertex(:, a, i) + (b%mid(:, a, 1)*b%p(:, 1))*ref%bubble(:, i, 1, point) &
                  + (b%mid(:, a, 2)*b%p(:, 2))*ref%bubble(:, i, 2, point) + (b%mid(:, a, 3)*b%p(:, 3))*ref%bubble(:, i, 3, point)
            end do
         end do
      end do
      if (section%formulation == formulation_s) then
         call slope_strain(ref, b)
         if (level >= level_force) call bow_strain(ref, b)
      end if

      b%m = 0
      b%m(:, 1, 1) = 1
      b%m(:, 2, 2) = 1
      if (b%arc) then
         inverse = 1/jacobian**2
         b%c_inverse(:, 1) = c(:, 2)*inverse
         b%c_inverse(:, 2) = c(:, 1)*inverse
         b%c_inverse(:, 3) = -c(:, 3)*inverse
         b%m(:, 1, 1) = 1 + 0.5_wp*(b%v(:, 1)*b%c_inverse(:, 1) + b%v(:, 3)*b%c_inverse(:, 3))
         b%m(:, 1, 2) = 0.5_wp*(b%v(:, 1)*b%c_inverse(:, 3) + b%v(:, 3)*b%c_inverse(:, 2))
         b%m(:, 2, 1) = 0.5_wp*(b%v(:, 3)*b%c_inverse(:, 1) + b%v(:, 2)*b%c_inverse(:, 3))
         b%m(:, 2, 2) = 1 + 0.5_wp*(b%v(:, 3)*b%c_inverse(:, 3) + b%v(:, 2)*b%c_inverse(:, 2))
      end if
      do point = 1, 3
         associate (d => b%gradient(:, :, :, point))
            b%curvature(:, 1, point) = b%m(:, 1, 1)*d(:, 1, 1) + b%m(:, 1, 2)*d(:, 2, 1)
            b%curvature(:, 2, point) = b%m(:, 2, 1)*d(:, 1, 2) + b%m(:, 2, 2)*d(:, 2, 2)
            b%curvature(:, 3, point) = b%m(:, 1, 1)*d(:, 1, 2) + b%m(:, 1, 2)*d(:, 2, 2) &
               + b%m(:, 2, 1)*d(:, 1, 1) + b%m(:, 2, 2)*d(:, 2, 1)
         end associate
      end do
   end subroutine new_bending

   !> What the sides alone decide: p_k, w_k, m_k and its derivatives.
   pure subroutine side_slopes(level, ref, c, b)
      integer, intent(in) :: level
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: c(lanes, 3)
      type(bending_t), intent(inout) :: b
      real(wp), dimension(lanes) :: inverse, l1, l2, stretch2
      real(wp) :: dl(lanes, 3)
      integer :: i, j, k
      do k = 1, 3
         i = 2*side_from(k)
         j = 2*side_to(k)
         l1 = ref%side(:, 1, k)
         l2 = ref%side(:, 2, k)
         b%p(:, k) = l1*(b%g(:, i - 1) + b%g(:, j - 1)) + l2*(b%g(:, i) + b%g(:, j))
         b%bow(:, k) = ref%bow(:, k)*(l1*(b%g(:, i - 1) - b%g(:, j - 1)) + l2*(b%g(:, i) - b%g(:, j)))
         stretch2 = c(:, 1)*l1*l1 + 2*c(:, 3)*l1*l2 + c(:, 2)*l2*l2
         inverse = 1/stretch2
         b%beta(:, k) = ((c(:, 2) - c(:, 1))*l1*l2 + c(:, 3)*(l1*l1 - l2*l2))*inverse
         if (level >= level_force) then
            dl(:, 1) = 2*l1*l1*inverse
            dl(:, 2) = 2*l2*l2*inverse
            dl(:, 3) = 2*l1*l2*inverse
            b%dbeta(:, 1, k) = -2*l1*l2*inverse - b%beta(:, k)*dl(:, 1)
            b%dbeta(:, 2, k) = 2*l1*l2*inverse - b%beta(:, k)*dl(:, 2)
            b%dbeta(:, 3, k) = (l1*l1 - l2*l2)*inverse - b%beta(:, k)*dl(:, 3)
         end if
         if (level >= level_tangent) then
            b%ddbeta(:, 1, k) = -2*b%dbeta(:, 1, k)*dl(:, 1)
            b%ddbeta(:, 2, k) = -2*b%dbeta(:, 2, k)*dl(:, 2)
            b%ddbeta(:, 3, k) = -2*b%dbeta(:, 3, k)*dl(:, 3)
            b%ddbeta(:, 4, k) = -b%dbeta(:, 1, k)*dl(:, 2) - b%dbeta(:, 2, k)*dl(:, 1)
            b%ddbeta(:, 5, k) = -b%dbeta(:, 1, k)*dl(:, 3) - b%dbeta(:, 3, k)*dl(:, 1)
            b%ddbeta(:, 6, k) = -b%dbeta(:, 2, k)*dl(:, 3) - b%dbeta(:, 3, k)*dl(:, 2)
         end if
         inverse = -0.75_wp/ref%side2(:, k)
         b%turned(:, 1, k) = -l2*inverse
         b%turned(:, 2, k) = l1*inverse
         b%mid(:, 1, k) = (l1 - b%beta(:, k)*l2)*inverse
         b%mid(:, 2, k) = (l2 + b%beta(:, k)*l1)*inverse
      end do
   end subroutine side_slopes

   !> V = <H (x) H> + 3/4 <G_b (x) G_b>.
   pure subroutine slope_strain(ref, b)
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(inout) :: b
      real(wp), parameter :: third = 1.0_wp/3
      real(wp) :: ww(lanes, 6)
      integer :: v
      do v = 1, 3
         ww(:, v) = 0.75_wp*b%bow(:, v)**2
      end do
      ww(:, 4) = 1.5_wp*b%bow(:, 1)*b%bow(:, 2)
      ww(:, 5) = 1.5_wp*b%bow(:, 1)*b%bow(:, 3)
      ww(:, 6) = 1.5_wp*b%bow(:, 2)*b%bow(:, 3)
      do v = 1, 3
         b%v(:, v) = ref%bubble_mean(:, v, 1)*ww(:, 1) + ref%bubble_mean(:, v, 2)*ww(:, 2) + ref%bubble_mean(:, v, 3)*ww(:, 3) &
            + ref%bubble_mean(:, v, 4)*ww(:, 4) + ref%bubble_mean(:, v, 5)*ww(:, 5) + ref%bubble_mean(:, v, 6)*ww(:, 6)
      end do
      associate (h => b%slope)
         b%v(:, 1) = b%v(:, 1) + third*(h(:, 1, 1)**2 + h(:, 1, 2)**2 + h(:, 1, 3)**2)
         b%v(:, 2) = b%v(:, 2) + third*(h(:, 2, 1)**2 + h(:, 2, 2)**2 + h(:, 2, 3)**2)
         b%v(:, 3) = 0.5_wp*b%v(:, 3) + third*(h(:, 1, 1)*h(:, 2, 1) + h(:, 1, 2)*h(:, 2, 2) + h(:, 1, 3)*h(:, 2, 3))
      end associate
   end subroutine slope_strain

   !> What the bows of the sides add to half the derivative of V with respect to w_k.
   pure subroutine bow_strain(ref, b)
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(inout) :: b
      integer :: k, v
      do k = 1, 3
         do v = 1, 3
            b%bow_strain(:, v, k) = 0.75_wp*(ref%bubble_mean(:, v, pack(1, k))*b%bow(:, 1) &
                                             + ref%bubble_mean(:, v, pack(2, k))*b%bow(:, 2) &
                                             + ref%bubble_mean(:, v, pack(3, k))*b%bow(:, 3))
         end do
      end do
   end subroutine bow_strain
end module finshell_bending
