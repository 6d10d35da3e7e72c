!> What can be said against an input before anything is solved: steps that cannot be followed, loads that do nothing.
module finshell_trial
   use finshell_kinds, only: wp
   use finshell_connector, only: is_dashpot
   use finshell_crossed_cells, only: crossed_cells
   use finshell_dynamic_start, only: check_start
   use finshell_equations, only: equations_t, free_part
   use finshell_equilibrium, only: equilibrium_t, new_equilibrium
   use finshell_error, only: error_t, raise, text_of
   use finshell_external, only: external_t, new_external
   use finshell_chamber, only: can_hold
   use finshell_factor, only: by_case, by_load_factor
   use finshell_frequencies, only: check_vibration
   use finshell_freedoms, only: n_nodal, uz
   use finshell_input, only: input_t
   use finshell_job, only: may_float
   use finshell_load, only: load_t, load_nodal, load_edge
   use finshell_load_case, only: change_case
   use finshell_mesh, only: mesh_t, find_edge_set, find_element_set, find_node_set
   use finshell_motion_start, only: check_mobile, lumped_masses
   use finshell_point_masses, only: point_masses
   use finshell_stage, only: change_stage, is_same_stage
   use finshell_status, only: status_input_error
   use finshell_step, only: step_t, control_load, control_linear, control_buckling, control_dynamic, control_explicit, &
      control_frequencies, control_name, control_timed, is_motion, leaves_state
   use finshell_structure, only: structure_t
   use finshell_targets, only: targets_t, new_targets
   use finshell_timed_step, only: check_timed_start
   implicit none
   private
   public :: check_steps, place_load_error, warning_of, mesh_warning

