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
   use finshell_field, only: increment_t, monitor_value
   use finshell_history, only: history_file_t
   use finshell_monitor, only: monitor_t, output_t
   use finshell_monitoring, only: watched_entries
   use finshell_observer, only: record_t
   use finshell_recovery, only: recovery_t
   use finshell_probe, only: probe_t
   use finshell_probe_file, only: probe_file_t
   use finshell_report_rules, only: row_of
   use finshell_result_fields, only: error_entry, find_field
   use finshell_state, only: state_t, linear_change_t
   use finshell_status, only: status_io_error
   use finshell_table_file, only: mode_header, table_file_t
   use finshell_step, only: control_frequencies, control_linear, is_in_time, is_mode, leaves_state, step_t
   use finshell_watching, only: watching_t
   implicit none
   private
   public :: reporter_t

   type, extends(watching_t) :: reporter_t
      real(wp), allocatable :: levels(:) !< load factors at which fields are written in any case
      type(history_file_t) :: history
      type(table_file_t) :: modes
      type(probe_file_t), allocatable :: probes(:)
      type(lock_t) :: lock
      logical :: quiet = .false.
      logical :: estimates = .false. !< of errors are asked for: fields or monitors
      logical :: judged = .false. !< &accuracy estimates the error
      real(wp) :: relative_error = -1 !< of the mesh, estimated, at the end; negative: not known
      logical :: stands_in = .false. !< arc-length stands in for the control of the step
      type(record_t) :: last
      real(wp) :: before(2) = 0 !< load factor and time at the increment before
      type(gap_t), allocatable :: gaps(:) !< monitors and fields with missing values
      !> Monitors and load factor of the last increment, of the first mode of a buckling step; NaN where they are missing.
      real(wp), allocatable :: final(:)
      logical :: fresh = .true. !< a step begins
      logical :: at_landings = .false. !< in this step fields are written at the times that it asks for, and at no others
      type(checkpoint_t) :: checkpoint
      integer :: continued = 0 !< the increment after which a run goes on
      logical :: continues = .false. !< the files of that run
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
      procedure, private :: begin_probes
      procedure, private :: write_fields
   end type reporter_t

contains

   !> Create the files NAME.history.csv, NAME.vtkhdf and NAME.xdmf; the result file starts with the unloaded state. Until all are
   !> there, older files of these names stay as they are.
   subroutine open_reports(self, base_name, input_text, problem, monitors, outputs, probes, levels, error)
      class(reporter_t), intent(inout) :: self
      character(len=*), intent(in) :: base_name, input_text
      type(equilibrium_t), intent(in), target :: problem
      type(monitor_t), intent(in) :: monitors(:)
      type(output_t), intent(in) :: outputs(:) !< the result files; of the first one the other keys count
      type(probe_t), intent(in) :: probes(:)
      real(wp), intent(in) :: levels(:)
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: reason
      integer :: i

      self%base_name = base_name
      self%problem => problem
      self%monitors = monitors
      self%levels = levels
      allocate (self%parts(size(outputs)), self%probes(size(probes)))
      self%probes%probe = probes
      do i = 1, size(outputs)
         self%parts(i)%output = outputs(i)
      end do
      self%modes%header = mode_header
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
      if (.not. allocated(error)) call self%begin_probes(error)
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
         call self%parts(i)%check(self%problem%structure%mesh, error)
      end do
      do i = 1, size(self%probes)
         if (.not. allocated(error)) call check_replaceable(self%base_name//'.'//self%probes(i)%probe%name//'.csv', error)
      end do
      if (allocated(error)) return
      call self%history%create(self%base_name//'~.history.csv', self%column_names(), error, self%duration > 0)
      if (.not. allocated(error)) call self%create_results(input_text, error)
   end subroutine create_files

   !> Go on with the files of an earlier run after one of its increments.
   subroutine continue_files(self, input_text, error)
      class(reporter_t), intent(inout) :: self
      character(len=*), intent(in) :: input_text
      type(error_t), allocatable, intent(out) :: error
      call self%history%open_for_restart(self%base_name//'.history.csv', self%base_name//'~.history.csv', self%column_names(), &
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
               call part%go_on(input_text, self%problem, recovery, self%column_names(), self%duration, &
                               self%continued, exists, error)
               part%due = .not. exists
            end if
            if (part%due .and. .not. allocated(error)) &
               call part%create(input_text, self%problem, recovery, self%column_names(), self%duration, error)
         end associate
         if (allocated(error)) return
      end do
      call self%write_fields(self%problem%state, row, recovery, error)
   end subroutine create_results

   !> Files of the probes: the present state, or those of an earlier run.
   subroutine begin_probes(self, error)
      class(reporter_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      type(increment_t) :: row
      integer :: i
      row = row_of(record_t(increment=self%continued, load_factor=self%problem%state%load_factor))
      if (self%duration > 0) row%motion = [self%problem%state%time]
      do i = 1, size(self%probes)
         if (.not. allocated(error)) call self%probes(i)%begin(self%base_name, self%problem, row, self%continues, error)
      end do
   end subroutine begin_probes

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
      if (.not. allocated(error)) call self%begin_probes(error)
   end subroutine change_mesh

   subroutine begin_step(self, step, number)
      class(reporter_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      integer, intent(in) :: number !< of the step in the input
      self%checkpoint%step = number
      self%fresh = .true.
      if (associated(self%problem)) & ! not where another process reports
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
      real(wp), allocatable :: numbers(:)
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
            numbers = [v%frequency, v%generalised_mass, v%effective_mass, v%whole_mass]
            call self%modes%append(self%base_name//'.modes.csv', record%increment, reshape(numbers, [size(numbers), 1]), error)
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
      do i = 1, size(self%probes)
         if (.not. allocated(error)) &
            call self%probes(i)%append(self%problem, state, row, leaves_state(record%control), error, change)
      end do
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
      if (any(self%parts%due) .or. any(self%probes%last_written < self%last%increment)) then
         call self%evaluate(state, self%last, row, recovery)
         call self%write_fields(state, row, recovery, error)
         do i = 1, size(self%probes)
            if (.not. allocated(error) .and. self%probes(i)%last_written < self%last%increment) &
               call self%probes(i)%append(self%problem, state, row, .true., error)
         end do
      end if
      if (.not. self%judged .and. self%last%increment > 0 .and. .not. leaves_state(self%last%control) &
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
