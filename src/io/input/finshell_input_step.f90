!> The group &step of an input file.
module finshell_input_step
   use finshell_kinds, only: wp
   use finshell_error, only: error_t
   use finshell_mesh, only: mesh_t
   use finshell_step, only: step_t, convergence_t, convergence_preset, control_load, control_displacement, control_arc_length
   use finshell_step, only: control_volume, control_linear, control_buckling, control_frequencies
   use finshell_step, only: control_dynamic, control_explicit, control_timed, is_in_time
   use finshell_step, only: leaves_state, prescribes_monitored, snap_ignore, snap_mark, snap_refuse
   use finshell_step, only: mass_consistent, mass_higher_order, mass_lumped, mixed_always, mixed_never
   use finshell_step, only: tangent_always, tangent_never
   use finshell_namelist, only: get_number_or_switch, group_t, get, has, check_all_used, complain_about
   use finshell_input_preset, only: preset_t
   use finshell_input_time_step, only: read_time_step
   use finshell_input_case, only: get_case, scales_t
   use finshell_input_common, only: get_set, get_component, kind_node, kind_element
   implicit none
   private
   public :: read_step

   real(wp), parameter :: usual_stabilisation = 2.0e-4_wp !< part of the energy of the first increment
   integer, parameter :: most_in_time = 10000000 !< increments of a step in time

