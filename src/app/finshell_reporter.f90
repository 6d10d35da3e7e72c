!> Reports every converged increment: a line on the screen, a row of the history, a step of the result file.
module finshell_reporter
   use, intrinsic :: iso_fortran_env, only: output_unit
   use finshell_kinds, only: wp
   use finshell_disk, only: lock_t, remove_in_system, take_lock
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_field, only: field_t, increment_t, monitor_value, name_t
   use finshell_history, only: history_file_t
   use finshell_monitor, only: monitor_t, output_t
   use finshell_monitoring, only: watch_t, new_watch, monitored_values, watched_elements, watched_entries, point_fields, &
      cell_fields, cell_entries
   use finshell_observer, only: observer_t, record_t
   use finshell_recovery, only: recovery_t, recover
   use finshell_results, only: results_file_t
   use finshell_stability, only: event_name, no_event
   use finshell_state, only: state_t, linear_change_t
   use finshell_status, only: status_io_error
   use finshell_storage, only: storage_t
   use finshell_step, only: control_linear, control_buckling
   use finshell_version, only: version
   implicit none
   private
   public :: reporter_t

   integer, parameter :: shown = 3 !< monitors on the screen

   !> How many values of a monitor or field could not be recovered.
   type :: gap_t
      character(len=:), allocatable :: name
      integer :: values = 0
   end type gap_t

   type, extends(observer_t) :: reporter_t
      type(equilibrium_t), pointer :: problem => null()
      type(monitor_t), allocatable :: monitors(:)
      type(watch_t), allocatable :: watches(:)
      type(output_t) :: output
      real(wp), allocatable :: levels(:) !< load factors at which fields are written in any case
      type(history_file_t) :: history
      type(results_file_t) :: results
      type(lock_t) :: lock
      character(len=:), allocatable :: base_name !< of all files
      logical :: quiet = .false.
      integer :: last_written = -1
      integer :: unstable = 0 !< increments with negative pivots
      integer :: descents = 0 !< increments found by a descent
      integer :: linear = 0 !< linear solutions and modes
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
   contains
      procedure :: open => open_reports
      procedure :: increment
      procedure :: finish
      procedure :: begin_step
      procedure, private :: create_files
      procedure, private :: evaluate
      procedure, private :: write_fields
      procedure, private :: count_gaps
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
      type(name_t), allocatable :: names(:)
      type(error_t), allocatable :: ignored
      character(len=:), allocatable :: reason
      integer :: i

      self%base_name = base_name
      self%problem => problem
      self%monitors = monitors
      self%output = output
      self%levels = levels
      allocate (self%watches(size(monitors)), names(size(monitors)))
      do i = 1, size(monitors)
         call new_watch(self%watches(i), monitors(i), problem%structure%mesh)
         names(i)%text = monitors(i)%name
      end do
      self%watched_elements = watched_elements(self%watches, size(problem%structure%mesh%triangles, 2))
      self%watched_entries = watched_entries(self%watches)
      self%cell_entries = cell_entries(output)
      allocate (self%gaps(0))
      call take_lock(base_name//'.lock', self%lock, reason)
      if (reason /= '') then
         call raise(error, status_io_error, base_name//'.lock: '//reason//'; wait for it, or take another name (name in &job) ' &
            //'or folder (-o)')
         return
      end if
      call remove_in_system(base_name//'.vtkhdf~live') ! of a run that was killed
      call remove_in_system(base_name//'.vtkhdf~copy')
      call self%create_files(input_text, names, error)
      if (.not. allocated(error)) call self%history%publish(base_name//'.history.csv', error)
      if (.not. allocated(error) .and. output%fields) call self%results%publish(error)
      if (.not. allocated(error)) return
      call self%history%close()
      call self%results%close(ignored)
      call remove_in_system(base_name//'~.history.csv')
      call remove_in_system(base_name//'~.vtkhdf')
      call remove_in_system(base_name//'~.xdmf')
      call self%lock%release(base_name//'.lock')
   end subroutine open_reports

   !> Create all files under other names.
   subroutine create_files(self, input_text, names, error)
      class(reporter_t), intent(inout) :: self
      character(len=*), intent(in) :: input_text
      type(name_t), intent(in) :: names(:) !< of the monitors
      type(error_t), allocatable, intent(out) :: error
      type(recovery_t) :: recovery
      type(increment_t) :: row

      call check_replaceable(self%base_name//'.history.csv', error)
      if (self%output%fields .and. .not. allocated(error)) call check_replaceable(self%base_name//'.vtkhdf', error)
      if (self%output%fields .and. .not. allocated(error)) call check_replaceable(self%base_name//'.xdmf', error)
      if (allocated(error)) return
      call self%history%create(self%base_name//'~.history.csv', names, error)
      if (allocated(error) .or. .not. self%output%fields) return
      call self%evaluate(self%problem%state, record_t(negative_pivots=0), .true., row, recovery)
      associate (mesh => self%problem%structure%mesh)
         call self%results%create(self%base_name//'~.vtkhdf', version, input_text, mesh%coordinates, mesh%triangles, &
                                  point_fields(self%problem, self%problem%state, self%output), &
                                  cell_fields(self%output, recovery), names, self%output%restart, error, &
                                  published_as=self%base_name//'.vtkhdf', &
                                  storage=storage_t(self%output%compress, self%output%single))
      end associate
      if (.not. allocated(error)) call self%write_fields(self%problem%state, row, recovery, error)
   end subroutine create_files

   !> An older file may be replaced if it may be written to.
   subroutine check_replaceable(name, error)
      character(len=*), intent(in) :: name
      type(error_t), allocatable, intent(out) :: error
      character(len=256) :: reason
      logical :: exists
      integer :: unit, status
      inquire (file=name, exist=exists)
      if (.not. exists) return
      open (newunit=unit, file=name, status='old', action='readwrite', iostat=status, iomsg=reason)
      if (status == 0) then
         close (unit)
      else
         call raise(error, status_io_error, name//': cannot be replaced: '//trim(reason))
      end if
   end subroutine check_replaceable

   subroutine begin_step(self)
      class(reporter_t), intent(inout) :: self
      self%fresh = .true.
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
      logical :: with_fields
      integer :: i

      with_fields = self%output%fields .and. (mod(record%increment, max(1, self%output%every)) == 0 &
         .or. record%control == control_linear .or. record%control == control_buckling &
         .or. any(abs(self%levels - record%load_factor) <= 1.0e-10_wp*max(1.0_wp, abs(record%load_factor))))
      call self%evaluate(state, record, with_fields, row, recovery, change)
      row%residual = record%residual
      row%correction = record%correction
      row%snap = merge(1, 0, record%snap)
      call self%history%append(row, error)
      if (allocated(error)) return
      do i = 1, size(self%watches)
         call self%count_gaps(self%monitors(i)%name, row%missing(i:i))
      end do
      if (self%fresh .or. record%control /= control_buckling) &
         self%final = [(monitor_value(row, i), i=1, size(row%monitors)), record%load_factor]
      self%fresh = .false.
      if ((record%stands_in .neqv. self%stands_in) .and. .not. self%quiet) write (output_unit, '(5x,a)') trim(merge( &
         'arc-length stands in from here: what the step prescribes turns round  ', &
         'the control of the step takes over again                              ', record%stands_in))
      self%stands_in = record%stands_in
      if (.not. self%quiet) call show(self, record, [(monitor_value(row, i), i=1, size(row%monitors))])
      if (record%regularised > 0 .and. .not. self%quiet) write (output_unit, '(5x,a,i0,a)') &
         'the tangent of the law was singular here: ', record%regularised, ' iterations used a stand-in; the solution is unchanged'
      if (record%descended) then
         self%descents = self%descents + 1
         if (.not. self%quiet) write (output_unit, '(5x,a)') &
            'Newton''s iteration failed; a descent in energy found this stable state (not along a path; others may exist)'
      end if
      if (record%switched > 1) then
         self%switched = self%switched + 1
         if (.not. self%quiet) write (output_unit, '(5x,a,i0,a)') &
            'fibres act where the linear solution stretches them: found in ', record%switched, ' solutions'
      end if
      if (record%control == control_linear .or. record%control == control_buckling) self%linear = self%linear + 1
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
      if (with_fields) call self%write_fields(state, row, recovery, error, change)
   end subroutine increment

   !> Write the fields of the last increment, if they have not been, and close the files.
   subroutine finish(self, state, error)
      class(reporter_t), intent(inout) :: self
      type(state_t), intent(in) :: state !< the last converged state
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: ignored
      type(increment_t) :: row
      type(recovery_t) :: recovery
      if (self%output%fields .and. self%last%increment > self%last_written .and. self%last_written >= 0) then
         call self%evaluate(state, self%last, .true., row, recovery)
         call self%write_fields(state, row, recovery, error)
      end if
      call self%results%close(ignored)
      if (allocated(ignored) .and. .not. allocated(error)) call move_alloc(ignored, error)
      call self%history%close()
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
      row = increment_t(record%increment, record%load_factor, record%iterations, record%negative_pivots)
      row%critical_point = record%event + merge(10, 0, record%located)
      allocate (row%monitors(size(self%watches)), row%missing(size(self%watches)))
      call monitored_values(self%problem, state, self%watches, row%monitors, row%missing, recovery, change)
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
      if (self%output%restart) then
         call self%results%append(row, point_fields(self%problem, state, self%output, change), cells, error, state%rotation)
      else
         call self%results%append(row, point_fields(self%problem, state, self%output, change), cells, error)
      end if
      if (allocated(error)) return
      self%last_written = row%increment
      do i = 1, size(cells)
         call self%count_gaps(cells(i)%name, cells(i)%missing)
      end do
   end subroutine write_fields

   !> Keep account of missing values, for the summary.
   subroutine count_gaps(self, name, missing)
      class(reporter_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(in) :: missing(:)
      integer :: i
      if (.not. any(missing)) return
      do i = 1, size(self%gaps)
         if (self%gaps(i)%name == name) exit
      end do
      if (i > size(self%gaps)) self%gaps = [self%gaps, gap_t(name)]
      self%gaps(i)%values = self%gaps(i)%values + count(missing)
   end subroutine count_gaps

   !> A limit or bifurcation point.
   subroutine show_event(record)
      type(record_t), intent(in) :: record
      if (record%located) then
         write (output_unit, '(5x,a)') event_name(record%event)//' located at load factor '//text_of(record%load_factor) &
            //'; cosine between null vector and load '//text_of(record%load_cosine)
      else
         write (output_unit, '(5x,a)') event_name(record%event)//' passed since the increment before'
      end if
   end subroutine show_event

   !> An increment that has left the path.
   subroutine show_snap(record)
      type(record_t), intent(in) :: record
      if (abs(record%misfit) > 0.01_wp) then
         write (output_unit, '(5x,a,f0.1,a)') 'SNAP: this state is not the continuation of the path; work and stored energy ' &
            //'differ by ', 100*abs(record%misfit), ' %'
      else
         write (output_unit, '(5x,a)') 'SNAP: this state is not the continuation of the path; shorter increments found none'
      end if
   end subroutine show_snap

   !> Progress: increment, load factor, monitors, iterations, cuts, pivots, CPU seconds.
   subroutine show(self, record, values)
      class(reporter_t), intent(in) :: self
      type(record_t), intent(in) :: record
      real(wp), intent(in) :: values(:)
      character(len=14) :: heading
      integer :: i, n
      n = min(shown, size(values))
      if (record%increment == 1) then
         write (output_unit, '(a)', advance='no') '  inc    load factor'
         do i = 1, n
            heading = self%monitors(i)%name
            write (output_unit, '(1x,a)', advance='no') adjustr(heading)
         end do
         write (output_unit, '(a)') '  iterations  cuts  negative pivots   CPU s'
      end if
      write (output_unit, '(i5,a)', advance='no') record%increment, column(record%load_factor)
      do i = 1, n
         write (output_unit, '(a)', advance='no') column(values(i))
      end do
      if (record%negative_pivots < 0) then
         write (output_unit, '(i12,i6,a17,f8.2)') record%iterations, record%cuts, '?', record%cpu_time
      else
         write (output_unit, '(i12,i6,i17,f8.2)') record%iterations, record%cuts, record%negative_pivots, record%cpu_time
      end if
      flush (output_unit)
   end subroutine show

   !> A number as a column, with a blank before it.
   pure function column(x) result(text)
      real(wp), intent(in) :: x
      character(len=15) :: text
      text = text_of(x)
      text = adjustr(text)
   end function column
end module finshell_reporter
