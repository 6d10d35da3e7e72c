!> Gradient of the core element: work of the resultants on the first variation of the strains.
!>
!> The resultants are carried back through the fields, from the points to vertices and sides and from there to the nodal slopes,
!> so that no derivative of a field is formed. With R the moments on the gradients of the vertex and side functions, the moments
!> do the work M:T on the curvature, T = sum R (x) (nodal slopes, mid-side excess). As M = I + 1/2 V C^-1, the slope strain
!> V/2 meets the membrane force plus l sym(T C^-1), l the thickness stretch.
module finshell_core_force
   use finshell_kinds, only: wp, lanes
   use finshell_bending, only: bending_t
   use finshell_core_strain, only: n_core, total_drilling_matrix
   use finshell_drilling, only: drilling_t
   use finshell_filter, only: filter_t, jacobian_gradient
   use finshell_kink, only: kink_t
   use finshell_reference, only: reference_t, zeta, n_side
   use finshell_resultants, only: resultants_t
   use finshell_voigt, only: pack
   implicit none
   private
   public :: work_t, new_work, add_slope_force, add_stabilised_force, add_paper_force

   !> Resultants times the area they stand for, carried to where the fields live.
   type :: work_t
      real(wp) :: n(lanes, 3, 3) !< membrane force at the points (component, point); in (S) each has a third of the element's
      real(wp) :: slope_n(lanes, 3, 3) !< what the slope strain meets
      real(wp) :: moment(lanes, 3, 3) !< conjugate to l sym(M grad G) (component, point)
      real(wp) :: vertex(lanes, 2, 3), side(lanes, 2, 3) !< R
      real(wp) :: t(lanes, 2, 2) !< T
      real(wp) :: bending(lanes) !< M:T, conjugate to l
      real(wp) :: arc(lanes, 3) !< (S): Z = C^-1 sym(V T) C^-1: 11, 22, 12
      real(wp) :: beta(lanes, 3) !< conjugate to beta_k p_k
      real(wp) :: drilling(lanes, 3) !< (S): conjugate to the drilling differences
   end type work_t

