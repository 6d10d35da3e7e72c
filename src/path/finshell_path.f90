!> Path following: from one equilibrium state to the next, increment by increment, until the step is done.
!>
!> Load, displacement and volume control and arc-length share one loop: an attempt prescribes one quantity (finshell_tracker,
!> finshell_control), starts from the extrapolated path (finshell_predictor) and iterates (finshell_newton). An attempt that fails,
!> or leads elsewhere than along the path (finshell_caution), is cut; one that passes a requested load level or monitored value
!> is taken back and replaced by one that prescribes it, so that it is met exactly. Limit and bifurcation points are noticed
!> (finshell_stability), located on request (finshell_locate), and branches followed on request. When `follow` returns, error or
!> not, the problem is in the last equilibrium state.
module finshell_path
   use finshell_kinds, only: wp, dp
   use finshell_status, only: status_not_converged
   use finshell_error, only: error_t, raise, text_of
   use finshell_factor, only: by_constant_factor, by_load_factor, by_release, corners, factor_at
   use finshell_problem, only: problem_t
   use finshell_step, only: step_t, control_load, control_arc_length, control_volume, &
      leaves_state, snap_mark, snap_refuse, ramp_before
   use finshell_account, only: account_t
   use finshell_attempt_text, only: announce_attempt, announce_outcome
   use finshell_control, only: arc_norm, control_vector
   use finshell_newton, only: newton_result_t
   use finshell_next_size, only: adapt, fall_back
   use finshell_observer, only: record_t, observer_t
   use finshell_targets, only: targets_t, new_targets
   use finshell_tracker, only: tracker_t, attempt_t, monitored
   use finshell_stability, only: stability_t, find_stability, bifurcation_point, limit_and_bifurcation
   use finshell_locate, only: mark, location_t
   use finshell_caution, only: objection, at_fold, fold_text
   use finshell_balance, only: verdict_t
   use finshell_diagnosis, only: failure_t, failure_text, crawls_to_limit, where_text
   use finshell_progress, only: progress_t, continues
   use finshell_stabilisation, only: stabiliser_t
   implicit none
   private
   public :: path_t

   type, extends(tracker_t) :: path_t
      integer :: increments = 0, iterations = 0, cuts = 0 !< since the path began
      real(dp) :: started = -1
      type(record_t) :: last !< the last converged increment
      type(stability_t) :: stability !< of the last equilibrium state
      integer :: case = 1 !< of loads, that the last step changed
      real(wp) :: laboured = 0 !< increments that failed at first, the last ones counting most
      real(wp) :: largest = 0 !< change of the load factor in an increment of this step
      type(progress_t) :: progress
      type(account_t) :: account !< of energy, where it is asked for
      type(targets_t) :: targets !< of the step under way
      integer :: done = 0 !< its increments
      logical :: underway = .false. !< it can go on from here
      integer :: ramping = by_load_factor !< the factor that its increments change: its own, or that of a ramp before it
   contains
      procedure :: follow
      procedure :: ramps_before
      procedure :: ramp
      procedure, private :: advance
      procedure, private :: settle
   end type path_t

   real(wp), parameter :: fading = 0.75_wp !< of the memory of failed attempts, from increment to increment
   real(wp), parameter :: least_fall = 0.1_wp !< of the first increment, for one by dynamic relaxation

