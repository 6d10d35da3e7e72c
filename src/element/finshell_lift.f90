!> From the core variables to nodal forces and the consistent tangent, the variation of the filter included exactly.
!>
!> Intermediate variations, components in the corotated frame: y = (df_1, df_2) of the midsurface gradient and the nodal
!> spins w_i. With U the in-plane stretch, t = tr U, phi = (psi_2, -psi_1):
!>   spin of the frame:    psi_3 = (df_12 - df_21)/t,   U phi = -(df_13, df_23)
!>   filtered rotations:   dtheta_i = H_i x_i,   x_i = w_i - psi,   H = T^-1(theta_i)
!>   stretch:              dU_11 = df_11 + psi_3 U_12,  dU_22 = df_22 - psi_3 U_12,  dU_12 = df_21 + psi_3 U_22
!> Second variations are taken along straight nodal paths and w_i = const (R_i <- exp(s w_i) R_i), so the tangent with
!> respect to spins is symmetric: the symmetric part of the textbook one (theory A5), from which it differs only by
!> out-of-balance moments. For total rotation vectors it is the exact Hessian.
module finshell_lift
   use finshell_kinds, only: wp, lanes, rows_3
   use finshell_freedoms, only: n_nodal, n_shell, uz
   use finshell_core, only: core_t, n_core
   use finshell_filter, only: filter_t
   use finshell_lift_geometric, only: geometric_part, n_lift, rows_6, rows_15
   use finshell_evaluation, only: level_tangent
   use finshell_reference, only: reference_t
   implicit none
   private
   public :: lift, core_variation

