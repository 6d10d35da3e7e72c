!> What scales a load or the motion of a support: the factors of a state, by number.
module finshell_factor
   use finshell_kinds, only: wp
   use finshell_state, only: state_t
   implicit none
   private
   public :: by_load_factor, by_constant_factor, unscaled, by_case
   public :: factor_at, set_factor, scaled_sum, number_of_factors, exchange_factors

   !> The load factor of the step; the constant factor, which rises to 1 before the first step; nothing: always there in full,
   !> as an elastic foundation is. Behind these, by_case + i: case i of those that the present step leaves alone. Also positions in
   !> arrays with a part for each.
   integer, parameter :: by_load_factor = 1, by_constant_factor = 2, unscaled = 3, by_case = 3

contains

   !> How many factors there are with so many cases that steps leave alone.
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
      case default; factor_at = state%case_factor(scaling - by_case)
      end select
   end function factor_at

   !> Replace a factor of a state.
   pure subroutine set_factor(state, scaling, value)
      type(state_t), intent(inout) :: state
      integer, intent(in) :: scaling
      real(wp), intent(in) :: value
      select case (scaling)
      case (by_load_factor); state%load_factor = value
      case (by_constant_factor); state%constant_factor = value
      case (by_case + 1:); state%case_factor(scaling - by_case) = value
      end select
   end subroutine set_factor

   !> Let the load factor of the step and another one change places.
   pure subroutine exchange_factors(state, scaling)
      type(state_t), intent(inout) :: state
      integer, intent(in) :: scaling
      real(wp) :: before
      before = state%load_factor
      state%load_factor = factor_at(state, scaling)
      call set_factor(state, scaling, before)
   end subroutine exchange_factors

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
