!> How monitors answer to motions of the unknowns and of the load factor at a state, and the row that holds one of them fixed.
module finshell_monitor_response
   use finshell_equations, only: field_displacement, field_rotation, gather
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t
   use finshell_factor, only: by_load_factor
   use finshell_held_motion, only: motion_at
   use finshell_kinds, only: wp
   use finshell_linear_response, only: border_row_t
   use finshell_monitor_gradient, only: knows_gradient, monitor_gradient
   use finshell_monitoring, only: monitored_values, watch_t
   use finshell_result_fields, only: on_nodes
   use finshell_sensitivity_choice, only: held_by_control, held_load_factor
   use finshell_state, only: state_t
   implicit none
   private
   public :: find_along, find_gradient, find_row

   !> Monitors without a gradient are followed along a motion by differences of fourth order: truncation (step^4) and rounding meet
   !> at the fifth root of epsilon.
   integer, parameter :: ways(4) = [-2, -1, 1, 2]
   real(wp), parameter :: shares(4) = [1.0_wp, -8.0_wp, 8.0_wp, -1.0_wp]/12
   real(wp), parameter :: small_motion = epsilon(1.0_wp)**0.2_wp

contains

   !> The row of what is held fixed; unallocated: the load factor is.
   subroutine find_row(problem, watches, fixed, row)
      type(equilibrium_t), intent(in) :: problem
      type(watch_t), intent(in) :: watches(:)
      integer, intent(in) :: fixed
      type(border_row_t), allocatable, intent(out) :: row
      if (fixed == held_load_factor) return
      allocate (row)
      row%f = problem%rate
      if (fixed == held_by_control) then
         row%c = problem%watched
         row%d = problem%watched_rate
      else
         call find_gradient(problem, watches(fixed), row%c, row%d)
      end if
   end subroutine find_row

   !> Derivatives of a monitor with respect to the unknowns and the load factor; and with respect to all motions.
   subroutine find_gradient(problem, watch, gradient, rate, all_motions)
      type(equilibrium_t), intent(in) :: problem
      type(watch_t), intent(in) :: watch
      real(wp), allocatable, intent(out) :: gradient(:) !< (n)
      real(wp), intent(out) :: rate
      real(wp), allocatable, intent(out), optional :: all_motions(:, :) !< (n_nodal, nodes)
      real(wp), allocatable :: nodal(:, :)
      integer :: i
      call monitor_gradient(problem, watch, nodal)
      if (present(all_motions)) all_motions = nodal
      allocate (gradient(problem%n), source=0.0_wp)
      associate (e => problem%equations)
         call e%links%fold(nodal)
         call gather(e, nodal, gradient(:e%n))
         rate = 0
         do i = 1, size(e%moved)
            rate = rate + dot_product(nodal(:, e%moved(i)), motion_at(e, i, by_load_factor, problem%state))
         end do
         ! what grows stores energy where nothing moves
         if (watch%field%name == 'energy' .and. allocated(problem%structure%growths)) &
            rate = rate + watch%factor*problem%growth%power
      end associate
   end subroutine find_gradient

   !> Change of the monitors along a motion of the unknowns and of the load factor.
   subroutine find_along(problem, watches, used, x, s, along, missing, error)
      type(equilibrium_t), intent(inout) :: problem
      type(watch_t), intent(in) :: watches(:)
      integer, intent(in) :: used(:) !< of the watches; the others get 0
      real(wp), intent(in) :: x(:), s
      real(wp), allocatable, intent(out) :: along(:)
      logical, allocatable, intent(out) :: missing(:)
      type(error_t), allocatable, intent(inout) :: error
      type(state_t) :: state
      integer, allocatable :: rest(:)
      real(wp), allocatable :: gradient(:), values(:)
      logical, allocatable :: gone(:)
      real(wp) :: largest, part, rate
      integer :: k
      along = spread(0.0_wp, 1, size(watches))
      missing = spread(.false., 1, size(watches))
      allocate (rest(0))
      do k = 1, size(used)
         if (knows_gradient(watches(used(k)))) then
            call find_gradient(problem, watches(used(k)), gradient, rate)
            along(used(k)) = dot_product(gradient, x) + rate*s
         else
            rest = [rest, used(k)]
         end if
      end do
      largest = max(maxval(abs(x), mask=problem%field == field_rotation), &
                    maxval(abs(x), mask=problem%field == field_displacement)/problem%detail)
      if (abs(s) > 0) largest = max(largest, abs(s)/max(abs(problem%state%load_factor), tiny(1.0_wp)/epsilon(1.0_wp)))
      if (.not. largest > 0 .or. size(rest) == 0) return
      part = small_motion/largest
      allocate (values(size(rest)), gone(size(rest)))
      state = problem%state
      do k = 1, size(ways)
         call problem%move(ways(k)*part*x, ways(k)*part*s)
         if (any(watches(rest)%field%on == on_nodes .and. watches(rest)%field%adds_up)) call problem%evaluate(.false., error)
         if (.not. allocated(error)) call monitored_values(problem, problem%state, watches(rest), values, gone)
         problem%state = state
         if (allocated(error)) exit
         along(rest) = along(rest) + shares(k)/part*values
         missing(rest) = missing(rest) .or. gone
      end do
      call problem%refresh()
      ! gradients of other monitors go by the forces at the state
      if (.not. allocated(error) .and. any(watches(rest)%field%on == on_nodes .and. watches(rest)%field%adds_up)) &
         call problem%evaluate(.false., error)
   end subroutine find_along
end module finshell_monitor_response
