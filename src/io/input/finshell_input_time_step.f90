!> The group &step of steps in time.
module finshell_input_time_step
   use finshell_error, only: error_t, text_of
   use finshell_input_amplitude, only: amplitude_t, get_amplitude
   use finshell_kinds, only: wp
   use finshell_namelist, only: group_t, get, has, complain_about
   use finshell_step, only: control_explicit, control_timed, prescribes_monitored, scheme_conserving, step_t
   use finshell_table, only: table_t
   use finshell_time_plan, only: time_plan_t
   implicit none
   private
   public :: read_time_step

contains

   !> What steps in time have beside increments and convergence.
   subroutine read_time_step(group, amplitudes, step, error)
      type(group_t), intent(inout) :: group
      type(amplitude_t), intent(in) :: amplitudes(:)
      type(step_t), intent(inout) :: step
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: scheme

      if (allocated(error)) return
      call get(group, 'duration', step%time%duration, error, above=0.0_wp)
      if (step%control == control_timed .and. prescribes_monitored(step%prescribes)) then
         call read_way(group, step, error)
      else
         call read_plan(group, amplitudes, step%time, error)
      end if
      call read_output_times(group, step%time, error)
      if (allocated(error)) return
      step%final_load_factor = 1
      if (prescribes_monitored(step%prescribes)) then
         step%ends_at_load_factor = .false.
      else if (allocated(step%time%table)) then
         step%final_load_factor = step%time%table%y(size(step%time%table%y))
      else
         step%final_load_factor = step%time%constant
      end if
      if (step%control == control_timed) then
         if (.not. allocated(step%time%table)) call rise_evenly(step%time)
         call get(group, 'time_tolerance', step%time_tolerance, error, default=step%time_tolerance, above=0.0_wp)
         return
      end if
      call get(group, 'mass_damping', step%mass_damping, error, default=step%mass_damping, minimum=0.0_wp)
      if (step%control == control_explicit) then
         call get(group, 'safety', step%safety, error, default=step%safety, above=0.0_wp, maximum=1.0_wp)
         call get(group, 'rotation_scaling', step%rotation_scaling, error, default=step%rotation_scaling, minimum=0.0_wp)
         call get(group, 'history_rows', step%history_rows, error, default=step%history_rows, minimum=1)
         return
      end if
      call get(group, 'scheme', scheme, error, default='generalised_alpha', choices='generalised_alpha, conserving')
      if (allocated(error)) return
      if (scheme == 'conserving') step%scheme = scheme_conserving
      call get(group, 'rotatory', step%rotatory, error, default=step%rotatory)
      call get(group, 'rho_infinity', step%rho_infinity, error, default=step%rho_infinity, minimum=0.0_wp, maximum=1.0_wp)
      call get(group, 'time_tolerance', step%time_tolerance, error, default=step%time_tolerance, above=0.0_wp)
      call get(group, 'stiffness_damping', step%stiffness_damping, error, default=step%stiffness_damping, minimum=0.0_wp)
   end subroutine read_time_step

   !> From the load factor that a step finds to the one that was given.
   pure subroutine rise_evenly(plan)
      type(time_plan_t), intent(inout) :: plan
      type(table_t) :: table
      table%x = [plan%duration]
      table%y = [plan%constant]
      plan%table = table
   end subroutine rise_evenly

   subroutine read_plan(group, amplitudes, plan, error)
      type(group_t), intent(inout) :: group
      type(amplitude_t), intent(in) :: amplitudes(:)
      type(time_plan_t), intent(inout) :: plan
      type(error_t), allocatable, intent(inout) :: error
      type(table_t) :: table
      integer :: at

      call get(group, 'times', table%x, error, required=has(group, 'factors'), minimum=0.0_wp)
      call get(group, 'factors', table%y, error, required=has(group, 'times'))
      call get(group, 'load_factor', plan%constant, error, default=plan%constant)
      call get(group, 'smooth', table%smooth, error, default=.false.)
      call get_amplitude(group, amplitudes, at, error)
      if (allocated(error)) return
      if (at > 0) then
         call take_amplitude(group, amplitudes(at), plan, error)
      else if (size(table%x) > 0) then
         if (has(group, 'load_factor')) then
            call complain_about(group, 'load_factor', 'the load factor is given over time by times and factors', error)
         else if (size(table%x) /= size(table%y)) then
            call complain_about(group, 'factors', 'there are '//text_of(size(table%y))//' factors for ' &
                                //text_of(size(table%x))//' times', error)
         else if (any(table%x(2:) <= table%x(:size(table%x) - 1))) then
            call complain_about(group, 'times', 'times have to rise', error)
         end if
         plan%table = table
      else if (table%smooth) then
         call complain_about(group, 'smooth', 'it is between times, and none are given', error)
      end if
   end subroutine read_plan

   !> When the values of what is prescribed are met; without times they are met at an even rate.
   subroutine read_way(group, step, error)
      type(group_t), intent(inout) :: group
      type(step_t), intent(inout) :: step
      type(error_t), allocatable, intent(inout) :: error
      type(table_t) :: table
      call get(group, 'times', table%x, error, required=.false., minimum=0.0_wp)
      if (allocated(error)) return
      if (allocated(step%volumes)) table%y = step%volumes
      if (allocated(step%displacements)) table%y = step%displacements
      if (size(table%x) > 0 .and. size(table%x) /= size(table%y)) then
         call complain_about(group, 'times', 'there are '//text_of(size(table%x))//' times for '//text_of(size(table%y)) &
                             //' values of what is prescribed', error)
      else if (any(table%x(2:) <= table%x(:size(table%x) - 1))) then
         call complain_about(group, 'times', 'times have to rise', error)
      end if
      step%time%table = table
   end subroutine read_way

   subroutine read_output_times(group, plan, error)
      type(group_t), intent(inout) :: group
      type(time_plan_t), intent(inout) :: plan
      type(error_t), allocatable, intent(inout) :: error
      if (allocated(error)) return
      call get(group, 'output_times', plan%output_times, error, required=.false., minimum=0.0_wp)
      call get(group, 'output_interval', plan%output_interval, error, default=plan%output_interval, minimum=0.0_wp)
      if (allocated(error)) return
      if (size(plan%output_times) == 0) deallocate (plan%output_times)
      if (.not. allocated(plan%output_times)) return
      if (any(plan%output_times(2:) <= plan%output_times(:size(plan%output_times) - 1))) then
         call complain_about(group, 'output_times', 'times have to rise', error)
      else if (maxval(plan%output_times) > plan%duration) then
         call complain_about(group, 'output_times', 'the last is after the end of the step', error)
      end if
   end subroutine read_output_times

   !> The load factor over the time since the step began is an amplitude.
   subroutine take_amplitude(group, amplitude, plan, error)
      type(group_t), intent(in) :: group
      type(amplitude_t), intent(in) :: amplitude
      type(time_plan_t), intent(inout) :: plan
      type(error_t), allocatable, intent(inout) :: error
      character(len=11), parameter :: others(4) = [character(len=11) :: 'load_factor', 'times', 'factors', 'smooth']
      integer :: i
      do i = 1, size(others)
         if (.not. has(group, trim(others(i)))) cycle
         call complain_about(group, trim(others(i)), 'the load factor is given over time by the amplitude', error)
         return
      end do
      if (.not. amplitude%over_time) then
         call complain_about(group, 'amplitude', "the load factor of a step in time needs an amplitude over = 'time'; '" &
                             //amplitude%name//"' is one over the load factor", error)
      else
         plan%table = amplitude%table
      end if
   end subroutine take_amplitude
end module finshell_input_time_step
