!> A model that a host takes step by step. The driver and a host go through the same door, `follow_step`; a host's observer ends it
!> after each increment, and the next call goes on from there as a restart would, but that everything is still in memory.
module finshell_session
   use finshell_bell, only: bell_t
   use finshell_course, only: course_of, course_t, numbers_of
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_factor, only: by_load_factor
   use finshell_host, only: coming, host_cases
   use finshell_imperfect, only: apply_given, apply_modes
   use finshell_input, only: input_t, parse_input, read_input
   use finshell_input_imperfection, only: modes_end
   use finshell_job, only: follow_step
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t
   use finshell_observer, only: stop_is_wanted
   use finshell_path, only: path_t
   use finshell_preparation, only: prepare
   use finshell_progress, only: progress_t
   use finshell_reporter, only: reporter_t
   use finshell_status, only: status_input_error
   use finshell_step, only: control_dynamic, control_explicit, control_load, control_name, has_course, is_in_time, &
      is_motion, leaves_state, scheme_conserving
   use finshell_targets, only: targets_t
   use finshell_team, only: team_t
   use finshell_thread_choice, only: choose_threads
   use finshell_trial, only: mesh_warning, warning_of
   use finshell_wishes, only: follow_time, gather, let_stand, wishes_t
   !$ use omp_lib, only: omp_get_max_threads
   implicit none
   private
   public :: session_t

   type :: session_t
      type(input_t) :: input
      type(equilibrium_t) :: problem
      type(path_t) :: path
      type(bell_t) :: bell
      type(reporter_t), allocatable :: reporter !< of results, once the host has asked for some
      integer :: step = 1 !< of the input, under way or to begin
      logical :: begun = .false. !< it is under way
      logical :: finished = .false. !< there is nothing left to do
      type(wishes_t) :: wishes !< of the host
      integer :: threads = 1 !< that pay
      character(len=:), allocatable :: warnings !< a line each
   contains
      procedure :: begin
      procedure :: advance
      procedure :: settle
      procedure :: proposed
      procedure :: step_name
      procedure, nopass :: control_of
      procedure, private :: hand_over
      procedure, private :: bring_in
      procedure, private :: drive
   end type session_t

   real(wp), parameter :: sliver = 1.0e-9_wp !< of the duration of a step: no increment of time is as short

