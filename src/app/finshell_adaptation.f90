!> A job on meshes that are refined where it pays, until the answer is as good as wanted (&accuracy).
!>
!> The job has run on the given mesh. Then, mesh by mesh: its error is estimated, the elements that are worth it (finshell_marking)
!> are cut (finshell_bisection), the state is carried over and brought to equilibrium at what the last step ends with
!> (finshell_carrying). Where that fails, and in jobs of linear steps, all steps run again on the new mesh. With `coarser` the given
!> mesh is a coarser one: so many times all elements are cut first, without an estimate.
module finshell_adaptation
   use, intrinsic :: iso_fortran_env, only: output_unit
   use finshell_bisection, only: bisection_t
   use finshell_carrying, only: carry_on, end_of, find_stress, is_linear, settle
   use finshell_equilibrium, only: equilibrium_t, new_equilibrium
   use finshell_error, only: error_t, raise, text_of
   use finshell_error_indicator, only: estimate_error, estimate_goal_error, goal_t, indicator_t, monitor_gradient
   use finshell_input, only: input_t
   use finshell_job, only: follow_steps
   use finshell_kinds, only: dp, wp
   use finshell_marking, only: shares_of_parts, worth_cutting
   use finshell_mesh, only: find_node_set
   use finshell_options, only: options_t
   use finshell_path, only: path_t
   use finshell_reporter, only: reporter_t
   use finshell_solver_choice, only: choose_solver
   use finshell_speaker, only: speaker_t
   use finshell_stations, only: station_t
   use finshell_status, only: status_io_error
   implicit none
   private
   public :: adapt

   !> Part of the tolerance that a mesh aims at, and its bounds: a mesh that fails by little costs another as large as itself.
   real(wp), parameter :: first_aim = 0.7_wp, least_aim = 0.3_wp, most_aim = 0.9_wp
   !> Growth of the elements beyond which a mesh is not cut again without another estimate: usually, and where the last cuts have
   !> nearly held what they promised (the ratio of both).
   integer, parameter :: usual_growth = 3, trusted_growth = 12
   real(wp), parameter :: trusted = 0.75_wp
   real(wp), parameter :: cost_exponent = 1.2_wp !< of the time of a mesh over its elements

   !> What one mesh gave.
   type :: result_t
      integer :: mesh = 1, elements = 0, unknowns = 0
      logical :: judged = .true. !< there is an estimate
      real(wp) :: estimate = 0 !< of the relative error
      real(wp) :: value = 0 !< of the monitor, or the load factor
      real(dp) :: seconds = 0 !< of CPU time since the program began
   end type result_t