contains

   !> Carry the resultants of the points to vertices and sides.
   pure subroutine new_work(stabilised, ref, weight, r, bend, l, w)
      logical, intent(in) :: stabilised !< formulation (S), else (P)
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: weight(lanes) !< area of a point
      type(resultants_t), intent(in) :: r
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: l(lanes)
      type(work_t), intent(inout) :: w
      real(wp) :: total(lanes, 3), x(lanes, 2, 2), s(lanes, 3)
      integer :: a, c, i, k, point, v

      do point = 1, 3
         k = lanes*(point - 1)
         do v = 1, 3
            w%n(:, v, point) = weight*r%n(k + 1:k + lanes, v)
            w%moment(:, v, point) = -weight*r%m(k + 1:k + lanes, v)
         end do
      end do
      if (stabilised) then
         do v = 1, 3
            w%n(:, v, 1) = (1.0_wp/3)*(w%n(:, v, 1) + w%n(:, v, 2) + w%n(:, v, 3))
            w%n(:, v, 2) = w%n(:, v, 1)
            w%n(:, v, 3) = w%n(:, v, 1)
         end do
      end if

      do v = 1, 3
         total(:, v) = w%moment(:, v, 1) + w%moment(:, v, 2) + w%moment(:, v, 3)
      end do
      do i = 1, 3
         w%vertex(:, 1, i) = total(:, 1)*ref%gradient(:, 1, i) + total(:, 3)*ref%gradient(:, 2, i)
         w%vertex(:, 2, i) = total(:, 3)*ref%gradient(:, 1, i) + total(:, 2)*ref%gradient(:, 2, i)
         w%side(:, :, i) = 0
         do point = 1, 3
            associate (m => w%moment(:, :, point), b => ref%bubble(:, :, i, point))
               w%side(:, 1, i) = w%side(:, 1, i) + (m(:, 1)*b(:, 1) + m(:, 3)*b(:, 2))
               w%side(:, 2, i) = w%side(:, 2, i) + (m(:, 3)*b(:, 1) + m(:, 2)*b(:, 2))
            end associate
         end do
      end do
      w%bending = 0
      do c = 1, 2
         do a = 1, 2
            w%t(:, a, c) = w%vertex(:, a, 1)*bend%g(:, c) + w%vertex(:, a, 2)*bend%g(:, 2 + c) + w%vertex(:, a, 3)*bend%g(:, 4 + c)
            do k = 1, 3
               w%t(:, a, c) = w%t(:, a, c) + w%side(:, a, k)*(bend%mid(:, c, k)*bend%p(:, k))
            end do
            w%bending = w%bending + bend%m(:, a, c)*w%t(:, a, c)
         end do
      end do
      w%slope_n = w%n
      if (bend%arc) then
         associate (ci => bend%c_inverse, v => bend%v, t => w%t)
            do a = 1, 2
               x(:, a, 1) = t(:, a, 1)*ci(:, 1) + t(:, a, 2)*ci(:, 3)
               x(:, a, 2) = t(:, a, 1)*ci(:, 3) + t(:, a, 2)*ci(:, 2)
            end do
            s(:, 1) = (1.0_wp/3)*l*x(:, 1, 1)
            s(:, 2) = (1.0_wp/3)*l*x(:, 2, 2)
            s(:, 3) = (1.0_wp/6)*l*(x(:, 1, 2) + x(:, 2, 1))
            do point = 1, 3
               w%slope_n(:, :, point) = w%slope_n(:, :, point) + s
            end do
            ! Z = sym(C^-1 V X), as X = T C^-1
            total(:, 1) = v(:, 1)*x(:, 1, 1) + v(:, 3)*x(:, 2, 1)
            total(:, 2) = v(:, 3)*x(:, 1, 2) + v(:, 2)*x(:, 2, 2)
            s(:, 1) = v(:, 1)*x(:, 1, 2) + v(:, 3)*x(:, 2, 2)
            s(:, 2) = v(:, 3)*x(:, 1, 1) + v(:, 2)*x(:, 2, 1)
            w%arc(:, 1) = ci(:, 1)*total(:, 1) + ci(:, 3)*s(:, 2)
            w%arc(:, 2) = ci(:, 3)*s(:, 1) + ci(:, 2)*total(:, 2)
            w%arc(:, 3) = 0.5_wp*(ci(:, 1)*s(:, 1) + ci(:, 3)*(total(:, 1) + total(:, 2)) + ci(:, 2)*s(:, 2))
         end associate
      end if
   end subroutine new_work

   !> Gradient with respect to midsurface strain and slopes, but for what the membrane strain has beside the slopes.
   pure subroutine add_slope_force(stabilised, ref, bend, l, dl, w, gradient)
      logical, intent(in) :: stabilised
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: l(lanes), dl(lanes, 3)
      type(work_t), intent(inout) :: w
      real(wp), intent(inout) :: gradient(lanes, n_core)
      real(wp) :: t(lanes, 2, 3), lm(lanes, 2, 2)
      real(wp), dimension(lanes) :: a1, a2, q, bow
      integer :: c, i, k, node, next, point

      lm(:, 1, 1) = l*bend%m(:, 1, 1)
      lm(:, 2, 1) = l*bend%m(:, 2, 1)
      lm(:, 1, 2) = l*bend%m(:, 1, 2)
      lm(:, 2, 2) = l*bend%m(:, 2, 2)
      do point = 1, 3
         associate (n => w%slope_n(:, :, point), h => bend%slope(:, :, point))
            t(:, 1, point) = n(:, 1)*h(:, 1) + n(:, 3)*h(:, 2)
            t(:, 2, point) = n(:, 3)*h(:, 1) + n(:, 2)*h(:, 2)
         end associate
      end do
      do node = 1, 3
         do c = 1, 2
            i = 1 + 2*node + c
            gradient(:, i) = gradient(:, i) + zeta(node, 1)*t(:, c, 1) + zeta(node, 2)*t(:, c, 2) + zeta(node, 3)*t(:, c, 3) &
               + lm(:, 1, c)*w%vertex(:, 1, node) + lm(:, 2, c)*w%vertex(:, 2, node)
         end do
      end do
      do k = 1, 3
         a1 = n_side(k, 1)*t(:, 1, 1) + n_side(k, 2)*t(:, 1, 2) + n_side(k, 3)*t(:, 1, 3) &
            + lm(:, 1, 1)*w%side(:, 1, k) + lm(:, 2, 1)*w%side(:, 2, k)
         a2 = n_side(k, 1)*t(:, 2, 1) + n_side(k, 2)*t(:, 2, 2) + n_side(k, 3)*t(:, 2, 3) &
            + lm(:, 1, 2)*w%side(:, 1, k) + lm(:, 2, 2)*w%side(:, 2, k)
         q = a1*bend%mid(:, 1, k) + a2*bend%mid(:, 2, k)
         w%beta(:, k) = a1*bend%turned(:, 1, k) + a2*bend%turned(:, 2, k)
         bow = 0
         if (stabilised) then
            do point = 1, 3
               bow = bow - bend%share*(t(:, 1, point)*ref%bubble(:, 1, k, point) + t(:, 2, point)*ref%bubble(:, 2, k, point))
            end do
            bow = ref%bow(:, k)*(bow + 3*(w%slope_n(:, 1, 1)*bend%bow_strain(:, 1, k) &
                                          + w%slope_n(:, 2, 1)*bend%bow_strain(:, 2, k) &
                                          + w%slope_n(:, 3, 1)*bend%bow_strain(:, 3, k)))
         end if
         next = 1 + mod(k, 3)
         do c = 1, 2
            gradient(:, 1 + 2*k + c) = gradient(:, 1 + 2*k + c) + (q + bow)*ref%side(:, c, k)
            gradient(:, 1 + 2*next + c) = gradient(:, 1 + 2*next + c) + (q - bow)*ref%side(:, c, k)
         end do
         a1 = w%beta(:, k)*bend%p(:, k)
         do i = 1, 3
            gradient(:, i) = gradient(:, i) + a1*bend%dbeta(:, i, k)
         end do
      end do
      do i = 1, 3
         gradient(:, i) = gradient(:, i) + w%bending*dl(:, i)
         if (bend%arc) gradient(:, i) = gradient(:, i) - l*w%arc(:, i)
      end do
   end subroutine add_slope_force

   !> Membrane force of (S) on (C - I)/2 and on the drilling strain; K_h tau.
   pure subroutine add_stabilised_force(drill, kh, tau, w, gradient, kink)
      type(drilling_t), intent(in) :: drill
      real(wp), intent(in) :: kh(lanes, 6), tau(lanes, 3)
      type(work_t), intent(inout) :: w
      real(wp), intent(inout) :: gradient(lanes, n_core)
      type(kink_t), intent(in) :: kink
      real(wp) :: n(lanes, 3)
      integer :: i, j
      n = 3*w%n(:, :, 1)
      do i = 1, 3
         gradient(:, i) = gradient(:, i) + n(:, i) &
            + (n(:, 1)*drill%strain_e(:, 1, i) + n(:, 2)*drill%strain_e(:, 2, i) + n(:, 3)*drill%strain_e(:, 3, i))
         gradient(:, 9 + i) = gradient(:, 9 + i) &
            + (kh(:, pack(i, 1))*tau(:, 1) + kh(:, pack(i, 2))*tau(:, 2) + kh(:, pack(i, 3))*tau(:, 3))
      end do
      do i = 1, drill%differences
         w%drilling(:, i) = n(:, 1)*drill%strain_a(:, 1, i) + n(:, 2)*drill%strain_a(:, 2, i) + n(:, 3)*drill%strain_a(:, 3, i)
      end do
      gradient(:, 10) = gradient(:, 10) + w%drilling(:, 1)
      gradient(:, 11) = gradient(:, 11) + w%drilling(:, 2)
      gradient(:, 12) = gradient(:, 12) - w%drilling(:, 1) - w%drilling(:, 2)
      if (.not. kink%any) return
      do i = 1, 9
         do j = 1, 3
            gradient(:, i) = gradient(:, i) + w%drilling(:, j)*kink%derivative(:, j, i)
         end do
      end do
   end subroutine add_stabilised_force

   !> Membrane force of (P) on (C - I)/2 + J B tau.
   pure subroutine add_paper_force(ref, filter, tau, higher, w, gradient)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: tau(lanes, 3), higher(lanes, 3, 3, 3)
      type(work_t), intent(in) :: w
      real(wp), intent(inout) :: gradient(lanes, n_core)
      real(wp) :: b(lanes, 3, 3), dj(lanes, 3), nb(lanes, 3)
      integer :: i, point
      nb = 0
      do point = 1, 3
         call total_drilling_matrix(ref, higher(:, :, :, point), b)
         do i = 1, 3
            nb(:, i) = nb(:, i) + w%n(:, 1, point)*b(:, 1, i) + w%n(:, 2, point)*b(:, 2, i) + w%n(:, 3, point)*b(:, 3, i)
         end do
      end do
      call jacobian_gradient(filter, dj)
      do i = 1, 3
         gradient(:, i) = gradient(:, i) + w%n(:, i, 1) + w%n(:, i, 2) + w%n(:, i, 3) &
            + dj(:, i)*(nb(:, 1)*tau(:, 1) + nb(:, 2)*tau(:, 2) + nb(:, 3)*tau(:, 3))
         gradient(:, 9 + i) = gradient(:, 9 + i) + filter%jacobian*nb(:, i)
      end do
   end subroutine add_paper_force
end module finshell_core_force
