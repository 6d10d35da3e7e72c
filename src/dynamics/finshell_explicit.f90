!> Explicit steps in time: central differences on lumped masses (finshell_leapfrog), in increments that stay below the stable one
!> (finshell_stable_step).
!>
!> Most increments are told to nobody: those at output times are, and some evenly spaced ones between. There the balance of energy
!> is drawn up too: a motion that has become unstable makes energy out of nothing, and is refused.
module finshell_explicit
   use finshell_assembly, only: paying_threads
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_factor, only: by_constant_factor, by_load_factor, set_factor, set_time
   use finshell_freedoms, only: n_nodal, ux
   use finshell_kinds, only: wp
   use finshell_leapfrog, only: leapfrog_t, new_leapfrog, sums_t
   use finshell_memo, only: memo_t
   use finshell_momentum, only: angular_momentum, momentum
   use finshell_motion_force, only: evaluate_forces, stored_energy
   use finshell_motion_start, only: begin_motion, check_mobile, lumped_masses
   use finshell_observer, only: observer_t, raise_stop, record_t
   use finshell_rotatory_inertia, only: scale_rotatory_inertia
   use finshell_stable_step, only: stable_increment
   use finshell_status, only: status_not_converged
   use finshell_state, only: state_t
   use finshell_step, only: step_t
   use finshell_support_motion, only: drive_supports, stops_of
   use finshell_time_plan, only: increments_for
   implicit none
   private
   public :: solve_explicit

   !> A step under way.
   type :: progress_t
      type(leapfrog_t) :: leapfrog
      real(wp) :: time = 0, began = 0 !< since the step began; when it did
      real(wp) :: at_start = 0 !< load factor
      real(wp) :: energy = 0, ripple = 0 !< at the beginning; see `sums_t`
      real(wp) :: most = 0 !< energy there has been to have, so far
      real(wp) :: noise = 0 !< energies below are rounding
      real(wp) :: misfit = 0 !< energy that works did not explain when an increment was told last
      real(wp) :: largest = 0 !< increment that is allowed
      integer :: threads = 1
      integer :: done = 0, told = 0 !< increments; of which observers know
      integer :: renewal = 0, interval = 10 !< when the stable increment is found anew; increments between
      type(record_t) :: record
   end type progress_t

   !> Kinetic energy beyond what there was and what loads brought in: of increments, and of the balance at those that are told.
   real(wp), parameter :: too_much = 0.5_wp, out_of_balance = 0.1_wp
   integer, parameter :: shortest_interval = 10, longest_interval = 2000
   !> Changes of the stable increment that make the interval longer and shorter. It becomes shorter at once, and longer by steps:
   !> what swings stays stable where it is stiffest.
   real(wp), parameter :: steady = 0.01_wp, unsteady = 0.03_wp, growth = 1.01_wp

