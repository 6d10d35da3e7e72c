!> Implicit steps in time: increment after increment the state at the end, with inertia and damping as one more load
!> (finshell_inertia), found by the iteration of static steps.
module finshell_dynamic
   use finshell_control, only: constraint_t
   use finshell_course, only: carry_course, course_t, numbers_of
   use finshell_course_report, only: fill_record, where_text
   use finshell_dynamic_start, only: begin_dynamic, first_size
   use finshell_equations, only: free_part, unknowns_of
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_factor, only: by_load_factor, set_factor, set_time
   use finshell_freedoms, only: ux, uz
   use finshell_conservation, only: keep_energy, keep_momenta, new_rigid, rigid_t
   use finshell_kinds, only: wp, dp
   use finshell_memo, only: memo_t
   use finshell_momentum, only: angular_momentum, kinetic_energy, momentum
   use finshell_account, only: account_t
   use finshell_balance, only: balance_t
   use finshell_newmark, only: new_newmark
   use finshell_newton, only: newton_result_t, solve_increment
   use finshell_observer, only: observer_t, record_t, stop_is_wanted
   use finshell_path, only: path_t
   use finshell_state, only: motion_between, state_t
   use finshell_structure, only: turning_nodes
   use finshell_status, only: status_not_converged
   use finshell_step, only: scheme_conserving, step_t
   use finshell_support_motion, only: stops_of, support_rates
   implicit none
   private
   public :: solve_dynamic

