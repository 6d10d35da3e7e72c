!> What a run watches, and what of a state is found for it: the values of monitors, and results of elements for all files that are
!> due.
module finshell_watching
   use finshell_energy_columns, only: add_static_energy, energy_names, energy_values
   use finshell_equilibrium, only: equilibrium_t
   use finshell_factor_columns, only: add_factors, factor_names
   use finshell_field, only: increment_t, name_t
   use finshell_kinds, only: wp
   use finshell_monitor, only: monitor_t
   use finshell_monitoring, only: watch_t, new_watch, monitored_values, watched_elements, watched_entries
   use finshell_observer, only: record_t
   use finshell_recovery, only: recovery_t, recover
   use finshell_report_rules, only: motion_values, row_of
   use finshell_result_fields, only: error_entry
   use finshell_result_part, only: result_part_t
   use finshell_state, only: state_t, linear_change_t
   use finshell_sensitivity, only: sensitivities_t
   use finshell_step, only: is_in_time, leaves_state
   use finshell_tally, only: tally_t
   implicit none
   private
   public :: watching_t

   type, abstract, extends(tally_t) :: watching_t
      type(equilibrium_t), pointer :: problem => null()
      type(monitor_t), allocatable :: monitors(:)
      type(watch_t), allocatable :: watches(:)
      type(result_part_t), allocatable :: parts(:) !< the result files
      character(len=:), allocatable :: base_name !< of all files
      integer, allocatable :: watched_elements(:) !< those that have to be recovered for the monitors
      integer, allocatable :: watched_entries(:) !< element fields of the monitors
      type(name_t), allocatable :: cases(:) !< of loads and supports, whose factors are columns of the history
      real(wp) :: duration = 0 !< of all steps in time; 0: there are none
      logical :: energy = .false. !< columns of the balance of energy
      type(sensitivities_t), allocatable :: sensitivities !< columns and fields of derivatives
      integer :: mesh = 0 !< number of the present one where there are several (a column of the history)
   contains
      procedure :: look_up
      procedure :: column_names
      procedure :: evaluate
   end type watching_t

contains

   !> Names of the monitors as columns, and that of the mesh where there are several.
   pure function column_names(self) result(names)
      class(watching_t), intent(in) :: self
      type(name_t), allocatable :: names(:)
      integer :: i
      allocate (names(size(self%monitors)))
      do i = 1, size(names)
         names(i)%text = self%monitors(i)%name
      end do
      if (allocated(self%cases)) names = [names, factor_names(self%problem, self%cases)]
      if (self%mesh > 0) names = [names, name_t('mesh')]
      if (self%energy) names = [names, energy_names(self%cases, self%duration > 0)]
      if (allocated(self%sensitivities)) names = [names, self%sensitivities%column_names()]
   end function column_names

   !> Look up what the monitors watch in the mesh, and what parts of it have files.
   subroutine look_up(self)
      class(watching_t), intent(inout) :: self
      integer :: i
      if (allocated(self%watches)) deallocate (self%watches)
      allocate (self%watches(size(self%monitors)))
      do i = 1, size(self%monitors)
         call new_watch(self%watches(i), self%monitors(i), self%problem%structure%mesh)
      end do
      self%watched_elements = watched_elements(self%watches, size(self%problem%structure%mesh%triangles, 2))
      self%watched_entries = watched_entries(self%watches)
      do i = 1, size(self%parts)
         call self%parts(i)%lay_out(self%base_name, self%problem%structure%mesh)
      end do
   end subroutine look_up

   !> The row of an increment, and its recovered results: of what is watched, and of the files that are due.
   subroutine evaluate(self, state, record, row, recovery, change)
      class(watching_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      type(increment_t), intent(out) :: row
      type(recovery_t), intent(out) :: recovery
      type(linear_change_t), intent(in), optional, target :: change
      integer, allocatable :: elements(:), entries(:)

      call wanted_results(self, elements, entries)
      if (size(entries) > 0) call recover(self%problem, state, elements, entries, recovery, change)
      row = row_of(record)
      allocate (row%monitors(size(self%watches)), row%missing(size(self%watches)))
      if (self%duration > 0) row%motion = motion_values(self%problem, state, record)
      call monitored_values(self%problem, state, self%watches, row%monitors, row%missing, recovery, change, row%motion)
      if (allocated(self%cases)) call add_factors(self%problem, self%cases, state, row%monitors, row%missing, change)
      if (self%mesh > 0) then
         row%monitors = [row%monitors, real(self%mesh, wp)]
         row%missing = [row%missing, .false.]
      end if
      if (self%energy) call add_energy(self, record, row)
      if (allocated(self%sensitivities)) call add_derivatives(self, state, record, row)
   end subroutine evaluate

   subroutine add_energy(self, record, row)
      class(watching_t), intent(in) :: self
      type(record_t), intent(in) :: record
      type(increment_t), intent(inout) :: row
      real(wp), allocatable :: values(:)
      logical, allocatable :: missing(:)
      call energy_values(record, self%problem%factor_of_case(2:), self%duration > 0, values, missing)
      row%monitors = [row%monitors, values]
      row%missing = [row%missing, missing]
      if (self%duration > 0) call add_static_energy(record, row%motion)
   end subroutine add_energy

   !> Derivatives at a converged increment of a static step. Others have none, nor has what is let go before a step.
   subroutine add_derivatives(self, state, record, row)
      class(watching_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      type(increment_t), intent(inout) :: row
      integer :: i
      associate (s => self%sensitivities)
         if (record%increment == 0 .or. leaves_state(record%control) .or. is_in_time(record%control) &
             .or. state%release_factor > 0) then
            call s%clear(self%problem%structure)
         else
            call s%differentiate(self%problem, self%watches, record%control, any(self%parts%due))
         end if
         row%monitors = [row%monitors, s%values]
         row%missing = [row%missing, s%missing]
         do i = 1, size(self%parts)
            self%parts(i)%more_points = s%points
            self%parts(i)%more_cells = s%cells
         end do
      end associate
   end subroutine add_derivatives

   !> Elements and entries to recover.
   subroutine wanted_results(self, elements, entries)
      class(watching_t), intent(in) :: self
      integer, allocatable, intent(out) :: elements(:), entries(:)
      logical :: needed(size(self%problem%structure%mesh%triangles, 2)), wanted(error_entry)
      integer :: i
      needed = .false.
      wanted = .false.
      needed(self%watched_elements) = .true.
      wanted(self%watched_entries) = .true.
      do i = 1, size(self%parts)
         associate (part => self%parts(i))
            if (.not. part%due .or. size(part%entries) == 0) cycle
            wanted(part%entries) = .true.
            if (allocated(part%elements)) then
               needed(part%elements) = .true.
            else
               needed = .true.
            end if
         end associate
      end do
      elements = pack([(i, i=1, size(needed))], needed)
      entries = pack([(i, i=1, size(wanted))], wanted)
   end subroutine wanted_results
end module finshell_watching
