!> Polar-decomposition filter: separates rigid motion from deformation (paper section 2.1, closed form).
!>
!> All vectors are components in the reference frame of the element; a hat means: rotated back by R (corotated).
!> With F = [f_1 f_2] the midsurface gradient, C = F'F, J = sqrt(det C), t = sqrt(tr C + 2J): U = (C + J I)/t, R = F U^-1.
!> Displacements, not positions, enter, so that strains and rotations keep full relative accuracy however small they are.
module finshell_filter
   use finshell_kinds, only: wp, i4, lanes
   use finshell_reference, only: reference_t
   use finshell_rotation_coefficients, only: log_coefficients, inverse_tangent_coefficients
   use finshell_status, only: status_collapsed_element, status_large_rotation
   use finshell_voigt, only: row, column
   implicit none
   private
   public :: filter_t, new_filter, jacobian_gradient, jacobian_hessian

   !> Largest filtered rotation (half-angle cosine 0.05: 174 degrees): the logarithm jumps at 180.
   real(wp), parameter :: smallest_half_cosine = 0.05_wp
   !> Least J over tr C, and least J: below, the normal and C have lost half of their digits.
   real(wp), parameter :: smallest_jacobian = 1.0e-8_wp

   type :: filter_t
      real(wp) :: strain(lanes, 3) !< midsurface Green-Lagrange strain (C - I)/2, Voigt
      real(wp) :: c(lanes, 3) !< C11, C22, C12
      real(wp) :: jacobian(lanes) !< J
      real(wp) :: u(lanes, 3) !< U11, U22, U12
      real(wp) :: u_inverse(lanes, 3) !< of U: 11, 22, 12
      real(wp) :: trace_u(lanes) !< t
      real(wp) :: rotation(lanes, 3, 3) !< R E: columns are the corotated axes, rows global components
      real(wp) :: theta(lanes, 3, 3) !< filtered rotation vector of each node (component, node), paper eq. (9)
      real(wp) :: eta(lanes, 3), mu(lanes, 3) !< coefficients of T^-1(theta) and of its derivative, per node
      real(wp) :: slope(lanes, 2, 3) !< covariant slopes G_i of the superimposed deflection
   end type filter_t

