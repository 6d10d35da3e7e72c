!> The state of a structure: displacements, rotations and factors. In motion also
!> their rates, and what laws remember. Nothing else is carried from one increment to the next.
module finshell_state
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_kinds, only: wp
   use finshell_past, only: past_t
   use finshell_table, only: follower_t
   use finshell_quaternion, only: update_quaternion, quaternion_product, quaternion_conjugate, quaternion_to_rotation_vector
   implicit none
   private
   public :: state_t, linear_change_t, new_state, move_state, moved_state, motion_between, small_part

   type :: state_t
      real(wp), allocatable :: displacement(:, :) !< (3, nodes), global
      real(wp), allocatable :: rotation(:, :) !< (4, nodes) unit quaternions, scalar first: reference to current directors
      real(wp) :: load_factor = 0 !< of the loads and supports of the case that the present step changes
      real(wp) :: constant_factor = 0 !< of constant loads and supports: rises to 1 before the first step
      real(wp) :: release_factor = 0 !< of forces that are let go before a step (finshell_stage)
      real(wp), allocatable :: case_factor(:) !< of the other cases, and of what follows tables (finshell_factor)
      type(follower_t), allocatable :: followers(:) !< what follows what; unallocated: nothing
      logical :: rises = .true. !< the factor that was changed last
      logical :: leaves = .true. !< accepted, to go on from; else it has been arrived at
      integer :: exchanged = 0 !< the factor that has changed places with the load factor (finshell_load_case); 0: none
      integer :: increment = 0 !< number of converged increments
      integer :: stage = 1 !< the step whose growths are there (finshell_stage)
      !> (factors) What growth goes by instead of the factors, where one is to change without the other; unallocated: the factors.
      real(wp), allocatable :: growing(:)
      real(wp) :: time = 0 !< spent in steps in time
      !> (n_nodal, nodes) rates of displacements, and spins; and their rates. Global axes. Unallocated: at rest.
      real(wp), allocatable :: velocity(:, :), acceleration(:, :)
      type(past_t), allocatable :: past !< of laws with states; unallocated: none has any
   contains
      procedure :: forget_trial
   end type state_t

   !> A linear change of a state: the result of a linear solution, or a buckling mode.
   type :: linear_change_t
      real(wp), allocatable :: motion(:, :) !< (n_nodal, nodes) displacements and spins, global
      real(wp), allocatable :: toward(:, :) !< (n_nodal, nodes) decides which fibres act (finshell_linear_step)
      logical :: alone = .false. !< results are those of the change, without the state it is a change of
      real(wp) :: energy = 0 !< change of the stored energy, to second order
      real(wp), allocatable :: pressure(:) !< change of the pressures of chambers; unallocated: none
      real(wp), allocatable :: growing(:) !< (factors) change of those that growth goes by; unallocated: none
   end type linear_change_t

contains

   !> The unloaded reference state.
   pure subroutine new_state(self, nodes, cases)
      type(state_t), intent(out) :: self
      integer, intent(in) :: nodes
      integer, intent(in), optional :: cases !< beside the one that steps change
      allocate (self%displacement(3, nodes), source=0.0_wp)
      allocate (self%rotation(4, nodes), source=0.0_wp)
      self%rotation(1, :) = 1
      if (present(cases)) allocate (self%case_factor(cases), source=0.0_wp)
   end subroutine new_state

   !> An accepted state was evaluated again: its laws remember what they did before, to the bit.
   pure subroutine forget_trial(self)
      class(state_t), intent(inout) :: self
      if (allocated(self%past)) self%past%end = self%past%begin
   end subroutine forget_trial

   !> Add displacements to displacements and spins to rotations.
   pure subroutine move_state(state, motion)
      type(state_t), intent(inout) :: state
      real(wp), intent(in) :: motion(:, :) !< (n_nodal, nodes) displacements and spins, global
      integer :: i
      do i = 1, size(motion, 2)
         state%displacement(:, i) = state%displacement(:, i) + motion(ux:uz, i)
         state%rotation(:, i) = update_quaternion(state%rotation(:, i), motion(rx:rz, i))
      end do
   end subroutine move_state

   !> A state moved by a part of a motion.
   pure function moved_state(state, motion, part) result(moved)
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: motion(:, :) !< (n_nodal, nodes) displacements and spins
      real(wp), intent(in) :: part
      type(state_t) :: moved
      moved = state
      call move_state(moved, part*motion)
   end function moved_state

   !> Part of a motion over which differences give derivatives to six digits and more.
   pure real(wp) function small_part(motion, length)
      real(wp), intent(in) :: motion(:, :)
      real(wp), intent(in) :: length !< of an element
      real(wp), parameter :: small_rotation = 1.0e-5_wp
      real(wp) :: largest
      largest = max(maxval(abs(motion(rx:rz, :))), maxval(abs(motion(ux:uz, :)))/length)
      small_part = small_rotation
      if (largest > 0) small_part = small_rotation/largest
   end function small_part

   !> The motion that leads from one state to another: displacements, and the rotation vectors of the relative rotations.
   pure function motion_between(from, to) result(motion)
      type(state_t), intent(in) :: from, to
      real(wp) :: motion(n_nodal, size(to%displacement, 2))
      integer :: i
      do i = 1, size(motion, 2)
         motion(ux:uz, i) = to%displacement(:, i) - from%displacement(:, i)
         motion(rx:rz, i) = quaternion_to_rotation_vector( &
                          quaternion_product(to%rotation(:, i), quaternion_conjugate(from%rotation(:, i))))
      end do
   end function motion_between
end module finshell_state
