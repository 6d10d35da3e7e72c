!> Drilling of a curved reference: what the slopes of the curved surface add to the bows of the sides.
!>
!> The bow of side k, from node i to node j, is (alpha_b/8)(tau_j - tau_i + f_kj - f_ki) with
!>     f_ki = c_R/(J |L|^2) (G_i - g_i)' K_k g_i,   g_i = U G0_i,   K_k = sym(L (x) L*) + beta_k L (x) L,   L* = (L_2, -L_1),
!> c_R = 2/alpha_b - 1 (theory, S2c): a spin in inextensional bending of a surface with slopes turns the projection of a side. f = 0
!> in the reference, in rigid motion and under every homogeneous stretch. The bows are kept as the three numbers
!> a = (bow_3, -bow_2, bow_1 + bow_2 + bow_3) 8/alpha_b; with f = 0 these are (tau_1 - tau_3, tau_2 - tau_3, 0).
module finshell_kink
   use finshell_kinds, only: wp, lanes
   use finshell_bending, only: bending_t
   use finshell_filter, only: filter_t, jacobian_gradient, jacobian_hessian
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_reference, only: reference_t, alpha_b
   use finshell_voigt, only: row, column
   implicit none
   private
   public :: kink_t, new_kink, add_kink_hessian

   type :: kink_t
      logical :: any !< the reference is curved; else the rest is not set
      real(wp) :: value(lanes, 3) !< addition to a
      real(wp) :: derivative(lanes, 3, 9) !< with respect to midsurface strain and slopes
      real(wp) :: g(lanes, 2, 3) !< g_i
      real(wp) :: dg(lanes, 2, 3, 3) !< of g_i (component, node, strain)
      real(wp) :: ddg(lanes, 2, 3, 6)
   end type kink_t

   real(wp), parameter :: c_r = 2/alpha_b - 1

