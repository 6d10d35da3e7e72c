!> Reports every converged increment: a line on the screen, a row of the history, a step of the result file.
module finshell_reporter
   use, intrinsic :: iso_fortran_env, only: output_unit
   use finshell_kinds, only: wp
   use finshell_checkpoint, only: checkpoint_t
   use finshell_disk, only: check_replaceable, lock_t, remove_in_system, take_lock
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error_indicator, only: estimate_error, indicator_t
   use finshell_error, only: error_t, raise
   use finshell_gaps, only: count_gaps, gap_t
   use finshell_increment_lines, only: show_event, show_increment, show_snap, show_ways, show_vibration
   use finshell_factor_columns, only: add_factors, factor_names
   use finshell_field, only: field_t, increment_t, monitor_value, name_t
   use finshell_history, only: history_file_t
   use finshell_mode_table, only: mode_table_t
   use finshell_monitor, only: monitor_t, output_t
   use finshell_monitoring, only: watch_t, new_watch, monitored_values, watched_elements, watched_entries, point_fields, &
      cell_fields, cell_entries
   use finshell_observer, only: observer_t, record_t
   use finshell_recovery, only: recovery_t, recover
   use finshell_report_rules, only: has_fields, motion_values, row_of
   use finshell_result_fields, only: error_entry, find_field
   use finshell_results, only: results_file_t
   use finshell_stability, only: no_event
   use finshell_state, only: state_t, linear_change_t
   use finshell_status, only: status_io_error
   use finshell_storage, only: storage_t
   use finshell_step, only: control_frequencies, control_linear, is_in_time, is_mode, leaves_state, step_t
   use finshell_version, only: version
   implicit none
   private
   public :: reporter_t

   type, extends(observer_t) :: reporter_t
      type(equilibrium_t), pointer :: problem => null()
      type(monitor_t), allocatable :: monitors(:)
      type(watch_t), allocatable :: watches(:)
      type(output_t) :: output
      real(wp), allocatable :: levels(:) !< load factors at which fields are written in any case
      type(history_file_t) :: history
      type(mode_table_t) :: modes
      type(results_file_t) :: results
      type(lock_t) :: lock
      character(len=:), allocatable :: base_name !< of all files
      logical :: quiet = .false.
      integer :: last_written = -1
      integer :: unstable = 0 !< increments with negative pivots
      integer :: descents = 0 !< increments found by a descent
      integer :: relaxations = 0, first_relaxed = 0 !< increments found by dynamic relaxation; the first of them
      integer :: steps = 0 !< of dynamic relaxation
      real(wp) :: stabilisation = 0 !< energy that it took in a step, in parts of the stored energy: the largest
      integer :: linear = 0 !< linear solutions and modes
      logical :: estimates = .false. !< of errors are asked for: fields or monitors
      real(wp) :: relative_error = -1 !< of the mesh, estimated, at the end; negative: not known
      integer :: switched = 0 !< linear and buckling steps whose solution decided which fibres act
      integer :: critical_points = 0 !< limit and bifurcation points
      integer :: rounded = 0 !< increments that rounding kept from their tolerance
      real(wp) :: residual = 0, correction = 0 !< worst of all increments
      logical :: stands_in = .false. !< arc-length stands in for the control of the step
      integer :: snaps = 0, first_snap = 0 !< increments that snapped; the first of them
      type(record_t) :: last
      integer, allocatable :: watched_elements(:) !< those that have to be recovered for the monitors
      integer, allocatable :: watched_entries(:), cell_entries(:) !< element fields of the monitors, of the result file
      type(gap_t), allocatable :: gaps(:) !< monitors and fields with missing values
      !> Monitors and load factor of the last increment, of the first mode of a buckling step; NaN where they are missing.
      real(wp), allocatable :: final(:)
      logical :: fresh = .true. !< a step begins
      type(name_t), allocatable :: cases(:) !< of loads and supports, whose factors are columns of the history
      real(wp) :: duration = 0 !< of all steps in time; 0: there are none
      logical :: at_landings = .false. !< in this step fields are written at the times that it asks for, and at no others
      integer :: moved = 0 !< increments in time
      type(checkpoint_t) :: checkpoint
      integer :: continued = 0 !< the increment after which a run goes on
      logical :: continues = .false. !< the files of that run
      integer :: mesh = 0 !< number of the present one where there are several (a column of the history)
      type(linear_change_t), allocatable :: change !< of the last linear step
   contains
      procedure :: open => open_reports
      procedure :: increment
      procedure :: finish
      procedure :: begin_step
      procedure :: change_mesh
      procedure, private :: create_files
      procedure, private :: continue_files
      procedure, private :: create_results
      procedure, private :: find_watches
      procedure, private :: evaluate
      procedure, private :: write_fields
   end type reporter_t

