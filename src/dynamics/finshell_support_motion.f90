!> Velocities and accelerations of moved supports.
module finshell_support_motion
   use finshell_equations, only: equations_t, motion_at
   use finshell_factor, only: by_load_factor
   use finshell_freedoms, only: n_nodal
   use finshell_kinds, only: wp
   use finshell_state, only: state_t
   use finshell_time_plan, only: time_plan_t
   implicit none
   private
   public :: factor_rates, support_rates

contains

   !> First and second derivative of the load factor with respect to time; at a corner those of what comes before it or, with
   !> `after`, behind it.
   pure function factor_rates(plan, time, at_start, after) result(rates)
      type(time_plan_t), intent(in) :: plan
      real(wp), intent(in) :: time, at_start !< see time_plan_t%factor
      logical, intent(in) :: after
      real(wp) :: rates(2), before, since, part, length
      integer :: i
      rates = 0
      if (.not. allocated(plan%times)) return
      before = at_start
      since = 0
      do i = 1, size(plan%times)
         if (time < plan%times(i) .or. (.not. after .and. time <= plan%times(i))) then
            length = plan%times(i) - since
            if (.not. length > 0) return
            rates(1) = (plan%factors(i) - before)/length
            if (.not. plan%smooth) return
            part = (time - since)/length
            rates = 3*rates(1)*[2*part*(1 - part), (2 - 4*part)/length]
            return
         end if
         before = plan%factors(i)
         since = plan%times(i)
      end do
   end function factor_rates

   !> Velocities and accelerations of held components, (n_nodal, nodes), zero elsewhere.
   pure subroutine support_rates(equations, state, rates, velocity, acceleration)
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: rates(2) !< of the load factor
      real(wp), intent(out), allocatable :: velocity(:, :), acceleration(:, :)
      integer :: i
      allocate (velocity(n_nodal, size(equations%frame)), acceleration(n_nodal, size(equations%frame)), source=0.0_wp)
      do i = 1, size(equations%moved)
         associate (motion => motion_at(equations, i, by_load_factor, state), node => equations%moved(i))
            velocity(:, node) = rates(1)*motion
            acceleration(:, node) = rates(2)*motion
         end associate
      end do
   end subroutine support_rates
end module finshell_support_motion
