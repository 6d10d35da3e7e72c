!> Path following: from one equilibrium state to the next, increment by increment, until the step is done.
!>
!> Load, displacement and volume control and arc-length share one loop: an attempt prescribes one quantity (finshell_control),
!> starts from the extrapolated path (finshell_predictor) and iterates (finshell_newton). An attempt that fails is cut; an
!> attempt that passes a requested load level or monitored value is taken back and replaced by one that prescribes that value,
!> so that it is met exactly.
!> The state of the problem is always the last equilibrium state when `follow` returns, error or not.
module finshell_path
   use finshell_kinds, only: wp, dp, i4
   use finshell_status, only: status_not_converged, status_invalid_argument
   use finshell_error, only: error_t, raise, text_of
   use finshell_problem, only: problem_t
   use finshell_state, only: state_t
   use finshell_step, only: step_t, control_load, control_displacement, control_arc_length, control_volume, control_name, &
      prescribes_monitored
   use finshell_control, only: constraint_t, arc_norm
   use finshell_newton, only: newton_result_t, solve_increment
   use finshell_predictor, only: history_t
   use finshell_increment, only: next_size, toward, snapped, fraction_passed, cut_ratio
   use finshell_observer, only: record_t, observer_t
   use finshell_targets, only: targets_t, new_targets
   implicit none
   private
   public :: path_t

   !> What an increment prescribes.
   type :: attempt_t
      integer :: control = control_load
      real(wp) :: size = 0 !< signed, in the measure of the control
      logical :: landing = .false. !< a load level or displacement is to be met, in another measure than the step's
      real(wp) :: prescribed = 0 !< the value that is prescribed, set by `try`
      real(wp) :: interpolate = 0 !< > 0: start at this fraction of the increment that overshot
   end type attempt_t

   type :: path_t
      integer :: increments = 0, iterations = 0, cuts = 0 !< since the path began
      real(wp) :: mean_levels(2) = 0 !< force and moment level, mean over the converged increments
      type(history_t) :: history
      real(wp) :: size = 0 !< next increment of the step, magnitude; arc-length: 0 before the first
      real(wp) :: load_weight = 0
      real(wp) :: length_per_factor = 1 !< arc-length after its first increment: bounds are stated as load factors
      real(dp) :: started = -1
      type(record_t) :: last !< the last converged increment
      real(wp), allocatable, private :: overshoot(:) !< the increment that passed a target
      real(wp), private :: overshoot_change = 0
   contains
      procedure :: follow
      procedure, private :: bring_in_constants
      procedure, private :: advance
      procedure, private :: plan
      procedure, private :: try
      procedure, private :: settle
   end type path_t

