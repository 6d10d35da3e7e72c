!> Static steps that take time: the load factor goes over time, or a monitored displacement or volume, and each increment looks for
!> equilibrium at its end. Without inertia it is the laws that know of the time (finshell_past), and loads that follow tables.
!>
!> Laws take the strain of an increment as going along a straight line. How far it is off this line, an eighth of the change of the
!> motion from increment to increment, is the error that increments are chosen by, relative to how far the step has come.
module finshell_timed_step
   use finshell_balance, only: balance_t
   use finshell_control, only: constraint_t
   use finshell_course, only: carry_course, course_t, numbers_of
   use finshell_course_report, only: fill_record, where_text
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_factor, only: by_load_factor, set_factor, set_time
   use finshell_kinds, only: wp, dp
   use finshell_memo, only: memo_t
   use finshell_newton, only: newton_result_t, solve_increment
   use finshell_observer, only: observer_t, record_t
   use finshell_path, only: path_t
   use finshell_state, only: state_t
   use finshell_status, only: status_input_error, status_not_converged
   use finshell_step, only: control_load, convergence_t, step_t
   use finshell_support_motion, only: stops_of
   use finshell_time_plan, only: time_plan_t
   implicit none
   private
   public :: check_timed_start, solve_timed

   real(wp), parameter :: per_duration = 10000 !< first increments in a step, where it begins and behind corners, at least
   real(wp), parameter :: off_chord = 0.125_wp !< distance of a parabola from its chord, over the change of two equal increments
   real(wp), parameter :: negligible = 1.0e-6_wp !< motion beside the displacements that there are
   real(wp), parameter :: rounding = 1.0e-10_wp
   real(wp), parameter :: close = 1.0e-6_wp !< tolerances of the state that it begins with