contains

   !> &step: how the path is followed. The defaults are those of finshell_step.
   subroutine read_step(group, mesh, default_name, scales, preset, step, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      character(len=*), intent(in) :: default_name
      type(scales_t), intent(in) :: scales
      type(preset_t), intent(inout) :: preset
      type(step_t), intent(out) :: step
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: control

      if (allocated(error)) return
      call get(group, 'name', step%name, error, default=default_name)
      call get_case(group, scales%cases, step%case, error)
      call get(group, 'control', control, error, default='load', &
         choices='load, displacement, arc_length, volume, relax, dynamic, explicit, linear, buckling, frequencies')
      if (allocated(error)) return
      select case (control)
      case ('displacement'); step%control = control_displacement
      case ('arc_length'); step%control = control_arc_length
      case ('volume'); step%control = control_volume
      case ('dynamic'); step%control = control_dynamic
      case ('explicit'); step%control = control_explicit
      case ('linear'); step%control = control_linear
      case ('buckling'); step%control = control_buckling
      case ('frequencies'); step%control = control_frequencies
      case default
         step%control = control_load
         step%relaxes = control == 'relax'
      end select
      if (has(group, 'duration')) then
         step%prescribes = step%control
         if (any(step%control == [control_load, control_displacement, control_volume]) .and. .not. step%relaxes) &
            step%control = control_timed
         if (.not. is_in_time(step%control)) call complain_about(group, 'duration', "of static steps those with control = " &
            //"'load', 'displacement' and 'volume' can take time, found '"//control//"'", error)
         if (allocated(error)) return
      end if
      if (leaves_state(step%control)) then
         call read_linear(group, step, error)
         return
      end if
      if (is_in_time(step%control)) then
         if (step%control == control_timed .and. prescribes_monitored(step%prescribes)) &
            call read_monitored(group, mesh, step, error)
         call read_time_step(group, scales%amplitudes, step, error)
         call read_increment_sizes(group, step, error)
         if (step%control /= control_explicit) call read_convergence(group, preset, step%convergence, error)
      else
         call read_targets(group, mesh, step, error)
         call read_increments(group, step, error)
         call read_convergence(group, preset, step%convergence, error)
      end if
      call check_all_used(group, error)
   end subroutine read_step

   !> Steps without iteration.
   subroutine read_linear(group, step, error)
      type(group_t), intent(inout) :: group
      type(step_t), intent(inout) :: step
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: mass
      if (step%control == control_linear) then
         call get(group, 'load_factor', step%final_load_factor, error, default=1.0_wp)
      else
         call get(group, 'modes', step%modes, error, default=step%modes, minimum=1)
         if (step%control == control_buckling) call get(group, 'near', step%near, error, default=step%near)
      end if
      if (step%control == control_frequencies) then
         call get(group, 'near', step%near, error, default=step%near, minimum=0.0_wp)
         call get(group, 'mass', mass, error, default='higher_order', choices='higher_order, consistent, lumped')
         call get(group, 'rotatory_inertia', step%rotatory, error, default=step%rotatory)
         if (allocated(error)) return
         select case (mass)
         case ('consistent'); step%mass = mass_consistent
         case ('lumped'); step%mass = mass_lumped
         case default; step%mass = mass_higher_order
         end select
      end if
      call check_all_used(group, error)
   end subroutine read_linear

   !> Where the step ends and what it must land on.
   subroutine read_targets(group, mesh, step, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(step_t), intent(inout) :: step
      type(error_t), allocatable, intent(inout) :: error
      call get(group, 'load_factor', step%final_load_factor, error, default=1.0_wp)
      step%ends_at_load_factor = has(group, 'load_factor') .or. step%control == control_load &
         .or. (step%control == control_arc_length .and. .not. (has(group, 'displacements') .or. has(group, 'volumes')))
      call get(group, 'load_levels', step%load_levels, error)
      call read_monitored(group, mesh, step, error)
   end subroutine read_targets

   !> What is monitored, and the values of it to land on.
   subroutine read_monitored(group, mesh, step, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(step_t), intent(inout) :: step
      type(error_t), allocatable, intent(inout) :: error
      integer :: control
      logical :: needs_displacement, needs_volume

      control = merge(step%prescribes, step%control, step%control == control_timed)
      needs_displacement = control == control_displacement .or. has(group, 'node_set') .or. has(group, 'component') &
         .or. has(group, 'displacements')
      call get(group, 'displacements', step%displacements, error, required=needs_displacement)
      call get_component(group, 'x, y, z', step%component, error, required=needs_displacement)
      if (needs_displacement) call get_set(group, kind_node, mesh, step%node_set, error)
      needs_volume = control == control_volume .or. has(group, 'volumes') .or. has(group, 'element_set')
      call get(group, 'volumes', step%volumes, error, required=needs_volume)
      if (allocated(error)) return
      if (size(step%displacements) == 0) deallocate (step%displacements)
      if (size(step%volumes) == 0) deallocate (step%volumes)
      if (has(group, 'element_set')) call get_set(group, kind_element, mesh, step%element_set, error)
      if (needs_volume .and. needs_displacement) &
         call complain_about(group, 'volumes', 'a step monitors either a displacement or a volume', error)
   end subroutine read_monitored

   subroutine read_increments(group, step, error)
      type(group_t), intent(inout) :: group
      type(step_t), intent(inout) :: step
      type(error_t), allocatable, intent(inout) :: error
      logical :: tangent

      call read_increment_sizes(group, step, error)
      call get(group, 'growth', step%growth, error, default=step%growth, minimum=1.0_wp)
      call get(group, 'wanted_iterations', step%wanted_iterations, error, default=step%wanted_iterations, minimum=0)
      call get(group, 'extrapolate', step%extrapolate, error, default=step%extrapolate)
      call get(group, 'tangent_predictor', tangent, error, default=.false.)
      if (has(group, 'tangent_predictor')) step%tangent_predictor = merge(tangent_always, tangent_never, tangent)
      call get(group, 'load_scale', step%load_scale, error, default=step%load_scale, minimum=0.0_wp)
      call read_following(group, step, error)
   end subroutine read_increments

   !> How large increments are, in the measure of the control: the load factor, a displacement, a volume or the time.
   subroutine read_increment_sizes(group, step, error)
      type(group_t), intent(inout) :: group
      type(step_t), intent(inout) :: step
      type(error_t), allocatable, intent(inout) :: error

      call get(group, 'first_increment', step%first_increment, error, default=step%first_increment)
      call get(group, 'largest_increment', step%largest_increment, error, default=step%largest_increment, minimum=0.0_wp)
      call get(group, 'smallest_increment', step%smallest_increment, error, default=step%smallest_increment, minimum=0.0_wp)
      if (is_in_time(step%control)) step%maximum_increments = most_in_time
      call get(group, 'maximum_increments', step%maximum_increments, error, default=step%maximum_increments, minimum=1)
      call get(group, 'maximum_cuts', step%maximum_cuts, error, default=step%maximum_cuts, minimum=0)
      call get(group, 'automatic', step%automatic, error, default=step%automatic)
      if (allocated(error)) return
      if (step%largest_increment > 0 .and. abs(step%first_increment) > step%largest_increment) then
         call complain_about(group, 'first_increment', 'it is larger than largest_increment', error)
      else if (step%largest_increment > 0 .and. step%smallest_increment > step%largest_increment) then
         call complain_about(group, 'smallest_increment', 'it is larger than largest_increment', error)
      else if (is_in_time(step%control) .and. step%first_increment < 0) then
         call complain_about(group, 'first_increment', 'time goes one way', error)
      end if
   end subroutine read_increment_sizes

   !> How much trust is put in an increment, and what is done about critical points.
   subroutine read_following(group, step, error)
      type(group_t), intent(inout) :: group
      type(step_t), intent(inout) :: step
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: snap

      call get(group, 'switch_control', step%switch_control, error, default=step%switch_control)
      call get(group, 'descent', step%descent, error, default=step%descent)
      call get(group, 'fallback', step%fallback, error, default=step%fallback)
      call get_number_or_switch(group, 'stabilise', step%stabilise, error, default=step%stabilise, on=usual_stabilisation, &
                                minimum=0.0_wp)
      if (allocated(error)) return
      if (step%stabilise > 0 .and. (step%control /= control_load .or. step%relaxes)) &
         call complain_about(group, 'stabilise', "only steps with control = 'load' can be stabilised", error)
      if (step%relaxes .and. has(group, 'fallback')) &
         call complain_about(group, 'fallback', "a step with control = 'relax' has nothing to fall back on", error)
      call get(group, 'cautious', step%cautious, error, default=step%cautious)
      call get(group, 'snap', snap, error, default='mark', choices='mark, refuse, ignore')
      if (allocated(error)) return
      select case (snap)
      case ('ignore'); step%snap = snap_ignore
      case ('refuse'); step%snap = snap_refuse
      case default; step%snap = snap_mark
      end select
      call get(group, 'patience', step%patience, error, default=step%patience, minimum=0)
      call get(group, 'locate', step%locate, error, default=step%locate)
      call get(group, 'switch_branch', step%switch_branch, error, default=step%switch_branch, minimum=0)
      call get(group, 'branch_amplitude', step%branch_amplitude, error, default=step%branch_amplitude)
      step%locate = step%locate .or. step%switch_branch > 0
   end subroutine read_following

   !> The tolerances of the preset, or those that `tolerance` names, and what deviates from them.
   subroutine read_convergence(group, preset, convergence, error)
      type(group_t), intent(inout) :: group
      type(preset_t), intent(inout) :: preset
      type(convergence_t), intent(inout) :: convergence
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: word
      type(error_t), allocatable :: refusal
      logical :: mixed

      call get(group, 'tolerance', word, error, default='', choices='paper, tight')
      if (allocated(error)) return
      if (has(group, 'tolerance')) then
         call convergence_preset(word, convergence, refusal)
      else
         convergence%residual = preset%convergence%residual
         convergence%correction = preset%convergence%correction
      end if
      if (allocated(refusal)) then
         call complain_about(group, 'tolerance', refusal%message, error)
         return
      end if
      associate (c => convergence)
         if (.not. (has(group, 'tolerance') .or. has(group, 'residual_tolerance'))) &
            call preset%note_tolerance('residual_tolerance', c%residual)
         if (.not. (has(group, 'tolerance') .or. has(group, 'correction_tolerance'))) &
            call preset%note_tolerance('correction_tolerance', c%correction)
         call get(group, 'residual_tolerance', c%residual, error, default=c%residual, above=0.0_wp)
         call get(group, 'correction_tolerance', c%correction, error, default=c%correction, above=0.0_wp)
         call get(group, 'maximum_iterations', c%maximum_iterations, error, default=c%maximum_iterations, minimum=1)
         call get(group, 'mixed', mixed, error, default=.false.)
         if (has(group, 'mixed')) c%mixed = merge(mixed_always, mixed_never, mixed)
         call get(group, 'rotation_limit', c%rotation_limit, error, default=c%rotation_limit)
      end associate
   end subroutine read_convergence
end module finshell_input_step
