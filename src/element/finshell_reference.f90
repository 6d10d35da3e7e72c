!> What the reference triangle alone decides for the shell: side functions and the assumed drilling strains.
!>
!> First index of every array: the element within the block (`lanes` of them side by side). Drilling strains: Felippa 2003
!> (ANDES/OPT template), with null nodal translations as the paper's eq. (31) asks.
module finshell_reference
   use finshell_kinds, only: wp, i4, lanes
   use finshell_triangle, only: triangle_t, new_triangle, opposite_of_side, side_from, side_to
   use finshell_voigt, only: pack
   implicit none
   private
   public :: side_free, side_straight, side_fixed
   public :: reference_t, new_reference, hold_sides, drilling_weight, higher_order_strain, side_from, side_to, zeta, n_side, &
      alpha_b

   !> What holds a side: nothing; supports along its normal in the plane of the element; those along the normal of the element too.
   integer, parameter :: side_free = 0, side_straight = 1, side_fixed = 2

   !> In-plane integration points: area coordinates (node, point), each of weight 1/3.
   real(wp), parameter :: zeta(3, 3) = reshape([4, 1, 1, 1, 4, 1, 1, 1, 4], [3, 3])/6.0_wp
   !> Side function 4 zeta_i zeta_j (side, point).
   real(wp), parameter :: n_side(3, 3) = reshape([4, 1, 4, 4, 4, 1, 1, 4, 4], [3, 3])/9.0_wp

   real(wp), parameter :: alpha_b = 1.5_wp !< force lumping of the basic part, the optimal value

   type, extends(triangle_t) :: reference_t
      real(wp) :: bubble(lanes, 2, 3, 3) !< gradient of the side function 4 zeta_i zeta_j (component, side, point)
      !> Mean of grad N_k (x) grad N_l, Voigt, for the pairs of sides 11, 22, 33, 12, 13, 23.
      real(wp) :: bubble_mean(lanes, 3, 6)
      !> Basic drilling strain (Voigt) per unit (tau_1 - tau_3), (tau_2 - tau_3), and bow of side 1 (finshell_kink).
      real(wp) :: basic(lanes, 3, 3)
      real(wp) :: bulge(lanes, 3) !< set by the caller: 0 for a side that is held in the plane, else 1
      !> Set by the caller: bow of a side per L_k.(G_i - G_j), 1/8, or 0 where it is held along the normal too (finshell_bending).
      real(wp) :: bow(lanes, 3)
   end type reference_t

