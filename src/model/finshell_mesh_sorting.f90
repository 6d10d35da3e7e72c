!> Sorting permutations: a stable radix sort, at most six times n steps. Used to find shared edges, duplicate nodes and node tags.
module finshell_mesh_sorting
   use finshell_kinds, only: dp, i8
   implicit none
   private
   public :: sorted_order, sorted_unique, position_in_sorted

   !> `order` such that keys(order) is ascending; equal keys keep their order.
   interface sorted_order
      module procedure :: sorted_order_integer
      module procedure :: sorted_order_real
   end interface sorted_order

contains

   !> Digit by digit from the lowest on, which keeps equal ones in order; digits in which no two keys differ are passed over.
   pure function sorted_order_integer(keys) result(order)
      integer(i8), intent(in) :: keys(:)
      integer, allocatable :: order(:)
      integer, parameter :: width = 11
      integer(i8), parameter :: sign = ishft(1_i8, 63) !< turned round, so that negative keys come first
      integer(i8), allocatable :: rest(:), moved(:)
      integer, allocatable :: work(:)
      integer(i8) :: differ
      integer :: place(0:2**width), bits, digit, i, shift

      order = [(i, i=1, size(keys))]
      if (size(keys) < 2) return
      differ = 0
      do i = 2, size(keys)
         differ = ior(differ, ieor(keys(i), keys(1)))
      end do
      rest = ieor(keys, sign)
      allocate (moved(size(keys)), work(size(keys)))
      do shift = 0, 63, width
         bits = min(width, 64 - shift)
         if (ibits(differ, shift, bits) == 0) cycle
         place = 0
         do i = 1, size(rest)
            digit = int(ibits(rest(i), shift, bits)) + 1
            place(digit) = place(digit) + 1
         end do
         do digit = 1, 2**bits
            place(digit) = place(digit) + place(digit - 1)
         end do
         do i = 1, size(rest)
            digit = int(ibits(rest(i), shift, bits))
            place(digit) = place(digit) + 1
            moved(place(digit)) = rest(i)
            work(place(digit)) = order(i)
         end do
         call swap(rest, moved)
         order = work
      end do

   contains

      pure subroutine swap(a, b)
         integer(i8), allocatable, intent(inout) :: a(:), b(:)
         integer(i8), allocatable :: c(:)
         call move_alloc(a, c)
         call move_alloc(b, a)
         call move_alloc(c, b)
      end subroutine swap
   end function sorted_order_integer

   !> Numbers are sorted by their bits, which ascend as the numbers do once those of negative ones are turned round.
   pure function sorted_order_real(keys) result(order)
      real(dp), intent(in) :: keys(:)
      integer, allocatable :: order(:)
      integer(i8) :: bits(size(keys))
      bits = transfer(keys + 0.0_dp, bits) ! + 0: -0 becomes 0
      order = sorted_order_integer(merge(ieor(bits, huge(bits)), bits, bits < 0))
   end function sorted_order_real

   !> The distinct values of a list, ascending.
   pure function sorted_unique(list) result(unique)
      integer, intent(in) :: list(:)
      integer, allocatable :: unique(:)
      integer, allocatable :: sorted(:)
      logical, allocatable :: keep(:)
      integer :: n

      n = size(list)
      sorted = list(sorted_order(int(list, i8)))
      allocate (keep(n))
      if (n > 0) keep(1) = .true.
      if (n > 1) keep(2:) = sorted(2:) /= sorted(:n - 1)
      unique = pack(sorted, keep)
   end function sorted_unique

   !> Position of a value in an ascending list, 0 when it is not there (bisection).
   pure integer function position_in_sorted(list, value) result(position)
      integer(i8), intent(in) :: list(:)
      integer(i8), intent(in) :: value
      integer :: low, high, middle

      position = 0
      low = 1
      high = size(list)
      do while (low <= high)
         middle = low + (high - low)/2
         if (list(middle) == value) then
            position = middle
            return
         else if (list(middle) < value) then
            low = middle + 1
         else
            high = middle - 1
         end if
      end do
   end function position_in_sorted
end module finshell_mesh_sorting
