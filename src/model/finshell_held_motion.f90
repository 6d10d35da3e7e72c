!> How supports move what they hold: displacements by the changes of the factors that scale them, rotations that are given as a
!> whole by vectors.
module finshell_held_motion
   use finshell_equations, only: equations_t
   use finshell_factor, only: factor_at, slope_of
   use finshell_freedoms, only: n_nodal, rx, rz
   use finshell_kinds, only: wp
   use finshell_quaternion, only: quaternion_product, rotation_vector_to_quaternion
   use finshell_rotation, only: tangent_operator
   use finshell_state, only: state_t
   implicit none
   private
   public :: anchor, motion_of, motion_at, turn_held, held_rotation, held_change, largest_turn

contains

   !> Prescribed rotations count from a state on: that in which supports have changed.
   pure subroutine anchor(self, rotation, factor)
      type(equations_t), intent(inout) :: self
      real(wp), intent(in) :: rotation(:, :) !< (4, nodes)
      real(wp), intent(in) :: factor(:) !< as many as move supports
      self%anchor_rotation = rotation
      self%anchor_factor = factor
   end subroutine anchor

   !> Displacement and spin of a moved node per change of factor k. Where the whole rotation is given by a vector that two factors
   !> scale, the spin is not the vector of the one that changes.
   pure function motion_of(self, i, k, state) result(motion)
      type(equations_t), intent(in) :: self
      integer, intent(in) :: i !< index into moved
      integer, intent(in) :: k !< finshell_factor
      type(state_t), intent(in) :: state
      real(wp) :: motion(n_nodal)
      motion = self%motion(:, i, k)
      if (self%turned(i)) motion(rx:rz) = matmul(tangent_operator(rotation_at(self, i, state)), motion(rx:rz))
   end function motion_of

   !> The same per change of a factor with all that follow it.
   pure function motion_at(self, i, active, state) result(motion)
      type(equations_t), intent(in) :: self
      integer, intent(in) :: i !< index into moved
      integer, intent(in) :: active !< factor that changes (finshell_factor)
      type(state_t), intent(in) :: state
      real(wp) :: motion(n_nodal), slope
      integer :: k
      motion = 0
      do k = 1, size(self%motion, 3)
         slope = slope_of(state, active, k)
         if (abs(slope) > 0) motion = motion + slope*motion_of(self, i, k, state)
      end do
   end function motion_at

   !> Rotation vector of a moved node whose whole rotation is given, from its anchor on.
   pure function rotation_at(self, i, state) result(rotation)
      type(equations_t), intent(in) :: self
      integer, intent(in) :: i !< index into moved
      type(state_t), intent(in) :: state
      real(wp) :: rotation(3), factor
      integer :: k
      rotation = 0
      do k = 1, size(self%motion, 3)
         factor = factor_at(state, k)
         if (allocated(self%anchor_factor)) factor = factor - self%anchor_factor(k)
         rotation = rotation + factor*self%motion(rx:rz, i, k)
      end do
   end function rotation_at

   !> That rotation, a quaternion.
   pure function held_rotation(self, i, state) result(rotation)
      type(equations_t), intent(in) :: self
      integer, intent(in) :: i !< index into moved
      type(state_t), intent(in) :: state
      real(wp) :: rotation(4)
      rotation = rotation_vector_to_quaternion(rotation_at(self, i, state))
      if (allocated(self%anchor_rotation)) rotation = quaternion_product(rotation, self%anchor_rotation(:, self%moved(i)))
   end function held_rotation

   !> Rotations of nodes whose whole rotation is given.
   pure subroutine turn_held(self, state)
      type(equations_t), intent(in) :: self
      type(state_t), intent(inout) :: state
      integer :: i
      do i = 1, size(self%moved)
         if (self%turned(i)) state%rotation(:, self%moved(i)) = held_rotation(self, i, state)
      end do
   end subroutine turn_held

   !> (n_nodal, moved) Displacements and rotation vectors of held components for changes of factors.
   pure function held_change(self, changes) result(motion)
      type(equations_t), intent(in) :: self
      real(wp), intent(in) :: changes(:) !< (factors that move supports)
      real(wp) :: motion(n_nodal, size(self%moved))
      integer :: k
      motion = 0
      do k = 1, size(changes)
         if (abs(changes(k)) > 0) motion = motion + changes(k)*self%motion(:, :, k)
      end do
   end function held_change

   !> Largest rotation (radian) of a node in a correction x of the unknowns and of factors.
   pure function largest_turn(self, x, changes) result(angle)
      class(equations_t), intent(in) :: self
      real(wp), intent(in) :: x(:) !< (n)
      real(wp), intent(in) :: changes(:) !< of the factors that move supports
      real(wp) :: angle
      real(wp) :: turn(rx:rz), held(n_nodal, size(self%moved))
      integer :: i, k
      angle = 0
      do i = 1, size(self%number, 2)
         turn = 0
         do k = rx, rz
            if (self%number(k, i) > 0) turn(k) = x(self%number(k, i))
         end do
         angle = max(angle, norm2(turn))
      end do
      held = held_change(self, changes)
      do i = 1, size(self%moved)
         angle = max(angle, norm2(held(rx:rz, i)))
      end do
   end function largest_turn
end module finshell_held_motion