contains

   !> Geometry of a block of reference triangles.
   pure subroutine new_reference(nodes, ref, status)
      real(wp), intent(in) :: nodes(lanes, 3, 3) !< (element, component, node)
      type(reference_t), intent(out) :: ref
      integer(i4), intent(inout) :: status(lanes) !< status_degenerate_reference, see judge_triangles
      real(wp) :: column(lanes, 3)
      integer, parameter :: first(4:6) = [1, 2, 1], second(4:6) = [3, 3, 2] !< nodes that two sides do not share: 12, 13, 23
      real(wp), parameter :: four_thirds = 4.0_wp/3
      real(wp), parameter :: bow = -(4.0_wp/3)*alpha_b/8 !< times the gradient of a vertex function: mean gradient of a bubble
      integer :: g, i, k

      call new_triangle(nodes, ref%triangle_t, status)
      do g = 1, 3
         do k = 1, 3
            do i = 1, 2
               ref%bubble(:, i, k, g) = 4*(zeta(side_to(k), g)*ref%gradient(:, i, side_from(k)) &
                                           + zeta(side_from(k), g)*ref%gradient(:, i, side_to(k)))
            end do
         end do
      end do
      ! four thirds of the sum of grad zeta (x) grad zeta for a side with itself; for two sides, eight thirds of the product
      ! of the nodes they do not share
      associate (d => ref%gradient)
         ref%bubble_mean(:, 1, 1) = four_thirds*(d(:, 1, 1)**2 + d(:, 1, 2)**2 + d(:, 1, 3)**2)
         ref%bubble_mean(:, 2, 1) = four_thirds*(d(:, 2, 1)**2 + d(:, 2, 2)**2 + d(:, 2, 3)**2)
         ref%bubble_mean(:, 3, 1) = (2*four_thirds)*(d(:, 1, 1)*d(:, 2, 1) + d(:, 1, 2)*d(:, 2, 2) + d(:, 1, 3)*d(:, 2, 3))
         ref%bubble_mean(:, :, 2) = ref%bubble_mean(:, :, 1)
         ref%bubble_mean(:, :, 3) = ref%bubble_mean(:, :, 1)
         do g = 4, 6
            ref%bubble_mean(:, 1, g) = (2*four_thirds)*(d(:, 1, first(g))*d(:, 1, second(g)))
            ref%bubble_mean(:, 2, g) = (2*four_thirds)*(d(:, 2, first(g))*d(:, 2, second(g)))
            ref%bubble_mean(:, 3, g) = (2*four_thirds)*(d(:, 1, first(g))*d(:, 2, second(g)) + d(:, 2, first(g))*d(:, 1, second(g)))
         end do
      end associate
      do k = 1, 2
         call basic_column(ref, k, column)
         ref%basic(:, :, k) = column
      end do
      ref%basic(:, 1, 3) = bow*ref%side(:, 2, 1)*ref%gradient(:, 1, 3)
      ref%basic(:, 2, 3) = -bow*ref%side(:, 1, 1)*ref%gradient(:, 2, 3)
      ref%basic(:, 3, 3) = bow*(ref%side(:, 2, 1)*ref%gradient(:, 2, 3) - ref%side(:, 1, 1)*ref%gradient(:, 1, 3))
   end subroutine new_reference

   !> Sides whose displacement is prescribed stay straight: drilling rotations move those held in the plane no longer, and what
   !> holds them does no work on a bulge. Where the normal is held too, slopes do not move them either, so their bow is no bubble
   !> of V (finshell_bending): under tension the bubbles of V have to outweigh those of the bulges, side by side.
   pure subroutine hold_sides(ref)
      type(reference_t), intent(inout) :: ref
      real(wp), dimension(lanes) :: amplitude, gx, gy, nx, ny
      real(wp) :: strain(lanes, 3)
      integer :: i, k, v
      do k = 1, 3
         ! mean strain of the bulge alpha_b/8 (tau_to - tau_from) 4 zeta_i zeta_j along the outward normal times the length
         amplitude = (1 - ref%bulge(:, k))*(-alpha_b/6)
         nx = ref%side(:, 2, k)
         ny = -ref%side(:, 1, k)
         gx = ref%gradient(:, 1, opposite_of_side(k))
         gy = ref%gradient(:, 2, opposite_of_side(k))
         strain(:, 1) = amplitude*nx*gx
         strain(:, 2) = amplitude*ny*gy
         strain(:, 3) = amplitude*(nx*gy + ny*gx)
         do v = 1, 3
            if (k /= 3) ref%basic(:, v, side_from(k)) = ref%basic(:, v, side_from(k)) + strain(:, v)
            if (k /= 2) ref%basic(:, v, merge(1, 2, k == 3)) = ref%basic(:, v, merge(1, 2, k == 3)) - strain(:, v)
         end do
      end do
      do v = 1, 3
         ref%basic(:, v, 3) = ref%bulge(:, 1)*ref%basic(:, v, 3)
         do k = 1, 3
            do i = 1, k
               ref%bubble_mean(:, v, pack(i, k)) = 64*(ref%bow(:, i)*ref%bow(:, k))*ref%bubble_mean(:, v, pack(i, k))
            end do
         end do
      end do
   end subroutine hold_sides

   !> Basic drilling strain of node i: column of the force-lumping matrix over the area (equal drilling gives none).
   pure subroutine basic_column(ref, i, column)
      type(reference_t), intent(in) :: ref
      integer, intent(in) :: i
      real(wp), intent(out) :: column(lanes, 3)
      real(wp), dimension(lanes) :: x_ij, x_ki, x_kj, y_jk, y_ik, y_ji, factor
      integer :: j, k
      j = side_to(i)
      k = side_to(j)
      x_ij = ref%x(:, 1, i) - ref%x(:, 1, j)
      x_ki = ref%x(:, 1, k) - ref%x(:, 1, i)
      x_kj = ref%x(:, 1, k) - ref%x(:, 1, j)
      y_jk = ref%x(:, 2, j) - ref%x(:, 2, k)
      y_ik = ref%x(:, 2, i) - ref%x(:, 2, k)
      y_ji = ref%x(:, 2, j) - ref%x(:, 2, i)
      factor = (alpha_b/12)/ref%area
      column(:, 1) = factor*y_jk*(y_ik - y_ji)
      column(:, 2) = factor*x_kj*(x_ki - x_ij)
      column(:, 3) = 2*factor*(x_ki*y_ik - x_ij*y_ji)
   end subroutine basic_column

   !> Weight of the higher-order drilling strain by the element's size, beta0 = (h/l)^2 between 1e-5 and 0.3, l the longest side.
   !>
   !> Thin elements need a small one, or a drilling stiffness of membrane size locks what bends without stretching; where they are
   !> as thick as long, a small one lets the geometric stiffness of bending win. Thickness and length have the same unit.
   pure subroutine drilling_weight(ref, thickness, beta0)
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: thickness(lanes)
      real(wp), intent(out) :: beta0(lanes)
      beta0 = min(max(thickness**2/max(ref%side2(:, 1), ref%side2(:, 2), ref%side2(:, 3)), 1.0e-5_wp), 0.3_wp)
   end subroutine drilling_weight

   !> Higher-order drilling strain per unit drilling angle at the three in-plane points, for beta0 = 1; it goes with sqrt(beta0).
   !>
   !> At the point near node g it is 3/4 T_e Q_g, because the mean of the Q vanishes.
   pure subroutine higher_order_strain(ref, higher)
      type(reference_t), intent(in) :: ref
      real(wp), intent(out) :: higher(lanes, 3, 3, 3) !< (element, Voigt component, node, point)
      ! Q_g(side, node) = 2A/3 pattern(node, side, g)/|side|^2, sides in the order 21, 32, 13
      real(wp), parameter :: pattern(3, 3, 3) = reshape([real(wp) :: &
                                                         1, 2, 1, 0, 1, -1, -1, -1, -2, &
                                                         -2, -1, -1, 1, 1, 2, -1, 0, 1, &
                                                         1, -1, 0, -1, -2, -1, 2, 1, 1], [3, 3, 3])
      real(wp), dimension(lanes, 3, 3) :: te
      real(wp), dimension(lanes) :: scale
      integer :: g, i, k, l, m, v

      ! rows of T_e carry products of the other two sides; the side length cancels against Q
      scale = 0.75_wp*(2.0_wp/3)*ref%area/(4*ref%area**2)
      do k = 1, 3
         l = side_to(k)
         m = side_to(l)
         te(:, 1, k) = -scale*ref%side(:, 2, l)*ref%side(:, 2, m)
         te(:, 2, k) = -scale*ref%side(:, 1, l)*ref%side(:, 1, m)
         te(:, 3, k) = scale*(ref%side(:, 2, l)*ref%side(:, 1, m) + ref%side(:, 1, l)*ref%side(:, 2, m))
      end do
      do g = 1, 3
         do i = 1, 3
            do v = 1, 3
               higher(:, v, i, g) = te(:, v, 1)*pattern(i, 1, g) + te(:, v, 2)*pattern(i, 2, g) + te(:, v, 3)*pattern(i, 3, g)
            end do
         end do
      end do
   end subroutine higher_order_strain
end module finshell_reference
