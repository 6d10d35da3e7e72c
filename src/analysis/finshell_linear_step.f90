!> A linear analysis: one solution K(state) du = change of load, about the reference state or about an equilibrium state.
!>
!> Fibres that act in tension only have two stiffnesses where they are just unstretched, as all are in the reference state. There
!> those act that the solution stretches: it is repeated until it agrees with the fibres that were taken to act. The response
!> is then piecewise linear, in proportion to a positive factor of the load.
!>
!> The result is geometrically linear: displacements, spins and what follows from them change in proportion to the load. It is
!> given to the observer; the state itself stays, so that the next step begins where this one did.
module finshell_linear_step
   use finshell_kinds, only: wp
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_error, only: error_t, raise, text_of
   use finshell_equations, only: field_pressure, gather, scatter
   use finshell_held_motion, only: motion_at
   use finshell_equilibrium, only: equilibrium_t
   use finshell_factor, only: by_load_factor, by_constant_factor, slopes
   use finshell_growing, only: growth_along, growth_rate_t
   use finshell_load_terms, only: add_rate, add_stiffness_times, turn_moments
   use finshell_observer, only: observer_t, record_t, vibration_t
   use finshell_state, only: state_t, linear_change_t, move_state
   use finshell_status, only: status_not_converged
   use finshell_step, only: step_t, control_linear
   use finshell_team, only: largest_of
   implicit none
   private
   public :: solve_linear, linear_motion, growing_by, report_change

   integer, parameter :: most_solutions = 40, full_solutions = 10 !< to find the fibres that act; until damping begins

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
      integer :: solutions

      call problem%accept()
      load_change = step%final_load_factor - problem%state%load_factor
      constant_change = 0
      if (problem%has_constants) constant_change = 1 - problem%state%constant_factor
      call linear_motion(problem, load_change, constant_change, change%motion, change%toward, solutions, error, &
                         pressure=change%pressure)
      if (allocated(error)) return
      if (allocated(problem%structure%growths)) change%growing = growing_by(problem, load_change, constant_change)
      call change_forces(problem, load_change, constant_change, change)
      call report_change(problem, change, step%final_load_factor, control_linear, solutions, observer, error)
   end subroutine solve_linear

   !> Displacements and spins due to changes of the load factor and of the constant factor; leaves the tangent factorised.
   !>
   !> With `leading` it is this motion that decides which fibres act, and the solution only where `leading` strains nothing.
   !> Errors: a singular matrix; fibres that do not settle.
   subroutine linear_motion(problem, load_change, constant_change, motion, toward, solutions, error, leading, pressure)
      type(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: load_change, constant_change
      real(wp), allocatable, intent(out) :: motion(:, :) !< (n_nodal, nodes)
      real(wp), allocatable, intent(out) :: toward(:, :) !< (n_nodal, nodes) decides which fibres act; unallocated: no such fibres
      integer, intent(out) :: solutions !< that it took to find them; 0: no law has such fibres
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: leading(:, :)
      real(wp), allocatable, intent(inout), optional :: pressure(:) !< change of the pressures of chambers
      real(wp), allocatable :: b(:), values(:), before(:, :), of_chambers(:)
      real(wp) :: change(1)
      logical :: damped

      solutions = 0
      damped = .false.
      do
         ! at first `toward` is not allocated, and so counts as absent
         call change_of_loads(problem, load_change, constant_change, b, error, toward)
         if (allocated(error)) return
         if (solutions > 0 .and. .not. damped) then
            change = maxval(abs(problem%values - values))
            call largest_of(problem%team, change)
            if (.not. change(1) > 0) return
         end if
         if (solutions == most_solutions) then
            call raise(error, status_not_converged, 'a linear solution does not settle which fibres act in tension (' &
               //text_of(solutions)//' solutions); a nonlinear step does not ask for it')
            return
         end if
         call solve_motion(problem, load_change, constant_change, b, motion, of_chambers, error)
         if (present(pressure)) pressure = of_chambers
         if (allocated(error) .and. problem%soft) error%message = error%message &
            //'. A law without stiffness in the reference state needs a step under load before a linear one'
         if (allocated(error) .or. .not. any(problem%structure%sections%switched)) return
         solutions = solutions + 1
         values = problem%values
         if (allocated(toward)) before = toward
         toward = motion
         if (present(leading)) toward = heading(leading, motion, problem%detail)
         ! where fibres go to and fro, half the way does what the whole did not
         damped = solutions > full_solutions .and. mod(solutions, 2) == 0
         if (damped) toward = 0.5_wp*(toward + before)
      end do
   end subroutine linear_motion

   !> One motion, and a trace of another for where the first strains nothing.
   pure function heading(leading, following, length) result(toward)
      real(wp), intent(in) :: leading(:, :), following(:, :)
      real(wp), intent(in) :: length !< of an element
      real(wp) :: toward(size(leading, 1), size(leading, 2))
      real(wp), parameter :: trace = 1.0e-6_wp
      toward = leading/level(leading) + trace*following/level(following)

   contains

      pure real(wp) function level(motion)
         real(wp), intent(in) :: motion(:, :)
         level = max(maxval(abs(motion(ux:uz, :)))/length, maxval(abs(motion(rx:rz, :))), tiny(1.0_wp))
      end function level
   end function heading

   !> The matrix, and the change of the loads as a right hand side.
   subroutine change_of_loads(problem, load_change, constant_change, b, error, toward)
      type(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: load_change, constant_change
      real(wp), allocatable, intent(out) :: b(:)
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: toward(:, :)

      allocate (b(problem%n), source=0.0_wp)
      if (abs(constant_change) > 0) then
         call problem%evaluate_toward(.true., error, toward, scaling=by_constant_factor)
         if (allocated(error)) return
         b = constant_change*problem%rate
      end if
      call problem%evaluate_toward(.true., error, toward)
      if (.not. allocated(error)) b = b + load_change*problem%rate
   end subroutine change_of_loads

   subroutine solve_motion(problem, load_change, constant_change, b, motion, pressure, error)
      type(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: load_change, constant_change
      real(wp), intent(in), contiguous :: b(:)
      real(wp), allocatable, intent(out) :: motion(:, :)
      real(wp), allocatable, intent(out) :: pressure(:) !< change of the pressures of chambers
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: x(:)
      integer :: i, node

      call problem%factorise(error)
      if (allocated(error)) return
      allocate (x(problem%n), source=0.0_wp)
      call problem%solve(b, x, error)
      if (allocated(error)) return
      allocate (motion(n_nodal, size(problem%equations%number, 2)))
      call scatter(problem%equations, x, motion)
      call turn_reactions(problem, b, x, motion, error)
      if (allocated(error)) return
      pressure = x(problem%equations%n + 1:)
      do i = 1, size(problem%equations%moved)
         node = problem%equations%moved(i)
         motion(:, node) = motion(:, node) + load_change*motion_at(problem%equations, i, by_load_factor, problem%state) &
            + constant_change*motion_at(problem%equations, i, by_constant_factor, problem%state)
      end do
      call problem%equations%links%extend(motion)
   end subroutine solve_motion

   !> Where one rotation of a node is held and two are free, the reaction moment turns with the node. The matrix, symmetric, leaves
   !> that out; as it is small, a few more solutions bring it in.
   subroutine turn_reactions(problem, b, x, motion, error)
      type(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: b(:)
      real(wp), intent(inout) :: x(:), motion(:, :) !< (n_nodal, nodes)
      type(error_t), allocatable, intent(out) :: error
      integer, parameter :: most = 20
      real(wp), allocatable :: moments(:, :), turned(:, :), t(:), y(:)
      real(wp) :: change
      integer :: i
      moments = problem%internal_force - problem%bulge_force
      do i = 1, size(moments, 2)
         if (count(problem%equations%number(rx:rz, i) > 0) /= 2 .or. any(problem%external%turning_nodes == i)) moments(:, i) = 0
      end do
      if (.not. any(abs(moments(rx:rz, :)) > 0)) return
      allocate (t(size(x)), y(size(x)))
      do i = 1, most
         turned = 0*motion
         call turn_moments(moments, -motion, turned)
         t = 0
         call gather(problem%equations, turned, t(:problem%equations%n))
         call problem%solve(b + t, y, error)
         if (allocated(error)) return
         call scatter(problem%equations, y, motion)
         change = norm2((y - x)*merge(0.0_wp, 1.0_wp, problem%field == field_pressure))
         x = y
         if (change <= 1.0e-13_wp*norm2(y(:problem%equations%n))) return
      end do
   end subroutine turn_reactions

   !> (factors) Change of the factors that growth goes by.
   pure function growing_by(problem, load_change, constant_change) result(change)
      type(equilibrium_t), intent(in) :: problem
      real(wp), intent(in) :: load_change, constant_change
      real(wp), allocatable :: change(:)
      associate (state => problem%state, n => size(problem%equations%motion, 3))
         change = load_change*slopes(state, by_load_factor, n)
         if (abs(constant_change) > 0) change = change + constant_change*slopes(state, by_constant_factor, n)
      end associate
   end function growing_by

   !> Internal and external forces after the change (their difference: reactions), and the stored energy.
   subroutine change_forces(problem, load_change, constant_change, change)
      type(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: load_change, constant_change
      type(linear_change_t), intent(inout) :: change
      real(wp), allocatable :: before(:, :), unit_force(:, :, :), bulges(:, :, :)
      type(growth_rate_t) :: grown
      integer :: i

      before = problem%internal_force
      call add_stiffness_times(problem%structure, problem%equations, [(i, i=1, size(problem%structure%mesh%triangles, 2))], &
                               problem%state, change%motion, problem%internal_force, change%toward)
      call turn_moments(before, change%motion, problem%internal_force)
      if (allocated(change%growing)) then
         allocate (grown%force(n_nodal, size(before, 2)))
         call growth_along(problem%structure, problem%equations%held, problem%state, change%growing, grown)
         problem%internal_force = problem%internal_force + grown%force
         change%energy = grown%power + 0.5_wp*(grown%stiffness + sum(grown%force*change%motion))
      end if
      change%energy = change%energy + 0.5_wp*sum((before + problem%internal_force)*change%motion)
      associate (loads => problem%external, structure => problem%structure, equations => problem%equations, state => problem%state)
         change%energy = change%energy + loads%standing_energy(structure, equations, state, change%motion)
         call loads%evaluate(structure, equations, state, problem%assembly, unit_force, bulges)
         call add_rate(state, by_load_factor, load_change*(unit_force + bulges), problem%external_force)
         call add_rate(state, by_constant_factor, constant_change*(unit_force + bulges), problem%external_force)
         call loads%add_change(structure, equations, state, change%motion, problem%external_force)
         do i = 1, loads%chambers%n
            associate (factor => loads%chambers%before + i)
               problem%external_force = problem%external_force &
                  + change%pressure(i)*(unit_force(:, :, factor) + bulges(:, :, factor))
            end associate
         end do
      end associate
   end subroutine change_forces

   !> Give a change to the observer as an increment of its own number.
   subroutine report_change(problem, change, load_factor, control, solutions, observer, error, vibration)
      type(equilibrium_t), intent(inout) :: problem
      type(linear_change_t), intent(in) :: change
      real(wp), intent(in) :: load_factor
      integer, intent(in) :: control
      integer, intent(in) :: solutions !< to find the fibres that act, see `linear_motion`
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      type(vibration_t), intent(in), optional :: vibration
      type(state_t) :: changed
      type(record_t) :: record

      problem%state%increment = problem%state%increment + 1
      call problem%accept()
      changed = problem%state
      changed%load_factor = load_factor
      if (change%alone) then
         changed%displacement = 0
         changed%rotation = spread([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp], 2, size(changed%rotation, 2))
      end if
      call move_state(changed, change%motion)
      if (allocated(change%pressure)) call problem%external%chambers%move(changed, change%pressure, linear=.true.)
      record%increment = changed%increment
      record%control = control
      record%iterations = max(1, solutions)
      record%switched = solutions
      record%negative_pivots = problem%negative_pivots
      record%load_factor = load_factor
      if (present(vibration)) record%vibration = vibration
      call cpu_time(record%cpu_time)
      call observer%increment(changed, record, error, change)
   end subroutine report_change
end module finshell_linear_step
