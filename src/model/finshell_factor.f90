!> What scales a load or the motion of a support: the factors of a state, by number.
module finshell_factor
   use finshell_kinds, only: wp
   use finshell_state, only: state_t
   use finshell_table, only: by_time, follower_t
   implicit none
   private
   public :: by_load_factor, by_constant_factor, unscaled, by_release, by_case
   public :: factor_at, factors_at, set_factor, set_time, start_following, slope_of, slopes, extrapolate, corners, scaled_sum
   public :: number_of_factors, exchange_factors, present_place

   !> The load factor of the step; the constant factor, which rises to 1 before the first step; nothing: always there in full,
   !> as an elastic foundation is; what is let go before a step (finshell_stage), from 1 to 0. Behind these, by_case + i: factor i
   !> of those that the present step leaves alone, or that follow another one. Also positions in arrays with a part for each.
   integer, parameter :: by_load_factor = 1, by_constant_factor = 2, unscaled = 3, by_release = 4, by_case = 4

contains

   !> How many factors there are with so many behind the first ones.
   pure integer function number_of_factors(cases)
      integer, intent(in) :: cases
      number_of_factors = merge(by_case + cases, by_constant_factor, cases > 0)
   end function number_of_factors

   pure real(wp) function factor_at(state, scaling)
      type(state_t), intent(in) :: state
      integer, intent(in) :: scaling
      select case (scaling)
      case (by_load_factor); factor_at = state%load_factor
      case (by_constant_factor); factor_at = state%constant_factor
      case (unscaled); factor_at = 1
      case (by_release); factor_at = state%release_factor
      case default; factor_at = state%case_factor(scaling - by_case)
      end select
   end function factor_at

   !> The first so many.
   pure function factors_at(state, number) result(values)
      type(state_t), intent(in) :: state
      integer, intent(in) :: number
      real(wp) :: values(number)
      integer :: k
      do k = 1, number
         values(k) = factor_at(state, k)
      end do
   end function factors_at

   !> Replace a factor of a state; those that follow it follow.
   pure subroutine set_factor(state, scaling, value)
      type(state_t), intent(inout) :: state
      integer, intent(in) :: scaling
      real(wp), intent(in) :: value
      real(wp) :: before
      before = factor_at(state, scaling)
      if (abs(value - before) > 0) then
         state%rises = value > before
         state%leaves = .false.
      end if
      select case (scaling)
      case (by_load_factor); state%load_factor = value
      case (by_constant_factor); state%constant_factor = value
      case (by_release); state%release_factor = value
      case (by_case + 1:); state%case_factor(scaling - by_case) = value
      end select
      call follow_all(state)
   end subroutine set_factor

   !> Replace the time; factors that follow it follow.
   pure subroutine set_time(state, time)
      type(state_t), intent(inout) :: state
      real(wp), intent(in) :: time
      state%time = time
      call follow_all(state)
   end subroutine set_time

   !> From now on some factors follow others, or the time.
   pure subroutine start_following(state, followers)
      type(state_t), intent(inout) :: state
      type(follower_t), intent(in), optional :: followers(:)
      if (present(followers)) state%followers = followers
      call follow_all(state)
   end subroutine start_following

   !> Factors that follow others, or the time.
   pure subroutine follow_all(state)
      type(state_t), intent(inout) :: state
      real(wp) :: x
      integer :: i
      if (.not. allocated(state%followers)) return
      do i = 1, size(state%followers)
         associate (f => state%followers(i))
            if (f%parent == by_time) then
               x = state%time
            else
               x = factor_at(state, f%parent)
            end if
            state%case_factor(f%factor - by_case) = f%table%value(x)
         end associate
      end do
   end subroutine follow_all

   !> Derivative of factor k with respect to a factor that changes: 1 for itself, the slope of its table for one that follows it. At
   !> a corner the slope is that of the side that the path comes from or, once the state is accepted, goes to.
   pure real(wp) function slope_of(state, active, k) result(slope)
      type(state_t), intent(in) :: state
      integer, intent(in) :: active, k
      real(wp) :: rates(2)
      integer :: i
      slope = merge(1, 0, k == active)
      if (.not. allocated(state%followers) .or. k <= by_case) return
      do i = 1, size(state%followers)
         associate (f => state%followers(i))
            if (f%factor /= k .or. f%parent /= active) cycle
            rates = f%table%rates(factor_at(state, active), state%rises .eqv. state%leaves)
            slope = rates(1)
         end associate
      end do
   end function slope_of

   !> Of the first so many factors.
   pure function slopes(state, active, number)
      type(state_t), intent(in) :: state
      integer, intent(in) :: active, number
      real(wp) :: slopes(number)
      integer :: k
      do k = 1, number
         slopes(k) = slope_of(state, active, k)
      end do
   end function slopes

   !> Change a factor, and those that follow it along their slopes: what a linear change is.
   pure subroutine extrapolate(state, active, change)
      type(state_t), intent(inout) :: state
      integer, intent(in) :: active
      real(wp), intent(in) :: change
      real(wp) :: slope
      integer :: i
      if (allocated(state%followers)) then
         do i = 1, size(state%followers)
            associate (k => state%followers(i)%factor)
               slope = slope_of(state, active, k)
               state%case_factor(k - by_case) = state%case_factor(k - by_case) + change*slope
            end associate
         end do
      end if
      select case (active)
      case (by_load_factor); state%load_factor = state%load_factor + change
      case (by_constant_factor); state%constant_factor = state%constant_factor + change
      end select
   end subroutine extrapolate

   !> Values of a factor, or times, at which tables of what follows it have corners.
   pure function corners(state, parent) result(x)
      type(state_t), intent(in) :: state
      integer, intent(in) :: parent
      real(wp), allocatable :: x(:)
      integer :: i
      allocate (x(0))
      if (.not. allocated(state%followers)) return
      do i = 1, size(state%followers)
         if (state%followers(i)%parent == parent) x = [x, state%followers(i)%table%x]
      end do
   end function corners

   !> Let the load factor of the step and another one change places.
   pure subroutine exchange_factors(state, scaling)
      type(state_t), intent(inout) :: state
      integer, intent(in) :: scaling
      real(wp) :: before
      integer :: i
      before = state%load_factor
      state%exchanged = merge(0, scaling, state%exchanged == scaling)
      state%load_factor = factor_at(state, scaling)
      state%case_factor(scaling - by_case) = before
      if (.not. allocated(state%followers)) return
      do i = 1, size(state%followers)
         associate (parent => state%followers(i)%parent)
            if (parent == by_load_factor) then
               parent = scaling
            else if (parent == scaling) then
               parent = by_load_factor
            end if
         end associate
      end do
   end subroutine exchange_factors

   !> Where a factor of the input is in a state.
   elemental integer function present_place(state, scaling) result(place)
      type(state_t), intent(in) :: state
      integer, intent(in) :: scaling
      place = scaling
      if (state%exchanged == 0) return
      if (scaling == by_load_factor) place = state%exchanged
      if (scaling == state%exchanged) place = by_load_factor
   end function present_place

   !> Forces for factors of 1 times the factors of a state.
   pure function scaled_sum(state, parts) result(total)
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: parts(:, :, :) !< (n_nodal, nodes, factors)
      real(wp) :: total(size(parts, 1), size(parts, 2))
      integer :: k
      total = state%load_factor*parts(:, :, by_load_factor) + state%constant_factor*parts(:, :, by_constant_factor)
      do k = unscaled, size(parts, 3)
         total = total + factor_at(state, k)*parts(:, :, k)
      end do
   end function scaled_sum
end module finshell_factor
