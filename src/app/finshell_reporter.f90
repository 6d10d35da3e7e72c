!> Reports every converged increment: a line on the screen, a row of the history, a step of the result file.
module finshell_reporter
   use finshell_kinds, only: wp
   use finshell_checkpoint, only: checkpoint_t
   use finshell_disk, only: check_replaceable, lock_t, remove_in_system, take_lock
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error_indicator, only: estimate_error, indicator_t
   use finshell_error, only: error_t, raise
   use finshell_gaps, only: count_gaps, gap_t
   use finshell_increment_lines, only: show_record
   use finshell_factor, only: factor_at
   use finshell_field, only: increment_t, monitor_value, name_t
   use finshell_history, only: history_file_t
   use finshell_mode_table, only: mode_table_t
   use finshell_monitor, only: monitor_t, output_t
   use finshell_monitoring, only: watch_t, new_watch, monitored_values, watched_elements, watched_entries
   use finshell_observer, only: record_t
   use finshell_recovery, only: recovery_t, recover
   use finshell_report_rules, only: motion_values, row_of
   use finshell_result_part, only: result_part_t
   use finshell_result_fields, only: error_entry, find_field
   use finshell_state, only: state_t, linear_change_t
   use finshell_status, only: status_io_error
   use finshell_tally, only: tally_t
   use finshell_step, only: control_frequencies, control_linear, is_in_time, is_mode, leaves_state, step_t
   implicit none
   private
   public :: reporter_t

   type, extends(tally_t) :: reporter_t
      type(equilibrium_t), pointer :: problem => null()
      type(monitor_t), allocatable :: monitors(:)
      type(watch_t), allocatable :: watches(:)
      type(result_part_t), allocatable :: parts(:) !< the result files
      real(wp), allocatable :: levels(:) !< load factors at which fields are written in any case
      type(history_file_t) :: history
      type(mode_table_t) :: modes
      type(lock_t) :: lock
      character(len=:), allocatable :: base_name !< of all files
      logical :: quiet = .false.
      logical :: estimates = .false. !< of errors are asked for: fields or monitors
      real(wp) :: relative_error = -1 !< of the mesh, estimated, at the end; negative: not known
      logical :: stands_in = .false. !< arc-length stands in for the control of the step
      type(record_t) :: last
      integer, allocatable :: watched_elements(:) !< those that have to be recovered for the monitors
      integer, allocatable :: watched_entries(:) !< element fields of the monitors
      real(wp) :: before(2) = 0 !< load factor and time at the increment before
      type(gap_t), allocatable :: gaps(:) !< monitors and fields with missing values
      !> Monitors and load factor of the last increment, of the first mode of a buckling step; NaN where they are missing.
      real(wp), allocatable :: final(:)
      logical :: fresh = .true. !< a step begins
      type(name_t), allocatable :: cases(:) !< of loads and supports, whose factors are columns of the history
      real(wp) :: duration = 0 !< of all steps in time; 0: there are none
      logical :: at_landings = .false. !< in this step fields are written at the times that it asks for, and at no others
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
      procedure, private :: look_up
      procedure, private :: evaluate
      procedure, private :: write_fields
   end type reporter_t