contains

   !> Follow the path through one step.
   !>
   !> Errors: bad settings; an increment that fails after all cuts (the message has the last load factor and why); too many
   !> increments; what the observer raised. All that converged before has been given to the observer.
   subroutine follow(self, problem, step, observer, error)
      class(path_t), intent(inout) :: self
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      type(targets_t) :: targets

      if (self%started < 0) call cpu_time(self%started)
      call problem%accept()
      call self%bring_in_constants(problem, step, observer, error)
      if (allocated(error)) return
      if (allocated(step%volumes)) then
         call problem%watch_volume(error, step%element_set)
         if (allocated(error)) return
      else if (allocated(step%node_set)) then
         call problem%watch(step%node_set, step%component, error)
         if (allocated(error)) return
      else if (allocated(problem%watched)) then
         deallocate (problem%watched)
      end if
      call new_targets(targets, step, problem%state%load_factor, monitored(problem, problem%state), error)
      if (allocated(error)) return
      if (continues(self%history, step, targets, problem%state%load_factor)) then
         self%history%monitored = 0
         self%size = self%history%length(1)
      else
         call self%history%forget()
         self%size = targets%first_size
         self%load_weight = 0
         self%length_per_factor = 1
      end if
      call self%advance(problem, step, targets, observer, error)
   end subroutine follow

   !> Does an arc-length step go on along the path of the step before? Else it starts with an increment of the load factor, which
   !> would leave a branch that descends.
   pure function continues(history, step, targets, factor) result(yes)
      type(history_t), intent(in) :: history
      type(step_t), intent(in) :: step
      type(targets_t), intent(in) :: targets
      real(wp), intent(in) :: factor
      logical :: yes
      yes = step%control == control_arc_length .and. history%count > 0
      if (yes) yes = history%length(1) > 0
      if (yes .and. targets%has_level()) yes = (targets%next_level() - factor)*history%factor(1) > 0
   end function continues

   !> Raise the factor of constant loads and supports to 1, under load control, before the first step.
   subroutine bring_in_constants(self, problem, step, observer, error)
      class(path_t), intent(inout) :: self
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      type(step_t) :: ramp
      type(targets_t) :: targets

      if (.not. problem%has_constants .or. problem%state%constant_factor >= 1) return
      ramp%convergence = step%convergence
      ramp%name = 'constant loads'
      ramp%first_increment = 1
      ramp%growth = step%growth
      ramp%wanted_iterations = step%wanted_iterations
      problem%constant_phase = .true.
      call new_targets(targets, ramp, problem%state%constant_factor, 0.0_wp, error)
      call self%history%forget()
      self%size = targets%first_size
      if (.not. allocated(error)) call self%advance(problem, ramp, targets, observer, error)
      problem%constant_phase = .false.
      call self%history%forget()
   end subroutine bring_in_constants

   !> Increment after increment until the targets are reached.
   subroutine advance(self, problem, step, targets, observer, error)
      class(path_t), intent(inout) :: self
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(targets_t), intent(inout) :: targets
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      type(attempt_t) :: attempt
      type(newton_result_t) :: result
      integer :: done, cuts, iterations
      logical :: no_landing, overshot

      done = 0
      do while (.not. targets%reached())
         if (done >= step%maximum_increments) then
            call raise(error, status_not_converged, where_text(step, problem)//': the step is not finished after ' &
               //text_of(done)//' increments, the most that are allowed')
            return
         end if
         cuts = 0
         iterations = 0
         no_landing = .false.
         attempt = self%plan(problem, step, targets, no_landing)
         do
            call self%try(problem, step, targets, attempt, result)
            iterations = iterations + result%iterations
            self%iterations = self%iterations + result%iterations
            if (result%converged) then
               call look_back(self, problem, targets, attempt, overshot)
               if (.not. overshot) exit
               cycle
            end if
            call problem%restore()
            cuts = cuts + 1
            self%cuts = self%cuts + 1
            if (attempt%landing) then
               ! The value to land on lies beyond a limit point, or far: come nearer first.
               no_landing = .true.
               self%size = 0.5_wp*self%size
            else
               self%size = cut_ratio*abs(attempt%size)
            end if
            if (cuts > step%maximum_cuts .or. self%size < targets%smallest_size*self%length_per_factor) then
               call raise(error, result%code, where_text(step, problem)//': the next increment failed '//trim(merge( &
                  'too often                           ', 'and would be smaller than allowed   ', cuts > step%maximum_cuts)) &
                  //' ('//text_of(cuts) &
                  //' attempts, the last of size '//text_of(real(attempt%size, dp))//' in '//control_name(attempt%control) &
                  //'): '//result%reason)
               return
            end if
            attempt = self%plan(problem, step, targets, no_landing)
         end do
         call self%settle(problem, step, targets, attempt, result, cuts, iterations)
         done = done + 1
         call observer%increment(problem%state, self%last, error)
         if (allocated(error)) return
      end do
   end subroutine advance

   !> Choose what the next increment prescribes.
   function plan(self, problem, step, targets, no_landing) result(attempt)
      class(path_t), intent(in) :: self
      class(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(targets_t), intent(in) :: targets
      logical, intent(in) :: no_landing
      type(attempt_t) :: attempt
      real(wp), allocatable :: x(:)
      real(wp) :: change, size
      logical :: known

      size = self%size
      if (targets%largest_size > 0) size = min(size, targets%largest_size*self%length_per_factor)
      attempt%control = step%control
      select case (step%control)
      case (control_displacement, control_volume)
         attempt%size = toward(size, monitored(problem, problem%state), targets%next_value())
      case (control_arc_length)
         attempt%size = size
         if (self%history%count == 0) then
            attempt%control = control_load
            attempt%size = targets%sense*size
            if (targets%has_level()) attempt%size = toward(size, problem%factor(), targets%next_level())
            return
         end if
      case default
         attempt%size = toward(size, problem%factor(), targets%next_level())
         return
      end select
      if (no_landing .or. .not. targets%has_level()) return

      ! Would the extrapolated path arrive at the next load level? Then prescribe the level.
      allocate (x(problem%n))
      call self%history%predict(attempt%control, attempt%size, x, change, known)
      if (.not. known) return
      if ((targets%next_level() - problem%factor())*change <= 0) return
      if (abs(change) < 0.85_wp*abs(targets%next_level() - problem%factor())) return
      attempt%control = control_load
      attempt%size = targets%next_level() - problem%factor()
      attempt%landing = .true.
   end function plan

   !> Predict, constrain, iterate.
   subroutine try(self, problem, step, targets, attempt, result)
      class(path_t), intent(inout) :: self
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(targets_t), intent(in) :: targets
      type(attempt_t), intent(inout) :: attempt
      type(newton_result_t), intent(out) :: result
      type(constraint_t) :: constraint
      real(wp), allocatable :: x(:)
      real(wp) :: change, scale, length, angle
      logical :: known

      allocate (x(problem%n))
      problem%mixed = step%convergence%mixed
      constraint%control = attempt%control
      constraint%load_weight = self%load_weight
      constraint%sense = sign(1.0_wp, attempt%size)
      constraint%target = attempt%size
      if (attempt%control == control_load) then
         constraint%target = problem%base_factor() + attempt%size
         if (targets%has_level()) constraint%target = snapped(constraint%target, targets%next_level(), attempt%size)
      else if (prescribes_monitored(attempt%control)) then
         constraint%target = monitored(problem, problem%base) + attempt%size
         if (targets%has_value()) constraint%target = snapped(constraint%target, targets%next_value(), attempt%size)
      end if

      attempt%prescribed = constraint%target

      known = .false.
      if (attempt%interpolate > 0) then
         x = attempt%interpolate*self%overshoot
         change = attempt%interpolate*self%overshoot_change
         known = .true.
      else if (step%extrapolate) then
         call self%history%predict(attempt%control, attempt%size, x, change, known)
      end if
      if (known) then
         if (attempt%control == control_load) change = attempt%size
         scale = 1
         if (attempt%control == control_arc_length) then
            length = arc_norm(x, problem%field, change, self%load_weight)
            if (length > 0) scale = attempt%size/length
         end if
         angle = scale*problem%largest_rotation(x, change)
         if (step%convergence%rotation_limit > 0 .and. angle > step%convergence%rotation_limit) &
            scale = scale*step%convergence%rotation_limit/angle
         call problem%move(scale*x, scale*change)
      else if (attempt%control == control_arc_length) then
         constraint%previous = self%history%vector(:, 1)
         constraint%previous_change = self%history%factor(1)
      end if
      call solve_increment(problem, constraint, step%convergence, self%mean_levels, result)
      if (result%converged .and. attempt%control == control_load) call problem%set_factor(constraint%target)
   end subroutine try

   !> After convergence: has a level or a monitored value been passed? Then go back and prescribe it.
   subroutine look_back(self, problem, targets, attempt, overshot)
      class(path_t), intent(inout) :: self
      class(problem_t), intent(inout) :: problem
      type(targets_t), intent(in) :: targets
      type(attempt_t), intent(inout) :: attempt
      logical, intent(out) :: overshot
      real(wp) :: factor, value, old_factor, old_value, level_part, value_part

      factor = problem%factor()
      value = monitored(problem, problem%state)
      old_factor = problem%base_factor()
      old_value = monitored(problem, problem%base)
      level_part = 2
      value_part = 2
      if (targets%has_level() .and. attempt%control /= control_load) &
         level_part = fraction_passed(old_factor, factor, targets%next_level())
      if (targets%has_value() .and. .not. prescribes_monitored(attempt%control)) &
         value_part = fraction_passed(old_value, value, targets%next_value())
      overshot = min(level_part, value_part) < 1
      if (.not. overshot) return
      if (.not. allocated(self%overshoot)) allocate (self%overshoot(problem%n))
      call problem%increment(self%overshoot)
      self%overshoot_change = factor - old_factor
      call problem%restore()
      attempt%landing = .true.
      attempt%interpolate = min(level_part, value_part)
      if (level_part <= value_part) then
         attempt%control = control_load
         attempt%size = targets%next_level() - old_factor
      else
         attempt%control = merge(control_volume, control_displacement, targets%of_volume)
         attempt%size = targets%next_value() - old_value
      end if
   end subroutine look_back

   !> Accept the new state; remember it; choose the next size; fill the record.
   subroutine settle(self, problem, step, targets, attempt, result, cuts, iterations)
      class(path_t), intent(inout) :: self
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(targets_t), intent(inout) :: targets
      type(attempt_t), intent(in) :: attempt
      type(newton_result_t), intent(in) :: result
      integer, intent(in) :: cuts, iterations
      real(wp), allocatable :: x(:)
      real(wp) :: change, moved, length, reached
      real(dp) :: now
      logical :: first

      allocate (x(problem%n))
      call problem%increment(x)
      change = problem%factor() - problem%base_factor()
      moved = monitored(problem, problem%state) - monitored(problem, problem%base)
      first = self%history%count == 0
      if (step%control == control_arc_length .and. first .and. step%load_scale > 0 .and. abs(change) > 0) &
         self%load_weight = (step%load_scale*arc_norm(x, problem%field, 0.0_wp, 0.0_wp)/change)**2
      length = arc_norm(x, problem%field, change, self%load_weight)
      call self%history%remember(x, change, moved, length)

      if (step%control == control_arc_length .and. first) then
         if (abs(change) > 0) self%length_per_factor = length/abs(change)
         self%size = next_size(length, result%iterations, cuts, step)
      else if (.not. attempt%landing) then
         self%size = next_size(max(abs(attempt%size), merge(self%size, 0.0_wp, cuts == 0)), result%iterations, cuts, step)
      end if

      problem%state%increment = problem%state%increment + 1
      call problem%accept()
      reached = monitored(problem, problem%state)
      ! A volume is met as closely as the iteration has converged.
      if (attempt%control == control_volume) reached = attempt%prescribed
      call targets%pass(problem%factor(), reached)
      self%increments = self%increments + 1
      self%mean_levels = self%mean_levels + ([problem%force_level, problem%moment_level] - self%mean_levels)/self%increments
      call cpu_time(now)
      self%last = record_t(increment=problem%state%increment, control=attempt%control, iterations=iterations, cuts=cuts, &
         negative_pivots=problem%negative_pivots, regularised=result%regularised, load_factor=problem%state%load_factor, &
         monitored=monitored(problem, problem%state), size=attempt%size, residual=result%residual, &
         correction=result%correction, cpu_time=now - self%started, &
         total_increments=self%increments, total_iterations=self%iterations, total_cuts=self%cuts)
   end subroutine settle

   !> Monitored displacement or volume at a state of the problem; 0 when none is watched.
   function monitored(problem, state) result(value)
      class(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: value
      value = 0
      if (allocated(problem%watched)) value = problem%monitored(state)
   end function monitored

   function where_text(step, problem) result(text)
      type(step_t), intent(in) :: step
      class(problem_t), intent(in) :: problem
      character(len=:), allocatable :: text
      text = 'step'
      if (allocated(step%name)) text = "step '"//step%name//"'"
      text = text//': stopped at load factor '//text_of(real(problem%state%load_factor, dp))//' (increment ' &
         //text_of(problem%state%increment)//')'
   end function where_text
end module finshell_path