contains

   !> Go on from the end of the job on its first mesh. Errors: a mesh on which it cannot be solved; files that cannot be written.
   subroutine adapt(options, bisection, input, problem, path, reporter, speaker, error)
      type(options_t), intent(in) :: options
      type(bisection_t), intent(inout) :: bisection !< begun with the mesh of the input
      type(input_t), intent(inout), target :: input !< comes to be that of the last mesh
      type(equilibrium_t), intent(inout) :: problem
      type(path_t), intent(inout) :: path
      type(reporter_t), intent(inout) :: reporter
      type(speaker_t), intent(inout) :: speaker
      type(error_t), allocatable, intent(out) :: error
      type(result_t) :: result
      type(input_t) :: next
      type(station_t), allocatable :: carried(:) !< the end is the last one
      logical :: whole
      real(wp), allocatable :: weights(:)
      real(wp) :: aim, held, promised, tolerance
      real(dp) :: before, now
      character(len=:), allocatable :: reason
      integer :: unit

      call open_table(options%folder//input%name//'.meshes.csv', input, unit, error)
      if (allocated(error)) return
      before = 0
      aim = first_aim
      promised = 0
      do
         whole = reporter%mesh <= input%accuracy%coarser
         result%mesh = reporter%mesh
         result%elements = size(input%structure%mesh%triangles, 2)
         result%unknowns = problem%n
         result%value = value_of(input, reporter)
         result%judged = input%accuracy%judged .and. .not. whole
         if (result%judged) then
            call judge(input, problem, reporter, weights, tolerance, result, error)
            if (allocated(error)) exit
         end if
         call cpu_time(now)
         result%seconds = now
         call tell(options, input, unit, result)
         if (whole) then
            carried = [speaker%stations%list, end_of(input, problem)]
            call find_stress(problem, input, carried)
            call carry_on(options, bisection, input, carried, next, error)
            if (.not. allocated(error)) call next_mesh(options, next, carried, input, problem, path, reporter, speaker, error)
            if (allocated(error)) exit
            before = now
            cycle
         end if
         reason = reason_to_end(input, result)
         if (reason /= '') exit
         ! cuts may promise more than they hold
         held = promised/sum(weights)
         if (promised > 0) aim = min(most_aim, max(least_aim, most_aim*held))
         call refine(options, bisection, input, problem, weights, aim*tolerance, &
                     merge(trusted_growth, usual_growth, held > trusted), promised, next, carried, error)
         if (allocated(error)) exit
         reason = reason_not_to_begin(input, size(bisection%side), result, now - before)
         if (reason /= '') exit
         before = now
         call next_mesh(options, next, carried, input, problem, path, reporter, speaker, error)
      end do
      close (unit)
      if (allocated(error)) then
         error%message = 'mesh '//text_of(reporter%mesh)//' (&accuracy): '//error%message
      else
         write (output_unit, '(a)') reason
      end if
   end subroutine adapt

   !> Estimate the error, and what each element has of it.
   subroutine judge(input, problem, reporter, weights, tolerance, result, error)
      type(input_t), intent(in) :: input
      type(equilibrium_t), intent(inout) :: problem
      type(reporter_t), intent(in) :: reporter
      real(wp), allocatable, intent(out) :: weights(:) !< shares of elements
      real(wp), intent(out) :: tolerance !< what their sum may be
      type(result_t), intent(inout) :: result
      type(error_t), allocatable, intent(out) :: error
      type(indicator_t) :: indicator
      type(goal_t) :: goal
      real(wp), allocatable :: gradient(:)

      tolerance = 0
      if (input%accuracy%monitor == 0) then
         if (is_linear(input)) then
            call estimate_error(problem, problem%state, indicator, reporter%change)
         else
            call estimate_error(problem, problem%state, indicator)
         end if
         weights = indicator%eta**2
         tolerance = input%accuracy%target**2*(indicator%energy + indicator%total**2)
         result%estimate = indicator%relative
         return
      end if
      associate (monitor => input%monitors(input%accuracy%monitor), mesh => input%structure%mesh)
         call monitor_gradient(problem, mesh%node_sets(find_node_set(mesh, monitor%node_set))%members, monitor%component, gradient)
         if (is_linear(input)) then
            call estimate_goal_error(problem, gradient, goal, error, reporter%change)
         else
            call estimate_goal_error(problem, gradient, goal, error)
         end if
         if (allocated(error)) return
         weights = goal%eta
         tolerance = input%accuracy%target*abs(reporter%final(input%accuracy%monitor)/monitor%factor)
         result%estimate = abs(monitor%factor)*goal%bound/max(abs(result%value), tiny(result%value))
      end associate
   end subroutine judge

   !> The monitor, or the load factor.
   pure real(wp) function value_of(input, reporter)
      type(input_t), intent(in) :: input
      type(reporter_t), intent(in) :: reporter
      value_of = reporter%final(size(reporter%final))
      if (input%accuracy%monitor > 0) value_of = reporter%final(input%accuracy%monitor)
   end function value_of

   !> Why this mesh is the last: '' if it is not.
   function reason_to_end(input, result) result(reason)
      type(input_t), intent(in) :: input
      type(result_t), intent(in) :: result
      character(len=:), allocatable :: reason
      reason = ''
      if (.not. result%judged) then
         reason = 'This mesh is as fine as that of the input.'
      else if (result%estimate <= input%accuracy%target) then
         reason = 'Accuracy: the estimate '//text_of(result%estimate)//' meets the target '//text_of(input%accuracy%target)//'.'
      else if (result%mesh >= input%accuracy%most_meshes) then
         reason = missed(input, result)//text_of(result%mesh)//' meshes are the most that are allowed (most_meshes).'
      end if
   end function reason_to_end

   !> Why the next one is too dear.
   function reason_not_to_begin(input, elements, result, last) result(reason)
      type(input_t), intent(in) :: input
      integer, intent(in) :: elements !< of the next one
      type(result_t), intent(in) :: result
      real(dp), intent(in) :: last !< seconds of the last one
      character(len=:), allocatable :: reason
      real(wp) :: needed
      reason = ''
      needed = last*(real(elements, wp)/result%elements)**cost_exponent
      if (elements > input%accuracy%most_elements) then
         reason = missed(input, result)//'the next mesh would have '//text_of(elements)//' elements, ' &
                  //text_of(input%accuracy%most_elements)//' are allowed (most_elements).'
      else if (result%seconds + needed > input%accuracy%budget) then
         reason = missed(input, result)//'the next mesh would take about '//text_of(ceiling(needed)) &
                  //' s of CPU time, more than is left of the budget ('//text_of(input%accuracy%budget)//' s).'
      end if
   end function reason_not_to_begin

   function missed(input, result) result(text)
      type(input_t), intent(in) :: input
      type(result_t), intent(in) :: result
      character(len=:), allocatable :: text
      text = 'Accuracy: the estimate '//text_of(result%estimate)//' MISSES the target '//text_of(input%accuracy%target)//': '
   end function missed

   !> The next mesh and the state carried over to it. Where the estimate promises that one cut of an element is not enough its
   !> parts are cut at once, as long as the mesh does not grow too much for the estimate to be believed.
   subroutine refine(options, bisection, input, problem, weights, tolerance, growth, promised, next, carried, error)
      type(options_t), intent(in) :: options
      type(bisection_t), intent(inout) :: bisection
      type(input_t), intent(in) :: input
      type(equilibrium_t), intent(in) :: problem
      real(wp), intent(in) :: weights(:), tolerance
      integer, intent(in) :: growth !< of the elements, beyond which parts are not cut again
      real(wp), intent(out) :: promised !< sum of the shares there
      type(input_t), intent(out) :: next
      type(station_t), allocatable, intent(out) :: carried(:) !< the end
      type(error_t), allocatable, intent(out) :: error
      type(input_t) :: before
      real(wp), allocatable :: shares(:)
      logical, allocatable :: chosen(:)
      next = input
      carried = [end_of(input, problem)]
      if (.not. is_linear(input)) call find_stress(problem, input, carried)
      shares = weights
      do
         chosen = worth_cutting(shares, tolerance)
         if (size(shares) > size(weights) .and. size(shares) + 3*count(chosen) > input%accuracy%most_elements) exit
         before = next
         call carry_on(options, bisection, before, carried, next, error, chosen)
         if (allocated(error)) return
         shares = shares_of_parts(shares, bisection%parent)
         promised = sum(shares)
         if (promised <= tolerance .or. size(shares) > growth*size(weights)) exit
      end do
   end subroutine refine

   !> Bring the job to its end on the next mesh.
   subroutine next_mesh(options, next, carried, input, problem, path, reporter, speaker, error)
      type(options_t), intent(in) :: options
      type(input_t), intent(in) :: next
      type(station_t), intent(inout) :: carried(:) !< to it
      type(input_t), intent(inout), target :: input
      type(equilibrium_t), intent(inout) :: problem
      type(path_t), intent(inout) :: path
      type(reporter_t), intent(inout) :: reporter
      type(speaker_t), intent(inout) :: speaker
      type(error_t), allocatable, intent(out) :: error
      type(path_t) :: anew
      type(error_t), allocatable :: failure
      integer :: i, number

      number = problem%state%increment
      input%structure = next%structure
      call choose_solver(input, .false., problem%solver%options, error)
      if (.not. allocated(error)) call new_equilibrium(problem, input%structure, error)
      if (.not. allocated(error)) call reporter%change_mesh(input%text, error)
      if (allocated(error)) return
      if (.not. is_linear(input)) then
         do i = 1, size(carried)
            carried(i)%state%increment = number
            call settle(input%steps(size(input%steps)), carried(i), problem, path, reporter, speaker, failure, error)
            number = problem%state%increment
            if (allocated(failure) .or. allocated(error)) exit
         end do
         if (allocated(error)) return
         if (.not. allocated(failure)) then
            speaker%stations%list = carried(:size(carried) - 1)
            return
         end if
         if (.not. options%quiet) write (output_unit, '(5x,a)') &
            'the state of the mesh before does not lead to equilibrium on this one ('//failure%message//'): the path is run anew'
         call new_equilibrium(problem, input%structure, error)
         if (allocated(error)) return
      end if
      anew%account%kept = path%account%kept
      call follow_steps(input%steps, problem, anew, reporter, speaker, error)
      path%increments = path%increments + anew%increments
      path%iterations = path%iterations + anew%iterations
      path%cuts = path%cuts + anew%cuts
   end subroutine next_mesh

   !> The table NAME.meshes.csv.
   subroutine open_table(name, input, unit, error)
      character(len=*), intent(in) :: name
      type(input_t), intent(in) :: input
      integer, intent(out) :: unit
      type(error_t), allocatable, intent(out) :: error
      character(len=256) :: reason
      integer :: status
      open (newunit=unit, file=name, status='replace', action='write', iostat=status, iomsg=reason)
      if (status == 0) then
         write (unit, '(a)') 'mesh,elements,unknowns,estimate,'//value_name(input)//',cpu_seconds'
      else
         call raise(error, status_io_error, name//': cannot be written: '//trim(reason))
      end if
   end subroutine open_table

   pure function value_name(input) result(name)
      type(input_t), intent(in) :: input
      character(len=:), allocatable :: name
      name = 'load_factor'
      if (input%accuracy%monitor > 0) name = input%monitors(input%accuracy%monitor)%name
   end function value_name

   !> What the mesh gave: a row of the table and, unless quiet, a line on the screen.
   subroutine tell(options, input, unit, result)
      type(options_t), intent(in) :: options
      type(input_t), intent(in) :: input
      integer, intent(in) :: unit
      type(result_t), intent(in) :: result
      character(len=160) :: line
      character(len=24) :: estimate
      character(len=:), allocatable :: judgement
      estimate = ''
      if (result%judged) write (estimate, '(es24.16e3)') result%estimate
      write (unit, '(3(i0,","),a,",",es24.16e3,",",f0.3)') result%mesh, result%elements, result%unknowns, trim(estimate), &
         result%value, result%seconds
      flush (unit)
      if (options%quiet) return
      judgement = ''
      if (result%judged) judgement = ', estimated error '//text_of(real(result%estimate, dp))
      write (line, '(a,i0,a,i0,a,f0.2,a)') 'mesh ', result%mesh, ': ', result%elements, ' elements, '//value_name(input)//' ' &
         //text_of(result%value)//judgement//', ', result%seconds, ' s of CPU time'
      write (output_unit, '(a)') trim(line)
      flush (output_unit)
   end subroutine tell
end module finshell_adaptation