contains

   !> Create the files NAME.history.csv, NAME.vtkhdf and NAME.xdmf; the result file starts with the unloaded state. Until all are
   !> there, older files of these names stay as they are.
   subroutine open_reports(self, base_name, input_text, problem, monitors, outputs, levels, error)
      class(reporter_t), intent(inout) :: self
      character(len=*), intent(in) :: base_name, input_text
      type(equilibrium_t), intent(in), target :: problem
      type(monitor_t), intent(in) :: monitors(:)
      type(output_t), intent(in) :: outputs(:) !< the result files; of the first one the other keys count
      real(wp), intent(in) :: levels(:)
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: reason
      integer :: i

      self%base_name = base_name
      self%problem => problem
      self%monitors = monitors
      self%levels = levels
      allocate (self%parts(size(outputs)))
      do i = 1, size(outputs)
         self%parts(i)%output = outputs(i)
      end do
      call self%look_up()
      self%estimates = any(self%watched_entries == error_entry) .or. any(monitors%quantity == find_field('relative_error'))
      do i = 1, size(outputs)
         self%estimates = self%estimates .or. any(self%parts(i)%entries == error_entry)
      end do
      allocate (self%gaps(0))
      call take_lock(base_name//'.lock', self%lock, reason)
      if (reason /= '') then
         call raise(error, status_io_error, base_name//'.lock: '//reason//'; wait for it, or take another name (name in &job) ' &
            //'or folder (-o)')
         return
      end if
      do i = 1, size(self%parts)
         call remove_in_system(self%parts(i)%name//'.vtkhdf~live') ! of a run that was killed
         call remove_in_system(self%parts(i)%name//'.vtkhdf~copy')
      end do
      if (self%continues) then
         call self%continue_files(input_text, error)
      else
         call self%create_files(input_text, error)
         if (.not. allocated(error)) call remove_in_system(base_name//'.restart') ! it is of another run
      end if
      if (.not. allocated(error)) call self%history%publish(base_name//'.history.csv', error)
      do i = 1, size(self%parts)
         if (.not. allocated(error) .and. outputs(i)%fields) call self%parts(i)%file%publish(error)
      end do
      if (.not. (allocated(error) .or. self%continues)) call self%checkpoint%start(base_name//'.restart', error)
      if (.not. allocated(error)) return
      call self%history%close()
      call remove_in_system(base_name//'~.history.csv')
      do i = 1, size(self%parts)
         call self%parts(i)%remove()
      end do
      call self%lock%release(base_name//'.lock')
   end subroutine open_reports

   !> Create all files under other names.
   subroutine create_files(self, input_text, error)
      class(reporter_t), intent(inout) :: self
      character(len=*), intent(in) :: input_text
      type(error_t), allocatable, intent(out) :: error
      integer :: i

      call check_replaceable(self%base_name//'.history.csv', error)
      if (.not. allocated(error)) call check_replaceable(self%base_name//'.restart', error)
      do i = 1, size(self%parts)
         call self%parts(i)%check(error)
      end do
      if (allocated(error)) return
      call self%history%create(self%base_name//'~.history.csv', column_names(self), error, self%duration > 0)
      if (.not. allocated(error)) call self%create_results(input_text, error)
   end subroutine create_files

   !> Go on with the files of an earlier run after one of its increments.
   subroutine continue_files(self, input_text, error)
      class(reporter_t), intent(inout) :: self
      character(len=*), intent(in) :: input_text
      type(error_t), allocatable, intent(out) :: error
      call self%history%open_for_restart(self%base_name//'.history.csv', self%base_name//'~.history.csv', column_names(self), &
                                         self%continued, error, self%duration > 0)
      if (allocated(error)) return
      call self%create_results(input_text, error)
      ! the record first: whatever happens between these, it has its rows
      if (.not. allocated(error)) call self%checkpoint%keep(self%base_name//'.restart', self%continued, error)
      if (.not. allocated(error)) call self%modes%cut(self%base_name//'.modes.csv', self%continued, error)
   end subroutine continue_files

   !> The result files of the present mesh, with the state of the problem, which is unloaded; or those of an earlier run, where they
   !> exist.
   subroutine create_results(self, input_text, error)
      class(reporter_t), intent(inout) :: self
      character(len=*), intent(in) :: input_text
      type(error_t), allocatable, intent(out) :: error
      type(recovery_t) :: recovery
      type(increment_t) :: row
      logical :: exists
      integer :: i
      self%parts%due = self%parts%output%fields
      if (.not. any(self%parts%due)) return
      call self%evaluate(self%problem%state, record_t(increment=self%continued, load_factor=self%problem%state%load_factor, &
                                                      negative_pivots=0), row, recovery)
      do i = 1, size(self%parts)
         associate (part => self%parts(i))
            if (part%due .and. self%continues) then
               call part%go_on(input_text, self%problem, recovery, column_names(self), self%duration, self%continued, exists, error)
               part%due = .not. exists
            end if
            if (part%due .and. .not. allocated(error)) &
               call part%create(input_text, self%problem, recovery, column_names(self), self%duration, error)
         end associate
         if (allocated(error)) return
      end do
      call self%write_fields(self%problem%state, row, recovery, error)
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
      if (allocated(self%cases)) names = [names, (name_t('factor_'//self%cases(i)%text), i=1, size(self%cases))]
      if (self%mesh > 0) names = [names, name_t('mesh')]
   end function column_names

   !> Look up what the monitors watch in the mesh, and what parts of it have files.
   subroutine look_up(self)
      class(reporter_t), intent(inout) :: self
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

   !> Go on with another mesh, which the problem has already, unloaded: the result file begins anew, the history goes on.
   subroutine change_mesh(self, input_text, error)
      class(reporter_t), intent(inout) :: self
      character(len=*), intent(in) :: input_text
      type(error_t), allocatable, intent(out) :: error
      integer :: i
      self%mesh = self%mesh + 1
      call self%look_up()
      self%last = record_t()
      do i = 1, size(self%parts)
         if (.not. allocated(error)) call self%parts(i)%file%close(error)
      end do
      if (.not. allocated(error)) call self%create_results(input_text, error)
      do i = 1, size(self%parts)
         if (.not. allocated(error) .and. self%parts(i)%output%fields) call self%parts(i)%file%publish(error)
      end do
   end subroutine change_mesh

   subroutine begin_step(self, step, number)
      class(reporter_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      integer, intent(in) :: number !< of the step in the input
      self%checkpoint%step = number
      self%fresh = .true.
      self%before = [factor_at(self%problem%state, self%problem%factor_of_case(step%case)), self%problem%state%time]
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
      integer :: i

      do i = 1, size(self%parts)
         call self%parts(i)%find_due(record, self%before, self%at_landings, self%levels)
      end do
      self%before = [record%load_factor, record%motion%time]
      call self%evaluate(state, record, row, recovery, change)
      call self%history%append(row, error)
      if (allocated(error)) return
      do i = 1, size(self%watches)
         call count_gaps(self%gaps, self%monitors(i)%name, row%missing(i:i))
      end do
      if (self%fresh .or. .not. is_mode(record%control)) &
         self%final = [(monitor_value(row, i), i=1, size(self%watches)), record%load_factor]
      self%fresh = .false.
      if (.not. self%quiet) call show_record(record, record%stands_in .neqv. self%stands_in, &
                                             record%increment == self%continued + 1 .and. self%mesh <= 1, self%monitors, &
                                             [(monitor_value(row, i), i=1, size(self%watches))], row%motion)
      self%stands_in = record%stands_in
      if (record%control == control_frequencies) then
         associate (v => record%vibration)
            call self%modes%append(self%base_name//'.modes.csv', record%increment, &
                                   [v%frequency, v%generalised_mass, v%effective_mass, v%whole_mass], error)
         end associate
      end if
      if (allocated(error)) return
      call self%count(record)
      if (record%control == control_linear .and. self%estimates) then
         call estimate_error(self%problem, state, indicator, change)
         self%relative_error = indicator%relative
      end if
      self%last = record
      if (present(change)) self%change = change
      call self%write_fields(state, row, recovery, error, change)
      if (.not. allocated(error) .and. .not. leaves_state(record%control)) &
         call self%checkpoint%note(any(self%parts%due) .or. .not. any(self%parts%output%fields), is_in_time(record%control), error)
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
      integer :: i
      do i = 1, size(self%parts)
         self%parts(i)%due = self%parts(i)%output%fields .and. self%last%increment > self%parts(i)%last_written &
            .and. self%parts(i)%last_written >= 0
      end do
      if (any(self%parts%due)) then
         call self%evaluate(state, self%last, row, recovery)
         call self%write_fields(state, row, recovery, error)
      end if
      if (self%mesh == 0 .and. self%last%increment > 0 .and. .not. leaves_state(self%last%control) &
          .and. .not. is_in_time(self%last%control)) then
         call estimate_error(self%problem, state, indicator)
         self%relative_error = indicator%relative
      end if
      do i = 1, size(self%parts)
         call self%parts(i)%file%close(ignored)
         if (allocated(ignored) .and. .not. allocated(error)) call move_alloc(ignored, error)
      end do
      call self%history%close()
      call self%checkpoint%write(ignored, if_due=.true.)
      if (allocated(ignored) .and. .not. allocated(error)) call move_alloc(ignored, error)
      call self%lock%release(self%base_name//'.lock')
   end subroutine finish

   !> The row of an increment, and its recovered results: of what is watched, and of the files that are due.
   subroutine evaluate(self, state, record, row, recovery, change)
      class(reporter_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      type(increment_t), intent(out) :: row
      type(recovery_t), intent(out) :: recovery
      type(linear_change_t), intent(in), optional, target :: change
      integer, allocatable :: elements(:), entries(:)
      integer :: i

      call wanted_results(self, elements, entries)
      if (size(entries) > 0) call recover(self%problem, state, elements, entries, recovery, change)
      row = row_of(record)
      allocate (row%monitors(size(self%watches)), row%missing(size(self%watches)))
      if (self%duration > 0) row%motion = motion_values(self%problem, state, record)
      call monitored_values(self%problem, state, self%watches, row%monitors, row%missing, recovery, change, row%motion)
      if (allocated(self%cases)) then
         row%monitors = [row%monitors, (factor_at(state, self%problem%factor_of_case(1 + i)), i=1, size(self%cases))]
         row%missing = [row%missing, (.false., i=1, size(self%cases))]
      end if
      if (self%mesh == 0) return
      row%monitors = [row%monitors, real(self%mesh, wp)]
      row%missing = [row%missing, .false.]
   end subroutine evaluate

   !> Elements and entries to recover.
   subroutine wanted_results(self, elements, entries)
      class(reporter_t), intent(in) :: self
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

   !> Write what is due.
   subroutine write_fields(self, state, row, recovery, error, change)
      class(reporter_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(increment_t), intent(in) :: row
      type(recovery_t), intent(in) :: recovery
      type(error_t), allocatable, intent(out) :: error
      type(linear_change_t), intent(in), optional, target :: change
      integer :: i
      do i = 1, size(self%parts)
         if (self%parts(i)%due .and. .not. allocated(error)) &
            call self%parts(i)%append(self%problem, state, row, recovery, self%gaps, error, change)
      end do
   end subroutine write_fields
end module finshell_reporter
