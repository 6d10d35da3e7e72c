!> A linear analysis: one solution K(state) du = change of load, about the reference state or about an equilibrium state.
!>
!> The result is geometrically linear: displacements, spins and what follows from them change in proportion to the load. It is
!> given to the observer; the state itself stays, so that the next step begins where this one did.
module finshell_linear_step
   use finshell_kinds, only: wp, dp
   use finshell_error, only: error_t
   use finshell_equations, only: motion_at, gather, scatter
   use finshell_equilibrium, only: equilibrium_t
   use finshell_load_terms, only: add_pressures, add_bulges, change_of_bulges, add_stiffness_times, turn_moments
   use finshell_observer, only: observer_t, record_t
   use finshell_quaternion, only: update_quaternion
   use finshell_state, only: state_t, linear_change_t
   use finshell_step, only: step_t, control_linear
   implicit none
   private
   public :: solve_linear, linear_motion, report_change

contains

   !> Solve for the load factor at which the step ends; constant loads that are not there yet are part of the change.
   !> Errors: a singular matrix; what the observer raised.
   subroutine solve_linear(problem, step, observer, error)
      type(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      type(linear_change_t) :: change
      real(wp) :: load_change, constant_change

      call problem%accept()
      load_change = step%final_load_factor - problem%state%load_factor
      constant_change = 0
      if (problem%has_constants) constant_change = 1 - problem%state%constant_factor
      call linear_motion(problem, load_change, constant_change, change%motion, error)
      if (allocated(error)) return
      call change_forces(problem, load_change, constant_change, change)
      call report_change(problem, change, step%final_load_factor, control_linear, observer, error)
   end subroutine solve_linear

   !> Displacements and spins due to changes of the load factor and of the constant factor; leaves the tangent factorised.
   subroutine linear_motion(problem, load_change, constant_change, motion, error)
      type(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: load_change, constant_change
      real(wp), allocatable, intent(out) :: motion(:, :) !< (6, nodes)
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: b(:), x(:)
      integer :: i, node

      problem%mixed = .false.
      problem%regularisation = 0
      allocate (b(problem%n), x(problem%n), source=0.0_wp)
      if (abs(constant_change) > 0) then
         problem%constant_phase = .true.
         call problem%evaluate(.true., error)
         problem%constant_phase = .false.
         if (allocated(error)) return
         b = constant_change*problem%rate
      end if
      call problem%evaluate(.true., error)
      if (allocated(error)) return
      b = b + load_change*problem%rate
      call problem%factorise(error)
      if (allocated(error)) return
      call problem%solve(b, x, error)
      if (allocated(error)) return
      allocate (motion(6, size(problem%equations%number, 2)))
      call scatter(problem%equations, x, motion)
      call turn_reactions(problem, b, x, motion, error)
      if (allocated(error)) return
      do i = 1, size(problem%equations%moved)
         node = problem%equations%moved(i)
         associate (e => problem%equations, load_factor => problem%state%load_factor, constant => problem%state%constant_factor)
            motion(:, node) = motion(:, node) + load_change*motion_at(e, i, 1, load_factor, constant) &
               + constant_change*motion_at(e, i, 2, load_factor, constant)
         end associate
      end do
   end subroutine linear_motion

   !> Where one rotation of a node is held and two are free, the reaction moment turns with the node. The matrix, symmetric, leaves
   !> that out; as it is small, a few more solutions bring it in.
   subroutine turn_reactions(problem, b, x, motion, error)
      type(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: b(:)
      real(wp), intent(inout) :: x(:), motion(:, :) !< (6, nodes)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: most = 20
      real(wp), allocatable :: moments(:, :), turned(:, :), t(:), y(:)
      integer :: i
      moments = problem%internal_force - problem%bulge_force
      do i = 1, size(moments, 2)
         if (count(problem%equations%number(4:6, i) > 0) /= 2 .or. any(problem%external%turning_nodes == i)) moments(:, i) = 0
      end do
      if (.not. any(abs(moments(4:6, :)) > 0)) return
      allocate (t(size(x)), y(size(x)))
      do i = 1, most
         turned = 0*motion
         call turn_moments(moments, -motion, turned)
         call gather(problem%equations, turned, t)
         call problem%solve(b + t, y, error)
         if (allocated(error)) return
         call scatter(problem%equations, y, motion)
         if (norm2(y - x) <= 1.0e-13_wp*norm2(y)) return
         x = y
      end do
   end subroutine turn_reactions

   !> Internal and external forces after the change (their difference: reactions), and the stored energy.
   subroutine change_forces(problem, load_change, constant_change, change)
      type(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: load_change, constant_change
      type(linear_change_t), intent(inout) :: change
      real(wp), allocatable :: before(:, :), unit_force(:, :, :), bulges(:, :, :), forward(:, :, :), backward(:, :, :)
      integer :: i

      before = problem%internal_force
      call add_stiffness_times(problem%structure, problem%equations, [(i, i=1, size(problem%structure%mesh%triangles, 2))], &
                               problem%state, change%motion, problem%internal_force)
      call turn_moments(before, change%motion, problem%internal_force)
      change%energy = 0.5_wp*sum((before + problem%internal_force)*change%motion)
      ! Pressure forces are of second degree in the positions: the difference is their exact derivative.
      call unit_forces(0.0_wp, unit_force)
      bulges = 0*unit_force
      call add_bulges(problem%external, problem%structure%mesh, problem%state, problem%assembly, bulges)
      call unit_forces(1.0_wp, forward)
      call unit_forces(-1.0_wp, backward)
      problem%external_force = problem%external_force + load_change*unit_force(:, :, 1) + constant_change*unit_force(:, :, 2) &
         + 0.5_wp*problem%state%load_factor*(forward(:, :, 1) - backward(:, :, 1)) &
         + 0.5_wp*problem%state%constant_factor*(forward(:, :, 2) - backward(:, :, 2)) &
         + load_change*bulges(:, :, 1) + constant_change*bulges(:, :, 2)
      call change_of_bulges(problem%external, problem%structure%mesh, problem%state, change%motion, problem%external_force)

   contains

      subroutine unit_forces(part, force)
         real(wp), intent(in) :: part !< of the motion
         real(wp), allocatable, intent(out) :: force(:, :, :)
         type(state_t) :: moved
         moved = problem%state
         moved%displacement = moved%displacement + part*change%motion(1:3, :)
         force = problem%external%dead
         call add_pressures(problem%external, problem%equations, problem%moved_of, problem%structure%mesh, moved, &
            problem%assembly, 1, force)
      end subroutine unit_forces
   end subroutine change_forces

   !> Give a change to the observer as an increment of its own number.
   subroutine report_change(problem, change, load_factor, control, observer, error)
      type(equilibrium_t), intent(inout) :: problem
      type(linear_change_t), intent(in) :: change
      real(wp), intent(in) :: load_factor
      integer, intent(in) :: control
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      type(state_t) :: changed
      type(record_t) :: record
      integer :: i

      problem%state%increment = problem%state%increment + 1
      call problem%accept()
      changed = problem%state
      changed%load_factor = load_factor
      if (change%alone) then
         changed%displacement = 0
         changed%rotation = spread([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 2, size(changed%rotation, 2))
      end if
      do i = 1, size(change%motion, 2)
         changed%displacement(:, i) = changed%displacement(:, i) + change%motion(1:3, i)
         changed%rotation(:, i) = update_quaternion(changed%rotation(:, i), change%motion(4:6, i))
      end do
      record%increment = changed%increment
      record%control = control
      record%iterations = 1
      record%negative_pivots = problem%negative_pivots
      record%load_factor = load_factor
      call cpu_time(record%cpu_time)
      problem%change = change
      call observer%increment(changed, record, error)
      deallocate (problem%change)
   end subroutine report_change
end module finshell_linear_step