contains

   !> Follow such a step from the state of the problem. Errors: a load factor that jumps at the beginning; an increment that fails
   !> however short; too many increments; what the observer raised. What converged before has been given to the observer.
   subroutine solve_timed(problem, step, path, observer, error, resumes)
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_t), intent(inout) :: path
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in) :: resumes !< it was under way, or a ramp before it
      type(course_t) :: course
      type(step_t) :: own
      type(memo_t) :: memo
      integer :: ramping

      own = step
      if (path%started < 0) call cpu_time(path%started)
      if (allocated(path%course)) then
         memo = memo_t(numbers=path%course, reading=.true.)
         call course%pace%begin(step, first_size(step), 0.0_wp)
         call carry_course(memo, course)
         course%duration = step%time%duration
         call problem%accept()
         call problem%watch_step(step, error)
         if (allocated(error)) return
      else
         ramping = by_load_factor
         if (resumes .and. path%underway) ramping = path%ramping
         call problem%accept()
         if (ramping == by_load_factor) call path%account%begin()
         call path%ramps_before(problem, step, observer, error, ramping)
         if (.not. allocated(error)) call begin(course, problem, step, error)
         if (allocated(error)) return
      end if
      if (step%prescribes /= control_load) call own%time%spread_evenly(course%at_start)
      if (course%seen /= problem%state%increment) call balance_first(course, problem, own, path)
      own%time%stops = stops_from(problem%state, own, course)
      call path%history%forget()
      path%tangent%known = .false.
      call follow(course, problem, own, path, observer, error)
      if (.not. allocated(error) .and. allocated(path%course)) deallocate (path%course)
   end subroutine solve_timed

   subroutine begin(self, problem, step, error)
      type(course_t), intent(inout) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(error_t), allocatable, intent(out) :: error
      self%duration = step%time%duration
      self%begun = problem%state%time
      call problem%watch_step(step, error)
      if (allocated(error)) return
      self%at_start = problem%state%load_factor
      if (step%prescribes /= control_load) self%at_start = problem%monitored(problem%state)
      if (step%prescribes == control_load) call check_timed_start(step, self%at_start, error)
      if (allocated(error)) error%message = where_text(self, step)//error%message
      if (allocated(error)) return
      call self%pace%begin(step, first_size(step), 0.0_wp)
      self%seen = -1
      self%mean_levels = 0
   end subroutine begin

   !> What steps before have left out of balance is no motion in time: it is balanced in none, where that succeeds.
   subroutine balance_first(self, problem, step, path)
      type(course_t), intent(inout) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_t), intent(inout) :: path
      type(newton_result_t) :: result
      type(constraint_t) :: constraint
      type(convergence_t) :: settings
      if (size_of_displacements(problem) > 0) then
         settings = step%convergence
         settings%residual = min(settings%residual, close)
         settings%correction = min(settings%correction, close)
         constraint%control = step%prescribes
         if (step%prescribes == control_load) then
            constraint%target = step%time%factor(self%time, self%at_start)
         else
            constraint%target = problem%monitored(problem%state)
         end if
         call solve_increment(problem, constraint, settings, self%mean_levels, result)
         path%iterations = path%iterations + result%iterations
         if (result%converged) then
            call problem%accept()
         else
            call problem%restore()
         end if
      end if
      if (self%increments == 0) self%energy = problem%base_entry%energy
      if (allocated(self%auxiliary)) deallocate (self%auxiliary)
   end subroutine balance_first

   !> Refuse a load factor that jumps at the beginning.
   subroutine check_timed_start(step, found, error)
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: found !< load factor that the step finds
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: first
      first = step%time%factor(0.0_wp, found)
      if (abs(first - found) > rounding*max(1.0_wp, abs(first))) call raise(error, status_input_error, &
         'the load factor jumps from '//text_of(real(found, dp))//' to '//text_of(real(first, dp))//' where the step begins, ' &
         //"which takes no time: a step control = 'load' without duration goes there at once")
   end subroutine check_timed_start

   pure real(wp) function first_size(step) result(size)
      type(step_t), intent(in) :: step
      size = step%time%duration/per_duration
      if (step%first_increment > 0) size = step%first_increment
   end function first_size

   !> Where tables that follow the load factor, if it is known beforehand, or the time, have corners.
   function stops_from(state, step, course) result(stops)
      type(state_t), intent(in) :: state
      type(step_t), intent(in) :: step
      type(course_t), intent(in) :: course
      real(wp), allocatable :: stops(:)
      type(state_t) :: began
      type(time_plan_t) :: plan
      began = state
      plan = step%time
      if (step%prescribes == control_load) then
         call set_factor(began, by_load_factor, course%at_start)
      else
         deallocate (plan%table)
      end if
      call set_time(began, course%begun)
      stops = stops_of(began, plan)
   end function stops_from

   subroutine follow(self, problem, step, path, observer, error)
      type(course_t), intent(inout) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(path_t), intent(inout) :: path
      class(observer_t), intent(inout) :: observer
      type(error_t), allocatable, intent(out) :: error
      type(record_t) :: record
      type(newton_result_t) :: result
      real(wp) :: h, end_time, estimate, moved, standing
      character(len=:), allocatable :: reason
      integer :: failures

      do while (self%time < self%duration)
         if (self%increments >= step%maximum_increments) then
            call raise(error, status_not_converged, where_text(self, step)//'the step is not finished after ' &
                       //text_of(self%increments)//' increments, the most that are allowed')
            return
         end if
         record = record_t()
         failures = 0
         standing = size_of_displacements(problem)
         do
            call self%aim(step%time, h, end_time)
            call attempt(self, problem, step, h, end_time, result)
            record%iterations = record%iterations + result%iterations
            if (result%converged) then
               call measure(self, problem, h, standing, estimate, moved)
               if (.not. self%pace%refuses(estimate, h)) exit
               call self%pace%take(estimate, h, result%iterations, 0.0_wp)
               reason = ' leads to another state than the motion before it does'
            else
               failures = failures + 1
               call self%pace%fail(h)
               reason = ' fails: '//result%reason
            end if
            if (failures > step%maximum_cuts .or. self%pace%exhausted()) then
               path%iterations = path%iterations + record%iterations
               path%cuts = path%cuts + record%cuts
               call problem%restore()
               call raise(error, status_not_converged, where_text(self, step)//'an increment of '//text_of(real(h, dp))//reason &
                          //"; where a structure snaps, control = 'dynamic' goes on")
               return
            end if
            record%cuts = record%cuts + 1
            call problem%restore()
         end do
         call self%pace%take(estimate, h, result%iterations, 0.0_wp)
         self%time = end_time
         call settle(self, problem, h, moved, path)
         if (step%time%is_corner(self%time)) then
            if (allocated(self%auxiliary)) deallocate (self%auxiliary)
            self%pace%size = min(self%pace%size, first_size(step))
         end if
         self%motion%landing = step%time%is_output(self%time)
         record%negative_pivots = problem%negative_pivots
         record%monitored = problem%monitored_or_zero()
         call fill_record(self, problem, step, h, result, path, record)
         path%course = numbers_of(self)
         path%underway = .true.
         path%ramping = by_load_factor
         call observer%increment(problem%state, record, error)
         if (allocated(error)) return
      end do
   end subroutine follow

   !> Go on as the increment before did, and iterate.
   subroutine attempt(self, problem, step, h, end_time, result)
      type(course_t), intent(in) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: h, end_time
      type(newton_result_t), intent(out) :: result
      real(wp), allocatable :: x(:)
      type(constraint_t) :: constraint
      real(wp) :: change
      constraint%control = step%prescribes
      constraint%target = step%time%factor(end_time, self%at_start)
      allocate (x(problem%n), source=0.0_wp)
      change = 0
      if (allocated(self%auxiliary)) then
         x = h*self%auxiliary(:problem%n, 1)
         change = h*self%auxiliary(problem%n + 1, 1)
      end if
      if (step%prescribes == control_load) change = constraint%target - problem%base%load_factor
      problem%state%time = self%begun + end_time ! what follows it goes along with the move
      call problem%move(x, change)
      call problem%say('Increment in time of '//text_of(real(h, dp))//' to time '//text_of(real(end_time, dp)))
      call solve_increment(problem, constraint, step%convergence, self%mean_levels, result)
      if (.not. result%converged) call problem%say('     failed: '//result%reason)
   end subroutine attempt

   !> The estimated error of a converged increment, and how far it has moved. Where no motion goes before it any motion is an error,
   !> relative to the displacements that there are; from rest it is none.
   subroutine measure(self, problem, h, standing, estimate, moved)
      type(course_t), intent(in) :: self
      class(equilibrium_t), intent(in) :: problem
      real(wp), intent(in) :: h
      real(wp), intent(in) :: standing !< displacements where it began
      real(wp), intent(out) :: estimate, moved
      real(wp), allocatable :: x(:)
      real(wp) :: scale
      allocate (x(problem%n))
      call problem%increment(x)
      moved = size_of(problem, x)
      estimate = 0
      if (allocated(self%auxiliary)) then
         scale = max(self%way + moved, negligible*standing)
         if (scale > 0) estimate = off_chord*size_of(problem, x - h*self%auxiliary(:problem%n, 1))/scale
      else if (standing > 0) then
         estimate = off_chord*moved/standing
      end if
   end subroutine measure

   !> Root of the mean square of a vector over the unknowns.
   pure real(wp) function size_of(problem, vector)
      class(equilibrium_t), intent(in) :: problem
      real(wp), intent(in) :: vector(:)
      size_of = sqrt(sum(problem%weight*vector**2)/max(sum(problem%weight), tiny(1.0_wp)))
   end function size_of

   real(wp) function size_of_displacements(problem)
      class(equilibrium_t), intent(in) :: problem
      real(wp), allocatable :: there(:)
      allocate (there(problem%n))
      call problem%magnitude(there)
      size_of_displacements = size_of(problem, there)
   end function size_of_displacements

   !> Take the state as the base of the next increment.
   subroutine settle(self, problem, h, moved, path)
      type(course_t), intent(inout) :: self
      class(equilibrium_t), intent(inout) :: problem
      real(wp), intent(in) :: h, moved
      type(path_t), intent(inout) :: path
      type(balance_t) :: balance
      real(wp), allocatable :: x(:)
      balance = problem%balance(by_load_factor)
      if (path%account%kept) call path%account%add(balance, 0.0_wp)
      allocate (x(problem%n))
      call problem%increment(x)
      call problem%transport(x)
      self%auxiliary = reshape([x/h, problem%change(by_load_factor)/h], [problem%n + 1, 1])
      self%way = self%way + moved
      self%motion%work = self%motion%work + balance%work
      self%motion%time = self%begun + self%time
      self%motion%stored_energy = problem%entry%energy
      self%motion%misfit = problem%entry%energy - self%energy - self%motion%work
      self%increments = self%increments + 1
      self%mean_levels = self%mean_levels + ([problem%force_level, problem%moment_level] - self%mean_levels)/self%increments
      problem%state%increment = problem%state%increment + 1
      self%seen = problem%state%increment
      call problem%accept()
   end subroutine settle
end module finshell_timed_step
