!> Unit quaternions q = (q0, qx, qy, qz), scalar part first: the rotation of a node without singularity, for any number of turns.
module finshell_quaternion
   use finshell_kinds, only: wp
   use finshell_rotation_coefficients, only: log_coefficients
   implicit none
   private
   public :: identity_quaternion, quaternion_product, quaternion_conjugate, quaternion_normalise
   public :: quaternion_to_matrix, matrix_to_quaternion, rotation_vector_to_quaternion, quaternion_to_rotation_vector
   public :: turn_quaternions, update_quaternion

   real(wp), parameter :: identity_quaternion(4) = [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]

contains

   !> Composition: first the rotation b, then the rotation a.
   pure function quaternion_product(a, b) result(c)
      real(wp), intent(in) :: a(4), b(4)
      real(wp) :: c(4)
      c(1) = a(1)*b(1) - (a(2)*b(2) + a(3)*b(3) + a(4)*b(4))
      c(2) = a(1)*b(2) + b(1)*a(2) + (a(3)*b(4) - a(4)*b(3))
      c(3) = a(1)*b(3) + b(1)*a(3) + (a(4)*b(2) - a(2)*b(4))
      c(4) = a(1)*b(4) + b(1)*a(4) + (a(2)*b(3) - a(3)*b(2))
   end function quaternion_product

   !> Each q becomes the product q b, `quaternion_product` side by side.
   pure subroutine turn_quaternions(n, q, b)
      integer, intent(in) :: n
      real(wp), intent(inout) :: q(n, 4)
      real(wp), intent(in) :: b(n, 4)
      real(wp) :: a1, a2, a3, a4
      integer :: l
      !GCC$ ivdep
      do l = 1, n
         a1 = q(l, 1)
         a2 = q(l, 2)
         a3 = q(l, 3)
         a4 = q(l, 4)
         q(l, 1) = a1*b(l, 1) - (a2*b(l, 2) + a3*b(l, 3) + a4*b(l, 4))
         q(l, 2) = a1*b(l, 2) + b(l, 1)*a2 + (a3*b(l, 4) - a4*b(l, 3))
         q(l, 3) = a1*b(l, 3) + b(l, 1)*a3 + (a4*b(l, 2) - a2*b(l, 4))
         q(l, 4) = a1*b(l, 4) + b(l, 1)*a4 + (a2*b(l, 3) - a3*b(l, 2))
      end do
   end subroutine turn_quaternions

   !> The inverse rotation.
   pure function quaternion_conjugate(q) result(c)
      real(wp), intent(in) :: q(4)
      real(wp) :: c(4)
      c = [q(1), -q(2), -q(3), -q(4)]
   end function quaternion_conjugate

   !> Unit quaternion with the direction of q; q must not be zero.
   pure function quaternion_normalise(q) result(c)
      real(wp), intent(in) :: q(4)
      real(wp) :: c(4)
      c = q/norm2(q)
   end function quaternion_normalise

   !> Rotation matrix of a unit quaternion.
   pure function quaternion_to_matrix(q) result(r)
      real(wp), intent(in) :: q(4)
      real(wp) :: r(3, 3)
      associate (w => q(1), x => q(2), y => q(3), z => q(4))
         r(1, 1) = 1.0_wp - 2.0_wp*(y*y + z*z)
         r(2, 2) = 1.0_wp - 2.0_wp*(z*z + x*x)
         r(3, 3) = 1.0_wp - 2.0_wp*(x*x + y*y)
         r(2, 1) = 2.0_wp*(x*y + w*z)
         r(1, 2) = 2.0_wp*(x*y - w*z)
         r(3, 1) = 2.0_wp*(x*z - w*y)
         r(1, 3) = 2.0_wp*(x*z + w*y)
         r(3, 2) = 2.0_wp*(y*z + w*x)
         r(2, 3) = 2.0_wp*(y*z - w*x)
      end associate
   end function quaternion_to_matrix

   !> Unit quaternion of a rotation matrix, scalar part >= 0 (Spurrier 1978: the largest of the four components first).
   pure function matrix_to_quaternion(r) result(q)
      real(wp), intent(in) :: r(3, 3)
      real(wp) :: q(4)
      real(wp) :: trace, largest
      integer :: i, j, k
      trace = r(1, 1) + r(2, 2) + r(3, 3)
      i = 1
      if (r(2, 2) > r(i, i)) i = 2
      if (r(3, 3) > r(i, i)) i = 3
      if (trace >= r(i, i)) then
         q(1) = 0.5_wp*sqrt(1.0_wp + trace)
         q(2) = (r(3, 2) - r(2, 3))/(4.0_wp*q(1))
         q(3) = (r(1, 3) - r(3, 1))/(4.0_wp*q(1))
         q(4) = (r(2, 1) - r(1, 2))/(4.0_wp*q(1))
      else
         j = modulo(i, 3) + 1
         k = modulo(j, 3) + 1
         largest = sqrt(0.5_wp*r(i, i) + 0.25_wp*(1.0_wp - trace))
         q(1 + i) = largest
         q(1) = (r(k, j) - r(j, k))/(4.0_wp*largest)
         q(1 + j) = (r(j, i) + r(i, j))/(4.0_wp*largest)
         q(1 + k) = (r(k, i) + r(i, k))/(4.0_wp*largest)
      end if
      q = upper_half(quaternion_normalise(q))
   end function matrix_to_quaternion

   !> Unit quaternion of the rotation vector v, |v| from 0 to many turns.
   pure function rotation_vector_to_quaternion(v) result(q)
      real(wp), intent(in) :: v(3)
      real(wp) :: q(4)
      real(wp) :: a, factor
      a = norm2(v)
      factor = 0.5_wp
      ! below, sin(a/2)/a = 1/2 - a^2/48 is 1/2 to rounding and a may be denormal
      if (a > sqrt(epsilon(a))) factor = sin(0.5_wp*a)/a
      q(1) = cos(0.5_wp*a)
      q(2:4) = factor*v
   end function rotation_vector_to_quaternion

   !> Rotation vector, |v| <= pi, of a quaternion (not necessarily normalised).
   !>
   !> q and -q give the same vector; at exactly pi, where v and -v are the same rotation, the first component that is not
   !> zero is positive.
   pure function quaternion_to_rotation_vector(q) result(v)
      real(wp), intent(in) :: q(4)
      real(wp) :: v(3)
      real(wp) :: p(4), c(1)
      p = upper_half(q)
      call log_coefficients(1, [p(2)*p(2) + p(3)*p(3) + p(4)*p(4)], p(1:1), c)
      v = c(1)*p(2:4)
   end function quaternion_to_rotation_vector

   !> q turned by the spatial spin increment omega: exp(omega) q, normalised.
   pure function update_quaternion(q, omega) result(updated)
      real(wp), intent(in) :: q(4), omega(3)
      real(wp) :: updated(4)
      updated = quaternion_normalise(quaternion_product(rotation_vector_to_quaternion(omega), q))
   end function update_quaternion

   !> Of q and -q, which are the same rotation, the one with non-negative scalar part.
   pure function upper_half(q) result(p)
      real(wp), intent(in) :: q(4)
      real(wp) :: p(4)
      integer :: i
      p = q
      do i = 1, 4
         if (q(i) > 0.0_wp) return
         if (q(i) < 0.0_wp) then
            p = -q
            return
         end if
      end do
   end function upper_half
end module finshell_quaternion
