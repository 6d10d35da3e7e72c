!> What scales a load or the motion of a support: the factors of a state, by name.
module finshell_factor
   use finshell_kinds, only: wp
   use finshell_state, only: state_t
   implicit none
   private
   public :: by_load_factor, by_constant_factor, unscaled
   public :: factor_at, set_factor, scaled_sum

   !> The load factor of the step; the constant factor, which rises to 1 before the first step; nothing: always there in full,
   !> as an elastic foundation is. Also positions in arrays with a part for each.
   integer, parameter :: by_load_factor = 1, by_constant_factor = 2, unscaled = 3

contains

   pure real(wp) function factor_at(state, scaling)
      type(state_t), intent(in) :: state
      integer, intent(in) :: scaling
      select case (scaling)
      case (by_load_factor); factor_at = state%load_factor
      case (by_constant_factor); factor_at = state%constant_factor
      case default; factor_at = 1
      end select
   end function factor_at

   !> Replace a factor of a state.
   pure subroutine set_factor(state, scaling, value)
      type(state_t), intent(inout) :: state
      integer, intent(in) :: scaling !< by_load_factor or by_constant_factor
      real(wp), intent(in) :: value
      select case (scaling)
      case (by_load_factor); state%load_factor = value
      case (by_constant_factor); state%constant_factor = value
      end select
   end subroutine set_factor

   !> Forces for factors of 1 times the factors of a state.
   pure function scaled_sum(state, parts) result(total)
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: parts(:, :, :) !< (n_nodal, nodes, 2 or 3)
      real(wp) :: total(size(parts, 1), size(parts, 2))
      total = state%load_factor*parts(:, :, by_load_factor) + state%constant_factor*parts(:, :, by_constant_factor)
      if (size(parts, 3) >= unscaled) total = total + parts(:, :, unscaled)
   end function scaled_sum
end module finshell_factor
