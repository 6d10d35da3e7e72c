!> Reports every converged increment: a line on the screen, a row of the history, a step of the result file.
module finshell_reporter
   use, intrinsic :: iso_fortran_env, only: output_unit
   use finshell_kinds, only: wp
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t
   use finshell_field, only: field_t, increment_t, name_t
   use finshell_history, only: history_file_t
   use finshell_monitor, only: monitor_t, output_t
   use finshell_monitoring, only: watch_t, new_watch, monitored_values, point_fields, cell_fields
   use finshell_observer, only: observer_t, record_t
   use finshell_results, only: results_file_t
   use finshell_stability, only: event_name, no_event
   use finshell_state, only: state_t
   use finshell_step, only: control_linear, control_buckling
   use finshell_version, only: version
   implicit none
   private
   public :: reporter_t

   integer, parameter :: shown = 3 !< monitors on the screen

   type, extends(observer_t) :: reporter_t
      type(equilibrium_t), pointer :: problem => null()
      type(monitor_t), allocatable :: monitors(:)
      type(watch_t), allocatable :: watches(:)
      type(output_t) :: output
      real(wp), allocatable :: levels(:) !< load factors at which fields are written in any case
      type(history_file_t) :: history
      type(results_file_t) :: results
      logical :: quiet = .false.
      integer :: last_written = -1
      integer :: unstable = 0 !< increments with negative pivots
      integer :: linear = 0 !< linear solutions and modes
      integer :: critical_points = 0 !< limit and bifurcation points
      integer :: snaps = 0, first_snap = 0 !< increments that snapped; the first of them
      type(record_t) :: last
   contains
      procedure :: open => open_reports
      procedure :: increment
      procedure :: finish
      procedure, private :: write_fields
   end type reporter_t

