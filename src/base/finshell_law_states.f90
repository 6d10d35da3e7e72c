!> What laws with states remember, of many elements of one section: arrays of the caller's.
!>
!> The numbers of an element: layer by layer, bottom to top; of a layer its three in-plane points in turn; of these the points
!> through the thickness, bottom to top; of these the state variables of the law.
module finshell_law_states
   use finshell_kinds, only: wp
   implicit none
   private
   public :: law_states_t

   type :: law_states_t
      real(wp), pointer, contiguous :: begin(:, :) => null() !< (numbers of an element, element)
      real(wp), pointer, contiguous :: end(:, :) => null() !< null: not wanted
      real(wp) :: time = 0, step = 0 !< time at the end; since the beginning
   end type law_states_t
end module finshell_law_states
