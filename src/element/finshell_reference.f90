!> What the reference triangle alone decides: frame, shape-function gradients, the assumed drilling strains.
!>
!> First index of every array: the element within the block (`lanes` of them side by side). Source: paper eq. (20);
!> drilling strains: Felippa 2003 (ANDES/OPT template), with null nodal translations as the paper's eq. (31) asks.
module finshell_reference
   use finshell_kinds, only: wp, i4, lanes
   use finshell_status, only: status_degenerate_reference
   implicit none
   private
   public :: reference_t, new_reference, straighten, higher_order_strain, side_from, side_to, zeta, alpha_b

   !> Side k runs from node side_from(k) to node side_to(k).
   integer, parameter :: side_from(3) = [1, 2, 3], side_to(3) = [2, 3, 1], opposite_of_side(3) = [3, 1, 2]

   !> In-plane integration points: area coordinates (node, point), each of weight 1/3.
   real(wp), parameter :: zeta(3, 3) = reshape([4, 1, 1, 1, 4, 1, 1, 1, 4], [3, 3])/6.0_wp

   real(wp), parameter :: alpha_b = 1.5_wp !< force lumping of the basic part, the optimal value

   type :: reference_t
      real(wp) :: frame(lanes, 3, 3) !< columns e, h, n0 (global components), paper eq. (20)
      real(wp) :: area(lanes)
      real(wp) :: x(lanes, 2, 3) !< nodes in the frame, origin at the centroid
      real(wp) :: side(lanes, 2, 3) !< side vectors L_k
      real(wp) :: side2(lanes, 3) !< |L_k|^2
      real(wp) :: gradient(lanes, 2, 3) !< gradient of the area coordinate of each node
      real(wp) :: bubble(lanes, 2, 3, 3) !< gradient of the side function 4 zeta_i zeta_j (component, side, point)
      real(wp) :: basic(lanes, 3, 2) !< basic drilling strain (Voigt) per unit (tau_1 - tau_3), (tau_2 - tau_3)
      real(wp) :: bulge(lanes, 3) !< set by the caller: 0 for a straight side, else 1
   end type reference_t

contains

   !> Geometry of a block of reference triangles.
   pure subroutine new_reference(nodes, ref, status)
      real(wp), intent(in) :: nodes(lanes, 3, 3) !< (element, component, node)
      type(reference_t), intent(out) :: ref
      integer(i4), intent(inout) :: status(lanes) !< status_degenerate_reference where the area vanishes
      real(wp), dimension(lanes, 3) :: a, b, c, column
      real(wp), dimension(lanes) :: length, twice_area, inverse
      integer :: g, i, k

      a = nodes(:, :, 2) - nodes(:, :, 1)
      b = nodes(:, :, 3) - nodes(:, :, 1)
      c(:, 1) = a(:, 2)*b(:, 3) - a(:, 3)*b(:, 2)
      c(:, 2) = a(:, 3)*b(:, 1) - a(:, 1)*b(:, 3)
      c(:, 3) = a(:, 1)*b(:, 2) - a(:, 2)*b(:, 1)
      length = sqrt(a(:, 1)**2 + a(:, 2)**2 + a(:, 3)**2)
      twice_area = sqrt(c(:, 1)**2 + c(:, 2)**2 + c(:, 3)**2)
      ! a triangle flatter than this has lost its normal to rounding
      where (.not. twice_area > 64*epsilon(1.0_wp)*length*sqrt(b(:, 1)**2 + b(:, 2)**2 + b(:, 3)**2))
         status = status_degenerate_reference
      end where
      inverse = 1/length
      do i = 1, 3
         ref%frame(:, i, 1) = a(:, i)*inverse
      end do
      inverse = 1/twice_area
      do i = 1, 3
         ref%frame(:, i, 3) = c(:, i)*inverse
      end do
      ref%frame(:, 1, 2) = ref%frame(:, 2, 3)*ref%frame(:, 3, 1) - ref%frame(:, 3, 3)*ref%frame(:, 2, 1)
      ref%frame(:, 2, 2) = ref%frame(:, 3, 3)*ref%frame(:, 1, 1) - ref%frame(:, 1, 3)*ref%frame(:, 3, 1)
      ref%frame(:, 3, 2) = ref%frame(:, 1, 3)*ref%frame(:, 2, 1) - ref%frame(:, 2, 3)*ref%frame(:, 1, 1)
      ref%area = 0.5_wp*twice_area

      ! in-plane coordinates relative to node 1, then to the centroid
      ref%x(:, :, 1) = 0
      ref%x(:, 1, 2) = length
      ref%x(:, 2, 2) = 0
      do i = 1, 2
         ref%x(:, i, 3) = b(:, 1)*ref%frame(:, 1, i) + b(:, 2)*ref%frame(:, 2, i) + b(:, 3)*ref%frame(:, 3, i)
      end do
      do k = 1, 3
         do i = 1, 2
            ref%side(:, i, k) = ref%x(:, i, side_to(k)) - ref%x(:, i, side_from(k))
         end do
         ref%side2(:, k) = ref%side(:, 1, k)**2 + ref%side(:, 2, k)**2
      end do
      do i = 1, 2
         a(:, i) = (ref%x(:, i, 2) + ref%x(:, i, 3))/3
         do k = 1, 3
            ref%x(:, i, k) = ref%x(:, i, k) - a(:, i)
         end do
      end do
      ! grad zeta_i = n0 x (opposite side) / (2A); the side opposite to node i is side i+1
      do k = 1, 3
         i = opposite_of_side(k)
         ref%gradient(:, 1, i) = -ref%side(:, 2, k)*inverse
         ref%gradient(:, 2, i) = ref%side(:, 1, k)*inverse
      end do

      do g = 1, 3
         do k = 1, 3
            do i = 1, 2
               ref%bubble(:, i, k, g) = 4*(zeta(side_to(k), g)*ref%gradient(:, i, side_from(k)) &
                                           + zeta(side_from(k), g)*ref%gradient(:, i, side_to(k)))
            end do
         end do
      end do
      do k = 1, 2
         call basic_column(ref, k, column)
         ref%basic(:, :, k) = column
      end do
   end subroutine new_reference

   !> Keep sides straight: their drilling rotations move them no longer. For sides whose displacement is prescribed: it is linear
   !> there, and what holds them does no work on a bulge.
   pure subroutine straighten(ref)
      type(reference_t), intent(inout) :: ref
      real(wp), dimension(lanes) :: amplitude, gx, gy, nx, ny
      real(wp) :: strain(lanes, 3)
      integer :: k, v
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
   end subroutine straighten

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

   !> Higher-order drilling strain per unit drilling angle at the three in-plane points, times sqrt(beta0).
   !>
   !> At the point near node g it is 3/4 sqrt(beta0) T_e Q_g, because the mean of the Q vanishes.
   pure subroutine higher_order_strain(ref, beta0, higher)
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: beta0
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
      scale = sqrt(beta0)*0.75_wp*(2.0_wp/3)*ref%area/(4*ref%area**2)
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