contains

   !> The first step that cannot be followed is an error with its line. The problem is left as it was.
   subroutine check_steps(input, problem, error)
      type(input_t), intent(in), target :: input
      type(equilibrium_t), intent(inout) :: problem
      type(error_t), allocatable, intent(out) :: error
      integer :: i
      logical :: staged
      staged = .false.
      do i = 1, size(input%steps)
         if (.not. is_same_stage(input%structure, problem%stage, i)) then
            staged = .true.
            problem%may_float = may_float(input%structure, input%steps, i)
            call change_stage(problem, i, error)
         end if
         problem%stage = i
         if (.not. allocated(error)) call change_case(problem, input%steps(i)%case, error)
         if (.not. allocated(error)) call check_step(input%steps(i), i == 1, problem, error)
         if (.not. allocated(error)) call check_rest(input%steps(:i), error)
         if (.not. allocated(error)) cycle
         error%message = input%file//':'//text_of(input%step_lines(i))//': &step: '//error%message
         exit
      end do
      if (.not. allocated(error)) call change_case(problem, 1, error)
      problem%stage = 1
      if (staged .and. .not. allocated(error)) then
         problem%may_float = may_float(input%structure, input%steps, 1)
         call new_equilibrium(problem, input%structure, error)
      end if
      if (allocated(problem%watched)) deallocate (problem%watched)
   end subroutine check_steps

   subroutine check_step(step, first, problem, error)
      type(step_t), intent(in) :: step
      logical, intent(in) :: first !< it begins unloaded; where a later one begins is known in the run only
      type(equilibrium_t), intent(inout) :: problem
      type(error_t), allocatable, intent(out) :: error
      type(targets_t) :: targets
      real(wp), allocatable :: mass(:, :)

      call check_chambers(step, problem, error)
      if (allocated(error)) return
      if (is_motion(step%control)) then
         call lumped_masses(problem, mass, error)
         if (allocated(error)) error%message = control_name(step%control)//': '//error%message
         if (.not. allocated(error)) call check_mobile(problem, control_name(step%control), mass, &
                                                       merge(uz, n_nodal, step%control == control_dynamic), error)
         if (.not. allocated(error) .and. first .and. step%control == control_dynamic) &
            call check_start(problem, step, 0.0_wp, .false., error)
         return
      end if
      if (step%control == control_timed) then
         if (first .and. step%prescribes == control_load) call check_timed_start(step, 0.0_wp, error)
      end if
      if (.not. leaves_state(step%control) .and. .not. allocated(error)) then
         call problem%watch_step(step, error)
         if (first .and. step%control /= control_timed .and. .not. allocated(error)) &
            call new_targets(targets, step, 0.0_wp, 0.0_wp, error)
         if (allocated(error)) return
      end if
      if (step%control == control_frequencies) call check_vibration(problem, .not. first, error)
      if (any(step%control == [control_load, control_linear, control_frequencies])) return
      if (step%control == control_timed .and. step%prescribes == control_load) return
      if (step%control == control_buckling .and. size(problem%external%turning_nodes) > 0) then
         call raise(error, status_input_error, 'buckling: a moment acts at node '//text_of(problem%external%turning_nodes(1)) &
            //', which can turn about several axes; such a moment is not conservative')
         return
      end if
      if (something_scales(problem, merge(by_load_factor, by_case + step%case - 1, step%case == 1))) return
      call raise(error, status_input_error, control_name(step%control)//" needs a load or a moved support that " &
         //'follows the load factor (one that is not constant, nor zero, nor on held nodes only); there is none')
   end subroutine check_step

   !> Refuse what cannot be done with chambers.
   subroutine check_chambers(step, problem, error)
      type(step_t), intent(in) :: step
      type(equilibrium_t), intent(in) :: problem
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), parameter :: advice = "' does not yield, so its pressure does not follow from its volume; " &
                                     //'give it a bulk_modulus'
      associate (chambers => problem%external%chambers)
         if (chambers%n == 0) return
         if (step%control == control_buckling) then
            call raise(error, status_input_error, 'buckling: linear buckling does not know the pressures of chambers; a load ' &
               //'step finds bifurcation points (column critical_point), and an arc-length step with locate = .true. encloses them')
         else if (chambers%yields()) then
            return
         else if (step%control == control_explicit) then
            call raise(error, status_input_error, "explicit: the liquid of chamber '" &
               //chambers%fluid(findloc(can_hold(chambers%fluid), .false., dim=1))%name//advice)
         else if (step%relaxes) then
            call raise(error, status_input_error, "relax: the liquid of chamber '" &
               //chambers%fluid(findloc(can_hold(chambers%fluid), .false., dim=1))%name//advice)
         end if
      end associate
   end subroutine check_chambers

   !> Refuse linear solutions and modes about a state in motion.
   subroutine check_rest(steps, error)
      type(step_t), intent(in) :: steps(:) !< the last one is checked
      type(error_t), allocatable, intent(inout) :: error
      integer :: before
      associate (control => steps(size(steps))%control)
         if (.not. leaves_state(control)) return
         before = findloc(leaves_state(steps%control), .false., dim=1, back=.true.)
         if (before == 0) return
         if (is_motion(steps(before)%control)) call raise(error, status_input_error, control_name(control) &
            //": the step before is in motion where it ends; a step control = 'load' between them brings it to rest")
      end associate
   end subroutine check_rest

   !> Whether the load factor moves anything.
   pure logical function something_scales(problem, scaling) result(yes)
      type(equilibrium_t), intent(in) :: problem
      integer, intent(in) :: scaling !< of the loads that follow it, in the structure
      integer, allocatable :: moving(:), scaled(:) !< factors that go along with it, of supports and of loads
      integer :: i
      moving = [by_load_factor]
      scaled = [scaling]
      if (allocated(problem%state%followers)) then
         associate (f => problem%state%followers)
            moving = [moving, pack(f%factor, f%parent == by_load_factor)]
            scaled = [scaled, pack(f%factor, f%parent == by_load_factor)]
         end associate
      end if
      associate (loads => problem%structure%loads)
         yes = any(abs(problem%equations%motion(:, :, pack(moving, moving <= size(problem%equations%motion, 3)))) > 0)
         associate (chambers => problem%structure%chambers)
            do i = 1, size(chambers)
               yes = yes .or. (abs(chambers(i)%inflow) > 0 .and. any(scaled == chambers(i)%scaling))
            end do
         end associate
         if (allocated(problem%structure%growths)) then
            associate (growths => problem%structure%growths%list)
               do i = 1, size(growths)
                  yes = yes .or. (growths(i)%span%covers(problem%stage) .and. any(scaled == growths(i)%scaling))
               end do
            end associate
         end if
         do i = 1, size(loads)
            if (.not. loads(i)%span%covers(problem%stage)) cycle
            yes = yes .or. (any(scaled == loads(i)%scaling) .and. acts(loads(i), problem%structure%mesh, problem%equations, &
                                                                       any(point_masses(problem%structure) > 0, dim=1)))
         end do
      end associate
   end function something_scales

   !> Whether a load acts on a component that is free.
   pure logical function acts(load, mesh, equations, heavy) result(yes)
      type(load_t), intent(in) :: load
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      logical, intent(in) :: heavy(:) !< (nodes) with masses beside those of elements
      integer :: i, k
      logical, allocatable :: member(:)

      allocate (member(size(mesh%coordinates, 2)), source=.false.)
      if (load%kind == load_nodal .or. load%at_nodes) then
         member(mesh%node_sets(find_node_set(mesh, load%set))%members) = .true.
      else if (any(load%kind == [character(len=16) :: load_edge, 'line_moment', 'follower_line'])) then
         associate (edges => mesh%edge_sets(find_edge_set(mesh, load%set))%edges)
            do i = 1, size(edges, 2)
               member(edges(:, i)) = .true.
            end do
         end associate
      else
         associate (elements => mesh%element_sets(find_element_set(mesh, load%set))%members)
            do i = 1, size(elements)
               member(mesh%triangles(:, elements(i))) = .true.
            end do
            if (size(elements) == size(mesh%triangles, 2)) member = member .or. heavy
         end associate
      end if
      yes = .false.
      do i = 1, size(member)
         if (.not. member(i)) cycle
         do k = 1, 3
            if (free(k)) yes = yes .or. abs(along(load%vector)) > 0
            if (free(k)) yes = yes .or. any(abs([load%pressure, load%numbers]) > 0)
            if (free(3 + k)) yes = yes .or. abs(along(load%moment)) > 0
         end do
         if (yes) return
      end do

   contains

      pure logical function free(component)
         integer, intent(in) :: component
         free = equations%number(component, i) > 0 .or. equations%links%depends(component, i)
      end function free

      !> Component k of a vector in the axes of node i.
      pure real(wp) function along(vector)
         real(wp), intent(in) :: vector(3)
         along = vector(k)
         if (equations%frame(i) > 0) along = dot_product(vector, equations%frames(:, k, equations%frame(i)))
      end function along
   end function acts

   !> What should be said, though it can be solved: '' or a sentence with its place.
   function warning_of(input, problem) result(text)
      type(input_t), intent(in) :: input
      type(equilibrium_t), intent(in) :: problem
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      if (problem%equations%links%any()) text = first_line(problem%equations%links%redundant)
      if (text /= '') return
      if (any(is_dashpot(input%structure%connectors)) .and. .not. any(is_motion(input%steps%control))) then
         text = input%file//': a &dashpot acts in steps in time only, and there is none'
         return
      end if
      if (all(input%steps%control == control_frequencies)) return
      if (allocated(input%velocity)) then
         if (.not. any(abs(free_part(problem%equations, input%velocity)) > 0)) &
            text = input%file//': &initial_velocity: it moves nothing: it is on held nodes only'
         if (text /= '') return
      else if (size(input%structure%loads) == 0 .and. .not. any(abs(problem%equations%motion) > 0) &
               .and. .not. any(abs(input%structure%chambers%inflow) > 0) .and. .not. allocated(input%structure%growths)) then
         text = input%file//': nothing acts on the structure: there is no &load, no &growth, no &chamber with an inflow, ' &
            //'and no support is moved'
         return
      end if
      do i = 1, size(input%structure%loads)
         if (input%structure%loads(i)%span%first > 1) cycle
         if (acts(input%structure%loads(i), input%structure%mesh, problem%equations, &
                  any(point_masses(input%structure) > 0, dim=1))) cycle
         text = input%file//':'//text_of(input%load_lines(i))//': &load: it moves nothing: it is zero, or acts on what is held only'
         return
      end do
   end function warning_of

   pure function first_line(lines) result(line)
      character(len=*), intent(in) :: lines
      character(len=:), allocatable :: line
      line = lines(:max(0, scan(lines, new_line('a')) - 1))
   end function first_line

   !> What should be said about the mesh: '' or a sentence.
   function mesh_warning(input) result(text)
      type(input_t), intent(in) :: input
      character(len=:), allocatable :: text
      integer, parameter :: share = 10 !< a few cells do no harm: a tenth of the elements
      integer :: elements
      real(wp) :: aspect
      text = ''
      call crossed_cells(input%structure%mesh, elements, aspect)
      if (share*elements < size(input%structure%mesh%triangles, 2) .or. elements == 0) return
      text = input%file//': '//text_of(elements)//' elements lie in crossed cells up to '//text_of(nint(aspect)) &
             //' times longer than wide: bent along their length these corrugate and are too stiff; take another diagonal ' &
             //'or cells as wide as long'
   end function mesh_warning

   !> Give an error of the loads the line of the load that makes it.
   subroutine place_load_error(input, problem, error)
      type(input_t), intent(in) :: input
      type(equilibrium_t), intent(in) :: problem
      type(error_t), allocatable, intent(inout) :: error
      type(structure_t) :: alone
      type(external_t) :: external
      type(error_t), allocatable :: refusal
      integer :: i
      do i = 1, size(input%structure%chambers)
         if (index(error%message, "chamber '"//input%structure%chambers(i)%name//"': ") /= 1) cycle
         error%message = text_of(input%chamber_lines(i))//': &'//error%message
         return
      end do
      if (index(error%message, 'load: ') /= 1) return
      alone = input%structure
      deallocate (alone%chambers)
      do i = 1, size(input%structure%loads)
         alone%loads = input%structure%loads(i:i)
         call new_external(external, alone, problem%equations, refusal)
         if (.not. allocated(refusal)) cycle
         error%message = text_of(input%load_lines(i))//': &'//refusal%message
         return
      end do
   end subroutine place_load_error
end module finshell_trial