contains

   !> Values, first derivatives, and what the second derivatives need.
   pure subroutine new_kink(level, ref, filter, bend, slope, kink)
      integer, intent(in) :: level
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: slope(lanes, 6) !< G0_i
      type(kink_t), intent(inout) :: kink
      real(wp) :: c(lanes, 3), s(lanes), ds(lanes, 9), f(lanes, 3), df(lanes, 9, 3), dj(lanes, 3)
      integer :: i, k

      call carried_slopes(level, filter, slope, kink)
      call jacobian_gradient(filter, dj)
      do k = 1, 3
         c = 0
         c(:, k) = 1
         call bilinear(level, ref, bend, kink, c, s, ds)
         f(:, k) = s/filter%jacobian
         if (level < level_force) cycle
         do i = 1, 9
            df(:, i, k) = ds(:, i)/filter%jacobian
         end do
         do i = 1, 3
            df(:, i, k) = df(:, i, k) - f(:, k)*dj(:, i)/filter%jacobian
         end do
      end do
      kink%value(:, 1) = f(:, 3)
      kink%value(:, 2) = -f(:, 2)
      kink%value(:, 3) = f(:, 1) + f(:, 2) + f(:, 3)
      if (level < level_force) return
      do i = 1, 9
         kink%derivative(:, 1, i) = df(:, i, 3)
         kink%derivative(:, 2, i) = -df(:, i, 2)
         kink%derivative(:, 3, i) = df(:, i, 1) + df(:, i, 2) + df(:, i, 3)
      end do
   end subroutine new_kink

   !> g_i = U G0_i with its derivatives: U = (C + J I)/t, t = sqrt(tr C + 2 J).
   pure subroutine carried_slopes(level, filter, slope, kink)
      integer, intent(in) :: level
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: slope(lanes, 6)
      type(kink_t), intent(inout) :: kink
      real(wp) :: u(lanes, 3), n(lanes, 3, 3), dj(lanes, 3), ddj(lanes, 6), dt(lanes, 3), ddt(lanes, 6)
      real(wp) :: du(lanes, 3, 3), ddu(lanes, 3)
      real(wp) :: it(lanes)
      integer :: i, j, p, v

      call apply(filter%u, kink%g)
      if (level < level_force) return
      it = 1/filter%trace_u
      u = filter%u
      call jacobian_gradient(filter, dj)
      ! t dt = (tr dC + 2 dJ)/2; n: derivative of C + J I
      n = 0
      do i = 1, 3
         dt(:, i) = it*(merge(1, 0, i < 3) + dj(:, i))
         n(:, 1, i) = dj(:, i)
         n(:, 2, i) = dj(:, i)
      end do
      n(:, 1, 1) = n(:, 1, 1) + 2
      n(:, 2, 2) = n(:, 2, 2) + 2
      n(:, 3, 3) = 1
      do i = 1, 3
         do v = 1, 3
            du(:, v, i) = it*(n(:, v, i) - u(:, v)*dt(:, i))
         end do
         call apply(du(:, :, i), kink%dg(:, :, :, i))
      end do
      if (level < level_tangent) return
      call jacobian_hessian(filter, ddj)
      do p = 1, 6
         i = row(p)
         j = column(p)
         ddt(:, p) = it*(ddj(:, p) - dt(:, i)*dt(:, j))
         do v = 1, 3
            ddu(:, v) = -it*(du(:, v, i)*dt(:, j) + du(:, v, j)*dt(:, i) + u(:, v)*ddt(:, p))
            if (v < 3) ddu(:, v) = ddu(:, v) + it*ddj(:, p)
         end do
         call apply(ddu, kink%ddg(:, :, :, p))
      end do

   contains

      !> Symmetric matrix (11, 22, 12) times G0_i.
      pure subroutine apply(m, g)
         real(wp), intent(in) :: m(lanes, 3)
         real(wp), intent(out) :: g(lanes, 2, 3)
         integer :: k
         do k = 1, 3
            g(:, 1, k) = m(:, 1)*slope(:, 2*k - 1) + m(:, 3)*slope(:, 2*k)
            g(:, 2, k) = m(:, 3)*slope(:, 2*k - 1) + m(:, 2)*slope(:, 2*k)
         end do
      end subroutine apply
   end subroutine carried_slopes

   !> K_i of the nodes for weights c of the sides, and its derivatives.
   pure subroutine node_matrices(level, ref, bend, c, m, dm, ddm)
      integer, intent(in) :: level
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: c(lanes, 3)
      real(wp), intent(out) :: m(lanes, 3, 3) !< (11, 22, 12; node)
      real(wp), intent(out) :: dm(lanes, 3, 3, 3) !< (component, node, strain)
      real(wp), intent(out), optional :: ddm(lanes, 3, 3, 6)
      real(wp) :: w(lanes), square(lanes, 3), side(lanes, 3)
      integer :: i, k, n, next, v
      m = 0
      dm = 0
      if (present(ddm)) ddm = 0
      do k = 1, 3
         next = 1 + mod(k, 3)
         w = c_r*c(:, k)/ref%side2(:, k)
         square(:, 1) = w*ref%side(:, 1, k)**2
         square(:, 2) = w*ref%side(:, 2, k)**2
         square(:, 3) = w*ref%side(:, 1, k)*ref%side(:, 2, k)
         side(:, 1) = square(:, 3) + bend%beta(:, k)*square(:, 1)
         side(:, 2) = -square(:, 3) + bend%beta(:, k)*square(:, 2)
         side(:, 3) = 0.5_wp*(square(:, 2) - square(:, 1)) + bend%beta(:, k)*square(:, 3)
         do v = 1, 3
            m(:, v, k) = m(:, v, k) - side(:, v)
            m(:, v, next) = m(:, v, next) + side(:, v)
            if (level < level_force) cycle
            do i = 1, 3
               dm(:, v, k, i) = dm(:, v, k, i) - square(:, v)*bend%dbeta(:, i, k)
               dm(:, v, next, i) = dm(:, v, next, i) + square(:, v)*bend%dbeta(:, i, k)
            end do
            if (.not. present(ddm)) cycle
            do n = 1, 6
               ddm(:, v, k, n) = ddm(:, v, k, n) - square(:, v)*bend%ddbeta(:, n, k)
               ddm(:, v, next, n) = ddm(:, v, next, n) + square(:, v)*bend%ddbeta(:, n, k)
            end do
         end do
      end do
   end subroutine node_matrices

   !> a' m b for a symmetric matrix (11, 22, 12).
   pure function product(a, m, b) result(s)
      real(wp), intent(in) :: a(lanes, 2), m(lanes, 3), b(lanes, 2)
      real(wp) :: s(lanes)
      s = a(:, 1)*(m(:, 1)*b(:, 1) + m(:, 3)*b(:, 2)) + a(:, 2)*(m(:, 3)*b(:, 1) + m(:, 2)*b(:, 2))
   end function product

   !> s = sum of c J f over the sides, and its first derivatives.
   pure subroutine bilinear(level, ref, bend, kink, c, s, ds)
      integer, intent(in) :: level
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      type(kink_t), intent(in) :: kink
      real(wp), intent(in) :: c(lanes, 3)
      real(wp), intent(out) :: s(lanes), ds(lanes, 9)
      real(wp) :: m(lanes, 3, 3), dm(lanes, 3, 3, 3), d(lanes, 2)
      integer :: e, i
      call node_matrices(level, ref, bend, c, m, dm)
      s = 0
      ds = 0
      do i = 1, 3
         d = bend%g(:, 2*i - 1:2*i) - kink%g(:, :, i)
         s = s + product(d, m(:, :, i), kink%g(:, :, i))
         if (level < level_force) cycle
         ds(:, 2 + 2*i) = m(:, 1, i)*kink%g(:, 1, i) + m(:, 3, i)*kink%g(:, 2, i)
         ds(:, 3 + 2*i) = m(:, 3, i)*kink%g(:, 1, i) + m(:, 2, i)*kink%g(:, 2, i)
         do e = 1, 3
            ds(:, e) = ds(:, e) + product(d, dm(:, :, i, e), kink%g(:, :, i)) &
               + product(d - kink%g(:, :, i), m(:, :, i), kink%dg(:, :, i, e))
         end do
      end do
   end subroutine bilinear

   !> Second derivatives of a at fixed work conjugates of a, with respect to midsurface strain and slopes.
   pure subroutine add_kink_hessian(ref, filter, bend, kink, conjugate, h)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      type(bending_t), intent(in) :: bend
      type(kink_t), intent(in) :: kink
      real(wp), intent(in) :: conjugate(lanes, 3)
      real(wp), intent(inout) :: h(lanes, 9, 9) !< upper triangle
      real(wp) :: c(lanes, 3), m(lanes, 3, 3), dm(lanes, 3, 3, 3), ddm(lanes, 3, 3, 6), d(lanes, 2), t(lanes, 2)
      real(wp) :: s(lanes), ds(lanes, 9), dj(lanes, 3), ddj(lanes, 6), ij(lanes)
      integer :: e, f, i, p

      c(:, 1) = conjugate(:, 3)
      c(:, 2) = conjugate(:, 3) - conjugate(:, 2)
      c(:, 3) = conjugate(:, 3) + conjugate(:, 1)
      ij = 1/filter%jacobian
      do i = 1, 3
         c(:, i) = c(:, i)*ij
      end do
      call jacobian_gradient(filter, dj)
      call bilinear(level_tangent, ref, bend, kink, c, s, ds)
      call node_matrices(level_tangent, ref, bend, c, m, dm, ddm)
      do i = 1, 3
         associate (g => kink%g(:, :, i))
            d = bend%g(:, 2*i - 1:2*i) - g
            do p = 1, 6
               e = row(p)
               f = column(p)
               h(:, e, f) = h(:, e, f) + product(d, ddm(:, :, i, p), g) + product(d - g, dm(:, :, i, e), kink%dg(:, :, i, f)) &
                  + product(d - g, dm(:, :, i, f), kink%dg(:, :, i, e)) + product(d - g, m(:, :, i), kink%ddg(:, :, i, p)) &
                  - 2*product(kink%dg(:, :, i, e), m(:, :, i), kink%dg(:, :, i, f))
            end do
            do e = 1, 3
               associate (dg => kink%dg(:, :, i, e), k => m(:, :, i), dk => dm(:, :, i, e))
                  t(:, 1) = dk(:, 1)*g(:, 1) + dk(:, 3)*g(:, 2) + k(:, 1)*dg(:, 1) + k(:, 3)*dg(:, 2)
                  t(:, 2) = dk(:, 3)*g(:, 1) + dk(:, 2)*g(:, 2) + k(:, 3)*dg(:, 1) + k(:, 2)*dg(:, 2)
               end associate
               h(:, e, 2 + 2*i) = h(:, e, 2 + 2*i) + t(:, 1) - ds(:, 2 + 2*i)*dj(:, e)*ij
               h(:, e, 3 + 2*i) = h(:, e, 3 + 2*i) + t(:, 2) - ds(:, 3 + 2*i)*dj(:, e)*ij
            end do
         end associate
      end do
      call jacobian_hessian(filter, ddj)
      do p = 1, 6
         e = row(p)
         f = column(p)
         h(:, e, f) = h(:, e, f) - (ds(:, e)*dj(:, f) + ds(:, f)*dj(:, e))*ij + s*(2*dj(:, e)*dj(:, f)*ij - ddj(:, p))*ij
      end do
   end subroutine add_kink_hessian
end module finshell_kink
