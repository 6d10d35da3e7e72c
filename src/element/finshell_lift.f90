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
   use finshell_kinds, only: wp, lanes
   use finshell_freedoms, only: n_nodal, n_shell, uz
   use finshell_core, only: core_t, n_core
   use finshell_filter, only: filter_t
   use finshell_lift_geometric, only: geometric_part, n_lift
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
      !> Per node, columns: the corotated axes as seen by the rotational dofs (filter%rotation for spins, T' times it for
      !> total rotation vectors).
      real(wp), intent(in) :: node_frame(lanes, 3, 3, 3)
      real(wp), intent(inout) :: force(lanes, n_shell)
      real(wp), intent(inout) :: moment(lanes, 3, 3) !< nodal moments conjugate to spins (global component, node)
      real(wp), intent(inout) :: tangent(lanes, n_shell, n_shell) !< upper triangle only
      real(wp) :: h(lanes, 3, 3, 3) !< H_i (row, column, node)
      real(wp) :: a(lanes, 3, 3, 3) !< d(tau_i, G_i1, G_i2)/dx_i (row, column, node)
      real(wp) :: lf(lanes, n_core, 6) !< d(core)/dy
      real(wp) :: f(lanes, n_lift), k(lanes, n_lift, n_lift)

      call inverse_tangents(filter, h)
      call first_variation(filter, h, a, lf)
      call intermediate_force(core%gradient, a, lf, f)
      call expand_force(ref, filter, node_frame, f, force, moment)
      if (level < level_tangent) return
      call material_part(core%hessian, a, lf, k)
      call intermediate_force(core%geometric_gradient, a, lf, f)
      call geometric_part(filter, core%geometric_gradient, h, f, k)
      call expand_tangent(ref, filter, node_frame, k, tangent)
   end subroutine lift

   !> Variation of the core variables for given nodal displacements and spins (global components).
   pure subroutine core_variation(ref, filter, increment, variation)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: increment(lanes, n_shell)
      real(wp), intent(out) :: variation(lanes, n_core)
      real(wp) :: h(lanes, 3, 3, 3), a(lanes, 3, 3, 3), lf(lanes, n_core, 6), y(lanes, n_lift)
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
         variation(:, v) = lf(:, v, 1)*y(:, 1) + lf(:, v, 2)*y(:, 2) + lf(:, v, 3)*y(:, 3) &
            + lf(:, v, 4)*y(:, 4) + lf(:, v, 5)*y(:, 5) + lf(:, v, 6)*y(:, 6)
      end do
      do i = 1, 3
         do m = 1, 3
            v = merge(3 + i, 3 + 2*i + m, m == 1)
            variation(:, v) = variation(:, v) + a(:, m, 1, i)*y(:, 4 + 3*i) + a(:, m, 2, i)*y(:, 5 + 3*i) &
               + a(:, m, 3, i)*y(:, 6 + 3*i)
         end do
      end do
   end subroutine core_variation

   !> H(theta) = I - K/2 + eta K^2, K = spin(theta).
   pure subroutine inverse_tangents(filter, h)
      type(filter_t), intent(in) :: filter
      real(wp), intent(out) :: h(lanes, 3, 3, 3)
      real(wp), dimension(lanes) :: e
      integer :: i
      do i = 1, 3
         associate (t => filter%theta(:, :, i))
            e = filter%eta(:, i)
            h(:, 1, 1, i) = 1 - e*(t(:, 2)**2 + t(:, 3)**2)
            h(:, 2, 2, i) = 1 - e*(t(:, 1)**2 + t(:, 3)**2)
            h(:, 3, 3, i) = 1 - e*(t(:, 1)**2 + t(:, 2)**2)
            h(:, 1, 2, i) = e*t(:, 1)*t(:, 2) + 0.5_wp*t(:, 3)
            h(:, 2, 1, i) = e*t(:, 1)*t(:, 2) - 0.5_wp*t(:, 3)
            h(:, 1, 3, i) = e*t(:, 1)*t(:, 3) - 0.5_wp*t(:, 2)
            h(:, 3, 1, i) = e*t(:, 1)*t(:, 3) + 0.5_wp*t(:, 2)
            h(:, 2, 3, i) = e*t(:, 2)*t(:, 3) + 0.5_wp*t(:, 1)
            h(:, 3, 2, i) = e*t(:, 2)*t(:, 3) - 0.5_wp*t(:, 1)
         end associate
      end do
   end subroutine inverse_tangents

   !> Core variables as linear functions of y and of the spins.
   pure subroutine first_variation(filter, h, a, lf)
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: h(lanes, 3, 3, 3)
      real(wp), intent(out) :: a(lanes, 3, 3, 3), lf(lanes, n_core, 6)
      real(wp) :: w(lanes, 3), inverse(lanes)
      integer :: c, i, m, v
      associate (u11 => filter%u(:, 1), u22 => filter%u(:, 2), u12 => filter%u(:, 3), &
                 v11 => filter%u_inverse(:, 1), v22 => filter%u_inverse(:, 2), v12 => filter%u_inverse(:, 3))
         lf = 0
         lf(:, 1, 1) = u11
         lf(:, 1, 2) = u12
         lf(:, 2, 4) = u12
         lf(:, 2, 5) = u22
         lf(:, 3, 1) = u12
         lf(:, 3, 2) = u22
         lf(:, 3, 4) = u11
         lf(:, 3, 5) = u12
         inverse = 1/filter%trace_u
         do i = 1, 3
            associate (t1 => filter%theta(:, 1, i), t2 => filter%theta(:, 2, i))
               do c = 1, 3
                  a(:, 1, c, i) = h(:, 3, c, i)
                  a(:, 2, c, i) = u12*h(:, 1, c, i) - u11*h(:, 2, c, i)
                  a(:, 3, c, i) = u22*h(:, 1, c, i) - u12*h(:, 2, c, i)
               end do
               ! through psi_3: the rotations turn back, and U turns with the frame
               w(:, 1) = -a(:, 1, 3, i)*inverse
               w(:, 2) = (filter%slope(:, 2, i) - a(:, 2, 3, i))*inverse
               w(:, 3) = -(t1*u12 + t2*u22 + a(:, 3, 3, i))*inverse
               do m = 1, 3
                  v = merge(3 + i, 3 + 2*i + m, m == 1)
                  lf(:, v, 2) = w(:, m)
                  lf(:, v, 4) = -w(:, m)
                  lf(:, v, 3) = a(:, m, 2, i)*v11 - a(:, m, 1, i)*v12
                  lf(:, v, 6) = a(:, m, 2, i)*v12 - a(:, m, 1, i)*v22
               end do
               lf(:, 5 + 2*i, 1) = -t2
               lf(:, 5 + 2*i, 4) = lf(:, 5 + 2*i, 4) + t1
               lf(:, 6 + 2*i, 4) = lf(:, 6 + 2*i, 4) - t2
               lf(:, 6 + 2*i, 5) = t1
            end associate
         end do
      end associate
   end subroutine first_variation

   !> f = L' gradient.
   pure subroutine intermediate_force(gradient, a, lf, f)
      real(wp), intent(in) :: gradient(lanes, n_core), a(lanes, 3, 3, 3), lf(lanes, n_core, 6)
      real(wp), intent(out) :: f(lanes, n_lift)
      integer :: c, i
      do c = 1, 6
         f(:, c) = lf(:, 1, c)*gradient(:, 1) + lf(:, 2, c)*gradient(:, 2) + lf(:, 3, c)*gradient(:, 3) &
            + lf(:, 4, c)*gradient(:, 4) + lf(:, 5, c)*gradient(:, 5) + lf(:, 6, c)*gradient(:, 6) &
            + lf(:, 7, c)*gradient(:, 7) + lf(:, 8, c)*gradient(:, 8) + lf(:, 9, c)*gradient(:, 9) &
            + lf(:, 10, c)*gradient(:, 10) + lf(:, 11, c)*gradient(:, 11) + lf(:, 12, c)*gradient(:, 12)
      end do
      do i = 1, 3
         do c = 1, 3
            f(:, 3 + 3*i + c) = a(:, 1, c, i)*gradient(:, 3 + i) + a(:, 2, c, i)*gradient(:, 5 + 2*i) &
               + a(:, 3, c, i)*gradient(:, 6 + 2*i)
         end do
      end do
   end subroutine intermediate_force

   !> k = L' hessian L, upper triangle. What is zero in `lf` is left out: see `first_variation`.
   pure subroutine material_part(hessian, a, lf, k)
      real(wp), intent(in) :: hessian(lanes, n_core, n_core), a(lanes, 3, 3, 3), lf(lanes, n_core, 6)
      real(wp), intent(inout) :: k(lanes, n_lift, n_lift)
      real(wp) :: s(lanes, n_core, 6) !< hessian lf
      real(wp) :: t(lanes, n_core)
      integer :: c, d, i, j, v
      do v = 1, n_core
         s(:, v, 1) = hessian(:, v, 1)*lf(:, 1, 1) + hessian(:, v, 3)*lf(:, 3, 1) + hessian(:, v, 7)*lf(:, 7, 1) &
            + hessian(:, v, 9)*lf(:, 9, 1) + hessian(:, v, 11)*lf(:, 11, 1)
         s(:, v, 2) = hessian(:, v, 1)*lf(:, 1, 2) + hessian(:, v, 3)*lf(:, 3, 2) + hessian(:, v, 4)*lf(:, 4, 2) &
            + hessian(:, v, 5)*lf(:, 5, 2) + hessian(:, v, 6)*lf(:, 6, 2) + hessian(:, v, 7)*lf(:, 7, 2) &
            + hessian(:, v, 8)*lf(:, 8, 2) + hessian(:, v, 9)*lf(:, 9, 2) + hessian(:, v, 10)*lf(:, 10, 2) &
            + hessian(:, v, 11)*lf(:, 11, 2) + hessian(:, v, 12)*lf(:, 12, 2)
         s(:, v, 3) = hessian(:, v, 4)*lf(:, 4, 3) + hessian(:, v, 5)*lf(:, 5, 3) + hessian(:, v, 6)*lf(:, 6, 3) &
            + hessian(:, v, 7)*lf(:, 7, 3) + hessian(:, v, 8)*lf(:, 8, 3) + hessian(:, v, 9)*lf(:, 9, 3) &
            + hessian(:, v, 10)*lf(:, 10, 3) + hessian(:, v, 11)*lf(:, 11, 3) + hessian(:, v, 12)*lf(:, 12, 3)
         s(:, v, 4) = hessian(:, v, 2)*lf(:, 2, 4) + hessian(:, v, 3)*lf(:, 3, 4) + hessian(:, v, 4)*lf(:, 4, 4) &
            + hessian(:, v, 5)*lf(:, 5, 4) + hessian(:, v, 6)*lf(:, 6, 4) + hessian(:, v, 7)*lf(:, 7, 4) &
            + hessian(:, v, 8)*lf(:, 8, 4) + hessian(:, v, 9)*lf(:, 9, 4) + hessian(:, v, 10)*lf(:, 10, 4) &
            + hessian(:, v, 11)*lf(:, 11, 4) + hessian(:, v, 12)*lf(:, 12, 4)
         s(:, v, 5) = hessian(:, v, 2)*lf(:, 2, 5) + hessian(:, v, 3)*lf(:, 3, 5) + hessian(:, v, 8)*lf(:, 8, 5) &
            + hessian(:, v, 10)*lf(:, 10, 5) + hessian(:, v, 12)*lf(:, 12, 5)
         s(:, v, 6) = hessian(:, v, 4)*lf(:, 4, 6) + hessian(:, v, 5)*lf(:, 5, 6) + hessian(:, v, 6)*lf(:, 6, 6) &
            + hessian(:, v, 7)*lf(:, 7, 6) + hessian(:, v, 8)*lf(:, 8, 6) + hessian(:, v, 9)*lf(:, 9, 6) &
            + hessian(:, v, 10)*lf(:, 10, 6) + hessian(:, v, 11)*lf(:, 11, 6) + hessian(:, v, 12)*lf(:, 12, 6)
      end do
      do c = 1, 6
         k(:, 1, c) = s(:, 1, c)*lf(:, 1, 1) + s(:, 3, c)*lf(:, 3, 1) + s(:, 7, c)*lf(:, 7, 1) + s(:, 9, c)*lf(:, 9, 1) &
            + s(:, 11, c)*lf(:, 11, 1)
      end do
      do c = 2, 6
         k(:, 2, c) = s(:, 1, c)*lf(:, 1, 2) + s(:, 3, c)*lf(:, 3, 2) + s(:, 4, c)*lf(:, 4, 2) + s(:, 5, c)*lf(:, 5, 2) &
            + s(:, 6, c)*lf(:, 6, 2) + s(:, 7, c)*lf(:, 7, 2) + s(:, 8, c)*lf(:, 8, 2) + s(:, 9, c)*lf(:, 9, 2) &
            + s(:, 10, c)*lf(:, 10, 2) + s(:, 11, c)*lf(:, 11, 2) + s(:, 12, c)*lf(:, 12, 2)
      end do
      do c = 3, 6
         k(:, 3, c) = s(:, 4, c)*lf(:, 4, 3) + s(:, 5, c)*lf(:, 5, 3) + s(:, 6, c)*lf(:, 6, 3) + s(:, 7, c)*lf(:, 7, 3) &
            + s(:, 8, c)*lf(:, 8, 3) + s(:, 9, c)*lf(:, 9, 3) + s(:, 10, c)*lf(:, 10, 3) + s(:, 11, c)*lf(:, 11, 3) &
            + s(:, 12, c)*lf(:, 12, 3)
      end do
      do c = 4, 6
         k(:, 4, c) = s(:, 2, c)*lf(:, 2, 4) + s(:, 3, c)*lf(:, 3, 4) + s(:, 4, c)*lf(:, 4, 4) + s(:, 5, c)*lf(:, 5, 4) &
            + s(:, 6, c)*lf(:, 6, 4) + s(:, 7, c)*lf(:, 7, 4) + s(:, 8, c)*lf(:, 8, 4) + s(:, 9, c)*lf(:, 9, 4) &
            + s(:, 10, c)*lf(:, 10, 4) + s(:, 11, c)*lf(:, 11, 4) + s(:, 12, c)*lf(:, 12, 4)
      end do
      do c = 5, 6
         k(:, 5, c) = s(:, 2, c)*lf(:, 2, 5) + s(:, 3, c)*lf(:, 3, 5) + s(:, 8, c)*lf(:, 8, 5) + s(:, 10, c)*lf(:, 10, 5) &
            + s(:, 12, c)*lf(:, 12, 5)
      end do
      k(:, 6, 6) = s(:, 4, 6)*lf(:, 4, 6) + s(:, 5, 6)*lf(:, 5, 6) + s(:, 6, 6)*lf(:, 6, 6) + s(:, 7, 6)*lf(:, 7, 6) &
         + s(:, 8, 6)*lf(:, 8, 6) + s(:, 9, 6)*lf(:, 9, 6) + s(:, 10, 6)*lf(:, 10, 6) + s(:, 11, 6)*lf(:, 11, 6) &
         + s(:, 12, 6)*lf(:, 12, 6)
      do c = 1, 6
         do i = 1, 3
            do d = 1, 3
               k(:, c, 3 + 3*i + d) = a(:, 1, d, i)*s(:, 3 + i, c) + a(:, 2, d, i)*s(:, 5 + 2*i, c) + a(:, 3, d, i)*s(:, 6 + 2*i, c)
            end do
         end do
      end do
      do j = 1, 3
         do c = 1, 3
            do v = 4, n_core
               t(:, v) = hessian(:, v, 3 + j)*a(:, 1, c, j) + hessian(:, v, 5 + 2*j)*a(:, 2, c, j) &
                  + hessian(:, v, 6 + 2*j)*a(:, 3, c, j)
            end do
            do i = 1, j
               do d = 1, merge(c, 3, i == j)
                  k(:, 3 + 3*i + d, 3 + 3*j + c) = a(:, 1, d, i)*t(:, 3 + i) + a(:, 2, d, i)*t(:, 5 + 2*i) &
                     + a(:, 3, d, i)*t(:, 6 + 2*i)
               end do
            end do
         end do
      end do
   end subroutine material_part

   !> Global nodal forces from the intermediate ones.
   pure subroutine expand_force(ref, filter, node_frame, f, force, moment)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: node_frame(lanes, 3, 3, 3), f(lanes, n_lift)
      real(wp), intent(inout) :: force(lanes, n_shell), moment(lanes, 3, 3)
      real(wp), dimension(lanes) :: a, b
      integer :: c, i
      do c = 1, 3
         a = filter%rotation(:, c, 1)*f(:, 1) + filter%rotation(:, c, 2)*f(:, 2) + filter%rotation(:, c, 3)*f(:, 3)
         b = filter%rotation(:, c, 1)*f(:, 4) + filter%rotation(:, c, 2)*f(:, 5) + filter%rotation(:, c, 3)*f(:, 6)
         do i = 1, 3
            force(:, n_nodal*(i - 1) + c) = ref%gradient(:, 1, i)*a + ref%gradient(:, 2, i)*b
            force(:, n_nodal*(i - 1) + uz + c) = node_frame(:, c, 1, i)*f(:, 4 + 3*i) + node_frame(:, c, 2, i)*f(:, 5 + 3*i) &
               + node_frame(:, c, 3, i)*f(:, 6 + 3*i)
            moment(:, c, i) = filter%rotation(:, c, 1)*f(:, 4 + 3*i) + filter%rotation(:, c, 2)*f(:, 5 + 3*i) &
               + filter%rotation(:, c, 3)*f(:, 6 + 3*i)
         end do
      end do
   end subroutine expand_force

   !> Global tangent from the intermediate one: each 3x3 block is rotated, then the two gradient blocks spread to the nodes.
   pure subroutine expand_tangent(ref, filter, node_frame, k, tangent)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: node_frame(lanes, 3, 3, 3), k(lanes, n_lift, n_lift)
      real(wp), intent(inout) :: tangent(lanes, n_shell, n_shell)
      real(wp) :: a(lanes, 3, 3), b(lanes, 3, 3, 3), g(lanes, 3, 3, 2)
      integer :: c, d, i, j

      ! gradient-gradient: blocks 11, 22, 12
      call get_block(k, 0, 0, a)
      call rotated(filter%rotation, a, filter%rotation, b(:, :, :, 1))
      call get_block(k, 3, 3, a)
      call rotated(filter%rotation, a, filter%rotation, b(:, :, :, 2))
      call get_block(k, 0, 3, a)
      call rotated(filter%rotation, a, filter%rotation, b(:, :, :, 3))
      do j = 1, 3
         do i = 1, j
            do d = 1, 3
               do c = 1, merge(d, 3, i == j)
                  tangent(:, n_nodal*(i - 1) + c, n_nodal*(j - 1) + d) = &
                     ref%gradient(:, 1, i)*(ref%gradient(:, 1, j)*b(:, c, d, 1) + ref%gradient(:, 2, j)*b(:, c, d, 3)) &
                     + ref%gradient(:, 2, i)*(ref%gradient(:, 1, j)*b(:, d, c, 3) + ref%gradient(:, 2, j)*b(:, c, d, 2))
               end do
            end do
         end do
      end do
      ! gradient-spin
      do j = 1, 3
         call get_block(k, 0, 3 + 3*j, a)
         call rotated(filter%rotation, a, node_frame(:, :, :, j), g(:, :, :, 1))
         call get_block(k, 3, 3 + 3*j, a)
         call rotated(filter%rotation, a, node_frame(:, :, :, j), g(:, :, :, 2))
         do i = 1, 3
            do d = 1, 3
               do c = 1, 3
                  if (i <= j) then
                     tangent(:, n_nodal*(i - 1) + c, n_nodal*(j - 1) + uz + d) = ref%gradient(:, 1, i)*g(:, c, d, 1) &
                        + ref%gradient(:, 2, i)*g(:, c, d, 2)
                  else
                     tangent(:, n_nodal*(j - 1) + uz + d, n_nodal*(i - 1) + c) = ref%gradient(:, 1, i)*g(:, c, d, 1) &
                        + ref%gradient(:, 2, i)*g(:, c, d, 2)
                  end if
               end do
            end do
         end do
      end do
      ! spin-spin
      do j = 1, 3
         do i = 1, j
            call get_block(k, 3 + 3*i, 3 + 3*j, a)
            call rotated(node_frame(:, :, :, i), a, node_frame(:, :, :, j), b(:, :, :, 1))
            do d = 1, 3
               do c = 1, merge(d, 3, i == j)
                  tangent(:, n_nodal*(i - 1) + uz + c, n_nodal*(j - 1) + uz + d) = b(:, c, d, 1)
               end do
            end do
         end do
      end do
   end subroutine expand_tangent

   !> The 3x3 block below offsets `o` (row) and `p` (column) of a symmetric matrix stored by its upper triangle.
   pure subroutine get_block(k, o, p, a)
      real(wp), intent(in) :: k(lanes, n_lift, n_lift)
      integer, intent(in) :: o, p
      real(wp), intent(out) :: a(lanes, 3, 3)
      integer :: c, d
      do d = 1, 3
         do c = 1, 3
            a(:, c, d) = k(:, min(o + c, p + d), max(o + c, p + d))
         end do
      end do
   end subroutine get_block

   !> b = v a w', with v and w holding axes as columns.
   pure subroutine rotated(v, a, w, b)
      real(wp), intent(in) :: v(lanes, 3, 3), a(lanes, 3, 3), w(lanes, 3, 3)
      real(wp), intent(out) :: b(lanes, 3, 3)
      real(wp) :: t(lanes, 3, 3)
      integer :: c, d
      do d = 1, 3
         do c = 1, 3
            t(:, c, d) = v(:, c, 1)*a(:, 1, d) + v(:, c, 2)*a(:, 2, d) + v(:, c, 3)*a(:, 3, d)
         end do
      end do
      do d = 1, 3
         do c = 1, 3
            b(:, c, d) = t(:, c, 1)*w(:, d, 1) + t(:, c, 2)*w(:, d, 2) + t(:, c, 3)*w(:, d, 3)
         end do
      end do
   end subroutine rotated
end module finshell_lift