contains

   !> Read an input, from its file or as a text, with the mesh that is given if there is one. The session stays where it is in
   !> memory. Errors: what is wrong with the input, by file and line.
   subroutine begin(self, file, error, text, mesh)
      class(session_t), intent(inout), target :: self
      character(len=*), intent(in) :: file !< with a text: for messages, and its folder for other files
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: text
      type(mesh_t), intent(in), optional :: mesh
      class(team_t), pointer :: alone
      integer :: i, nodes

      nullify (alone)
      if (present(text)) then
         call parse_input(text, file, self%input, error, given=mesh)
      else
         call read_input(file, self%input, error)
      end if
      if (allocated(error)) return
      if (allocated(self%input%accuracy)) then
         call raise(error, status_input_error, self%input%file//':'//text_of(self%input%accuracy%line) &
                    //': &accuracy: a model that is taken step by step keeps its mesh; leave the group out, or use the program')
         return
      end if
      if (size(self%input%sensitivities) > 0) then
         call raise(error, status_input_error, self%input%file//':'//text_of(self%input%sensitivities(1)%line) &
                    //': &sensitivity: derivatives stand in the results of the program; a model that is taken step by step has '// &
                    'none: leave the group out, or use the program')
         return
      end if
      call apply_given(self%input, error)
      if (allocated(error)) return
      associate (input => self%input, structure => self%input%structure)
         structure%hosted = host_cases
         structure%cases = structure%cases + host_cases
         nodes = size(structure%mesh%coordinates, 2)
         call self%wishes%begin(self%problem, nodes)
         call choose_threads(input%threads, size(structure%mesh%triangles, 2))
         !$ self%threads = omp_get_max_threads()
         call prepare(input, self%problem, alone, error)
         if (.not. allocated(error) .and. modes_end(input%imperfections) > 0) then
            call apply_modes(input, self%problem, .false., error)
            self%step = modes_end(input%imperfections) + 1
         end if
         if (allocated(error)) return
         call let_stand(self%problem)
         self%path%account%kept = input%outputs(1)%energy
         call cpu_time(self%path%started)
         call self%bell%attach(self%problem, input%monitors, input%factors, &
                               sum([(input%steps(i)%time%duration, i=1, size(input%steps))]), input%outputs(1)%energy)
         self%warnings = trim(warning_of(input, self%problem))
         if (mesh_warning(input) /= '') self%warnings = trim(self%warnings//new_line('a')//mesh_warning(input))
      end associate
   end subroutine begin

   !> The next increment, of the step under way or of the one behind it; steps that leave the state as it is are done as a whole.
   !> What the host gives comes in before it where the step is static, in its course where it is in time.
   !>
   !> With a size, it is that of the increment in the measure of its control, cut where it fails; in time the model arrives there
   !> in as many increments as that takes. Errors: an increment that fails however short; the state is then that before it.
   subroutine advance(self, size_wanted, error)
      class(session_t), intent(inout) :: self
      real(wp), intent(in) :: size_wanted !< 0: as the step proposes
      type(error_t), allocatable, intent(out) :: error
      integer :: number

      self%bell%reports = 0
      if (size(self%bell%found) > 0) then
         deallocate (self%bell%found)
         allocate (self%bell%found(0))
      end if
      if (size_wanted < 0 .or. .not. size_wanted < huge(1.0_wp)) call raise(error, status_input_error, 'the size of an increment ' &
         //'is '//text_of(size_wanted)//'; expected a positive number, or 0: as the step proposes')
      if (allocated(error)) return
      call gather(self%problem, error)
      if (allocated(error)) return
      do while (self%step <= size(self%input%steps))
         number = self%step
         if (.not. is_done(self)) then
            call self%hand_over(size_wanted, error)
            if (.not. allocated(error)) call self%drive(size_wanted, error)
         end if
         if (allocated(error)) then
            if (error%code == stop_is_wanted) then
               deallocate (error)
               self%begun = .true.
               self%finished = self%step == size(self%input%steps) .and. is_done(self)
            end if
            return
         end if
         if (leaves_state(self%input%steps(number)%control) .or. is_in_time(self%input%steps(number)%control)) then
            self%path%underway = .false.
            if (allocated(self%path%course)) deallocate (self%path%course)
         end if
         self%step = number + 1
         self%begun = .false.
         self%finished = self%step > size(self%input%steps)
         if (self%bell%reports > 0) return
         if (self%step <= size(self%input%steps)) call gather(self%problem, error)
         if (allocated(error)) return
      end do
      self%finished = .true.
   end subroutine advance

   !> Has the step under way come to its end with the last increment?
   logical function is_done(self)
      class(session_t), intent(in) :: self
      type(course_t) :: course
      is_done = self%begun
      if (.not. is_done) return
      associate (step => self%input%steps(self%step))
         if (has_course(step%control)) then
            is_done = allocated(self%path%course)
            if (.not. is_done) return
            course = course_of(self%path%course)
            is_done = .not. course%time < step%time%duration
         else
            is_done = .not. (is_in_time(step%control) .or. leaves_state(step%control)) .and. self%path%underway &
                      .and. self%path%ramping == by_load_factor .and. self%path%targets%reached()
         end if
      end associate
   end function is_done

   !> Let what the host gives come in, at the load factor that there is.
   subroutine settle(self, error)
      class(session_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      self%bell%reports = 0
      call gather(self%problem, error)
      if (allocated(error) .or. .not. self%wishes%pending(self%problem)) return
      if (allocated(self%problem%state%velocity)) then
         call raise(error, status_input_error, 'in motion there is no state to settle in: what the host gives comes in with the ' &
                    //'next increment in time')
         return
      end if
      call self%bring_in(error)
   end subroutine settle

   !> The size that the next increment would have: of time in a step in time, else in the measure of the control; 0: not known, as
   !> the step has not begun.
   real(wp) function proposed(self)
      class(session_t), intent(in) :: self
      type(course_t) :: course
      proposed = 0
      if (self%step > size(self%input%steps) .or. .not. self%begun) return
      proposed = self%path%size
      if (.not. is_in_time(self%input%steps(self%step)%control)) return
      proposed = 0
      if (.not. has_course(self%input%steps(self%step)%control) .or. .not. allocated(self%path%course)) return
      course = course_of(self%path%course)
      proposed = min(course%pace%size, self%input%steps(self%step)%time%next_landing(course%time) - course%time)
   end function proposed

   !> The name of a step of the input.
   pure function step_name(self, number) result(name)
      class(session_t), intent(in) :: self
      integer, intent(in) :: number
      character(len=:), allocatable :: name
      name = self%input%steps(min(number, size(self%input%steps)))%name
   end function step_name

   !> The name of a control; '' before the first increment.
   pure function control_of(control) result(name)
      integer, intent(in) :: control
      character(len=:), allocatable :: name
      name = ''
      if (control > 0) name = control_name(control)
   end function control_of

   !> Before a call of the analysis: what the host wants, and until when.
   subroutine hand_over(self, size_wanted, error)
      class(session_t), intent(inout) :: self
      real(wp), intent(in) :: size_wanted
      type(error_t), allocatable, intent(out) :: error
      associate (step => self%input%steps(self%step))
         self%bell%until = -huge(1.0_wp)
         if (step%control == control_dynamic) then
            if (self%wishes%pending(self%problem) .or. size_wanted > 0) call ramp_over_time(self, size_wanted, error)
         else if (.not. self%wishes%pending(self%problem)) then
            return
         else if (step%control == control_load .and. .not. allocated(self%problem%state%velocity)) then
            call self%bring_in(error)
         else if (self%begun .or. is_motion(step%control) .or. leaves_state(step%control) &
                  .or. allocated(self%problem%state%velocity)) then
            call raise(error, status_input_error, "step '"//step%name//"': forces and displacements of a host change in steps " &
                       //"with control = 'load' and 'dynamic', found '"//control_name(step%control)//"'; before a static one " &
                       //'begins, finshell_model_settle brings them in')
         else
            call self%bring_in(error)
         end if
      end associate
   end subroutine hand_over

   !> Forces and displacements go from what they are to what the host wants in the course of an increment of time.
   subroutine ramp_over_time(self, size_wanted, error)
      class(session_t), intent(inout) :: self
      real(wp), intent(in) :: size_wanted
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: length, left
      type(course_t) :: course
      associate (problem => self%problem, step => self%input%steps(self%step))
         if (step%scheme == scheme_conserving .and. any(problem%host%moves)) then
            call raise(error, status_input_error, "step '"//step%name//"': a host prescribes displacements; the scheme that " &
                       //"conserves energy does not know their work: scheme = 'generalised_alpha' does")
            return
         end if
         left = step%time%duration
         length = step%first_increment
         if (.not. length > 0) length = step%time%duration/100
         if (self%begun .and. allocated(self%path%course)) then
            course = course_of(self%path%course)
            left = left - course%time
            length = course%pace%size
         end if
         if (size_wanted > 0) length = size_wanted
         if (left - length < sliver*step%time%duration) length = left
         if (.not. length > 0) return ! the step has come to its end
         call self%wishes%announce(problem, error)
         if (allocated(error)) return
         call follow_time(problem, length)
         self%bell%until = problem%state%time + length*(1 - sliver)
      end associate
   end subroutine ramp_over_time

   !> Forces and displacements go from what they are to what the host wants at the present load factor, in as many increments as
   !> that takes; then the step goes on. What does not come in stays wanted.
   subroutine bring_in(self, error)
      class(session_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: late
      type(targets_t) :: targets
      type(progress_t) :: progress
      integer :: done, number, ramping
      real(wp) :: largest, next
      logical :: underway
      number = min(self%step, size(self%input%steps))
      associate (problem => self%problem, path => self%path)
         targets = path%targets
         progress = path%progress
         done = path%done
         ramping = path%ramping
         underway = path%underway
         largest = path%largest
         next = path%size
         call self%wishes%announce(problem, error)
         if (allocated(error)) return
         self%bell%patient = .true.
         self%bell%step = self%step
         call path%ramp(problem, self%input%steps(number), coming(problem%structure), self%bell, error, .false.)
         self%bell%patient = .false.
         call path%history%forget()
         path%targets = targets
         path%progress = progress
         path%done = done
         path%ramping = ramping
         path%underway = underway
         path%largest = largest
         path%size = next
      end associate
      call gather(self%problem, late)
      if (.not. allocated(error) .and. allocated(late)) call move_alloc(late, error)
   end subroutine bring_in

   !> One call of the analysis.
   subroutine drive(self, size_wanted, error)
      class(session_t), intent(inout) :: self
      real(wp), intent(in) :: size_wanted
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: first
      type(course_t) :: course
      associate (steps => self%input%steps, path => self%path)
         self%bell%step = self%step
         self%bell%patient = leaves_state(steps(self%step)%control)
         first = steps(self%step)%first_increment
         if (size_wanted > 0) then
            steps(self%step)%first_increment = size_wanted
            if (self%begun .and. has_course(steps(self%step)%control) .and. allocated(path%course)) then
               course = course_of(path%course)
               course%pace%size = size_wanted
               path%course = numbers_of(course)
            else if (self%begun .and. .not. is_in_time(steps(self%step)%control)) then
               path%size = size_wanted
            end if
         end if
         call follow_step(steps, self%step, self%problem, path, self%bell, error, self%input%velocity, resumes=self%begun)
         steps(self%step)%first_increment = first
         self%bell%patient = .false.
      end associate
   end subroutine drive
end module finshell_session
