!> How the nodes of a shell turn when they move far: the retraction of a motion.
!>
!> A correction is a solution of linear equations: its displacements add, its spins turn. In it a thin element is bent little, as its
!> nodes turn with its sides: to first order. To second order they do not: sides that turn by an angle and stretch in
!> the same motion turn by less, and what is missing bends an element of side d and thickness h by h/d times as much at its
!> surfaces. Where elements are smaller than the thickness a correction of a tenth of a radian tears them. So the nodes are turned on by
!> what the elements around them turn, as bodies, beyond their linear spin. That is of second order: Newton's method
!> stays what it is, and the states that it converges to do not change.
module finshell_retraction
   use finshell_kinds, only: wp
   use finshell_rotation, only: cross_product
   use finshell_quaternion, only: quaternion_product, quaternion_to_rotation_vector, rotation_vector_to_quaternion
   implicit none
   private
   public :: turns_beyond, spins_with

   real(wp), parameter :: negligible = 1.0e-9_wp !< gradient of a motion whose square is rounding
   !> Cosine of the turn of a normal, and the area over that before, beyond which an element says nothing.
   real(wp), parameter :: least_cosine = -0.5_wp, least_area = 1.0e-6_wp

contains

   !> Rotation vectors of the nodes: mean, weighted by reference area, over the elements at a node, of rotation minus linear spin in a
   !> motion from a displaced state.
   pure function turns_beyond(triangles, reference, displacement, motion) result(beyond)
      integer, intent(in) :: triangles(:, :) !< (3, elements)
      real(wp), intent(in) :: reference(:, :), displacement(:, :) !< (3, nodes)
      real(wp), intent(in) :: motion(:, :) !< (>= 3, nodes) displacements come first
      real(wp) :: beyond(3, size(reference, 2))
      beyond = mean_turns(triangles, reference, displacement, motion, .true.)
   end function turns_beyond

   !> The same mean of the linear spins.
   pure function spins_with(triangles, reference, displacement, motion) result(spins)
      integer, intent(in) :: triangles(:, :) !< (3, elements)
      real(wp), intent(in) :: reference(:, :), displacement(:, :) !< (3, nodes)
      real(wp), intent(in) :: motion(:, :) !< (>= 3, nodes) displacements come first
      real(wp) :: spins(3, size(reference, 2))
      spins = mean_turns(triangles, reference, displacement, motion, .false.)
   end function spins_with

   pure function mean_turns(triangles, reference, displacement, motion, beyond) result(turns)
      integer, intent(in) :: triangles(:, :)
      real(wp), intent(in) :: reference(:, :), displacement(:, :), motion(:, :)
      logical, intent(in) :: beyond
      real(wp) :: turns(3, size(reference, 2))
      real(wp) :: weight(size(reference, 2)), area, spin(3), turn(3), x(3, 3), v(3, 3)
      integer :: i, k, node
      turns = 0
      weight = 0
      do i = 1, size(triangles, 2)
         x = reference(:, triangles(:, i))
         area = norm2(cross_product(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1)))
         x = x + displacement(:, triangles(:, i))
         v = motion(:3, triangles(:, i))
         call element_turn(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1), v(:, 2) - v(:, 1), v(:, 3) - v(:, 1), beyond, spin, turn)
         if (.not. beyond) turn = spin
         do k = 1, 3
            node = triangles(k, i)
            turns(:, node) = turns(:, node) + area*turn
            weight(node) = weight(node) + area
         end do
      end do
      do i = 1, size(weight)
         if (weight(i) > 0) turns(:, i) = turns(:, i)/weight(i)
      end do
   end function mean_turns

   !> Linear spin of a triangle with the sides a and b from one corner, which change by da and db; and its rotation beyond that.
   pure subroutine element_turn(a, b, da, db, beyond, spin, turn)
      real(wp), intent(in) :: a(3), b(3), da(3), db(3)
      logical, intent(in) :: beyond !< the rotation is wanted
      real(wp), intent(out) :: spin(3), turn(3)
      real(wp) :: n(3), e1(3), e2(3), d1(3), d2(3), f1(3), f2(3), m(3), tilt(4), g1(3), g2(3), c, along, across

      turn = 0
      spin = 0
      n = cross_product(a, b)
      across = norm2(n)
      along = norm2(a)
      if (.not. (across > 0 .and. along > 0)) return
      n = n/across
      e1 = a/along
      e2 = cross_product(n, e1)
      across = across/along
      d1 = da/along
      d2 = (db - dot_product(b, e1)*d1)/across
      spin = dot_product(d2, n)*e1 - dot_product(d1, n)*e2 + 0.5_wp*(dot_product(e2, d1) - dot_product(e1, d2))*n
      if (.not. beyond .or. max(maxval(abs(d1)), maxval(abs(d2))) < negligible) return
      f1 = e1 + d1
      f2 = e2 + d2
      m = cross_product(f1, f2)
      if (.not. norm2(m) > least_area) return
      m = m/norm2(m)
      c = dot_product(n, m)
      if (.not. c > least_cosine) return
      ! The shortest rotation of the normal, then that about it (polar decomposition in the plane).
      tilt(1) = sqrt(0.5_wp*(1 + c))
      tilt(2:4) = cross_product(n, m)/(2*tilt(1))
      g1 = turned(e1)
      g2 = turned(e2)
      c = atan2(dot_product(g2, f1) - dot_product(g1, f2), dot_product(g1, f1) + dot_product(g2, f2))
      turn = quaternion_to_rotation_vector(quaternion_product(rotation_vector_to_quaternion(c*m), tilt)) - spin

   contains

      pure function turned(v) result(w)
         real(wp), intent(in) :: v(3)
         real(wp) :: w(3)
         w = 2*cross_product(tilt(2:4), v)
         w = v + tilt(1)*w + cross_product(tilt(2:4), w)
      end function turned
   end subroutine element_turn
end module finshell_retraction
