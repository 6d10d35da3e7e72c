!> The observer of a host: it keeps a row of every report, and ends the call of the analysis when the host is to have its say.
!> The step then goes on where it stood, by the way that a restart takes.
module finshell_bell
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t
   use finshell_field, only: increment_t, monitor_value, name_t
   use finshell_kinds, only: wp
   use finshell_monitor, only: monitor_t
   use finshell_observer, only: raise_stop, record_t
   use finshell_recovery, only: recovery_t
   use finshell_state, only: linear_change_t, state_t
   use finshell_step, only: is_in_time, is_mode, leaves_state, step_t
   use finshell_watching, only: watching_t
   implicit none
   private
   public :: bell_t

   !> Columns of a row before those of the monitors.
   character(len=16), parameter :: first_columns(*) = [character(len=16) :: 'increment', 'step', 'control', 'load_factor', 'time', &
                                                       'size', 'iterations', 'cuts', 'negative_pivots']

   !> A linear solution or a mode.
   type :: found_t
      type(state_t) :: state
      type(linear_change_t) :: change !< that has led to it
   end type found_t

   type, extends(watching_t) :: bell_t
      integer :: step = 1 !< of the input
      logical :: patient = .false. !< the analysis goes on whatever is reported
      real(wp) :: until = -huge(1.0_wp) !< steps in time: not before this time
      type(record_t) :: last
      integer :: reports = 0 !< since the host has called
      real(wp), allocatable :: rows(:, :) !< (columns, reports) the first `filled` ones count
      integer :: filled = 0
      type(found_t), allocatable :: found(:) !< linear solutions and modes, since the host has called
   contains
      procedure :: attach
      procedure :: increment
      procedure :: columns
      procedure :: take_row
   end type bell_t

contains

   !> Whose reports these will be.
   subroutine attach(self, problem, monitors, cases, duration, energy)
      class(bell_t), intent(inout) :: self
      type(equilibrium_t), intent(in), target :: problem
      type(monitor_t), intent(in) :: monitors(:)
      type(name_t), intent(in) :: cases(:) !< of loads and supports
      real(wp), intent(in) :: duration !< of all steps in time
      logical, intent(in) :: energy
      type(name_t), allocatable :: names(:)
      self%problem => problem
      self%monitors = monitors
      self%cases = cases
      self%duration = duration
      self%energy = energy
      self%base_name = ''
      allocate (self%parts(0), self%found(0))
      call self%look_up()
      names = self%columns()
      allocate (self%rows(size(names), 16))
   end subroutine attach

   !> Names of what is in a row.
   function columns(self) result(names)
      class(bell_t), intent(in) :: self
      type(name_t), allocatable :: names(:), monitors(:)
      integer :: i
      monitors = self%column_names()
      allocate (names(size(first_columns) + size(monitors)))
      do i = 1, size(names)
         if (i <= size(first_columns)) names(i)%text = trim(first_columns(i))
         if (i > size(first_columns)) names(i)%text = monitors(i - size(first_columns))%text
      end do
   end function columns

   !> See finshell_observer.
   subroutine increment(self, state, record, error, change)
      class(bell_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      type(error_t), allocatable, intent(out) :: error
      type(linear_change_t), intent(in), optional, target :: change
      call self%take_row(state, record, change)
      self%last = record
      self%reports = self%reports + 1
      if (present(change)) call keep(self, state, change)
      if (self%patient .or. leaves_state(record%control) .or. is_mode(record%control)) return
      if (is_in_time(record%control) .and. state%time < self%until) return
      call raise_stop(error)
   end subroutine increment

   subroutine keep(self, state, change)
      class(bell_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(linear_change_t), intent(in) :: change
      type(found_t), allocatable :: grown(:)
      integer :: i
      allocate (grown(size(self%found) + 1))
      do i = 1, size(self%found)
         grown(i) = self%found(i)
      end do
      grown(size(grown))%state = state
      grown(size(grown))%change = change
      call move_alloc(grown, self%found)
   end subroutine keep

   !> Another row. A value that is missing is a NaN.
   subroutine take_row(self, state, record, change)
      class(bell_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      type(linear_change_t), intent(in), optional, target :: change
      type(increment_t) :: row
      type(recovery_t) :: recovery
      real(wp), allocatable :: grown(:, :)
      integer :: i
      call self%evaluate(state, record, row, recovery, change)
      if (self%filled == size(self%rows, 2)) then
         allocate (grown(size(self%rows, 1), 2*self%filled))
         grown(:, :self%filled) = self%rows
         call move_alloc(grown, self%rows)
      end if
      self%filled = self%filled + 1
      self%rows(:, self%filled) = [real(record%increment, wp), real(self%step, wp), real(record%control, wp), record%load_factor, &
         state%time, record%size, real(record%iterations, wp), real(record%cuts, wp), real(record%negative_pivots, wp), &
         (monitor_value(row, i), i=1, size(row%monitors))]
   end subroutine take_row
end module finshell_bell