contains

   !> Nodal force and tangent, dofs (displacement, rotation) of each node in turn, global components.
   pure subroutine lift(level, ref, filter, core, node_frame, force, moment, tangent)
      integer, intent(in) :: level
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      type(core_t), intent(in) :: core
      !> Columns: the corotated axes (0), and per node these as seen by the rotational dofs (filter%rotation for spins, T' times
      !> it for total rotation vectors).
      real(wp), intent(in) :: node_frame(lanes, rows_3, 3, 0:3)
      real(wp), intent(inout) :: force(lanes, n_shell)
      real(wp), intent(inout) :: moment(lanes, 3, 3) !< nodal moments conjugate to spins (global component, node)
      real(wp), intent(inout) :: tangent(lanes, n_shell, n_shell)
      real(wp) :: h(lanes, rows_3, 3, 3) !< H_i (column, row, node)
      real(wp) :: a(lanes, rows_3, 3, 3) !< d(tau_i, G_i1, G_i2)/dx_i (column, row, node)
      real(wp) :: lf(lanes, rows_6, n_core) !< d(core)/dy (column, row)
      real(wp) :: f(lanes, rows_15), k(lanes, rows_15, n_lift)

      call inverse_tangents(filter, h)
      call first_variation(filter, h, a, lf)
      call intermediate_force(core%gradient, a, lf, f)
      call expand_force(ref, node_frame, f, force, moment)
      if (level < level_tangent) return
      call material_part(core%hessian, a, lf, k)
      call intermediate_force(core%geometric_gradient, a, lf, f)
      call geometric_part(filter, core%geometric_gradient, h, f, k)
      call expand_tangent(ref, node_frame, k, tangent)
   end subroutine lift

   !> Variation of the core variables for given nodal displacements and spins (global components).
   pure subroutine core_variation(ref, filter, increment, variation)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: increment(lanes, n_shell)
      real(wp), intent(out) :: variation(lanes, n_core)
      real(wp) :: h(lanes, rows_3, 3, 3), a(lanes, rows_3, 3, 3), lf(lanes, rows_6, n_core), y(lanes, n_lift)
      integer :: c, i, m, v
      call inverse_tangents(filter, h)
      call first_variation(filter, h, a, lf)
      y = 0
      do i = 1, 3
         do c = 1, 3
            do m = 1, 3
               ! components in the corotated axes
               y(:, c) = y(:, c) + ref%gradient(:, 1, i)*(filter%rotation(:, m, c)*increment(:, n_nodal*(i - 1) + m))
               y(:, 3 + c) = y(:, 3 + c) + ref%gradient(:, 2, i)*(filter%rotation(:, m, c)*increment(:, n_nodal*(i - 1) + m))
               y(:, 3 + 3*i + c) = y(:, 3 + 3*i + c) + filter%rotation(:, m, c)*increment(:, n_nodal*(i - 1) + uz + m)
            end do
         end do
      end do
      do v = 1, n_core
         variation(:, v) = lf(:, 1, v)*y(:, 1) + lf(:, 2, v)*y(:, 2) + lf(:, 3, v)*y(:, 3) &
            + lf(:, 4, v)*y(:, 4) + lf(:, 5, v)*y(:, 5) + lf(:, 6, v)*y(:, 6)
      end do
      do i = 1, 3
         do m = 1, 3
            v = merge(9 + i, 2*i + m, m == 1)
            variation(:, v) = variation(:, v) + a(:, 1, m, i)*y(:, 4 + 3*i) + a(:, 2, m, i)*y(:, 5 + 3*i) &
               + a(:, 3, m, i)*y(:, 6 + 3*i)
         end do
      end do
   end subroutine core_variation

   !> H(theta) = I - K/2 + eta K^2, K = spin(theta).
   pure subroutine inverse_tangents(filter, h)
      type(filter_t), intent(in) :: filter
      real(wp), intent(out) :: h(lanes, rows_3, 3, 3)
      real(wp), dimension(lanes) :: e
      integer :: i
      if (rows_3 > 3) h(:, rows_3, :, :) = 0
      do i = 1, 3
         associate (t => filter%theta(:, :, i))
            e = filter%eta(:, i)
            h(:, 1, 1, i) = 1 - e*(t(:, 2)**2 + t(:, 3)**2)
            h(:, 2, 2, i) = 1 - e*(t(:, 1)**2 + t(:, 3)**2)
            h(:, 3, 3, i) = 1 - e*(t(:, 1)**2 + t(:, 2)**2)
            h(:, 2, 1, i) = e*t(:, 1)*t(:, 2) + 0.5_wp*t(:, 3)
            h(:, 1, 2, i) = e*t(:, 1)*t(:, 2) - 0.5_wp*t(:, 3)
            h(:, 3, 1, i) = e*t(:, 1)*t(:, 3) - 0.5_wp*t(:, 2)
            h(:, 1, 3, i) = e*t(:, 1)*t(:, 3) + 0.5_wp*t(:, 2)
            h(:, 3, 2, i) = e*t(:, 2)*t(:, 3) + 0.5_wp*t(:, 1)
            h(:, 2, 3, i) = e*t(:, 2)*t(:, 3) - 0.5_wp*t(:, 1)
         end associate
      end do
   end subroutine inverse_tangents

   !> Core variables as linear functions of y and of the spins.
   pure subroutine first_variation(filter, h, a, lf)
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: h(lanes, rows_3, 3, 3)
      real(wp), intent(out) :: a(lanes, rows_3, 3, 3), lf(lanes, rows_6, n_core)
      real(wp) :: w(lanes, 3), inverse(lanes)
      integer :: c, i, m, v
      associate (u11 => filter%u(:, 1), u22 => filter%u(:, 2), u12 => filter%u(:, 3), &
                 v11 => filter%u_inverse(:, 1), v22 => filter%u_inverse(:, 2), v12 => filter%u_inverse(:, 3))
         do v = 1, n_core
            do c = 1, rows_6
               lf(:, c, v) = 0
            end do
         end do
         lf(:, 1, 1) = u11
         lf(:, 2, 1) = u12
         lf(:, 4, 2) = u12
         lf(:, 5, 2) = u22
         lf(:, 1, 3) = u12
         lf(:, 2, 3) = u22
         lf(:, 4, 3) = u11
         lf(:, 5, 3) = u12
         inverse = 1/filter%trace_u
         do i = 1, 3
            associate (t1 => filter%theta(:, 1, i), t2 => filter%theta(:, 2, i))
               do c = 1, rows_3
                  a(:, c, 1, i) = h(:, c, 3, i)
                  a(:, c, 2, i) = u12*h(:, c, 1, i) - u11*h(:, c, 2, i)
                  a(:, c, 3, i) = u22*h(:, c, 1, i) - u12*h(:, c, 2, i)
               end do
               ! through psi_3: the rotations turn back, and U turns with the frame
               w(:, 1) = -a(:, 3, 1, i)*inverse
               w(:, 2) = (filter%slope(:, 2, i) - a(:, 3, 2, i))*inverse
               w(:, 3) = -(t1*u12 + t2*u22 + a(:, 3, 3, i))*inverse
               do m = 1, 3
                  v = merge(9 + i, 2*i + m, m == 1)
                  lf(:, 2, v) = w(:, m)
                  lf(:, 4, v) = -w(:, m)
                  lf(:, 3, v) = a(:, 2, m, i)*v11 - a(:, 1, m, i)*v12
                  lf(:, 6, v) = a(:, 2, m, i)*v12 - a(:, 1, m, i)*v22
               end do
               lf(:, 1, 2 + 2*i) = -t2
               lf(:, 4, 2 + 2*i) = lf(:, 4, 2 + 2*i) + t1
               lf(:, 4, 3 + 2*i) = lf(:, 4, 3 + 2*i) - t2
               lf(:, 5, 3 + 2*i) = t1
            end associate
         end do
      end associate
   end subroutine first_variation

   !> f = L' gradient.
   pure subroutine intermediate_force(gradient, a, lf, f)
      real(wp), intent(in) :: gradient(lanes, n_core), a(lanes, rows_3, 3, 3), lf(lanes, rows_6, n_core)
      real(wp), intent(out) :: f(lanes, rows_15)
      integer :: c, i
      do c = 1, rows_6
         f(:, c) = lf(:, c, 1)*gradient(:, 1) + lf(:, c, 2)*gradient(:, 2) + lf(:, c, 3)*gradient(:, 3) &
            + lf(:, c, 4)*gradient(:, 4) + lf(:, c, 5)*gradient(:, 5) + lf(:, c, 6)*gradient(:, 6) &
            + lf(:, c, 7)*gradient(:, 7) + lf(:, c, 8)*gradient(:, 8) + lf(:, c, 9)*gradient(:, 9) &
            + lf(:, c, 10)*gradient(:, 10) + lf(:, c, 11)*gradient(:, 11) + lf(:, c, 12)*gradient(:, 12)
      end do
      do i = 1, 3
         do c = 1, rows_3
            f(:, 3 + 3*i + c) = a(:, c, 1, i)*gradient(:, 9 + i) + a(:, c, 2, i)*gradient(:, 2 + 2*i) &
               + a(:, c, 3, i)*gradient(:, 3 + 2*i)
         end do
      end do
   end subroutine intermediate_force

   !> k = L' hessian L, upper triangle, but y below the spins. What is zero in `lf` is left out: see `first_variation`.
   pure subroutine material_part(hessian, a, lf, k)
      real(wp), intent(in) :: hessian(lanes, n_core, n_core), a(lanes, rows_3, 3, 3), lf(lanes, rows_6, n_core)
      real(wp), intent(inout) :: k(lanes, rows_15, n_lift)
      real(wp) :: s(lanes, n_core, 6) !< hessian lf
      real(wp) :: t(lanes, n_core)
      integer, parameter :: first = merge(1, 4, lanes == 1)
      integer :: c, d, i, j, v
      do v = 1, n_core
         s(:, v, 1) = hessian(:, v, 1)*lf(:, 1, 1) + hessian(:, v, 3)*lf(:, 1, 3) + hessian(:, v, 4)*lf(:, 1, 4) &
            + hessian(:, v, 6)*lf(:, 1, 6) + hessian(:, v, 8)*lf(:, 1, 8)
         s(:, v, 2) = hessian(:, v, 1)*lf(:, 2, 1) + hessian(:, v, 3)*lf(:, 2, 3) + hessian(:, v, 10)*lf(:, 2, 10) &
            + hessian(:, v, 11)*lf(:, 2, 11) + hessian(:, v, 12)*lf(:, 2, 12) + hessian(:, v, 4)*lf(:, 2, 4) &
            + hessian(:, v, 5)*lf(:, 2, 5) + hessian(:, v, 6)*lf(:, 2, 6) + hessian(:, v, 7)*lf(:, 2, 7) &
            + hessian(:, v, 8)*lf(:, 2, 8) + hessian(:, v, 9)*lf(:, 2, 9)
         s(:, v, 3) = hessian(:, v, 10)*lf(:, 3, 10) + hessian(:, v, 11)*lf(:, 3, 11) + hessian(:, v, 12)*lf(:, 3, 12) &
            + hessian(:, v, 4)*lf(:, 3, 4) + hessian(:, v, 5)*lf(:, 3, 5) + hessian(:, v, 6)*lf(:, 3, 6) &
            + hessian(:, v, 7)*lf(:, 3, 7) + hessian(:, v, 8)*lf(:, 3, 8) + hessian(:, v, 9)*lf(:, 3, 9)
         s(:, v, 4) = hessian(:, v, 2)*lf(:, 4, 2) + hessian(:, v, 3)*lf(:, 4, 3) + hessian(:, v, 10)*lf(:, 4, 10) &
            + hessian(:, v, 11)*lf(:, 4, 11) + hessian(:, v, 12)*lf(:, 4, 12) + hessian(:, v, 4)*lf(:, 4, 4) &
            + hessian(:, v, 5)*lf(:, 4, 5) + hessian(:, v, 6)*lf(:, 4, 6) + hessian(:, v, 7)*lf(:, 4, 7) &
            + hessian(:, v, 8)*lf(:, 4, 8) + hessian(:, v, 9)*lf(:, 4, 9)
         s(:, v, 5) = hessian(:, v, 2)*lf(:, 5, 2) + hessian(:, v, 3)*lf(:, 5, 3) + hessian(:, v, 5)*lf(:, 5, 5) &
            + hessian(:, v, 7)*lf(:, 5, 7) + hessian(:, v, 9)*lf(:, 5, 9)
         s(:, v, 6) = hessian(:, v, 10)*lf(:, 6, 10) + hessian(:, v, 11)*lf(:, 6, 11) + hessian(:, v, 12)*lf(:, 6, 12) &
            + hessian(:, v, 4)*lf(:, 6, 4) + hessian(:, v, 5)*lf(:, 6, 5) + hessian(:, v, 6)*lf(:, 6, 6) &
            + hessian(:, v, 7)*lf(:, 6, 7) + hessian(:, v, 8)*lf(:, 6, 8) + hessian(:, v, 9)*lf(:, 6, 9)
      end do
      if (lanes == 1) then
         ! whole columns are contiguous
         do c = 1, 6
            do d = 1, rows_6
               k(:, d, c) = lf(:, d, 1)*s(:, 1, c) + lf(:, d, 2)*s(:, 2, c) + lf(:, d, 3)*s(:, 3, c) + lf(:, d, 10)*s(:, 10, c) &
                  + lf(:, d, 11)*s(:, 11, c) + lf(:, d, 12)*s(:, 12, c) + lf(:, d, 4)*s(:, 4, c) + lf(:, d, 5)*s(:, 5, c) &
                  + lf(:, d, 6)*s(:, 6, c) + lf(:, d, 7)*s(:, 7, c) + lf(:, d, 8)*s(:, 8, c) + lf(:, d, 9)*s(:, 9, c)
            end do
         end do
      else
         do c = 1, 6
            k(:, 1, c) = s(:, 1, c)*lf(:, 1, 1) + s(:, 3, c)*lf(:, 1, 3) + s(:, 4, c)*lf(:, 1, 4) + s(:, 6, c)*lf(:, 1, 6) &
               + s(:, 8, c)*lf(:, 1, 8)
         end do
         do c = 2, 6
            k(:, 2, c) = s(:, 1, c)*lf(:, 2, 1) + s(:, 3, c)*lf(:, 2, 3) + s(:, 10, c)*lf(:, 2, 10) + s(:, 11, c)*lf(:, 2, 11) &
               + s(:, 12, c)*lf(:, 2, 12) + s(:, 4, c)*lf(:, 2, 4) + s(:, 5, c)*lf(:, 2, 5) + s(:, 6, c)*lf(:, 2, 6) &
               + s(:, 7, c)*lf(:, 2, 7) + s(:, 8, c)*lf(:, 2, 8) + s(:, 9, c)*lf(:, 2, 9)
         end do
         do c = 3, 6
            k(:, 3, c) = s(:, 10, c)*lf(:, 3, 10) + s(:, 11, c)*lf(:, 3, 11) + s(:, 12, c)*lf(:, 3, 12) + s(:, 4, c)*lf(:, 3, 4) &
               + s(:, 5, c)*lf(:, 3, 5) + s(:, 6, c)*lf(:, 3, 6) + s(:, 7, c)*lf(:, 3, 7) + s(:, 8, c)*lf(:, 3, 8) &
               + s(:, 9, c)*lf(:, 3, 9)
         end do
         do c = 4, 6
            k(:, 4, c) = s(:, 2, c)*lf(:, 4, 2) + s(:, 3, c)*lf(:, 4, 3) + s(:, 10, c)*lf(:, 4, 10) + s(:, 11, c)*lf(:, 4, 11) &
               + s(:, 12, c)*lf(:, 4, 12) + s(:, 4, c)*lf(:, 4, 4) + s(:, 5, c)*lf(:, 4, 5) + s(:, 6, c)*lf(:, 4, 6) &
               + s(:, 7, c)*lf(:, 4, 7) + s(:, 8, c)*lf(:, 4, 8) + s(:, 9, c)*lf(:, 4, 9)
         end do
         do c = 5, 6
            k(:, 5, c) = s(:, 2, c)*lf(:, 5, 2) + s(:, 3, c)*lf(:, 5, 3) + s(:, 5, c)*lf(:, 5, 5) + s(:, 7, c)*lf(:, 5, 7) &
               + s(:, 9, c)*lf(:, 5, 9)
         end do
         k(:, 6, 6) = s(:, 10, 6)*lf(:, 6, 10) + s(:, 11, 6)*lf(:, 6, 11) + s(:, 12, 6)*lf(:, 6, 12) + s(:, 4, 6)*lf(:, 6, 4) &
            + s(:, 5, 6)*lf(:, 6, 5) + s(:, 6, 6)*lf(:, 6, 6) + s(:, 7, 6)*lf(:, 6, 7) + s(:, 8, 6)*lf(:, 6, 8) &
            + s(:, 9, 6)*lf(:, 6, 9)
      end if
      do c = 1, 6
         do i = 1, 3
            do d = 1, rows_3
               k(:, 3 + 3*i + d, c) = a(:, d, 1, i)*s(:, 9 + i, c) + a(:, d, 2, i)*s(:, 2 + 2*i, c) + a(:, d, 3, i)*s(:, 3 + 2*i, c)
            end do
         end do
      end do
      do j = 1, 3
         do c = 1, 3
            do v = first, n_core
               t(:, v) = hessian(:, v, 9 + j)*a(:, c, 1, j) + hessian(:, v, 2 + 2*j)*a(:, c, 2, j) &
                  + hessian(:, v, 3 + 2*j)*a(:, c, 3, j)
            end do
            do i = 1, j
               do d = 1, merge(c, rows_3, i == j .and. lanes > 1)
                  k(:, 3 + 3*i + d, 3 + 3*j + c) = a(:, d, 1, i)*t(:, 9 + i) + a(:, d, 2, i)*t(:, 2 + 2*i) &
                     + a(:, d, 3, i)*t(:, 3 + 2*i)
               end do
            end do
         end do
      end do
   end subroutine material_part

   !> Global nodal forces from the intermediate ones.
   pure subroutine expand_force(ref, node_frame, f, force, moment)
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: node_frame(lanes, rows_3, 3, 0:3), f(lanes, rows_15)
      real(wp), intent(inout) :: force(lanes, n_shell), moment(lanes, 3, 3)
      real(wp), dimension(lanes) :: a, b
      integer :: c, i
      do c = 1, 3
         a = node_frame(:, c, 1, 0)*f(:, 1) + node_frame(:, c, 2, 0)*f(:, 2) + node_frame(:, c, 3, 0)*f(:, 3)
         b = node_frame(:, c, 1, 0)*f(:, 4) + node_frame(:, c, 2, 0)*f(:, 5) + node_frame(:, c, 3, 0)*f(:, 6)
         do i = 1, 3
            force(:, n_nodal*(i - 1) + c) = ref%gradient(:, 1, i)*a + ref%gradient(:, 2, i)*b
            force(:, n_nodal*(i - 1) + uz + c) = node_frame(:, c, 1, i)*f(:, 4 + 3*i) + node_frame(:, c, 2, i)*f(:, 5 + 3*i) &
               + node_frame(:, c, 3, i)*f(:, 6 + 3*i)
            moment(:, c, i) = node_frame(:, c, 1, 0)*f(:, 4 + 3*i) + node_frame(:, c, 2, 0)*f(:, 5 + 3*i) &
               + node_frame(:, c, 3, 0)*f(:, 6 + 3*i)
         end do
      end do
   end subroutine expand_force

   !> Global tangent from the intermediate one: each 3x3 block is rotated, then the two gradient blocks spread to the nodes.
   pure subroutine expand_tangent(ref, node_frame, k, tangent)
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: node_frame(lanes, rows_3, 3, 0:3)
      real(wp), intent(inout) :: k(lanes, rows_15, n_lift) !< the lower triangles of the blocks on the diagonal are filled
      real(wp), intent(inout) :: tangent(lanes, n_shell, n_shell)
      real(wp) :: b(lanes, rows_3, 3, 4), first(lanes, rows_3), second(lanes, rows_3), t(lanes, rows_3)
      integer :: c, d, i, j

      do i = 0, 12, 3
         k(:, i + 2, i + 1) = k(:, i + 1, i + 2)
         k(:, i + 3, i + 1) = k(:, i + 1, i + 3)
         k(:, i + 3, i + 2) = k(:, i + 2, i + 3)
      end do
      if (rows_3 > 3) b(:, rows_3, :, 4) = 0
      associate (axes => node_frame(:, :, :, 0), gradient => ref%gradient)
         ! gradient-gradient: blocks 11, 22, 12
         call rotated(axes, k, 0, axes, b(:, :, :, 1))
         call rotated(axes, k, rows_15*3 + 3, axes, b(:, :, :, 2))
         call rotated(axes, k, rows_15*3, axes, b(:, :, :, 3))
         do d = 1, 3
            do c = 1, 3
               b(:, c, d, 4) = b(:, d, c, 3)
            end do
         end do
         do j = 1, 3
            do d = 1, 3
               do c = 1, rows_3
                  first(:, c) = gradient(:, 1, j)*b(:, c, d, 1) + gradient(:, 2, j)*b(:, c, d, 3)
                  second(:, c) = gradient(:, 1, j)*b(:, c, d, 4) + gradient(:, 2, j)*b(:, c, d, 2)
               end do
               do i = 1, j
                  do c = 1, rows_3
                     t(:, c) = gradient(:, 1, i)*first(:, c) + gradient(:, 2, i)*second(:, c)
                  end do
                  do c = 1, merge(d, 3, i == j)
                     tangent(:, n_nodal*(i - 1) + c, n_nodal*(j - 1) + d) = t(:, c)
                     tangent(:, n_nodal*(j - 1) + d, n_nodal*(i - 1) + c) = t(:, c)
                  end do
               end do
            end do
         end do
         ! spin-gradient
         do j = 1, 3
            call rotated(node_frame(:, :, :, j), k, 3 + 3*j, axes, b(:, :, :, 1))
            call rotated(node_frame(:, :, :, j), k, rows_15*3 + 3 + 3*j, axes, b(:, :, :, 2))
            do i = 1, 3
               do c = 1, 3
                  do d = 1, rows_3
                     t(:, d) = gradient(:, 1, i)*b(:, d, c, 1) + gradient(:, 2, i)*b(:, d, c, 2)
                  end do
                  do d = 1, 3
                     tangent(:, n_nodal*(i - 1) + c, n_nodal*(j - 1) + uz + d) = t(:, d)
                     tangent(:, n_nodal*(j - 1) + uz + d, n_nodal*(i - 1) + c) = t(:, d)
                  end do
               end do
            end do
         end do
      end associate
      ! spin-spin
      do j = 1, 3
         do i = 1, j
            call rotated(node_frame(:, :, :, i), k, rows_15*(3 + 3*j) + 3 + 3*i, node_frame(:, :, :, j), b(:, :, :, 1))
            do d = 1, 3
               do c = 1, merge(d, 3, i == j)
                  tangent(:, n_nodal*(i - 1) + uz + c, n_nodal*(j - 1) + uz + d) = b(:, c, d, 1)
                  tangent(:, n_nodal*(j - 1) + uz + d, n_nodal*(i - 1) + uz + c) = b(:, c, d, 1)
               end do
            end do
         end do
      end do
   end subroutine expand_tangent

   !> b = v a w', with v and w holding axes as columns, a the 3x3 block of k after so many numbers (of each lane).
   pure subroutine rotated(v, k, o, w, b)
      real(wp), intent(in) :: v(lanes, rows_3, 3), k(lanes, rows_15*n_lift), w(lanes, rows_3, 3)
      integer, intent(in) :: o
      real(wp), intent(out) :: b(lanes, rows_3, 3)
      real(wp) :: t(lanes, rows_3, 3)
      integer :: c, d, i
      do d = 1, 3
         i = o + rows_15*(d - 1)
         do c = 1, rows_3
            t(:, c, d) = v(:, c, 1)*k(:, i + 1) + v(:, c, 2)*k(:, i + 2) + v(:, c, 3)*k(:, i + 3)
         end do
      end do
      do d = 1, 3
         do c = 1, rows_3
            b(:, c, d) = t(:, c, 1)*w(:, d, 1) + t(:, c, 2)*w(:, d, 2) + t(:, c, 3)*w(:, d, 3)
         end do
      end do
   end subroutine rotated
end module finshell_lift
