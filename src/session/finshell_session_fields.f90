!> Fields of a session as arrays that it owns: they stay where they are and get new values when they are asked for again.
module finshell_session_fields
   use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise
   use finshell_field_batch, only: element_field_t, element_fields, n_element_fields
   use finshell_kinds, only: wp
   use finshell_monitor, only: monitor_t
   use finshell_monitoring, only: monitored_values, new_node_results, new_watch, watch_t
   use finshell_node_fields, only: n_node_fields, node_field_t, node_fields, node_results_t
   use finshell_recovery, only: recover, recovery_t
   use finshell_report_rules, only: motion_values
   use finshell_result_fields, only: field_names, find_field, on_elements, on_nodes, on_structure, result_field_t, result_fields
   use finshell_session, only: session_t
   use finshell_state, only: linear_change_t, state_t
   use finshell_status, only: status_input_error
   implicit none
   private
   public :: shelf_t, look

   !> An array (component, place, item) for each entry of the table of fields.
   type :: buffer_t
      real(wp), allocatable :: values(:, :, :)
   end type buffer_t

   type :: shelf_t
      type(buffer_t), allocatable :: buffers(:)
   end type shelf_t

contains

   !> Bring a field up to date. What is missing is a NaN. Errors: there is no such field, or it needs more than a name.
   subroutine look(shelf, session, name, mode, values, on, error)
      type(shelf_t), intent(inout), target :: shelf
      type(session_t), intent(in), target :: session
      character(len=*), intent(in) :: name
      integer, intent(in) :: mode !< 0: of the state; else of that linear solution or mode of the last call
      real(wp), pointer, intent(out) :: values(:, :, :) !< (component, place, item)
      integer, intent(out) :: on !< see finshell_result_fields
      type(error_t), allocatable, intent(out) :: error
      type(result_field_t), allocatable :: table(:)
      type(linear_change_t), allocatable :: change
      type(state_t), pointer :: state
      real(wp), allocatable :: fresh(:, :, :)
      integer :: entry

      nullify (values)
      on = 0
      entry = find_field(name)
      if (entry == 0) then
         call raise(error, status_input_error, "there is no field '"//name//"'; there are: "//field_names(.false.))
         return
      end if
      table = result_fields()
      if (mode < 0 .or. mode > size(session%bell%found)) call raise(error, status_input_error, 'the last call has found no ' &
         //'linear solution or mode of this number')
      if (allocated(error)) return
      state => session%problem%state
      if (mode > 0) then
         state => session%bell%found(mode)%state
         change = session%bell%found(mode)%change
      end if
      on = table(entry)%on
      select case (on)
      case (on_nodes); call nodal(session%problem, state, table(entry)%entry, fresh, change)
      case (on_elements); call elemental(session%problem, state, table(entry)%entry, fresh, change)
      case (on_structure); call global(session, state, table(entry), entry, fresh, change)
      case default
         call raise(error, status_input_error, "the field '"//name//"' belongs to a connector or a cut: name that in a &monitor " &
                    //'and read the history')
         return
      end select
      if (.not. allocated(shelf%buffers)) allocate (shelf%buffers(size(table)))
      associate (buffer => shelf%buffers(entry))
         if (allocated(buffer%values)) then
            buffer%values(:, :, :) = fresh
         else
            buffer%values = fresh
         end if
      end associate
      values => shelf%buffers(entry)%values
   end subroutine look

   subroutine nodal(problem, state, entry, values, change)
      type(equilibrium_t), intent(in), target :: problem
      type(state_t), intent(in), target :: state !< of the problem, or what a change has led to
      integer, intent(in) :: entry
      real(wp), allocatable, intent(out) :: values(:, :, :)
      type(linear_change_t), intent(in), optional, target :: change
      type(node_results_t) :: results
      type(node_field_t) :: table(n_node_fields)
      integer :: i
      table = node_fields()
      call new_node_results(problem, state, results, change)
      allocate (values(3, 1, size(state%displacement, 2)))
      do i = 1, size(values, 3)
         values(:, 1, i) = table(entry)%recover(results, i)
      end do
   end subroutine nodal

   subroutine elemental(problem, state, entry, values, change)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: entry
      real(wp), allocatable, intent(out) :: values(:, :, :)
      type(linear_change_t), intent(in), optional, target :: change
      type(recovery_t) :: recovery
      integer :: e, p
      call recover(problem, state, [(e, e=1, size(problem%structure%mesh%triangles, 2))], [entry], recovery, change)
      values = recovery%fields(1)%values
      do e = 1, size(values, 3)
         do p = 1, size(values, 2)
            if (recovery%fields(1)%missing(p, e)) values(:, p, e) = ieee_value(1.0_wp, ieee_quiet_nan)
         end do
      end do
   end subroutine elemental

   !> A number, or three, of the whole structure: as a monitor has it.
   subroutine global(session, state, field, number, values, change)
      type(session_t), intent(in), target :: session
      type(state_t), intent(in), target :: state
      type(result_field_t), intent(in) :: field
      integer, intent(in) :: number
      real(wp), allocatable, intent(out) :: values(:, :, :)
      type(linear_change_t), intent(in), optional, target :: change
      type(monitor_t) :: monitor
      type(watch_t) :: watch(1)
      real(wp), allocatable :: motion(:)
      real(wp) :: value(1)
      logical :: missing(1)
      integer :: i
      allocate (values(merge(3, 1, index(field%components, ',') > 0), 1, 1))
      if (session%bell%duration > 0) motion = motion_values(session%problem, state, session%bell%last)
      do i = 1, size(values, 1)
         monitor%quantity = number
         monitor%component = i
         call new_watch(watch(1), monitor, session%problem%structure%mesh)
         call monitored_values(session%problem, state, watch, value, missing, change=change, motion=motion)
         values(i, 1, 1) = value(1)
         if (missing(1)) values(i, 1, 1) = ieee_value(1.0_wp, ieee_quiet_nan)
      end do
   end subroutine global
end module finshell_session_fields
