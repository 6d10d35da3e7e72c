!> Total rotation vectors as nodal unknowns: the spins they stand for, omega = T(theta) d theta, for a block of elements.
!>
!> The same functions as in finshell_rotation, for `lanes` elements side by side; sines, cosines and coefficients once.
module finshell_vector_rotation
   use finshell_kinds, only: wp, lanes
   use finshell_freedoms, only: n_nodal, n_shell, uz
   use finshell_evaluation, only: level_force
   use finshell_rotation_coefficients, only: tangent_coefficients
   implicit none
   private
   public :: vector_rotation_t, new_vector_rotation, turn_state, turned_frame, add_vector_curvature

   type :: vector_rotation_t
      real(wp) :: theta(lanes, 3, 3) !< rotation vectors (component, node)
      real(wp) :: quaternion(lanes, 4, 3) !< the same rotations
      real(wp) :: c2(lanes, 3), c3(lanes, 3) !< T = I + c2 K + c3 K^2, K = spin(theta), per node
      real(wp) :: dc2(lanes, 3), dc3(lanes, 3) !< their derivatives over the angle, divided by the angle
   end type vector_rotation_t

contains

   !> Quaternions and, for level_force and above, the tangent operators of nodal rotation vectors.
   pure subroutine new_vector_rotation(level, rotation, v)
      integer, intent(in) :: level
      real(wp), intent(in) :: rotation(lanes, 4, 3) !< rotation vectors in the first three components
      type(vector_rotation_t), intent(inout) :: v
      real(wp), dimension(lanes, 3) :: angle, sine, cosine, c1, factor
      integer :: c, i
      v%theta = rotation(:, 1:3, :)
      angle = sqrt(rotation(:, 1, :)**2 + rotation(:, 2, :)**2 + rotation(:, 3, :)**2)
      sine = sin(0.5_wp*angle)
      cosine = cos(0.5_wp*angle)
      ! below, sin(a/2)/a = 1/2 - a^2/48 is 1/2 to rounding and a may have underflowed
      factor = merge(sine/max(angle, tiny(1.0_wp)), 0.5_wp, angle > sqrt(epsilon(1.0_wp)))
      v%quaternion(:, 1, :) = cosine
      do i = 1, 3
         do c = 1, 3
            v%quaternion(:, 1 + c, i) = factor(:, i)*rotation(:, c, i)
         end do
      end do
      if (level < level_force) return
      call tangent_coefficients(3*lanes, angle, sine, cosine, c1, v%c2, v%c3, v%dc2, v%dc3)
   end subroutine new_vector_rotation

   !> Increments since a state: the rotations are exp(theta) state; spins and their derivatives stay those of theta.
   pure subroutine turn_state(v, state)
      type(vector_rotation_t), intent(inout) :: v
      real(wp), intent(in) :: state(lanes, 4, 3) !< quaternions, any length
      real(wp) :: a(lanes, 4)
      integer :: i
      do i = 1, 3
         a = v%quaternion(:, :, i)
         associate (b => state(:, :, i), c => v%quaternion(:, :, i))
            c(:, 1) = a(:, 1)*b(:, 1) - (a(:, 2)*b(:, 2) + a(:, 3)*b(:, 3) + a(:, 4)*b(:, 4))
            c(:, 2) = a(:, 1)*b(:, 2) + b(:, 1)*a(:, 2) + (a(:, 3)*b(:, 4) - a(:, 4)*b(:, 3))
            c(:, 3) = a(:, 1)*b(:, 3) + b(:, 1)*a(:, 3) + (a(:, 4)*b(:, 2) - a(:, 2)*b(:, 4))
            c(:, 4) = a(:, 1)*b(:, 4) + b(:, 1)*a(:, 4) + (a(:, 2)*b(:, 3) - a(:, 3)*b(:, 2))
         end associate
      end do
   end subroutine turn_state

   !> T' applied to the columns of a frame: the axes as the rotation vector of node i sees them.
   pure subroutine turned_frame(v, i, frame, turned)
      type(vector_rotation_t), intent(in) :: v
      integer, intent(in) :: i
      real(wp), intent(in) :: frame(lanes, 3, 3)
      real(wp), intent(out) :: turned(lanes, 3, 3)
      real(wp), dimension(lanes, 3) :: once, twice
      integer :: c, j
      do j = 1, 3
         call cross(v%theta(:, :, i), frame(:, :, j), once)
         call cross(v%theta(:, :, i), once, twice)
         do c = 1, 3
            turned(:, c, j) = frame(:, c, j) - v%c2(:, i)*once(:, c) + v%c3(:, i)*twice(:, c)
         end do
      end do
   end subroutine turned_frame

   !> Second derivative of the spins, worked on by the nodal moments: the symmetric part of d(T' m)/d theta.
   pure subroutine add_vector_curvature(v, moment, tangent)
      type(vector_rotation_t), intent(in) :: v
      real(wp), intent(in) :: moment(lanes, 3, 3) !< conjugate to the spins (component, node)
      real(wp), intent(inout) :: tangent(lanes, n_shell, n_shell)
      real(wp), dimension(lanes, 3) :: once, twice, b
      real(wp) :: work(lanes)
      integer :: c, i, o, r
      do i = 1, 3
         o = n_nodal*(i - 1) + uz
         associate (t => v%theta(:, :, i), m => moment(:, :, i))
            call cross(t, m, once)
            call cross(t, once, twice)
            do c = 1, 3
               b(:, c) = 0.5_wp*(v%dc3(:, i)*twice(:, c) - v%dc2(:, i)*once(:, c) - v%c3(:, i)*m(:, c))
            end do
            do c = 1, 3
               do r = 1, c
                  tangent(:, o + r, o + c) = tangent(:, o + r, o + c) + b(:, r)*t(:, c) + b(:, c)*t(:, r)
                  tangent(:, o + c, o + r) = tangent(:, o + r, o + c)
               end do
            end do
            work = v%c3(:, i)*(t(:, 1)*m(:, 1) + t(:, 2)*m(:, 2) + t(:, 3)*m(:, 3))
         end associate
         do c = 1, 3
            tangent(:, o + c, o + c) = tangent(:, o + c, o + c) + work
         end do
      end do
   end subroutine add_vector_curvature

   !> c = a cross b.
   pure subroutine cross(a, b, c)
      real(wp), intent(in) :: a(lanes, 3), b(lanes, 3)
      real(wp), intent(out) :: c(lanes, 3)
      c(:, 1) = a(:, 2)*b(:, 3) - a(:, 3)*b(:, 2)
      c(:, 2) = a(:, 3)*b(:, 1) - a(:, 1)*b(:, 3)
      c(:, 3) = a(:, 1)*b(:, 2) - a(:, 2)*b(:, 1)
   end subroutine cross
end module finshell_vector_rotation