contains

   !> Filter a block of elements.
   pure subroutine new_filter(ref, displacement, quaternion, filter, status)
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: displacement(lanes, 3, 3) !< (element, global component, node)
      real(wp), intent(in) :: quaternion(lanes, 4, 3) !< nodal rotations, scalar first, any length
      type(filter_t), intent(out) :: filter
      integer(i4), intent(inout) :: status(lanes)
      real(wp), dimension(lanes, 3) :: g, h1, h2, n, r1, r2
      real(wp), dimension(lanes) :: a, b, inverse
      real(wp) :: p(lanes, 4) !< quaternion of the frame's rotation
      real(wp) :: q0(lanes, 3), q(lanes, 3, 3) !< filtered nodal rotations: scalar parts, vectors (component, node)
      real(wp) :: angle2(lanes, 3), coefficient(lanes, 3)
      integer :: i, k

      ! gradient of the displacement, in the reference frame: f_alpha = e_alpha + h_alpha
      do i = 1, 3
         g(:, i) = displacement(:, i, 2) - displacement(:, i, 1)
         n(:, i) = displacement(:, i, 3) - displacement(:, i, 1)
      end do
      do i = 1, 3
         a = ref%frame(:, 1, i)*g(:, 1) + ref%frame(:, 2, i)*g(:, 2) + ref%frame(:, 3, i)*g(:, 3)
         b = ref%frame(:, 1, i)*n(:, 1) + ref%frame(:, 2, i)*n(:, 2) + ref%frame(:, 3, i)*n(:, 3)
         h1(:, i) = a*ref%gradient(:, 1, 2) + b*ref%gradient(:, 1, 3)
         h2(:, i) = a*ref%gradient(:, 2, 2) + b*ref%gradient(:, 2, 3)
      end do
      filter%strain(:, 1) = h1(:, 1) + 0.5_wp*(h1(:, 1)**2 + h1(:, 2)**2 + h1(:, 3)**2)
      filter%strain(:, 2) = h2(:, 2) + 0.5_wp*(h2(:, 1)**2 + h2(:, 2)**2 + h2(:, 3)**2)
      filter%strain(:, 3) = h1(:, 2) + h2(:, 1) + (h1(:, 1)*h2(:, 1) + h1(:, 2)*h2(:, 2) + h1(:, 3)*h2(:, 3))
      filter%c(:, 1) = 1 + 2*filter%strain(:, 1)
      filter%c(:, 2) = 1 + 2*filter%strain(:, 2)
      filter%c(:, 3) = filter%strain(:, 3)

      ! normal; J from the cross product (no cancellation when the triangle is nearly flat)
      n(:, 1) = h1(:, 2)*h2(:, 3) - h1(:, 3)*(1 + h2(:, 2))
      n(:, 2) = h1(:, 3)*h2(:, 1) - (1 + h1(:, 1))*h2(:, 3)
      n(:, 3) = (1 + h1(:, 1))*(1 + h2(:, 2)) - h1(:, 2)*h2(:, 1)
      filter%jacobian = sqrt(n(:, 1)**2 + n(:, 2)**2 + n(:, 3)**2)
      ! .not. > catches NaN as well
      where (status == 0 .and. (.not. filter%jacobian > smallest_jacobian*max(filter%c(:, 1) + filter%c(:, 2), 1.0_wp) &
                                .or. filter%jacobian > huge(1.0_wp)*epsilon(1.0_wp))) status = status_collapsed_element
      inverse = 1/filter%jacobian
      do i = 1, 3
         n(:, i) = n(:, i)*inverse
      end do
      filter%trace_u = sqrt(filter%c(:, 1) + filter%c(:, 2) + 2*filter%jacobian)
      b = 1/filter%trace_u
      filter%u(:, 1) = (filter%c(:, 1) + filter%jacobian)*b
      filter%u(:, 2) = (filter%c(:, 2) + filter%jacobian)*b
      filter%u(:, 3) = filter%c(:, 3)*b
      filter%u_inverse(:, 1) = filter%u(:, 2)*inverse
      filter%u_inverse(:, 2) = filter%u(:, 1)*inverse
      filter%u_inverse(:, 3) = -filter%u(:, 3)*inverse

      ! r1 = (f_1 + f_2 x n)/t, r2 = n x r1
      r1(:, 1) = (1 + h1(:, 1) + (1 + h2(:, 2))*n(:, 3) - h2(:, 3)*n(:, 2))*b
      r1(:, 2) = (h1(:, 2) + h2(:, 3)*n(:, 1) - h2(:, 1)*n(:, 3))*b
      r1(:, 3) = (h1(:, 3) + h2(:, 1)*n(:, 2) - (1 + h2(:, 2))*n(:, 1))*b
      r2(:, 1) = n(:, 2)*r1(:, 3) - n(:, 3)*r1(:, 2)
      r2(:, 2) = n(:, 3)*r1(:, 1) - n(:, 1)*r1(:, 3)
      r2(:, 3) = n(:, 1)*r1(:, 2) - n(:, 2)*r1(:, 1)
      do i = 1, 3
         filter%rotation(:, i, 1) = ref%frame(:, i, 1)*r1(:, 1) + ref%frame(:, i, 2)*r1(:, 2) + ref%frame(:, i, 3)*r1(:, 3)
         filter%rotation(:, i, 2) = ref%frame(:, i, 1)*r2(:, 1) + ref%frame(:, i, 2)*r2(:, 2) + ref%frame(:, i, 3)*r2(:, 3)
         filter%rotation(:, i, 3) = ref%frame(:, i, 1)*n(:, 1) + ref%frame(:, i, 2)*n(:, 2) + ref%frame(:, i, 3)*n(:, 3)
      end do
      call frame_quaternion(r1, r2, n, p)

      do k = 1, 3
         ! nodal quaternion in the reference frame, then conj(p) q
         do i = 1, 3
            h1(:, i) = ref%frame(:, 1, i)*quaternion(:, 2, k) + ref%frame(:, 2, i)*quaternion(:, 3, k) &
               + ref%frame(:, 3, i)*quaternion(:, 4, k)
         end do
         a = quaternion(:, 1, k)
         q0(:, k) = p(:, 1)*a + (p(:, 2)*h1(:, 1) + p(:, 3)*h1(:, 2) + p(:, 4)*h1(:, 3))
         q(:, 1, k) = p(:, 1)*h1(:, 1) - a*p(:, 2) - (p(:, 3)*h1(:, 3) - p(:, 4)*h1(:, 2))
         q(:, 2, k) = p(:, 1)*h1(:, 2) - a*p(:, 3) - (p(:, 4)*h1(:, 1) - p(:, 2)*h1(:, 3))
         q(:, 3, k) = p(:, 1)*h1(:, 3) - a*p(:, 4) - (p(:, 2)*h1(:, 2) - p(:, 3)*h1(:, 1))
         ! q and -q are the same rotation
         a = sign(1.0_wp, q0(:, k))/sqrt(q0(:, k)**2 + q(:, 1, k)**2 + q(:, 2, k)**2 + q(:, 3, k)**2)
         q0(:, k) = q0(:, k)*a
         do i = 1, 3
            q(:, i, k) = q(:, i, k)*a
         end do
         where (status == 0 .and. .not. q0(:, k) > smallest_half_cosine) status = status_large_rotation
         angle2(:, k) = q(:, 1, k)**2 + q(:, 2, k)**2 + q(:, 3, k)**2
      end do
      ! the three nodes at once: their chains of operations overlap
      call log_coefficients(3*lanes, angle2, q0, coefficient)
      do k = 1, 3
         do i = 1, 3
            filter%theta(:, i, k) = coefficient(:, k)*q(:, i, k)
         end do
         angle2(:, k) = filter%theta(:, 1, k)**2 + filter%theta(:, 2, k)**2 + filter%theta(:, 3, k)**2
         filter%slope(:, 1, k) = filter%theta(:, 1, k)*filter%u(:, 3) - filter%theta(:, 2, k)*filter%u(:, 1)
         filter%slope(:, 2, k) = filter%theta(:, 1, k)*filter%u(:, 2) - filter%theta(:, 2, k)*filter%u(:, 3)
      end do
      call inverse_tangent_coefficients(3*lanes, angle2, filter%eta, filter%mu)
   end subroutine new_filter

   pure subroutine jacobian_gradient(filter, dj)
      type(filter_t), intent(in) :: filter
      real(wp), intent(out) :: dj(lanes, 3)
      dj(:, 1) = filter%c(:, 2)/filter%jacobian
      dj(:, 2) = filter%c(:, 1)/filter%jacobian
      dj(:, 3) = -filter%c(:, 3)/filter%jacobian
   end subroutine jacobian_gradient

   !> Second derivatives of J with respect to the midsurface strain: J J,ef = (J^2),ef/2 - J,e J,f with (J^2),12 = 4, (J^2),33 = -2.
   pure subroutine jacobian_hessian(filter, ddj)
      type(filter_t), intent(in) :: filter
      real(wp), intent(out) :: ddj(lanes, 6)
      real(wp) :: dj(lanes, 3), inverse(lanes)
      integer :: p
      inverse = 1/filter%jacobian
      call jacobian_gradient(filter, dj)
      do p = 1, 6
         ddj(:, p) = -inverse*dj(:, row(p))*dj(:, column(p))
      end do
      ddj(:, 4) = ddj(:, 4) + 2*inverse
      ddj(:, 3) = ddj(:, 3) - inverse
   end subroutine jacobian_hessian

   !> Quaternion, of any length, of the rotation with the columns r1, r2, r3.
   !>
   !> Each column of 4 q q' is a multiple of q, and linear in the rotation; the one with the largest diagonal is taken
   !> (Spurrier 1978).
   pure subroutine frame_quaternion(r1, r2, r3, q)
      real(wp), dimension(lanes, 3), intent(in) :: r1, r2, r3
      real(wp), intent(out) :: q(lanes, 4)
      real(wp) :: m(lanes, 4, 4), largest(lanes)
      integer :: i, j
      m(:, 1, 1) = 1 + r1(:, 1) + r2(:, 2) + r3(:, 3)
      m(:, 2, 2) = 1 + r1(:, 1) - r2(:, 2) - r3(:, 3)
      m(:, 3, 3) = 1 - r1(:, 1) + r2(:, 2) - r3(:, 3)
      m(:, 4, 4) = 1 - r1(:, 1) - r2(:, 2) + r3(:, 3)
      m(:, 2, 1) = r2(:, 3) - r3(:, 2)
      m(:, 3, 1) = r3(:, 1) - r1(:, 3)
      m(:, 4, 1) = r1(:, 2) - r2(:, 1)
      m(:, 3, 2) = r2(:, 1) + r1(:, 2)
      m(:, 4, 2) = r3(:, 1) + r1(:, 3)
      m(:, 4, 3) = r3(:, 2) + r2(:, 3)
      q = m(:, :, 1)
      largest = m(:, 1, 1)
      do i = 2, 4
         do j = 1, 4
            q(:, j) = merge(m(:, max(i, j), min(i, j)), q(:, j), m(:, i, i) > largest)
         end do
         largest = max(largest, m(:, i, i))
      end do
   end subroutine frame_quaternion
end module finshell_filter
