!> Velocities and accelerations of moved supports, and when they change abruptly.
module finshell_support_motion
   use finshell_equations, only: equations_t
   use finshell_held_motion, only: held_change, held_rotation, motion_of
   use finshell_factor, only: by_load_factor, corners, factors_at, set_factor, set_time
   use finshell_freedoms, only: n_nodal, rx, rz
   use finshell_kinds, only: wp
   use finshell_quaternion, only: quaternion_conjugate, quaternion_product, quaternion_to_rotation_vector
   use finshell_state, only: state_t
   use finshell_table, only: by_time, table_t
   use finshell_time_plan, only: time_plan_t
   implicit none
   private
   public :: support_rates, drive_supports, stops_of

contains

   !> First and second derivative with respect to time of all factors that move supports, from those of the load factor.
   pure function rates_of(state, load_rates, after, number) result(rates)
      type(state_t), intent(in) :: state !< at this time
      real(wp), intent(in) :: load_rates(2)
      logical, intent(in) :: after !< at corners what comes behind them, else what comes before
      integer, intent(in) :: number
      real(wp) :: rates(2, number), slope(2)
      integer :: i
      rates = 0
      rates(:, by_load_factor) = load_rates
      if (.not. allocated(state%followers)) return
      do i = 1, size(state%followers)
         associate (f => state%followers(i))
            if (f%factor > number) cycle
            if (f%parent == by_time) then
               rates(:, f%factor) = f%table%rates(state%time, after)
            else if (f%parent == by_load_factor) then
               slope = f%table%rates(state%load_factor, after .eqv. load_rates(1) >= 0)
               rates(:, f%factor) = [slope(1)*load_rates(1), slope(1)*load_rates(2) + slope(2)*load_rates(1)**2]
            end if
         end associate
      end do
   end function rates_of

   !> Velocities and accelerations of held components, (n_nodal, nodes), zero elsewhere.
   pure subroutine support_rates(equations, state, load_rates, after, velocity, acceleration)
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: load_rates(2) !< of the load factor
      logical, intent(in) :: after !< as for `rates_of`
      real(wp), intent(out), allocatable :: velocity(:, :), acceleration(:, :)
      real(wp) :: rates(2, size(equations%motion, 3)), motion(n_nodal)
      integer :: i, k
      allocate (velocity(n_nodal, size(equations%frame)), acceleration(n_nodal, size(equations%frame)), source=0.0_wp)
      rates = rates_of(state, load_rates, after, size(rates, 2))
      do i = 1, size(equations%moved)
         do k = 1, size(rates, 2)
            if (.not. any(abs(rates(:, k)) > 0)) cycle
            motion = motion_of(equations, i, k, state)
            associate (node => equations%moved(i))
               velocity(:, node) = velocity(:, node) + rates(1, k)*motion
               acceleration(:, node) = acceleration(:, node) + rates(2, k)*motion
            end associate
         end do
      end do
   end subroutine support_rates

   !> Mean velocities and spins with which moved supports come to where they are at a load factor and a time, and rotations there
   !> that are prescribed as a whole.
   pure subroutine drive_supports(equations, state, load_factor, time, length, drive, turned)
      type(equations_t), intent(in) :: equations
      type(state_t), intent(inout) :: state !< is left as it was
      real(wp), intent(in) :: load_factor, time !< at the end
      real(wp), intent(in) :: length !< of time until then
      real(wp), intent(out) :: drive(:, :), turned(:, :) !< (n_nodal, moved), (4, moved)
      real(wp) :: load_before, time_before, before(size(equations%motion, 3))
      integer :: i
      if (size(drive, 2) == 0) return
      load_before = state%load_factor
      time_before = state%time
      before = factors_at(state, size(before))
      call set_factor(state, by_load_factor, load_factor)
      call set_time(state, time)
      drive = held_change(equations, (factors_at(state, size(before)) - before)/length)
      turned = 0
      do i = 1, size(equations%moved)
         if (.not. equations%turned(i)) cycle
         turned(:, i) = held_rotation(equations, i, state)
         drive(rx:rz, i) = quaternion_to_rotation_vector(quaternion_product(turned(:, i), &
                                                         quaternion_conjugate(state%rotation(:, equations%moved(i)))))/length
      end do
      call set_factor(state, by_load_factor, load_before)
      call set_time(state, time_before)
   end subroutine drive_supports

   !> Times since a step in time began at which something that follows its load factor, or the time, has a corner; ascending.
   pure function stops_of(state, plan) result(stops)
      type(state_t), intent(in) :: state !< at the beginning of the step
      type(time_plan_t), intent(in) :: plan
      real(wp), allocatable :: stops(:)
      type(table_t) :: table
      real(wp), allocatable :: levels(:)
      integer :: i
      stops = corners(state, by_time) - state%time
      levels = corners(state, by_load_factor)
      if (allocated(plan%table)) then
         table = plan%begun(state%load_factor)
         do i = 1, size(levels)
            stops = [stops, table%arrivals(levels(i))]
         end do
      end if
      stops = pack(stops, stops > 0 .and. stops < plan%duration)
   end function stops_of
end module finshell_support_motion