contains

   !> Follow the path through one step.
   !>
   !> Errors: bad settings; an increment that fails after all cuts (the message has the last load factor and why); too many
   !> increments; what the observer raised. All that converged before has been given to the observer.
   subroutine follow(self, problem, step, observer, error, resume)
      class(path_t), intent(inout) :: self
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: resume !< the path was under way (finshell_path_memory): it goes on where the problem stands
      type(targets_t) :: targets
      logical :: again
      integer :: ramping

      again = .false.
      if (present(resume)) again = resume
      ramping = by_load_factor
      if (again) ramping = self%ramping
      again = again .and. ramping == by_load_factor
      if (self%started < 0) call cpu_time(self%started)
      if (allocated(problem%state%velocity)) deallocate (problem%state%velocity, problem%state%acceleration)
      call problem%accept()
      if (.not. again .and. ramping == by_load_factor) call self%account%begin()
      if (.not. again) call self%ramps_before(problem, step, observer, error, ramping)
      if (allocated(error)) return
      call problem%watch_step(step, error)
      if (allocated(error)) return
      if (again) then
         targets = self%targets
         targets%largest_size = abs(step%largest_increment)
         if (step%smallest_increment > 0) targets%smallest_size = step%smallest_increment
         call self%advance(problem, step, targets, observer, error, self%done)
         return
      end if
      call new_targets(targets, step, problem%state%load_factor, monitored(problem, problem%state), error, &
                       corners(problem%state, step%scaling))
      if (allocated(error)) return
      self%substitute = .false.
      self%bifurcations = 0
      self%largest = 0
      self%falls = 0
      self%stabiliser = stabiliser_t(part=merge(step%stabilise, 0.0_wp, step%control == control_load .and. .not. step%relaxes))
      self%laboured = 0
      call self%progress%begin(problem%state)
      self%rough = .false.
      self%hampered = .false.
      self%smooth = .true.
      if (allocated(self%branch)) deallocate (self%branch)
      if (step%case == self%case .and. continues(self%history, step, targets, problem%state%load_factor)) then
         self%history%monitored = 0
         self%history%has_tangent = .false. ! another control goes another way from here
         self%size = self%history%length(1)
      else
         call self%history%forget()
         self%kinked = .false.
         self%tangent%known = .false.
         self%stability%sense = 0 ! a step may go back the way the one before has come
         self%size = targets%first_size
         self%load_weight = 0
         self%length_per_factor = 1
      end if
      self%case = step%case
      call self%advance(problem, step, targets, observer, error)
   end subroutine follow

   !> What comes before a step, by load control: let go what is to be let go, bring in constant loads and supports.
   subroutine ramps_before(self, problem, step, observer, error, underway)
      class(path_t), intent(inout) :: self
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      integer, intent(in), optional :: underway !< the factor of the ramp that a run goes on with; by_load_factor: none
      integer :: ramping
      ramping = by_load_factor
      if (present(underway)) ramping = underway
      if (problem%state%release_factor > 0) call self%ramp(problem, step, by_release, observer, error, ramping == by_release)
      if (allocated(error) .or. leaves_state(step%control)) return ! which see to constant loads themselves
      if (ramping == by_constant_factor .or. (problem%has_constants .and. problem%state%constant_factor < 1)) &
         call self%ramp(problem, step, by_constant_factor, observer, error, ramping == by_constant_factor)
   end subroutine ramps_before

   subroutine ramp(self, problem, step, scaling, observer, error, resumes)
      class(path_t), intent(inout) :: self
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step !< that comes after it
      integer, intent(in) :: scaling !< the factor that it changes
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in) :: resumes !< it was under way
      type(targets_t) :: targets
      if (allocated(problem%watched)) deallocate (problem%watched)
      if (resumes) then
         targets = self%targets
         call self%advance(problem, ramp_before(step, scaling), targets, observer, error, self%done)
      else
         call new_targets(targets, ramp_before(step, scaling), factor_at(problem%state, scaling), 0.0_wp, error)
         call self%history%forget()
         self%kinked = .false.
         self%tangent%known = .false.
         self%stability%sense = 0
         self%size = targets%first_size
         if (.not. allocated(error)) call self%progress%begin(problem%state)
         if (.not. allocated(error)) call self%advance(problem, ramp_before(step, scaling), targets, observer, error)
      end if
      if (.not. allocated(error)) call self%history%forget() ! a run that ends here may go on
   end subroutine ramp

   !> Increment after increment until the targets are reached.
   subroutine advance(self, problem, step, targets, observer, error, before)
      class(path_t), intent(inout) :: self
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(targets_t), intent(inout) :: targets
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      integer, intent(in), optional :: before !< increments of the step already done
      type(attempt_t) :: attempt
      type(newton_result_t) :: result
      type(stability_t) :: after
      type(record_t) :: record
      type(location_t) :: place
      type(verdict_t) :: verdict
      character(len=:), allocatable :: complaint
      type(failure_t) :: failure
      logical :: no_landing, overshot, turning, ended, crawls, descent_left, spent
      integer :: done, cuts
      done = 0
      if (present(before)) done = before
      do while (.not. targets%reached())
         complaint = self%progress%complaint(step)
         if (done >= step%maximum_increments) complaint = 'the step is not finished after '//text_of(done) &
                                                          //' increments, the most that are allowed'
         if (complaint /= '') call raise(error, status_not_converged, where_text(step, problem)//': '//complaint)
         if (allocated(error)) return
         cuts = 0
         record = record_t()
         no_landing = .false.
         spent = .false.
         if (allocated(self%refused)) deallocate (self%refused)
         attempt = self%plan(problem, step, targets, no_landing)
         if (self%rough) attempt%descends = self%may_descend(problem, step, targets, result, cuts, attempt)
         failure = failure_t(control=step%control, increment=self%increments, pivots=self%stability%negative_pivots, &
                             factor=factor_at(problem%state, step%scaling), way=self%history%way_to_limit(), size=attempt%size, &
                             slenderness=problem%slenderness, soft=problem%soft, constant=step%scaling == by_constant_factor, &
                             laboured=fading*self%laboured + 1, crumples=problem%crumples)
         do
            call announce_attempt(problem, step, attempt, self%increments + 1, cuts)
            call self%try(problem, step, targets, attempt, result)
            call announce_outcome(problem, result)
            record%iterations = record%iterations + result%iterations
            record%steps = record%steps + result%steps
            spent = spent .or. result%spent
            failure%tried_pivots = max(failure%tried_pivots, result%first_pivots)
            turning = .false.
            if (result%converged) then
               overshot = .false.
               if (attempt%control /= control_vector) call self%look_back(problem, step, targets, attempt, overshot)
               if (overshot) cycle
               call find_stability(problem, step%scaling, result, self%increments == 0, self%stability, after, record%iterations)
               if (attempt%along .and. after%negative_pivots > max(self%stability%negative_pivots, 0)) then
                  ! Along the tangent an increment may arrive on an unstable branch that the path does not take.
                  attempt%chord = .true.
                  call problem%restore()
                  cycle
               end if
               call objection(self%tracker_t, problem, step, attempt, result, self%stability, after, complaint, turning, verdict)
               if (complaint == '') call self%stabiliser%object(problem, step%scaling, complaint)
               if (complaint == '') call mark(self%tracker_t, problem, step, targets, self%stability, attempt, after, result, &
                                              record, place, cuts, complaint)
               if (complaint == '') exit
               result%converged = .false.
               result%code = status_not_converged
               result%reason = complaint
               call announce_outcome(problem, result)
            else if (self%may_start_softly(problem, step, result, cuts, attempt)) then
               call problem%restore()
               attempt%softly = .true.
               attempt%turn = result%first_rotation
               cycle
            else if (.not. spent .and. self%may_descend(problem, step, targets, result, cuts, attempt)) then
               call problem%restore()
               attempt%descends = .true.
               cycle
            end if
            call problem%restore()
            descent_left = cuts == 0 .and. step%descent .and. attempt%control == control_load .and. .not. attempt%descends
            cuts = cuts + 1
            call fall_back(self%tracker_t, step, targets, attempt, cuts, turning, no_landing)
            ended = at_fold(self%tracker_t, attempt) .and. .not. self%leaping
            failure%attempts = cuts
            failure%too_many = cuts > step%maximum_cuts
            crawls = crawls_to_limit(failure, self%size, self%largest) .and. .not. (step%smallest_increment > 0 .or. descent_left)
            if (step%snap == snap_mark .and. self%snapped_size > 0 .and. attempt%control == self%snapped_control &
                .and. .not. self%leaping .and. (ended .or. exhausted() .or. crawls)) then
               self%leaping = .true.
               self%size = self%snapped_size
               cuts = 0
            else if ((exhausted() .or. crawls) .and. self%may_fall_back(problem, step, attempt)) then
               call fall_into(attempt)
               cycle
            else if (exhausted() .or. crawls .or. (ended .and. step%snap == snap_refuse)) then
               self%iterations = self%iterations + record%iterations
               self%cuts = self%cuts + cuts
               call note(attempt)
               call raise(error, result%code, where_text(step, problem)//': '//failure_text(failure)//fold_text(self%snapped_size))
               return
            end if
            attempt = self%plan(problem, step, targets, no_landing)
            attempt%again = .true.
            attempt%plain = cuts > 1 .and. mod(cuts, 2) == 0 ! what mixed Newton cannot reach in a smaller one, plain Newton may
         end do

         record%cuts = cuts
         record%snap = verdict%snap
         record%misfit = verdict%misfit
         call self%settle(problem, step, targets, attempt, result, record)
         self%stability = after
         if (self%kinked) self%stability%sense = 0
         if (record%located .and. any(record%event == [bifurcation_point, limit_and_bifurcation])) &
            call self%pass_bifurcation(problem, step, place%vector)
         done = done + 1
         self%targets = targets
         self%done = done
         self%ramping = step%scaling
         self%underway = .true.
         call observer%increment(problem%state, self%last, error)
         if (allocated(error)) return
      end do

   contains

      subroutine note(last) ! why it has failed
         type(attempt_t), intent(in) :: last
         if (last%relaxes .and. .not. step%relaxes) then
            failure%reason = failure%reason//'. Then '//result%reason(:scan(result%reason//';', ';') - 1)
         else
            call failure%note(result%code, last%control, last%size, result%reason)
         end if
      end subroutine note

      !> When nothing else is left: the increment that was tried first, if it is no tiny one; from rest the way to the next level.
      subroutine fall_into(last)
         type(attempt_t), intent(inout) :: last
         call note(last)
         self%size = max(abs(failure%size), least_fall*targets%first_size)
         ! a sheet, which the load has to stretch
         if (failure%increment == 0) self%size = abs(targets%next_level() - factor_at(problem%state, step%scaling))
         last = self%plan(problem, step, targets, no_landing)
         last%relaxes = .true.
         self%falls = self%falls + 1
      end subroutine fall_into

      logical function exhausted()
         exhausted = cuts > step%maximum_cuts .or. self%size < targets%smallest_size*self%length_per_factor
      end function exhausted
   end subroutine advance

   !> Accept the new state; remember it; choose the next size; fill the record.
   subroutine settle(self, problem, step, targets, attempt, result, record)
      class(path_t), intent(inout) :: self
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(targets_t), intent(inout) :: targets
      type(attempt_t), intent(in) :: attempt
      type(newton_result_t), intent(in) :: result
      type(record_t), intent(in) :: record !< iterations, cuts and event of the increment
      real(wp), allocatable :: x(:)
      real(wp) :: change, moved, length, factor, reached
      real(dp) :: now
      logical :: first, missed

      allocate (x(problem%n))
      call problem%increment(x)
      change = problem%change(step%scaling)
      moved = monitored(problem, problem%state) - monitored(problem, problem%base)
      first = self%history%count == 0 .and. attempt%control == control_load
      if (step%control == control_arc_length .and. first .and. step%load_scale > 0 .and. abs(change) > 0) &
         self%load_weight = (step%load_scale*arc_norm(x, problem%field, 0.0_wp, 0.0_wp)/change)**2
      length = arc_norm(x, problem%field, change, self%load_weight)
      self%largest = max(self%largest, abs(change))
      self%laboured = fading*self%laboured + merge(1, 0, record%cuts > 0)
      self%tangent = result%last
      self%leaping = .false.
      missed = self%hampered .and. record%cuts > 0
      call self%remember(problem, step, attempt, result, missed, x, change, moved, length)
      call self%turn_corner(targets, factor_at(problem%state, step%scaling))
      call self%stabiliser%calibrate(problem, step%scaling, change)
      self%rough = attempt%descends .and. result%regularised > 0
      self%hampered = record%cuts > 0
      ! What a descent has found is not the way the path goes.
      if ((self%rough .or. attempt%relaxes) .and. step%control == control_load) call self%history%forget()

      if (self%account%kept) call self%account%add(problem%balance(step%scaling), problem%taken)
      problem%state%increment = problem%state%increment + 1
      call problem%accept()
      factor = factor_at(problem%state, step%scaling)
      reached = monitored(problem, problem%state)
      ! A volume is met as closely as the iteration has converged.
      if (attempt%control == control_volume) reached = attempt%prescribed
      call targets%pass(factor, reached)
      call adapt(self%tracker_t, step, targets, attempt, result, record%cuts, first, length, change, reached)

      self%increments = self%increments + 1
      self%iterations = self%iterations + record%iterations
      self%cuts = self%cuts + record%cuts
      self%mean_levels = self%mean_levels + ([problem%force_level, problem%moment_level] - self%mean_levels)/self%increments
      call self%progress%note(problem%state, targets, factor, reached, record%negative_pivots)
      call cpu_time(now)
      self%last = record
      self%last%increment = problem%state%increment
      self%last%control = attempt%control
      self%last%descended = self%rough
      self%last%account = self%account
      self%last%relaxed = attempt%relaxes
      self%last%taken = self%stabiliser%share()
      if (.not. (self%rough .or. attempt%relaxes)) self%last%regularised = result%regularised
      self%last%load_factor = problem%state%load_factor
      self%last%monitored = monitored(problem, problem%state)
      self%last%size = attempt%size
      self%last%residual = result%residual
      self%last%correction = result%correction
      self%last%stands_in = self%substitute
      self%last%rounding = result%rounding
      self%last%cpu_time = now - self%started
      self%last%total_increments = self%increments
      self%last%total_iterations = self%iterations
      self%last%total_cuts = self%cuts
   end subroutine settle
end module finshell_path