contains

   !> Create the files NAME.history.csv, NAME.vtkhdf and NAME.xdmf; the result file starts with the unloaded state.
   subroutine open_reports(self, base_name, input_text, problem, monitors, output, levels, error)
      class(reporter_t), intent(inout) :: self
      character(len=*), intent(in) :: base_name, input_text
      type(equilibrium_t), intent(in), target :: problem
      type(monitor_t), intent(in) :: monitors(:)
      type(output_t), intent(in) :: output
      real(wp), intent(in) :: levels(:)
      type(error_t), allocatable, intent(out) :: error
      type(name_t), allocatable :: names(:)
      type(field_t), allocatable :: cells(:)
      integer :: i

      self%problem => problem
      self%monitors = monitors
      self%output = output
      self%levels = levels
      allocate (self%watches(size(monitors)), names(size(monitors)))
      do i = 1, size(monitors)
         call new_watch(self%watches(i), monitors(i), problem%structure%mesh)
         names(i)%text = monitors(i)%name
      end do
      call self%history%create(base_name//'.history.csv', names, error)
      if (allocated(error) .or. .not. output%fields) return
      call cell_fields(problem, problem%state, output, cells, error)
      if (allocated(error)) return
      associate (mesh => problem%structure%mesh)
         call self%results%create(base_name//'.vtkhdf', version, input_text, mesh%coordinates, mesh%triangles, &
                                  point_fields(problem, problem%state, output), cells, names, output%restart, error)
      end associate
      if (.not. allocated(error)) call self%write_fields(problem%state, record_t(negative_pivots=0), error)
   end subroutine open_reports

   !> See finshell_observer.
   subroutine increment(self, state, record, error)
      class(reporter_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      type(error_t), allocatable, intent(out) :: error
      type(increment_t) :: row

      row = increment_t(record%increment, record%load_factor, record%iterations, record%negative_pivots)
      row%critical_point = record%event + merge(10, 0, record%located)
      row%snap = merge(1, 0, record%snap)
      allocate (row%monitors(size(self%watches)))
      call monitored_values(self%problem, state, self%watches, row%monitors, error)
      if (allocated(error)) return
      call self%history%append(row, error)
      if (allocated(error)) return
      if (.not. self%quiet) call show(self, record, row%monitors)
      if (record%regularised > 0 .and. .not. self%quiet) write (output_unit, '(5x,a,i0,a)') &
         'the tangent of the law was singular here: ', record%regularised, ' iterations used a stand-in; the solution is unchanged'
      if (record%control == control_linear .or. record%control == control_buckling) self%linear = self%linear + 1
      if (record%event /= no_event) then
         self%critical_points = self%critical_points + 1
         if (.not. self%quiet) call show_event(record)
      end if
      if (record%negative_pivots > 0) self%unstable = self%unstable + 1
      if (record%snap) then
         self%snaps = self%snaps + 1
         if (self%first_snap == 0) self%first_snap = record%increment
         if (.not. self%quiet) call show_snap(record)
      end if
      self%last = record
      if (.not. self%output%fields) return
      if (mod(record%increment, max(1, self%output%every)) == 0 &
          .or. record%control == control_linear .or. record%control == control_buckling &
          .or. any(abs(self%levels - record%load_factor) <= 1.0e-10_wp*max(1.0_wp, abs(record%load_factor)))) &
         call self%write_fields(state, record, error)
   end subroutine increment

   !> Write the fields of the last increment, if they have not been, and close the files.
   subroutine finish(self, state, error)
      class(reporter_t), intent(inout) :: self
      type(state_t), intent(in) :: state !< the last converged state
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: ignored
      if (self%output%fields .and. self%last%increment > self%last_written .and. self%last_written >= 0) &
         call self%write_fields(state, self%last, error)
      call self%results%close(ignored)
      if (allocated(ignored) .and. .not. allocated(error)) call move_alloc(ignored, error)
      call self%history%close()
   end subroutine finish

   subroutine write_fields(self, state, record, error)
      class(reporter_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      type(error_t), allocatable, intent(out) :: error
      type(field_t), allocatable :: cells(:)
      type(increment_t) :: row
      row = increment_t(record%increment, record%load_factor, record%iterations, record%negative_pivots)
      allocate (row%monitors(size(self%watches)))
      call monitored_values(self%problem, state, self%watches, row%monitors, error)
      if (allocated(error)) return
      call cell_fields(self%problem, state, self%output, cells, error)
      if (allocated(error)) return
      if (self%output%restart) then
         call self%results%append(row, point_fields(self%problem, state, self%output), cells, error, state%rotation)
      else
         call self%results%append(row, point_fields(self%problem, state, self%output), cells, error)
      end if
      if (.not. allocated(error)) self%last_written = record%increment
   end subroutine write_fields

   !> A limit or bifurcation point.
   subroutine show_event(record)
      type(record_t), intent(in) :: record
      if (record%located) then
         write (output_unit, '(5x,a,es13.6,a,es8.1)') event_name(record%event)//' located at load factor ', record%load_factor, &
            '; cosine between null vector and load ', record%load_cosine
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
         write (output_unit, '(a)', advance='no') '  inc   load factor'
         do i = 1, n
            heading = self%monitors(i)%name
            write (output_unit, '(1x,a)', advance='no') adjustr(heading)
         end do
         write (output_unit, '(a)') '  iterations  cuts  negative pivots   CPU s'
      end if
      write (output_unit, '(i5,es14.6)', advance='no') record%increment, record%load_factor
      do i = 1, n
         write (output_unit, '(1x,es14.6)', advance='no') values(i)
      end do
      if (record%negative_pivots < 0) then
         write (output_unit, '(i12,i6,a17,f8.2)') record%iterations, record%cuts, '?', record%cpu_time
      else
         write (output_unit, '(i12,i6,i17,f8.2)') record%iterations, record%cuts, record%negative_pivots, record%cpu_time
      end if
      flush (output_unit)
   end subroutine show
end module finshell_reporter
