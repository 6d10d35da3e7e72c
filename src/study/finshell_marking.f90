!> Which elements to cut, so that the error comes down to a tolerance at the least number of elements.
!>
!> The error is a sum of shares w of elements; cut into n parts, an element has n parts of w/n^2 each, w/n together (strains of the
!> first order: w goes with the square of the area). The sum of w/n is the tolerance T with the fewest parts for
!> n = sqrt(w) sum(sqrt(w))/T: all parts then have the same share. Where a solution is smooth, far from the tolerance, these are
!> all elements; where it is local, those that are too large.
module finshell_marking
   use finshell_kinds, only: wp
   implicit none
   private
   public :: worth_cutting, shares_of_parts, largest_share

   real(wp), parameter :: fewest_parts = 2.0_wp !< from which on a triangle is cut, into four
   real(wp), parameter :: most_share = 0.5_wp !< of the error, in what is cut for progress alone
   integer, parameter :: halvings = 60

contains

   !> Elements to cut in four: where that is enough, the fewest that leave less than the tolerance; else those that should have two
   !> parts or more, and half of the error at least.
   pure function worth_cutting(shares, tolerance) result(chosen)
      real(wp), intent(in) :: shares(:) !< >= 0
      real(wp), intent(in) :: tolerance !< < the sum of the shares
      logical :: chosen(size(shares))
      real(wp) :: part
      part = (sum(shares) - tolerance)/(0.75_wp*sum(shares)) ! a cut leaves a quarter
      if (part <= most_share) then
         chosen = largest_share(shares, part)
      else
         chosen = sqrt(shares)*sum(sqrt(shares)) >= fewest_parts*tolerance .or. largest_share(shares, most_share)
      end if
   end function worth_cutting

   !> What the parts of cut elements may be expected to have.
   pure function shares_of_parts(shares, parent) result(parts)
      real(wp), intent(in) :: shares(:)
      integer, intent(in) :: parent(:) !< (parts)
      real(wp) :: parts(size(parent))
      integer :: number(size(shares)), i
      number = 0
      do i = 1, size(parent)
         number(parent(i)) = number(parent(i)) + 1
      end do
      parts = shares(parent)/real(number(parent), wp)**2
   end function shares_of_parts

   !> The largest values that make up a part of the sum (Doerfler, SIAM J. Numer. Anal. 33, 1996); equal ones go together, so that
   !> what is symmetric stays it.
   pure function largest_share(values, part) result(chosen)
      real(wp), intent(in) :: values(:) !< >= 0
      real(wp), intent(in) :: part !< 0 to 1
      logical :: chosen(size(values))
      real(wp), parameter :: equal = 1 - 1.0e-6_wp
      real(wp) :: high, low, middle, wanted
      integer :: i
      low = 0
      high = maxval(values)
      wanted = part*sum(values)
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