contains

   !> Follow a step in time from the state of the problem. Errors: an element without mass, supports that would jump; an increment
   !> that fails however short; too many increments; what the observer raised. What converged before has been given to the observer.
   subroutine solve_dynamic(problem, step, path, observer, error)
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_t), intent(inout) :: path
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      type(course_t) :: course
      type(step_t) :: own
      logical :: limp, soft

      own = step
      limp = problem%limp
      soft = problem%soft
      ! masses hold what has no stiffness
      problem%limp = .false.
      problem%soft = .false.
      if (path%started < 0) call cpu_time(path%started)
      call path%history%forget()
      path%tangent%known = .false.
      course%duration = step%time%duration
      if (allocated(path%course)) then
         call resume(course, problem, own, path, error)
      else
         if (allocated(problem%kept_inertia)) deallocate (problem%kept_inertia)
         call path%account%begin()
         course%begun = problem%state%time
         course%at_start = problem%state%load_factor
         own%time%stops = stops_of(problem%state, step%time)
         if (step%stiffness_damping > 0) course%first_displacement = problem%state%displacement
         if (step%stiffness_damping > 0) course%first_rotation = problem%state%rotation
         if (step%stiffness_damping > 0 .and. allocated(problem%state%past)) course%first_past = problem%state%past%begin
         call begin_dynamic(problem, step, error)
         if (.not. allocated(error)) call begin(course, problem, step, error)
      end if
      if (.not. allocated(error)) call follow(course, problem, own, path, observer, error)
      if (.not. allocated(error) .and. allocated(path%course)) deallocate (path%course)
      problem%limp = limp
      problem%soft = soft
      if (.not. allocated(problem%inertia)) return
      if (allocated(error)) then
         if (error%code == stop_is_wanted) call move_alloc(problem%inertia, problem%kept_inertia)
      end if
      if (allocated(problem%inertia)) deallocate (problem%inertia)
   end subroutine solve_dynamic

   subroutine begin(self, problem, step, error)
      type(course_t), intent(inout) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: first
      call first_size(problem, step, first, error)
      if (allocated(error)) return
      call self%pace%begin(step, first, sqrt(sum(problem%inertia%mass(ux:uz, :)*problem%state%displacement**2)))
      call choose_method(self, problem, step)
      self%energy = kinetic_energy(problem%state, problem%inertia%mass*problem%state%velocity) + problem%entry%energy
      self%auxiliary = problem%state%acceleration
      call keep_forces(self, problem)
   end subroutine begin

   !> What goes by the step and the supports alone.
   subroutine choose_method(self, problem, step)
      type(course_t), intent(inout) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      self%conserves = step%scheme == scheme_conserving
      problem%inertia%rodrigues = self%conserves
      problem%inertia%rates_of_masters = self%conserves .or. step%rho_infinity > 0.85_wp
      self%method = new_newmark(merge(1.0_wp, step%rho_infinity, self%conserves))
      self%flies = all(problem%equations%supported%displacements == 0)
   end subroutine choose_method

   !> Go on with a step that was under way when the run ended: masses and damping are those of its beginning.
   subroutine resume(self, problem, step, path, error)
      type(course_t), intent(inout) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(inout) :: step
      type(path_t), intent(in) :: path
      type(error_t), allocatable, intent(out) :: error
      type(memo_t) :: memo
      type(state_t) :: state
      state = problem%state
      memo = memo_t(numbers=path%course, reading=.true.)
      call self%pace%begin(step, self%duration, 0.0_wp)
      call carry_course(memo, self)
      call set_factor(problem%state, by_load_factor, self%at_start)
      call set_time(problem%state, self%begun)
      step%time%stops = stops_of(problem%state, step%time)
      if (allocated(problem%kept_inertia)) then
         call move_alloc(problem%kept_inertia, problem%inertia)
         call choose_method(self, problem, step)
         problem%state = state
         call problem%accept()
         problem%base_entry%reaction = self%reaction
         return
      end if
      if (allocated(self%first_displacement)) problem%state%displacement = self%first_displacement
      if (allocated(self%first_rotation)) problem%state%rotation = self%first_rotation
      if (allocated(self%first_past) .and. allocated(problem%state%past)) then
         problem%state%past%begin = self%first_past
         problem%state%past%since = self%begun
      end if
      call begin_dynamic(problem, step, error)
      if (allocated(error)) return
      call choose_method(self, problem, step)
      problem%state = state
      call problem%accept()
      call problem%evaluate(.false., error)
      if (allocated(error)) return
      call problem%state%forget_trial()
      call problem%accept()
      problem%base_entry%reaction = self%reaction
   end subroutine resume

   subroutine follow(self, problem, step, path, observer, error)
      type(course_t), intent(inout) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_t), intent(inout) :: path
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      type(record_t) :: record
      type(newton_result_t) :: result
      real(wp) :: h, end_time, estimate, speed
      integer :: failures

      do while (self%time < self%duration)
         if (self%increments >= step%maximum_increments) then
            call raise(error, status_not_converged, where_text(self, step)//'the step is not finished after ' &
                       //text_of(self%increments)//' increments, the most that are allowed')
            return
         end if
         record = record_t()
         failures = 0
         do
            call self%aim(step%time, h, end_time)
            call attempt(self, problem, step, h, end_time, result)
            record%iterations = record%iterations + result%iterations
            if (result%converged) then
               call measure(self, problem, h, estimate, speed)
               if (.not. self%pace%refuses(estimate, h)) exit
               call self%pace%take(estimate, h, result%iterations, 0.0_wp)
            else
               failures = failures + 1
               call self%pace%fail(h)
               if (failures > step%maximum_cuts .or. self%pace%exhausted()) then
                  path%iterations = path%iterations + record%iterations
                  path%cuts = path%cuts + record%cuts
                  call problem%restore()
                  call raise(error, result%code, where_text(self, step)//'an increment of '//text_of(real(h, dp))//' fails: ' &
                             //result%reason)
                  return
               end if
            end if
            record%cuts = record%cuts + 1
            call problem%restore()
         end do
         call self%pace%take(estimate, h, result%iterations, speed)
         self%time = end_time
         call settle(self, problem, h, path%account)
         self%motion%landing = step%time%is_output(self%time)
         call fill_record(self, problem, step, h, result, path, record)
         self%reaction = problem%base_entry%reaction
         path%course = numbers_of(self)
         path%underway = .true.
         call observer%increment(problem%state, record, error)
         if (allocated(error)) return
      end do
   end subroutine follow

   !> Predict the state at the end of an increment and iterate.
   subroutine attempt(self, problem, step, h, end_time, result)
      type(course_t), intent(in) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: h, end_time
      type(newton_result_t), intent(out) :: result
      real(wp), allocatable :: x(:)
      real(wp) :: factor, rates(2)

      factor = step%time%factor(end_time, self%at_start)
      associate (inertia => problem%inertia, base => problem%base)
         call self%method%prepare(base, self%auxiliary, h, inertia)
         rates = step%time%factor_rates(end_time, self%at_start, .false.)
         allocate (x(problem%n), source=0.0_wp)
         call unknowns_of(problem%equations, h*base%velocity + 0.5_wp*h**2*self%auxiliary, x(:problem%equations%n))
         problem%state%time = self%begun + end_time ! what follows it goes along with the move
         call problem%move(x, factor - base%load_factor)
         call support_rates(problem%equations, problem%state, rates, .false., inertia%held_velocity, inertia%held_acceleration)
      end associate
      call problem%say('Increment in time of '//text_of(real(h, dp))//' to time '//text_of(real(end_time, dp)))
      call solve_increment(problem, constraint_t(target=factor), step%convergence, self%mean_levels, result)
      if (.not. result%converged) call problem%say('     failed: '//result%reason)
   end subroutine attempt

   !> The estimated error of a converged increment.
   subroutine measure(self, problem, h, estimate, speed)
      type(course_t), intent(in) :: self
      class(equilibrium_t), intent(in) :: problem
      real(wp), intent(in) :: h
      real(wp), intent(out) :: estimate, speed
      associate (inertia => problem%inertia, base => problem%base)
         speed = max(size_of(base%velocity), size_of(inertia%velocity))
         estimate = self%pace%error_of(h, self%method%error_constant*size_of(inertia%acceleration - base%acceleration), &
                                       size_of(motion_between(base, problem%state)), speed)
      end associate

   contains

      !> Norm of a nodal vector in the masses.
      pure real(wp) function size_of(nodal)
         real(wp), intent(in) :: nodal(:, :) !< (n_nodal, nodes)
         real(wp), allocatable :: own(:, :)
         integer :: i
         own = free_part(problem%equations, nodal)
         if (self%flies) then
            do i = 1, 3
               own(i, :) = own(i, :) - sum(problem%inertia%mass(i, :)*own(i, :))/sum(problem%inertia%mass(i, :))
            end do
         end if
         size_of = sqrt(sum(problem%inertia%mass*own**2))
      end function size_of
   end subroutine measure

   !> Take the state as the base of the next increment.
   subroutine settle(self, problem, h, account)
      type(course_t), intent(inout) :: self
      class(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: h
      type(account_t), intent(inout) :: account
      real(wp), allocatable :: nodal(:, :)
      type(balance_t) :: balance

      balance = problem%balance(by_load_factor)
      if (account%kept) call account%add(balance, 0.0_wp)
      associate (inertia => problem%inertia, state => problem%state)
         state%velocity = inertia%velocity
         state%acceleration = inertia%acceleration
         state%time = self%begun + self%time
         state%increment = state%increment + 1
         call self%method%advance(problem%base, state%acceleration, self%auxiliary)
         self%motion%work = self%motion%work + balance%work
         self%motion%damped = self%motion%damped + 0.5_wp*sum(motion_between(problem%base, state)*(self%damping + inertia%damping))
         if (self%conserves) call conserve(self, problem, h, balance%known)
         nodal = inertia%mass*state%velocity
         self%motion%time = state%time
         self%motion%kinetic_energy = kinetic_energy(state, nodal)
         self%motion%stored_energy = problem%entry%energy
         self%motion%misfit = self%motion%kinetic_energy + problem%entry%energy - self%energy - self%motion%work &
                              + self%motion%damped
         self%motion%momentum = momentum(nodal)
         self%motion%angular_momentum = angular_momentum(problem%structure%mesh%coordinates, state, nodal)
      end associate
      call keep_forces(self, problem)
      self%increments = self%increments + 1
      self%mean_levels = self%mean_levels + ([problem%force_level, problem%moment_level] - self%mean_levels)/self%increments
      call problem%accept()
   end subroutine settle

   !> Project the velocities onto what is conserved.
   subroutine conserve(self, problem, h, known)
      type(course_t), intent(inout) :: self
      class(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: h
      logical, intent(in) :: known !< whether the work is; if not, the energy is what it comes to
      type(rigid_t) :: rigid
      real(wp), allocatable :: x(:, :, :)
      real(wp) :: excess
      associate (inertia => problem%inertia, state => problem%state, base => problem%base, equations => problem%equations, &
                 reference => problem%structure%mesh%coordinates)
         allocate (x(3, size(reference, 2), 3))
         x(:, :, 1) = reference + base%displacement
         x(:, :, 3) = reference + state%displacement
         x(:, :, 2) = 0.5_wp*(x(:, :, 1) + x(:, :, 3))
         call new_rigid(rigid, equations, inertia%mass, turning_nodes(problem%structure), x(:, :, 2))
         call keep_momenta(rigid, equations, inertia%mass, x, base%velocity, 0.5_wp*h*(self%load + load_of(problem)), &
                           state%velocity)
         excess = kinetic_energy(state, inertia%mass*state%velocity) + problem%entry%energy &
                  - self%energy - self%motion%work + self%motion%damped
         if (known) then
            call keep_energy(rigid, equations, inertia%mass, x(:, :, 3), -excess, state%velocity)
         else if (.not. allocated(state%past)) then ! of laws with states the excess is what they have dissipated
            self%energy = self%energy + excess
         end if
      end associate
   end subroutine conserve

   !> Forces of loads and damping at the state just evaluated, (n_nodal, nodes).
   function load_of(problem) result(load)
      class(equilibrium_t), intent(in) :: problem
      real(wp), allocatable :: load(:, :)
      load = problem%external_force + problem%inertia%mass*problem%inertia%acceleration
   end function load_of

   !> Of the state just evaluated, what the next increment needs.
   subroutine keep_forces(self, problem)
      type(course_t), intent(inout) :: self
      class(equilibrium_t), intent(in) :: problem
      self%damping = problem%inertia%damping
      self%load = load_of(problem)
   end subroutine keep_forces
end module finshell_dynamic
