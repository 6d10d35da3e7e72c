!> Discrete-Kirchhoff bending of the deformed triangle, pulled back to the reference (theory: G and its gradient).
!>
!> The covariant slope field G is quadratic: nodal values G_i and mid-side values 1/2 (G_i + G_j) - 3/4 m_k p_k with
!> p_k = L_k.(G_i + G_j) and m_k = C L_k/(L_k.C L_k) = (L_k + beta_k L_k^)/|L_k|^2, where L^ is L turned by 90 degrees. So the
!> deformation enters through one scalar per side, beta_k(C) = (L^.C L)/(L.C L). This is Batoz, Bathe & Ho's DKT on the
!> intermediate triangle, exactly. Nodal slopes are ordered G = (G_11, G_12, G_21, G_22, G_31, G_32).
module finshell_bending
   use finshell_kinds, only: wp, lanes
   use finshell_material, only: level_force, level_tangent
   use finshell_reference, only: reference_t, side_from, side_to, zeta
   implicit none
   private
   public :: bending_t, new_bending

   type :: bending_t
      real(wp) :: p(lanes, 3) !< p_k of each side
      real(wp) :: beta(lanes, 3), dbeta(lanes, 3, 3), ddbeta(lanes, 6, 3) !< beta_k; with respect to the midsurface strain
      real(wp) :: slope(lanes, 2, 3) !< G at the in-plane points
      real(wp) :: slope_g(lanes, 2, 3, 6) !< dG/dG_i (component, point, nodal slope)
      real(wp) :: slope_e(lanes, 2, 3, 3) !< dG/d(midsurface strain) (component, point, strain)
      real(wp) :: slope_side(lanes, 2, 3, 3) !< dG/d(beta_k p_k) (component, side, point)
      real(wp) :: curvature(lanes, 3, 3) !< sym grad G, Voigt, at the in-plane points
      real(wp) :: curvature_g(lanes, 3, 6, 3)
      real(wp) :: curvature_e(lanes, 3, 3, 3)
      real(wp) :: curvature_side(lanes, 3, 3, 3)
   end type bending_t

