!> Where an implicit step in time begins: masses, damping, the load factor at once, accelerations from equilibrium, and how long the
!> first increment is.
module finshell_dynamic_start
   use finshell_equations, only: free_part
   use finshell_held_motion, only: held_change
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_factor, only: by_constant_factor, by_load_factor, factors_at, set_factor
   use finshell_freedoms, only: n_corners, n_nodal, rx, rz, ux, uz
   use finshell_inertia_damper, only: new_damper
   use finshell_kinds, only: wp, dp
   use finshell_linked_start, only: linked_accelerations, linked_velocities
   use finshell_motion_start, only: begin_motion, check_mobile, lumped_masses
   use finshell_state, only: moved_state, small_part, state_t
   use finshell_status, only: status_input_error
   use finshell_step, only: step_t
   use finshell_support_motion, only: support_rates
   implicit none
   private
   public :: begin_dynamic, check_start, first_size

   real(wp), parameter :: per_period = 60 !< increments in the period of the motion that begins
   real(wp), parameter :: first_turn = 0.05_wp !< radian
   real(wp), parameter :: per_duration = 100 !< and in a step, at least

contains

   !> The inertia of a problem, and its state at the time 0+. Errors: see `solve_dynamic`.
   subroutine begin_dynamic(problem, step, error)
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: force(:, :)

      call check_start(problem, step, problem%state%load_factor, abs(problem%state%constant_factor - 1) <= 0, error)
      if (allocated(error)) return
      if (allocated(problem%inertia)) deallocate (problem%inertia)
      allocate (problem%inertia)
      associate (inertia => problem%inertia, state => problem%state, equations => problem%equations)
         call lumped_masses(problem, inertia%mass, error)
         if (allocated(error)) return
         call check_mobile(problem, 'dynamic', inertia%mass, uz, error)
         if (allocated(error)) return
         if (.not. step%rotatory) inertia%mass(rx:rz, :) = 0
         inertia%mass_damping = step%mass_damping
         inertia%dashpots = problem%external%dashpots
         if (step%stiffness_damping > 0) call new_damper(inertia%damper, problem%structure, state, problem%own_elements, &
            equations%held, step%stiffness_damping, error)
         if (allocated(error)) return

         call begin_motion(problem)
         call support_rates(equations, state, step%time%factor_rates(0.0_wp, state%load_factor, .true.), .true., &
                            inertia%held_velocity, inertia%held_acceleration)
         call set_factor(state, by_load_factor, step%time%factor(0.0_wp, state%load_factor))
         state%velocity = free_part(equations, state%velocity) + inertia%held_velocity
         call equations%links%settle(state)
         call equations%links%refresh(state)
         if (equations%links%any()) call linked_velocities(problem, state%velocity, error)
         if (allocated(error)) return
         call problem%accept()
         inertia%v0 = state%velocity
         allocate (inertia%a0(n_nodal, size(inertia%mass, 2)), source=0.0_wp)
         problem%condensed = .true. ! what flows into chambers at once raises their pressures at once
         call problem%evaluate(.false., error)
         problem%condensed = .false.
         if (allocated(error)) return
         force = problem%external_force - problem%internal_force + inertia%mass*inertia%held_acceleration
         if (equations%links%any()) then
            call linked_accelerations(problem, force, state%acceleration, error)
            if (allocated(error)) return
         else
            where (inertia%mass > 0) state%acceleration = force/inertia%mass
            where (.not. inertia%mass > 0) state%acceleration = 0
         end if
         state%acceleration = free_part(equations, state%acceleration) + inertia%held_acceleration
      end associate
      call problem%accept()
   end subroutine begin_dynamic

   !> Refuse supports that would jump at the beginning of a step.
   subroutine check_start(problem, step, found, constants_act, error)
      class(equilibrium_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: found !< load factor that the step finds
      logical, intent(in) :: constants_act
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: first
      real(wp), allocatable :: change(:)
      type(state_t) :: after
      first = step%time%factor(0.0_wp, found)
      associate (motion => problem%equations%motion)
         after = problem%state
         call set_factor(after, by_load_factor, found)
         change = factors_at(after, size(motion, 3))
         call set_factor(after, by_load_factor, first)
         change = factors_at(after, size(motion, 3)) - change
         if (any(abs(held_change(problem%equations, change)) > 0)) then
            call raise(error, status_input_error, 'dynamic: supports move with the load factor, which jumps from ' &
               //text_of(real(found, dp))//' to '//text_of(real(first, dp)) &
               //' at the beginning; give it over time by times and factors')
         else if (any(abs(motion(:, :, by_constant_factor)) > 0) .and. .not. constants_act) then
            call raise(error, status_input_error, "dynamic: constant supports would jump to their place: a step control = 'load' " &
               //'load_factor = 0 before this one brings them there')
         end if
      end associate
   end subroutine check_start

   !> A first increment: a part of the period that Rayleigh's quotient gives of the acceleration or, without one, of the velocity;
   !> and no more than turns or stretches a side of an element a little.
   subroutine first_size(problem, step, size, error)
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      real(wp), intent(out) :: size
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: direction(:, :), force(:, :)
      real(wp) :: mass, part, rate, stiffness
      type(state_t) :: kept

      size = step%time%duration/per_duration
      if (step%first_increment > 0) return
      rate = fastest_side(problem)
      if (rate*size > first_turn) size = first_turn/rate
      associate (inertia => problem%inertia, state => problem%state)
         direction = free_part(problem%equations, state%acceleration)
         direction(rx:rz, :) = 0
         if (.not. any(abs(direction) > 0)) direction = free_part(problem%equations, state%velocity)
         mass = sum(inertia%mass*direction**2)
         if (.not. mass > 0) return
         force = problem%internal_force
         if (problem%external%chambers%n > 0) force = force - problem%external_force
         kept = state
         problem%condensed = .true.
         part = small_part(direction, problem%detail)
         state = moved_state(kept, direction, part)
         call problem%evaluate(.false., error)
         problem%condensed = .false.
         if (allocated(error)) return
         if (problem%external%chambers%n > 0) force = force + problem%external_force
         stiffness = sum(direction*(problem%internal_force - force))/part
         state = kept
         call problem%evaluate(.false., error)
         if (allocated(error)) return
         if (stiffness > 0) size = min(size, 2*acos(-1.0_wp)*sqrt(mass/stiffness)/per_period)
      end associate
      call problem%accept()
   end subroutine first_size

   !> Largest change of a side of an element in a unit of time, per length.
   pure real(wp) function fastest_side(problem) result(rate)
      class(equilibrium_t), intent(in) :: problem
      integer :: e, i, j
      rate = 0
      associate (mesh => problem%structure%mesh, v => problem%state%velocity)
         do e = 1, size(mesh%triangles, 2)
            do i = 1, n_corners
               j = mod(i, n_corners) + 1
               associate (a => mesh%triangles(i, e), b => mesh%triangles(j, e))
                  rate = max(rate, norm2(v(ux:uz, b) - v(ux:uz, a))/norm2(mesh%coordinates(:, b) - mesh%coordinates(:, a)))
               end associate
            end do
         end do
      end associate
   end function fastest_side
end module finshell_dynamic_start