contains

   !> Follow the motion from the state of the problem. Errors: no mass; an element that ends; instability; too many increments.
   subroutine solve_explicit(problem, given, observer, increments, iterations, error, course, underway)
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: given !< the step
      class(observer_t), intent(inout) :: observer
      integer, intent(inout) :: increments, iterations !< those that are told, and all; this step is added
      type(error_t), allocatable, intent(out) :: error
      !> Allocated: of a step that goes on; else it comes to hold what a restart needs. And whether it does.
      real(wp), allocatable, intent(inout), optional :: course(:)
      logical, intent(inout), optional :: underway
      type(progress_t) :: self
      type(sums_t) :: sums
      type(step_t) :: step
      real(wp) :: after, landing
      integer :: left, row
      logical :: goes_on

      step = given
      goes_on = .false.
      if (present(course)) goes_on = allocated(course)
      if (goes_on) then
         call resume(self, problem, step, course, error)
      else
         step%time%stops = stops_of(problem%state, step%time)
         call begin(self, problem, step, error)
      end if
      if (allocated(error)) return
      row = step%time%next_row(self%time, step%history_rows)
      do while (self%time < step%time%duration)
         landing = step%time%next_landing(self%time)
         left = increments_for(landing - self%time, self%largest)
         do while (left > 0)
            if (self%done >= step%maximum_increments) then
               call raise(error, status_not_converged, name_of(step)//'it is not finished after '//text_of(self%done) &
                          //' increments, the most that are allowed')
               exit
            end if
            after = (landing - self%time)/left
            call advance(self, problem, step, after)
            left = left - 1
            if (left == 0) self%time = landing
            call go_to(self, problem, step)
            call evaluate_forces(problem, error, velocity=self%leapfrog%driven(problem%equations))
            if (allocated(error)) then
               error%message = name_of(step)//'at time '//text_of(problem%state%time)//': '//error%message &
                               //'; or the motion is unstable and needs shorter increments (safety or largest_increment)'
            else
               call check_growth(self, step, problem%state%time, error)
            end if
            if (allocated(error)) exit
            if (allocated(problem%state%past)) call problem%state%past%settle(problem%state%time)
            if (left == 0 .or. self%time >= row*step%time%duration/max(1, step%history_rows)) then
               call tell(self, problem, step, observer, left == 0, course, underway, sums, error)
               if (.not. allocated(error)) call check_balance(self, step, problem%state%time, sums%work, &
                                                              allocated(problem%state%past), error)
               if (allocated(error)) exit
               row = step%time%next_row(self%time, step%history_rows)
            else if (observer%wants_stop()) then
               call keep(self, problem, course, underway)
               call raise_stop(error)
               exit
            end if
            if (self%done < self%renewal) cycle
            call renew(self, problem, step, error)
            if (allocated(error)) exit
            if (left > 0) left = increments_for(landing - self%time, self%largest)
         end do
         if (allocated(error)) exit
      end do
      increments = increments + self%told
      iterations = iterations + self%done
      if (allocated(error)) then
         call problem%restore()
      else
         if (present(course)) deallocate (course)
         call problem%evaluate(.false., error) ! a static step may follow
         if (.not. allocated(error)) call problem%accept()
      end if
   end subroutine solve_explicit

   !> Go on with a step that was under way when the run ended.
   subroutine resume(self, problem, step, course, error)
      type(progress_t), intent(out) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(inout) :: step
      real(wp), intent(in) :: course(:)
      type(error_t), allocatable, intent(out) :: error
      type(memo_t) :: memo
      type(state_t) :: began
      call cpu_time(self%record%cpu_time)
      self%record%cpu_time = -self%record%cpu_time
      self%threads = paying_threads(problem%assembly%elements)
      call new_masses(self, problem, step, error)
      if (allocated(error)) return
      memo = memo_t(numbers=course, reading=.true.)
      call carry_progress(memo, self)
      began = problem%state
      call set_factor(began, by_load_factor, self%at_start)
      call set_time(began, self%began)
      step%time%stops = stops_of(began, step%time)
      call evaluate_forces(problem, error, velocity=self%leapfrog%driven(problem%equations))
      if (allocated(error)) return
      call problem%state%forget_trial()
      if (self%done >= self%renewal) call renew(self, problem, step, error)
   end subroutine resume

   !> What goes from increment to increment beside the state.
   subroutine carry_progress(memo, self)
      type(memo_t), intent(inout) :: memo
      type(progress_t), intent(inout) :: self
      call self%leapfrog%carry(memo)
      call memo%carry(self%time)
      call memo%carry(self%began)
      call memo%carry(self%at_start)
      call memo%carry(self%energy)
      call memo%carry(self%ripple)
      call memo%carry(self%most)
      call memo%carry(self%noise)
      call memo%carry(self%largest)
      call memo%carry(self%done)
      call memo%carry(self%told)
      call memo%carry(self%renewal)
      call memo%carry(self%interval)
      call memo%carry(self%record%total_iterations)
   end subroutine carry_progress

   !> Masses, and velocities to start from.
   subroutine new_masses(self, problem, step, error)
      type(progress_t), intent(inout) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: mass(:, :)
      call begin_motion(problem)
      call lumped_masses(problem, mass, error)
      if (.not. allocated(error)) call check_mobile(problem, 'explicit', mass, n_nodal, error)
      if (allocated(error)) return
      call problem%external%place(problem%assembly)
      call scale_rotatory_inertia(problem%structure, step%rotation_scaling, mass)
      call new_leapfrog(self%leapfrog, problem%equations, problem%state, mass, step%mass_damping)
   end subroutine new_masses

   !> Loads and supports jump to where the step has them; masses, velocities and forces at the beginning.
   subroutine begin(self, problem, step, error)
      type(progress_t), intent(out) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: still(:), turned(:, :)
      real(wp), parameter :: instant = 1.0e-6_wp !< part of an increment that gives a rate
      type(sums_t) :: sums

      call cpu_time(self%record%cpu_time)
      self%record%cpu_time = -self%record%cpu_time
      self%began = problem%state%time
      self%at_start = problem%state%load_factor
      self%threads = paying_threads(problem%assembly%elements)
      allocate (still(problem%n), source=0.0_wp)
      call problem%move(still, 1 - problem%state%constant_factor, scaling=by_constant_factor)
      call problem%move(still, step%time%factor(0.0_wp, self%at_start) - self%at_start)
      call new_masses(self, problem, step, error)
      if (allocated(error)) return
      call evaluate_forces(problem, error, velocity=self%leapfrog%driven(problem%equations))
      if (.not. allocated(error)) call renew(self, problem, step, error)
      if (allocated(error)) then
         error%message = name_of(step)//error%message
         return
      end if
      self%noise = 0.5e-20_wp*sum(self%leapfrog%mass(ux, :))*(problem%detail/self%largest)**2
      associate (drive => self%leapfrog%drive)
         allocate (turned(4, size(drive, 2)))
         call prescribe(self, problem, step, instant*min(self%largest, step%time%duration), drive, turned)
      end associate
      call self%leapfrog%whole(problem%equations, problem%state, problem%internal_force, problem%external_force, &
                               self%leapfrog%drive, sums)
      self%energy = sums%kinetic + stored_energy(problem)
      self%ripple = sums%ripple
   end subroutine begin

   !> The stable increment at the present state, and when to look again.
   subroutine renew(self, problem, step, error)
      type(progress_t), intent(inout) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: last, change
      if (.not. step%automatic .and. step%first_increment > 0) then
         self%largest = step%first_increment
         self%renewal = huge(self%renewal)
         return
      end if
      last = self%largest
      call stable_increment(problem, self%leapfrog, self%largest, error)
      if (allocated(error)) return
      self%largest = step%safety*min(self%largest, huge(self%largest)/2)
      if (step%largest_increment > 0) self%largest = min(self%largest, step%largest_increment)
      change = abs(self%largest - last)/self%largest
      if (last > 0) self%largest = min(self%largest, growth*last)
      if (last > 0 .and. change < steady) &
         self%interval = min(merge(2, 5, change > 0.2_wp*steady)*self%interval, longest_interval)
      if (last > 0 .and. change > unsteady) self%interval = max(self%interval/2, shortest_interval)
      self%renewal = self%done + self%interval
   end subroutine renew

   !> One increment: velocities and the state, supports included; not yet time and load factor.
   subroutine advance(self, problem, step, after)
      type(progress_t), intent(inout) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: after
      real(wp) :: drive(n_nodal, size(problem%equations%moved)), turned(4, size(problem%equations%moved))
      call prescribe(self, problem, step, after, drive, turned)
      if (self%done == 0) self%ripple = after**2*self%ripple + 0.5_wp*self%leapfrog%square_of_jump(problem%equations, drive)
      call self%leapfrog%advance(problem%equations, problem%state, problem%internal_force, problem%external_force, after, drive, &
                                 turned, self%threads)
      self%time = self%time + after
      self%done = self%done + 1
   end subroutine advance

   !> Velocities and spins of moved supports over a length of time from now on, and rotations after it.
   subroutine prescribe(self, problem, step, length, drive, turned)
      type(progress_t), intent(in) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: length
      real(wp), intent(out) :: drive(:, :), turned(:, :) !< (n_nodal, moved), (4, moved)
      call drive_supports(problem%equations, problem%state, step%time%factor(self%time + length, self%at_start), &
                          self%began + self%time + length, length, drive, turned)
   end subroutine prescribe

   !> Time and load factor of the state follow those of the step.
   subroutine go_to(self, problem, step)
      type(progress_t), intent(in) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      call set_factor(problem%state, by_load_factor, step%time%factor(self%time, self%at_start))
      call set_time(problem%state, self%began + self%time)
   end subroutine go_to

   !> Tell the observer of the present state.
   subroutine tell(self, problem, step, observer, lands, course, underway, sums, error)
      type(progress_t), intent(inout) :: self
      class(equilibrium_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      class(observer_t), intent(inout) :: observer
      logical, intent(in) :: lands
      real(wp), allocatable, intent(inout), optional :: course(:) !< see `solve_explicit`
      logical, intent(inout), optional :: underway
      type(sums_t), intent(out) :: sums
      type(error_t), allocatable, intent(out) :: error
      type(record_t) :: record
      real(wp), allocatable :: nodal(:, :)
      real(wp) :: drive(n_nodal, size(problem%equations%moved)), turned(4, size(problem%equations%moved))

      call prescribe(self, problem, step, self%leapfrog%before, drive, turned)
      call self%leapfrog%whole(problem%equations, problem%state, problem%internal_force, problem%external_force, drive, sums)
      nodal = self%leapfrog%mass*problem%state%velocity
      self%told = self%told + 1
      problem%state%increment = problem%state%increment + 1
      record%increment = problem%state%increment
      record%control = step%control
      record%iterations = self%done - self%record%total_iterations
      record%load_factor = problem%state%load_factor
      record%size = self%leapfrog%before
      record%total_increments = self%told
      record%total_iterations = self%done
      associate (m => record%motion)
         m%time = problem%state%time
         if (lands) m%landing = step%time%is_output(self%time)
         m%kinetic_energy = sums%kinetic
         m%stored_energy = stored_energy(problem)
         m%work = sums%work
         m%damped = sums%damped
         m%misfit = m%kinetic_energy - self%leapfrog%before**2*sums%ripple + m%stored_energy + m%damped - m%work - self%energy &
                    + self%ripple
         self%misfit = m%misfit
         m%momentum = momentum(nodal)
         m%angular_momentum = angular_momentum(problem%structure%mesh%coordinates, problem%state, nodal)
      end associate
      self%record%total_iterations = self%done
      call cpu_time(record%cpu_time)
      record%cpu_time = record%cpu_time + self%record%cpu_time
      call keep(self, problem, course, underway)
      call observer%increment(problem%state, record, error)
   end subroutine tell

   !> Accept the present state, and hold what a restart from it needs.
   subroutine keep(self, problem, course, underway)
      type(progress_t), intent(inout) :: self
      class(equilibrium_t), intent(inout) :: problem
      real(wp), allocatable, intent(inout), optional :: course(:) !< see `solve_explicit`
      logical, intent(inout), optional :: underway
      type(memo_t) :: memo
      call problem%accept()
      if (.not. present(course)) return
      call carry_progress(memo, self)
      course = memo%numbers(:memo%at)
      underway = .true.
   end subroutine keep

   !> Motion cannot have more energy than there was and than loads brought in.
   subroutine check_growth(self, step, time, error)
      type(progress_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: time
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: available
      if (self%done < 2) return ! velocities of one side
      available = self%energy - self%ripple + self%leapfrog%work
      self%most = max(self%most, available)
      if (self%leapfrog%kinetic - available > too_much*self%most + self%noise) call refuse(self, step, time, error)
   end subroutine check_growth

   !> What the scheme keeps constant.
   subroutine check_balance(self, step, time, work, dissipates, error)
      type(progress_t), intent(in) :: self
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: time, work
      logical, intent(in) :: dissipates !< laws may take energy, and give none
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: unexplained
      unexplained = abs(self%misfit)
      if (dissipates) unexplained = self%misfit
      if (unexplained > out_of_balance*max(self%most, abs(self%energy + work)) + self%noise) call refuse(self, step, time, error)
   end subroutine check_balance

   subroutine refuse(self, step, time, error)
      type(progress_t), intent(in) :: self
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: time
      type(error_t), allocatable, intent(inout) :: error
      call raise(error, status_not_converged, name_of(step)//'the motion became unstable before time '//text_of(time) &
         //', in increments of '//text_of(self%leapfrog%before)//': it has energy that neither loads nor supports brought in; ' &
         //'take shorter increments (safety or largest_increment)')
   end subroutine refuse

   pure function name_of(step) result(text)
      type(step_t), intent(in) :: step
      character(len=:), allocatable :: text
      text = "explicit step: "
      if (allocated(step%name)) text = "step '"//step%name//"': "
   end function name_of
end module finshell_explicit
