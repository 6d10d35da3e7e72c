!> The file NAME.PROBE.csv of a probe: rows of all its points at each increment.
module finshell_probe_file
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t
   use finshell_field, only: increment_t
   use finshell_kinds, only: wp
   use finshell_nearest, only: place_t
   use finshell_probe, only: probe_t
   use finshell_probing, only: probe_columns, probe_values
   use finshell_state, only: linear_change_t, state_t
   use finshell_table_file, only: table_file_t
   implicit none
   private
   public :: probe_file_t

   type :: probe_file_t
      type(probe_t) :: probe
      type(table_file_t), private :: table
      character(len=:), allocatable, private :: name
      type(place_t), allocatable, private :: places(:) !< where the line is on the surface
      integer :: last_written = -1
   contains
      procedure :: begin
      procedure :: append
   end type probe_file_t

contains

   !> Begin with the present state of the problem, or go on with the file of an earlier run after an increment.
   subroutine begin(self, base_name, problem, row, continues, error)
      class(probe_file_t), intent(inout) :: self
      character(len=*), intent(in) :: base_name
      type(equilibrium_t), intent(in) :: problem
      type(increment_t), intent(in) :: row !< of the state
      logical, intent(in) :: continues
      type(error_t), allocatable, intent(out) :: error
      logical :: exists
      self%name = base_name//'.'//self%probe%name//'.csv'
      self%table = table_file_t('increment,load_factor,'//probe_columns(problem, self%probe))
      if (allocated(row%motion)) self%table%header = 'increment,load_factor,time,'//probe_columns(problem, self%probe)
      if (allocated(self%places)) deallocate (self%places)
      inquire (file=self%name, exist=exists)
      if (continues .and. exists) then
         call self%table%cut(self%name, row%increment, error)
         self%last_written = row%increment
      else
         call self%append(problem, problem%state, row, .true., error)
      end if
   end subroutine begin

   !> Write the rows of an increment, if it is one that the probe has.
   subroutine append(self, problem, state, row, always, error, change)
      class(probe_file_t), intent(inout) :: self
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(increment_t), intent(in) :: row
      type(error_t), allocatable, intent(out) :: error
      type(linear_change_t), intent(in), optional :: change
      logical, intent(in) :: always !< else as the probe has it
      real(wp), allocatable :: values(:, :), rows(:, :), head(:)
      integer :: n
      if (.not. always .and. mod(row%increment, self%probe%every) /= 0) return
      call probe_values(problem, state, self%probe, self%places, values, change)
      head = [row%load_factor]
      if (allocated(row%motion)) head = [head, row%motion(1)]
      n = size(head)
      allocate (rows(n + size(values, 1), size(values, 2)))
      rows(:n, :) = spread(head, 2, size(values, 2))
      rows(n + 1:, :) = values
      call self%table%append(self%name, row%increment, rows, error)
      self%last_written = row%increment
   end subroutine append
end module finshell_probe_file
