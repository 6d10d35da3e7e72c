!> Where the elements of a list are kept by the assembly: found once for a list that is added again and again.
module finshell_places
   use finshell_kinds, only: i4
   implicit none
   private
   public :: places_t, find_places

   !> Compressed lists: at slot s stand the positions order(first(s):first(s + 1) - 1) of the list, ascending.
   type :: places_t
      integer(i4), allocatable :: first(:) !< (slots + 1)
      integer(i4), allocatable :: order(:)
   end type places_t

contains

   !> Sort a list by slots. Elements without a slot are left out: they are with other members of a team.
   pure function find_places(slot, slots, elements) result(places)
      integer(i4), intent(in) :: slot(:) !< (elements of the mesh) 0: none
      integer, intent(in) :: slots
      integer, intent(in) :: elements(:) !< element numbers, which may stand here several times
      type(places_t) :: places
      integer(i4), allocatable :: fill(:)
      integer :: i, s
      allocate (places%first(slots + 1), source=0_i4)
      allocate (places%order(size(elements)))
      do i = 1, size(elements)
         s = slot(elements(i))
         if (s > 0) places%first(s + 1) = places%first(s + 1) + 1_i4
      end do
      places%first(1) = 1
      do s = 1, slots
         places%first(s + 1) = places%first(s + 1) + places%first(s)
      end do
      fill = places%first
      do i = 1, size(elements)
         s = slot(elements(i))
         if (s == 0) cycle
         places%order(fill(s)) = int(i, i4)
         fill(s) = fill(s) + 1_i4
      end do
   end function find_places
end module finshell_places