contains

   !> Create the files NAME.history.csv, NAME.vtkhdf and NAME.xdmf; the result file starts with the unloaded state. Until all are
   !> there, older files of these names stay as they are.
   subroutine open_reports(self, base_name, input_text, problem, monitors, output, levels, error)
      class(reporter_t), intent(inout) :: self
      character(len=*), intent(in) :: base_name, input_text
      type(equilibrium_t), intent(in), target :: problem
      type(monitor_t), intent(in) :: monitors(:)
      type(output_t), intent(in) :: output
      real(wp), intent(in) :: levels(:)
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: ignored
      character(len=:), allocatable :: reason

      self%base_name = base_name
      self%problem => problem
      self%monitors = monitors
      self%output = output
      self%levels = levels
      call self%find_watches()
      self%cell_entries = cell_entries(output)
      self%estimates = any(self%cell_entries == error_entry) .or. any(self%watched_entries == error_entry) &
         .or. any(monitors%quantity == find_field('relative_error'))
      allocate (self%gaps(0))
      call take_lock(base_name//'.lock', self%lock, reason)
      if (reason /= '') then
         call raise(error, status_io_error, base_name//'.lock: '//reason//'; wait for it, or take another name (name in &job) ' &
            //'or folder (-o)')
         return
      end if
      call remove_in_system(base_name//'.vtkhdf~live') ! of a run that was killed
      call remove_in_system(base_name//'.vtkhdf~copy')
      if (self%continues) then
         call self%continue_files(input_text, error)
      else
         call self%create_files(input_text, error)
         if (.not. allocated(error)) call remove_in_system(base_name//'.restart') ! it is of another run
      end if
      if (.not. allocated(error)) call self%history%publish(base_name//'.history.csv', error)
      if (.not. allocated(error) .and. output%fields) call self%results%publish(error)
      if (.not. (allocated(error) .or. self%continues)) call self%checkpoint%start(base_name//'.restart', error)
      if (.not. allocated(error)) return
      call self%history%close()
      call self%results%close(ignored)
      call remove_in_system(base_name//'~.history.csv')
      call remove_in_system(base_name//'~.vtkhdf')
      call remove_in_system(base_name//'~.xdmf')
      call self%lock%release(base_name//'.lock')
   end subroutine open_reports

   !> Create all files under other names.
   subroutine create_files(self, input_text, error)
      class(reporter_t), intent(inout) :: self
      character(len=*), intent(in) :: input_text
      type(error_t), allocatable, intent(out) :: error

      call check_replaceable(self%base_name//'.history.csv', error)
      if (.not. allocated(error)) call check_replaceable(self%base_name//'.restart', error)
      if (self%output%fields .and. .not. allocated(error)) call check_replaceable(self%base_name//'.vtkhdf', error)
      if (self%output%fields .and. .not. allocated(error)) call check_replaceable(self%base_name//'.xdmf', error)
      if (allocated(error)) return
      call self%history%create(self%base_name//'~.history.csv', column_names(self), error, self%duration > 0)
      if (.not. allocated(error) .and. self%output%fields) call self%create_results(input_text, error)
   end subroutine create_files

   !> Go on with the files of an earlier run after one of its increments.
   subroutine continue_files(self, input_text, error)
      class(reporter_t), intent(inout) :: self
      character(len=*), intent(in) :: input_text
      type(error_t), allocatable, intent(out) :: error
      type(recovery_t) :: recovery
      type(increment_t) :: row
      logical :: exists
      call self%history%open_for_restart(self%base_name//'.history.csv', self%base_name//'~.history.csv', column_names(self), &
                                         self%continued, error, self%duration > 0)
      if (allocated(error)) return
      inquire (file=self%base_name//'.vtkhdf', exist=exists)
      if (exists .and. self%output%fields) then
         call self%evaluate(self%problem%state, record_t(negative_pivots=0), .true., row, recovery)
         call self%results%open_for_restart(self%base_name//'.vtkhdf', self%base_name//'~.vtkhdf', version, input_text, &
                                            self%problem%structure%mesh%coordinates, self%problem%structure%mesh%triangles, &
                                            point_fields(self%problem, self%problem%state, self%output), &
                                            cell_fields(self%output, recovery), column_names(self), self%continued, error, &
                                            storage_t(self%output%compress, self%output%single, self%duration))
         self%last_written = self%continued
      else if (self%output%fields) then
         call self%create_results(input_text, error)
      end if
      ! the record first: whatever happens between these, it has its rows
      if (.not. allocated(error)) call self%checkpoint%keep(self%base_name//'.restart', self%continued, error)
      if (.not. allocated(error)) call self%modes%cut(self%base_name//'.modes.csv', self%continued, error)
   end subroutine continue_files

   !> The result file of the present mesh, with the state of the problem, which is unloaded.
   subroutine create_results(self, input_text, error)
      class(reporter_t), intent(inout) :: self
      character(len=*), intent(in) :: input_text
      type(error_t), allocatable, intent(out) :: error
      type(recovery_t) :: recovery
      type(increment_t) :: row
      call self%evaluate(self%problem%state, record_t(increment=self%continued, load_factor=self%problem%state%load_factor, &
                                                      negative_pivots=0), .true., row, recovery)
      associate (mesh => self%problem%structure%mesh)
         call self%results%create(self%base_name//'~.vtkhdf', version, input_text, mesh%coordinates, mesh%triangles, &
                                  point_fields(self%problem, self%problem%state, self%output), &
                                  cell_fields(self%output, recovery), column_names(self), error, &
                                  published_as=self%base_name//'.vtkhdf', &
                                  storage=storage_t(self%output%compress, self%output%single, self%duration))
      end associate
      if (.not. allocated(error)) call self%write_fields(self%problem%state, row, recovery, error)
   end subroutine create_results

   !> Names of the monitors as columns, and that of the mesh where there are several.
   pure function column_names(self) result(names)
      class(reporter_t), intent(in) :: self
      type(name_t), allocatable :: names(:)
      integer :: i
      allocate (names(size(self%monitors)))
      do i = 1, size(names)
         names(i)%text = self%monitors(i)%name
      end do
      if (allocated(self%cases)) names = [names, factor_names(self%problem, self%cases)]
      if (self%mesh > 0) names = [names, name_t('mesh')]
   end function column_names

   !> Look up what the monitors watch in the mesh.
   subroutine find_watches(self)
      class(reporter_t), intent(inout) :: self
      integer :: i
      if (allocated(self%watches)) deallocate (self%watches)
      allocate (self%watches(size(self%monitors)))
      do i = 1, size(self%monitors)
         call new_watch(self%watches(i), self%monitors(i), self%problem%structure%mesh)
      end do
      self%watched_elements = watched_elements(self%watches, size(self%problem%structure%mesh%triangles, 2))
      self%watched_entries = watched_entries(self%watches)
   end subroutine find_watches

   !> Go on with another mesh, which the problem has already, unloaded: the result file begins anew, the history goes on.
   subroutine change_mesh(self, input_text, error)
      class(reporter_t), intent(inout) :: self
      character(len=*), intent(in) :: input_text
      type(error_t), allocatable, intent(out) :: error
      self%mesh = self%mesh + 1
      call self%find_watches()
      self%last = record_t()
      if (.not. self%output%fields) return
      call self%results%close(error)
      if (.not. allocated(error)) call self%create_results(input_text, error)
      if (.not. allocated(error)) call self%results%publish(error)
   end subroutine change_mesh

   subroutine begin_step(self, step, number)
      class(reporter_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      integer, intent(in) :: number !< of the step in the input
      self%checkpoint%step = number
      self%fresh = .true.
      self%at_landings = is_in_time(step%control) .and. (allocated(step%time%output_times) .or. step%time%output_interval > 0)
   end subroutine begin_step

   !> See finshell_observer.
   subroutine increment(self, state, record, error, change)
      class(reporter_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      type(error_t), allocatable, intent(out) :: error
      type(linear_change_t), intent(in), optional, target :: change
      type(increment_t) :: row
      type(recovery_t) :: recovery
      type(indicator_t) :: indicator
      logical :: with_fields
      integer :: i

      with_fields = self%output%fields .and. has_fields(record, self%output%every, self%at_landings, self%levels)
      call self%evaluate(state, record, with_fields, row, recovery, change)
      call self%history%append(row, error)
      if (allocated(error)) return
      do i = 1, size(self%watches)
         call count_gaps(self%gaps, self%monitors(i)%name, row%missing(i:i))
      end do
      if (self%fresh .or. .not. is_mode(record%control)) &
         self%final = [(monitor_value(row, i), i=1, size(self%watches)), record%load_factor]
      self%fresh = .false.
      if ((record%stands_in .neqv. self%stands_in) .and. .not. self%quiet) write (output_unit, '(5x,a)') trim(merge( &
         'arc-length stands in from here: what the step prescribes turns round  ', &
         'the control of the step takes over again                              ', record%stands_in))
      self%stands_in = record%stands_in
      if (.not. self%quiet) call show_increment(record, record%increment == self%continued + 1 .and. self%mesh <= 1, &
                                                self%monitors, [(monitor_value(row, i), i=1, size(self%watches))], row%motion)
      if (record%control == control_frequencies) then
         if (.not. self%quiet) call show_vibration(record%vibration)
         associate (v => record%vibration)
            call self%modes%append(self%base_name//'.modes.csv', record%increment, &
                                   [v%frequency, v%generalised_mass, v%effective_mass, v%whole_mass], error)
         end associate
      end if
      if (allocated(error)) return
      if (.not. self%quiet) call show_ways(record)
      if (record%descended) self%descents = self%descents + 1
      self%steps = self%steps + record%steps
      self%stabilisation = max(self%stabilisation, record%taken)
      if (record%relaxed) then
         self%relaxations = self%relaxations + 1
         if (self%first_relaxed == 0) self%first_relaxed = record%increment
      end if
      if (record%switched > 1) self%switched = self%switched + 1
      if (leaves_state(record%control)) self%linear = self%linear + 1
      if (is_in_time(record%control)) self%moved = self%moved + 1
      if (record%control == control_linear .and. self%estimates) then
         call estimate_error(self%problem, state, indicator, change)
         self%relative_error = indicator%relative
      end if
      if (record%event /= no_event) then
         self%critical_points = self%critical_points + 1
         if (.not. self%quiet) call show_event(record)
      end if
      if (record%rounding) self%rounded = self%rounded + 1
      self%residual = max(self%residual, record%residual)
      self%correction = max(self%correction, record%correction)
      if (record%negative_pivots > 0) self%unstable = self%unstable + 1
      if (record%snap) then
         self%snaps = self%snaps + 1
         if (self%first_snap == 0) self%first_snap = record%increment
         if (.not. self%quiet) call show_snap(record)
      end if
      self%last = record
      if (present(change)) self%change = change
      if (with_fields) call self%write_fields(state, row, recovery, error, change)
      if (.not. allocated(error) .and. .not. leaves_state(record%control)) &
         call self%checkpoint%note(with_fields .or. .not. self%output%fields, is_in_time(record%control), error)
   end subroutine increment

   !> Write the fields of the last increment, if they have not been, and close the files.
   subroutine finish(self, state, error)
      class(reporter_t), intent(inout) :: self
      type(state_t), intent(in) :: state !< the last converged state
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: ignored
      type(increment_t) :: row
      type(recovery_t) :: recovery
      type(indicator_t) :: indicator
      if (self%output%fields .and. self%last%increment > self%last_written .and. self%last_written >= 0) then
         call self%evaluate(state, self%last, .true., row, recovery)
         call self%write_fields(state, row, recovery, error)
      end if
      if (self%mesh == 0 .and. self%last%increment > 0 .and. .not. leaves_state(self%last%control) &
          .and. .not. is_in_time(self%last%control)) then
         call estimate_error(self%problem, state, indicator)
         self%relative_error = indicator%relative
      end if
      call self%results%close(ignored)
      if (allocated(ignored) .and. .not. allocated(error)) call move_alloc(ignored, error)
      call self%history%close()
      call self%checkpoint%write(ignored, if_due=.true.)
      if (allocated(ignored) .and. .not. allocated(error)) call move_alloc(ignored, error)
      call self%lock%release(self%base_name//'.lock')
   end subroutine finish

   !> The row of an increment, and its recovered results: of all elements if there are fields of theirs to write.
   subroutine evaluate(self, state, record, with_fields, row, recovery, change)
      class(reporter_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      logical, intent(in) :: with_fields
      type(increment_t), intent(out) :: row
      type(recovery_t), intent(out) :: recovery
      type(linear_change_t), intent(in), optional, target :: change
      integer :: i

      if (with_fields .and. size(self%cell_entries) > 0) then
         call recover(self%problem, state, [(i, i=1, size(self%problem%structure%mesh%triangles, 2))], &
                      [self%cell_entries, pack(self%watched_entries, [(all(self%cell_entries /= self%watched_entries(i)), &
                                                                       i=1, size(self%watched_entries))])], recovery, &
                      change)
      else if (size(self%watched_entries) > 0) then
         call recover(self%problem, state, self%watched_elements, self%watched_entries, recovery, change)
      end if
      row = row_of(record)
      allocate (row%monitors(size(self%watches)), row%missing(size(self%watches)))
      if (self%duration > 0) row%motion = motion_values(self%problem, state, record)
      call monitored_values(self%problem, state, self%watches, row%monitors, row%missing, recovery, change, row%motion)
      if (allocated(self%cases)) call add_factors(self%problem, self%cases, state, row%monitors, row%missing, change)
      if (self%mesh == 0) return
      row%monitors = [row%monitors, real(self%mesh, wp)]
      row%missing = [row%missing, .false.]
   end subroutine evaluate

   subroutine write_fields(self, state, row, recovery, error, change)
      class(reporter_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(increment_t), intent(in) :: row
      type(recovery_t), intent(in) :: recovery
      type(error_t), allocatable, intent(out) :: error
      type(linear_change_t), intent(in), optional, target :: change
      type(field_t), allocatable :: cells(:)
      integer :: i
      cells = cell_fields(self%output, recovery)
      call self%results%append(row, point_fields(self%problem, state, self%output, change), cells, error)
      if (allocated(error)) return
      self%last_written = row%increment
      do i = 1, size(cells)
         call count_gaps(self%gaps, cells(i)%name, cells(i)%missing)
      end do
   end subroutine write_fields
end module finshell_reporter
