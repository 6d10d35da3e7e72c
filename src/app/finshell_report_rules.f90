!> What the reports of an increment hold: the columns of the motion, and whether there are fields.
module finshell_report_rules
   use finshell_equilibrium, only: equilibrium_t
   use finshell_field, only: increment_t
   use finshell_kinds, only: wp
   use finshell_monitoring, only: stored_energy
   use finshell_observer, only: motion_t, record_t
   use finshell_state, only: state_t
   use finshell_step, only: is_in_time, leaves_state
   implicit none
   private
   public :: has_fields, motion_values, passes, row_of

contains

   !> Are fields to be written at an increment?
   pure logical function has_fields(record, every, at_landings, levels)
      type(record_t), intent(in) :: record
      integer, intent(in) :: every !< increments from one set of fields to the next
      logical, intent(in) :: at_landings !< a step in time asks for certain times, and for no others
      real(wp), intent(in) :: levels(:) !< load factors of static steps at which fields are written in any case
      has_fields = mod(record%increment, max(1, every)) == 0
      if (is_in_time(record%control)) then
         has_fields = record%motion%landing .or. (has_fields .and. .not. at_landings)
      else
         has_fields = has_fields .or. leaves_state(record%control) &
                      .or. any(abs(levels - record%load_factor) <= 1.0e-10_wp*max(1.0_wp, abs(record%load_factor)))
      end if
   end function has_fields

   !> Does an increment from one value to another reach or pass this one?
   elemental logical function passes(from, to, value)
      real(wp), intent(in) :: from, to, value
      real(wp) :: rounding
      rounding = 1.0e-10_wp*max(1.0_wp, abs(value))
      passes = (from < value - rounding .and. to >= value - rounding) .or. (from > value + rounding .and. to <= value + rounding)
   end function passes

   !> What a row of the history takes from the record of an increment.
   pure function row_of(record) result(row)
      type(record_t), intent(in) :: record
      type(increment_t) :: row
      row = increment_t(record%increment, record%load_factor, record%iterations, record%negative_pivots)
      row%critical_point = record%event + merge(10, 0, record%located)
      row%residual = record%residual
      row%correction = record%correction
      row%snap = merge(1, 0, record%snap)
      row%found_by = merge(2, merge(1, 0, record%descended), record%relaxed)
      row%stabilisation = record%taken
   end function row_of

   !> Values of motion_columns (finshell_field). Equilibrium states are at rest, at the time where the motion before them has ended.
   function motion_values(problem, state, record) result(values)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(record_t), intent(in) :: record
      real(wp), allocatable :: values(:)
      type(motion_t) :: m
      m = record%motion
      m%time = state%time
      if (.not. is_in_time(record%control)) m%stored_energy = stored_energy(problem, state)
      values = [m%time, m%kinetic_energy, m%stored_energy, m%work, m%damped, m%momentum, m%angular_momentum]
   end function motion_values
end module finshell_report_rules
