!> Polar-decomposition filter: separates rigid motion from deformation (paper section 2.1, closed form).
!>
!> All vectors are components in the reference frame of the element; a hat means: rotated back by R (corotated).
!> With F = [f_1 f_2] the midsurface gradient, C = F'F, J = sqrt(det C), t = sqrt(tr C + 2J): U = (C + J I)/t, R = F U^-1.
!> Displacements, not positions, enter, so that strains and rotations keep full relative accuracy however small they are.
module finshell_filter
   use finshell_kinds, only: wp, i4, lanes
   use finshell_reference, only: reference_t
   use finshell_quaternion, only: matrix_to_quaternion
   use finshell_rotation_coefficients, only: log_coefficients, inverse_tangent_coefficients
   use finshell_status, only: status_collapsed_element, status_large_rotation
   implicit none
   private
   public :: filter_t, new_filter

   !> Largest filtered rotation (half-angle cosine 0.05: 174 degrees): the logarithm jumps at 180.
   real(wp), parameter :: smallest_half_cosine = 0.05_wp
   real(wp), parameter :: few = 64*epsilon(1.0_wp)

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
      real(wp), dimension(lanes) :: a, b, inverse, s2, coefficient
      real(wp) :: q(lanes, 4), p(lanes, 4), matrix(3, 3)
      integer :: i, k, l

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
      ! .not. > catches NaN as well; a J below rounding of the side lengths, reference or current, has no normal
      where (status == 0 .and. (.not. filter%jacobian > few*max(filter%c(:, 1) + filter%c(:, 2), few) &
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
      do l = 1, lanes
         matrix(:, 1) = r1(l, :)
         matrix(:, 2) = r2(l, :)
         matrix(:, 3) = n(l, :)
         p(l, :) = matrix_to_quaternion(matrix)
      end do

      do k = 1, 3
         ! nodal quaternion in the reference frame, then conj(p) q
         do i = 1, 3
            h1(:, i) = ref%frame(:, 1, i)*quaternion(:, 2, k) + ref%frame(:, 2, i)*quaternion(:, 3, k) &
               + ref%frame(:, 3, i)*quaternion(:, 4, k)
         end do
         a = quaternion(:, 1, k)
         q(:, 1) = p(:, 1)*a + (p(:, 2)*h1(:, 1) + p(:, 3)*h1(:, 2) + p(:, 4)*h1(:, 3))
         q(:, 2) = p(:, 1)*h1(:, 1) - a*p(:, 2) - (p(:, 3)*h1(:, 3) - p(:, 4)*h1(:, 2))
         q(:, 3) = p(:, 1)*h1(:, 2) - a*p(:, 3) - (p(:, 4)*h1(:, 1) - p(:, 2)*h1(:, 3))
         q(:, 4) = p(:, 1)*h1(:, 3) - a*p(:, 4) - (p(:, 2)*h1(:, 2) - p(:, 3)*h1(:, 1))
         ! q and -q are the same rotation; the length of q does not matter to the coefficients
         a = sign(1.0_wp, q(:, 1))
         s2 = q(:, 2)**2 + q(:, 3)**2 + q(:, 4)**2
         a = a/sqrt(q(:, 1)**2 + s2)
         do i = 1, 4
            q(:, i) = q(:, i)*a
         end do
         where (status == 0 .and. .not. q(:, 1) > smallest_half_cosine) status = status_large_rotation
         s2 = q(:, 2)**2 + q(:, 3)**2 + q(:, 4)**2
         call log_coefficients(lanes, s2, q(:, 1), coefficient)
         do i = 1, 3
            filter%theta(:, i, k) = coefficient*q(:, i + 1)
         end do
         a = filter%theta(:, 1, k)**2 + filter%theta(:, 2, k)**2 + filter%theta(:, 3, k)**2
         call inverse_tangent_coefficients(lanes, a, filter%eta(:, k), filter%mu(:, k))
         filter%slope(:, 1, k) = filter%theta(:, 1, k)*filter%u(:, 3) - filter%theta(:, 2, k)*filter%u(:, 1)
         filter%slope(:, 2, k) = filter%theta(:, 1, k)*filter%u(:, 2) - filter%theta(:, 2, k)*filter%u(:, 3)
      end do
   end subroutine new_filter
end module finshell_filter
