!> The steps in which a load or a support is there.
module finshell_span
   implicit none
   private
   public :: span_t

   type :: span_t
      integer :: first = 1, last = huge(1) !< steps of the input
   contains
      procedure :: covers
      procedure :: is_whole
   end type span_t

contains

   elemental logical function covers(self, step)
      class(span_t), intent(in) :: self
      integer, intent(in) :: step
      covers = self%first <= step .and. step <= self%last
   end function covers

   !> Is it all steps?
   elemental logical function is_whole(self)
      class(span_t), intent(in) :: self
      is_whole = self%first <= 1 .and. self%last == huge(1)
   end function is_whole
end module finshell_span
