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
   use finshell_reference, only: reference_t, alpha_b, side_from, side_to
   use finshell_voigt, only: row, column
   implicit none
   private
   public :: kink_t, new_kink, add_kink_hessian

   type :: kink_t
      logical :: any !< the reference is curved; else the rest is not set
      real(wp) :: value(lanes, 3) !< addition to a
      real(wp) :: derivative(lanes, 3, 9) !< with respect to midsurface strain and slopes
      real(wp) :: s(lanes, 3) !< J (f_kj - f_ki) of side k
      real(wp) :: ds(lanes, 9, 3)
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
      real(wp) :: f(lanes, 3), df(lanes, 9, 3), dj(lanes, 3)
      integer :: i, k

      call carried_slopes(level, filter, slope, kink)
      call side_forms(level, ref, bend, kink)
      call jacobian_gradient(filter, dj)
      do k = 1, 3
         f(:, k) = kink%s(:, k)/filter%jacobian
         if (level < level_force) cycle
         do i = 1, 9
            df(:, i, k) = kink%ds(:, i, k)/filter%jacobian
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

   !> J |L|^2/c_R f is a form of G_i - g_i and g_i: its matrix K_k, and the derivative of that with respect to beta_k.
   pure subroutine side_matrices(ref, bend, k, matrix, square)
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      integer, intent(in) :: k
      real(wp), intent(out) :: matrix(lanes, 3), square(lanes, 3) !< (11, 22, 12), times c_R/|L|^2
      real(wp) :: w(lanes)
      w = c_r/ref%side2(:, k)
      square(:, 1) = w*ref%side(:, 1, k)**2
      square(:, 2) = w*ref%side(:, 2, k)**2
      square(:, 3) = w*ref%side(:, 1, k)*ref%side(:, 2, k)
      matrix(:, 1) = square(:, 3) + bend%beta(:, k)*square(:, 1)
      matrix(:, 2) = -square(:, 3) + bend%beta(:, k)*square(:, 2)
      matrix(:, 3) = 0.5_wp*(square(:, 2) - square(:, 1)) + bend%beta(:, k)*square(:, 3)
   end subroutine side_matrices

   !> Symmetric matrix (11, 22, 12) times a vector.
   pure function times(m, a) result(b)
      real(wp), intent(in) :: m(lanes, 3), a(lanes, 2)
      real(wp) :: b(lanes, 2)
      b(:, 1) = m(:, 1)*a(:, 1) + m(:, 3)*a(:, 2)
      b(:, 2) = m(:, 3)*a(:, 1) + m(:, 2)*a(:, 2)
   end function times

   pure function dot(a, b) result(s)
      real(wp), intent(in) :: a(lanes, 2), b(lanes, 2)
      real(wp) :: s(lanes)
      s = a(:, 1)*b(:, 1) + a(:, 2)*b(:, 2)
   end function dot

   !> J (f_kj - f_ki) of the sides, and its first derivatives.
   pure subroutine side_forms(level, ref, bend, kink)
      integer, intent(in) :: level
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      type(kink_t), intent(inout) :: kink
      real(wp) :: matrix(lanes, 3), square(lanes, 3), d(lanes, 2), x(lanes, 2), y(lanes, 2), z(lanes)
      integer :: e, i, k, sign, tip
      kink%s = 0
      if (level >= level_force) kink%ds = 0
      do k = 1, 3
         call side_matrices(ref, bend, k, matrix, square)
         do tip = 1, 2
            i = merge(side_from(k), side_to(k), tip == 1)
            sign = 2*tip - 3
            associate (g => kink%g(:, :, i))
               d = bend%g(:, 2*i - 1:2*i) - g
               x = times(matrix, g)
               kink%s(:, k) = kink%s(:, k) + sign*dot(d, x)
               if (level < level_force) cycle
               kink%ds(:, 2 + 2*i, k) = sign*x(:, 1)
               kink%ds(:, 3 + 2*i, k) = sign*x(:, 2)
               y = times(matrix, d - g)
               z = dot(d, times(square, g))
            end associate
            do e = 1, 3
               kink%ds(:, e, k) = kink%ds(:, e, k) + sign*(z*bend%dbeta(:, e, k) + dot(y, kink%dg(:, :, i, e)))
            end do
         end do
      end do
   end subroutine side_forms

   !> Second derivatives of a at fixed work conjugates of a, with respect to midsurface strain and slopes.
   pure subroutine add_kink_hessian(ref, filter, bend, kink, conjugate, h)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      type(bending_t), intent(in) :: bend
      type(kink_t), intent(in) :: kink
      real(wp), intent(in) :: conjugate(lanes, 3)
      real(wp), intent(inout) :: h(lanes, 3, 9) !< rows of the strain, upper triangle: there are none with respect to slopes alone
      real(wp) :: c(lanes, 3), w(lanes), matrix(lanes, 3), square(lanes, 3), d(lanes, 2), t(lanes, 2), y(lanes, 2), z(lanes)
      real(wp) :: sg(lanes, 2), sy(lanes, 2), kg(lanes, 2, 3), r(lanes, 3)
      real(wp) :: s(lanes), ds(lanes, 9), dj(lanes, 3), ddj(lanes, 6), ij(lanes)
      integer :: e, f, i, k, p, tip

      c(:, 1) = conjugate(:, 3)
      c(:, 2) = conjugate(:, 3) - conjugate(:, 2)
      c(:, 3) = conjugate(:, 3) + conjugate(:, 1)
      ij = 1/filter%jacobian
      call jacobian_gradient(filter, dj)
      s = 0
      ds = 0
      do k = 1, 3
         w = c(:, k)*ij
         s = s + w*kink%s(:, k)
         do i = 1, 9
            ds(:, i) = ds(:, i) + w*kink%ds(:, i, k)
         end do
         call side_matrices(ref, bend, k, matrix, square)
         do tip = 1, 2
            i = merge(side_from(k), side_to(k), tip == 1)
            w = -w ! the beginning counts against the end
            d = bend%g(:, 2*i - 1:2*i) - kink%g(:, :, i)
            sg = times(square, kink%g(:, :, i))
            y = d - kink%g(:, :, i)
            sy = times(square, y)
            y = times(matrix, y)
            z = dot(d, sg)
            do e = 1, 3
               r(:, e) = dot(sy, kink%dg(:, :, i, e))
               kg(:, :, e) = times(matrix, kink%dg(:, :, i, e))
               t(:, 1) = w*(sg(:, 1)*bend%dbeta(:, e, k) + kg(:, 1, e))
               t(:, 2) = w*(sg(:, 2)*bend%dbeta(:, e, k) + kg(:, 2, e))
               h(:, e, 2 + 2*i) = h(:, e, 2 + 2*i) + t(:, 1)
               h(:, e, 3 + 2*i) = h(:, e, 3 + 2*i) + t(:, 2)
            end do
            do p = 1, 6
               e = row(p)
               f = column(p)
               h(:, e, f) = h(:, e, f) + w*(z*bend%ddbeta(:, p, k) + r(:, f)*bend%dbeta(:, e, k) + r(:, e)*bend%dbeta(:, f, k) &
                                            + dot(y, kink%ddg(:, :, i, p)) - 2*dot(kg(:, :, e), kink%dg(:, :, i, f)))
            end do
         end do
      end do
      do i = 4, 9
         do e = 1, 3
            h(:, e, i) = h(:, e, i) - ds(:, i)*dj(:, e)*ij
         end do
      end do
      call jacobian_hessian(filter, ddj)
      do p = 1, 6
         e = row(p)
         f = column(p)
         h(:, e, f) = h(:, e, f) - (ds(:, e)*dj(:, f) + ds(:, f)*dj(:, e))*ij + s*(2*dj(:, e)*dj(:, f)*ij - ddj(:, p))*ij
      end do
   end subroutine add_kink_hessian
end module finshell_kink
