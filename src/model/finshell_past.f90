!> What laws with states remember at all elements of a mesh (finshell_law_states), as a part of the state of a structure: it goes
!> where the state goes, and comes back with it.
module finshell_past
   use finshell_kinds, only: wp
   use finshell_section, only: section_t, states_of
   implicit none
   private
   public :: past_t, new_past

   type :: past_t
      !> (most numbers of an element, elements) where the increment began, and as the last evaluation of the elements has left them
      real(wp), allocatable :: begin(:, :), end(:, :)
      real(wp) :: since = 0 !< time where it began
   contains
      procedure :: settle
   end type past_t

contains

   !> Nothing has been strained yet. Unallocated: no law remembers.
   pure subroutine new_past(past, sections, elements)
      type(past_t), allocatable, intent(out) :: past
      type(section_t), intent(in) :: sections(:)
      integer, intent(in) :: elements
      integer :: i, most
      most = 0
      do i = 1, size(sections)
         most = max(most, states_of(sections(i)))
      end do
      if (most == 0) return
      allocate (past)
      allocate (past%begin(most, elements), past%end(most, elements), source=0.0_wp)
   end subroutine new_past

   !> The increment is accepted: its end is where the next one begins.
   pure subroutine settle(self, time)
      class(past_t), intent(inout) :: self
      real(wp), intent(in) :: time
      self%begin = self%end
      self%since = time
   end subroutine settle
end module finshell_past