contains

   !> Slopes and curvatures of a block of elements with their first derivatives.
   pure subroutine new_bending(level, ref, c, g, b)
      integer, intent(in) :: level
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: c(lanes, 3) !< C11, C22, C12
      real(wp), intent(in) :: g(lanes, 6) !< nodal slopes
      type(bending_t), intent(out) :: b
      real(wp), dimension(lanes) :: inverse, l1, l2, stretch2
      real(wp) :: m(lanes, 2, 3), t(lanes, 3, 3), dl(lanes, 3), turned(lanes, 2, 3)
      real(wp) :: dp(lanes, 3, 3) !< p_k times derivatives of beta_k (strain, side)
      real(wp) :: n_side, n_before
      integer :: a, i, j, k, l, point, v

      do k = 1, 3
         i = 2*side_from(k)
         j = 2*side_to(k)
         l1 = ref%side(:, 1, k)
         l2 = ref%side(:, 2, k)
         b%p(:, k) = l1*(g(:, i - 1) + g(:, j - 1)) + l2*(g(:, i) + g(:, j))
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
            do v = 1, 3
               dp(:, v, k) = b%p(:, k)*b%dbeta(:, v, k)
            end do
         end if
         if (level >= level_tangent) then
            b%ddbeta(:, 1, k) = -2*b%dbeta(:, 1, k)*dl(:, 1)
            b%ddbeta(:, 2, k) = -2*b%dbeta(:, 2, k)*dl(:, 2)
            b%ddbeta(:, 3, k) = -2*b%dbeta(:, 3, k)*dl(:, 3)
            b%ddbeta(:, 4, k) = -b%dbeta(:, 1, k)*dl(:, 2) - b%dbeta(:, 2, k)*dl(:, 1)
            b%ddbeta(:, 5, k) = -b%dbeta(:, 1, k)*dl(:, 3) - b%dbeta(:, 3, k)*dl(:, 1)
            b%ddbeta(:, 6, k) = -b%dbeta(:, 2, k)*dl(:, 3) - b%dbeta(:, 3, k)*dl(:, 2)
         end if
         inverse = 1/ref%side2(:, k)
         turned(:, 1, k) = -0.75_wp*(-l2*inverse)
         turned(:, 2, k) = -0.75_wp*(l1*inverse)
         m(:, 1, k) = -0.75_wp*((l1 - b%beta(:, k)*l2)*inverse)
         m(:, 2, k) = -0.75_wp*((l2 + b%beta(:, k)*l1)*inverse)
      end do

      do point = 1, 3
         do k = 1, 3
            ! -3/4 sym(m (x) grad N) and -3/4 N m: what a unit p_k does; `turned` the same for a unit beta_k p_k
            n_side = 4*zeta(side_from(k), point)*zeta(side_to(k), point)
            t(:, 1, k) = m(:, 1, k)*ref%bubble(:, 1, k, point)
            t(:, 2, k) = m(:, 2, k)*ref%bubble(:, 2, k, point)
            t(:, 3, k) = m(:, 1, k)*ref%bubble(:, 2, k, point) + m(:, 2, k)*ref%bubble(:, 1, k, point)
            b%curvature_side(:, 1, k, point) = turned(:, 1, k)*ref%bubble(:, 1, k, point)
            b%curvature_side(:, 2, k, point) = turned(:, 2, k)*ref%bubble(:, 2, k, point)
            b%curvature_side(:, 3, k, point) = turned(:, 1, k)*ref%bubble(:, 2, k, point) &
               + turned(:, 2, k)*ref%bubble(:, 1, k, point)
            b%slope_side(:, 1, k, point) = n_side*turned(:, 1, k)
            b%slope_side(:, 2, k, point) = n_side*turned(:, 2, k)
         end do
         do i = 1, 3
            ! node i begins side i and ends the side before it
            k = i
            j = side_to(side_to(i))
            n_side = 4*zeta(side_from(k), point)*zeta(side_to(k), point)
            n_before = 4*zeta(side_from(j), point)*zeta(side_to(j), point)
            do a = 1, 2
               l = 2*(i - 1) + a
               do v = 1, 3
                  b%curvature_g(:, v, l, point) = t(:, v, k)*ref%side(:, a, k) + t(:, v, j)*ref%side(:, a, j)
               end do
               b%curvature_g(:, a, l, point) = b%curvature_g(:, a, l, point) + ref%gradient(:, a, i)
               b%curvature_g(:, 3, l, point) = b%curvature_g(:, 3, l, point) + ref%gradient(:, 3 - a, i)
               do v = 1, 2
                  b%slope_g(:, v, point, l) = n_side*m(:, v, k)*ref%side(:, a, k) + n_before*m(:, v, j)*ref%side(:, a, j)
               end do
               b%slope_g(:, a, point, l) = b%slope_g(:, a, point, l) + zeta(i, point)
            end do
         end do
         do v = 1, 3
            b%curvature(:, v, point) = b%curvature_g(:, v, 1, point)*g(:, 1) + b%curvature_g(:, v, 2, point)*g(:, 2) &
               + b%curvature_g(:, v, 3, point)*g(:, 3) + b%curvature_g(:, v, 4, point)*g(:, 4) &
               + b%curvature_g(:, v, 5, point)*g(:, 5) + b%curvature_g(:, v, 6, point)*g(:, 6)
         end do
         do v = 1, 2
            b%slope(:, v, point) = b%slope_g(:, v, point, 1)*g(:, 1) + b%slope_g(:, v, point, 2)*g(:, 2) &
               + b%slope_g(:, v, point, 3)*g(:, 3) + b%slope_g(:, v, point, 4)*g(:, 4) &
               + b%slope_g(:, v, point, 5)*g(:, 5) + b%slope_g(:, v, point, 6)*g(:, 6)
         end do
         if (level < level_force) cycle
         do a = 1, 3
            do v = 1, 3
               b%curvature_e(:, v, a, point) = b%curvature_side(:, v, 1, point)*dp(:, a, 1) &
                  + b%curvature_side(:, v, 2, point)*dp(:, a, 2) + b%curvature_side(:, v, 3, point)*dp(:, a, 3)
            end do
            do v = 1, 2
               b%slope_e(:, v, point, a) = b%slope_side(:, v, 1, point)*dp(:, a, 1) &
                  + b%slope_side(:, v, 2, point)*dp(:, a, 2) + b%slope_side(:, v, 3, point)*dp(:, a, 3)
            end do
         end do
      end do
   end subroutine new_bending
end module finshell_bending
