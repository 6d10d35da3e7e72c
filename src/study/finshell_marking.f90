!> Which elements to refine.
module finshell_marking
   use finshell_kinds, only: wp
   implicit none
   private
   public :: largest_share

   integer, parameter :: halvings = 60

contains

   !> The largest values that make up a share of the sum (Doerfler, SIAM J. Numer. Anal. 33, 1996); equal ones go together, so that
   !> what is symmetric stays it.
   pure function largest_share(values, share) result(chosen)
      real(wp), intent(in) :: values(:) !< >= 0
      real(wp), intent(in) :: share !< 0 to 1
      logical :: chosen(size(values))
      real(wp), parameter :: equal = 1 - 1.0e-6_wp
      real(wp) :: high, low, middle, wanted
      integer :: i
      low = 0
      high = maxval(values)
      wanted = share*sum(values)
      do i = 1, halvings
         middle = 0.5_wp*(low + high)
         if (sum(values, values >= middle) >= wanted) then
            low = middle
         else
            high = middle
         end if
      end do
      chosen = values >= low*equal .and. values > 0
   end function largest_share
end module finshell_marking
