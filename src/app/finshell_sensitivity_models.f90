!> Prepares the derivatives that a run is asked for: reads the input with each parameter a little changed, once, and refuses what
!> has no derivatives here.
module finshell_sensitivity_models
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_imperfect, only: apply_given
   use finshell_input, only: input_t, parse_input
   use finshell_input_imperfection, only: modes_end
   use finshell_kinds, only: wp
   use finshell_load, only: load_edge
   use finshell_sensitivity, only: places, sensitivities_t, small_step, varied_t
   use finshell_sensitivity_choice, only: held_by_control, per_node, per_parameter, sensitivity_choice_t
   use finshell_setting, only: apply_setting, new_setting, setting_t
   use finshell_status, only: status_input_error
   use finshell_step, only: control_volume, is_in_time, leaves_state
   use finshell_structure, only: curved_elements, remembers, structure_t
   use finshell_support, only: axes_cylindrical
   use finshell_variant, only: new_variant
   implicit none
   private
   public :: prepare_sensitivities

contains

   !> Errors, with file and line: parameters that cannot be varied, models and runs that are not differentiated.
   subroutine prepare_sensitivities(input, levels, several, problem, sensitivities, error)
      type(input_t), intent(in) :: input
      integer, intent(in) :: levels !< of refinement of the mesh, as the input was read with
      logical, intent(in) :: several !< processes share the work
      type(equilibrium_t), intent(in) :: problem
      type(sensitivities_t), allocatable, intent(out) :: sensitivities
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: refusal
      integer :: i, k, n

      if (size(input%sensitivities) == 0) return
      do i = 1, size(input%sensitivities)
         refusal = refusal_of(input, input%sensitivities(i), several)
         if (refusal == '') cycle
         call raise(error, status_input_error, place_of(input, i)//refusal)
         return
      end do
      allocate (sensitivities)
      sensitivities%choices = input%sensitivities
      n = 0
      do i = 1, size(input%sensitivities)
         if (is_first(input%sensitivities, i)) n = n + 1
      end do
      allocate (sensitivities%varied(n))
      k = 0
      do i = 1, size(input%sensitivities)
         if (.not. is_first(input%sensitivities, i)) cycle
         k = k + 1
         call vary(input, levels, problem, input%sensitivities(i), sensitivities%varied(k), error)
         if (.not. allocated(error)) cycle
         error%message = place_of(input, i)//error%message
         return
      end do
      call sensitivities%clear(input%structure)
   end subroutine prepare_sensitivities

   pure function place_of(input, i) result(text)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      character(len=:), allocatable :: text
      text = input%file//':'//text_of(input%sensitivities(i)%line)//': &sensitivity: '
   end function place_of

   !> Is it the first one with its parameter?
   pure logical function is_first(choices, i)
      type(sensitivity_choice_t), intent(in) :: choices(:)
      integer, intent(in) :: i
      integer :: k
      is_first = choices(i)%per == per_parameter
      if (.not. is_first) return
      do k = 1, i - 1
         if (choices(k)%per == per_parameter) is_first = is_first .and. choices(k)%parameter /= choices(i)%parameter
      end do
   end function is_first

   !> Read the input with the parameter at four places around its value.
   subroutine vary(input, levels, problem, choice, varied, error)
      type(input_t), intent(in) :: input
      integer, intent(in) :: levels
      type(equilibrium_t), intent(in) :: problem
      type(sensitivity_choice_t), intent(in) :: choice
      type(varied_t), intent(inout) :: varied
      type(error_t), allocatable, intent(inout) :: error
      type(input_t) :: changed
      type(setting_t) :: setting
      character(len=:), allocatable :: complaint, text
      character(len=24) :: number
      integer :: k
      varied%parameter = choice%parameter
      varied%step = small_step*choice%scale
      do k = 1, size(places)
         write (number, '(es24.16e3)') choice%value + places(k)*varied%step
         call new_setting(setting, choice%before//trim(adjustl(number))//choice%behind, complaint)
         text = input%text
         call apply_setting(setting, input%file, text, error)
         if (.not. allocated(error)) call parse_input(text, input%file, changed, error, levels)
         call apply_given(changed, error)
         if (allocated(error)) then
            error%message = 'with '//choice%parameter//' = '//trim(adjustl(number))//': '//error%message
            return
         end if
         call new_variant(varied%variant(k), changed%structure, input%structure, error)
         if (.not. allocated(error)) call varied%variant(k)%follow(problem, error)
         if (allocated(error)) then
            error%message = choice%parameter//' cannot be varied: '//error%message
            return
         end if
      end do
   end subroutine vary

   !> What keeps a run from this derivative; '': nothing.
   function refusal_of(input, choice, several) result(text)
      type(input_t), intent(in) :: input
      type(sensitivity_choice_t), intent(in) :: choice
      logical, intent(in) :: several
      character(len=:), allocatable :: text
      text = ''
      if (several) then
         text = 'derivatives are found in one process: take finshell, not finshell_mpi'
      else if (remembers(input%structure)) then
         text = 'laws with states remember the way that led to a state; derivatives are those of laws without'
      else if (allocated(input%accuracy)) then
         text = 'with &accuracy the mesh changes during the run; refine the mesh by itself'
      else if (modes_end(input%imperfections) > 0) then
         text = 'imperfections by modes depend on all parameters; write the mode to a file and take that'
      else if (any(input%steps%case > 1)) then
         text = 'steps of a named case are not differentiated'
      else if (any(input%steps%stabilise > 0)) then
         text = 'the states of a stabilised step depend on the way they were reached; derivatives need states in equilibrium'
      else if (all(is_in_time(input%steps%control) .or. leaves_state(input%steps%control))) then
         text = "derivatives are those of static states; a step control = 'load', 'displacement', 'volume' or 'arc_length' " &
                //'is needed'
      else if (choice%per == per_node) then
         text = refusal_of_positions(input, choice)
      end if
   end function refusal_of

   !> What keeps a model from derivatives with respect to the positions of nodes.
   function refusal_of_positions(input, choice) result(text)
      type(input_t), intent(in) :: input
      type(sensitivity_choice_t), intent(in) :: choice
      character(len=:), allocatable :: text
      character(len=*), parameter :: line_loads(3) = [character(len=13) :: load_edge, 'line_moment', 'follower_line']
      integer :: i
      text = ''
      associate (s => input%structure)
         if (size(curved_elements(s, [(i, i=1, size(s%element_section))])) > 0) then
            text = "normals of a curved reference hang on more nodes than those of an element: take normals = 'facet' in &mesh"
         else if (allocated(s%joints)) then
            text = 'joints (&tie, &rigid_body, &equal, &equation)'
         else if (size(s%chambers) > 0) then
            text = 'chambers'
         else if (size(s%connectors) > 0) then
            text = 'connectors and point masses'
         else if (any([(any(s%loads%kind == line_loads(i)), i=1, size(line_loads))])) then
            text = 'loads along edges'
         else if (any(s%supports%axes_kind == axes_cylindrical)) then
            text = 'supports in cylindrical axes'
         else if (choice%fixed == held_by_control) then
            do i = 1, size(input%steps)
               if (input%steps(i)%control == control_volume .and. allocated(input%steps(i)%element_set)) &
                  text = 'a volume that a step prescribes by an element_set'
            end do
         end if
         if (text /= '' .and. text(1:7) /= 'normals') text = 'node_position is not known with '//text
      end associate
   end function refusal_of_positions
end module finshell_sensitivity_models
