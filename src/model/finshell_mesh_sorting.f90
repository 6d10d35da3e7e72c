!> Sorting permutations: stable merge sort, n log n in the worst case. Used to find shared edges, duplicate nodes and node tags.
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

   pure function sorted_order_integer(keys) result(order)
      integer(i8), intent(in) :: keys(:)
      integer, allocatable :: order(:)
      integer, allocatable :: work(:)
      integer :: n, width, first, middle, last, i, j, k

      n = size(keys)
      order = [(i, i=1, n)]
      allocate (work(n))
      width = 1
      do while (width < n)
         do first = 1, n, 2*width
            middle = min(first + width, n + 1)
            last = min(first + 2*width, n + 1)
            i = first
            j = middle
            do k = first, last - 1
               if (takes_left(i, j, middle, last)) then
                  work(k) = order(i)
                  i = i + 1
               else
                  work(k) = order(j)
                  j = j + 1
               end if
            end do
         end do
         order = work
         width = 2*width
      end do

   contains

      pure logical function takes_left(i, j, middle, last)
         integer, intent(in) :: i, j, middle, last
         if (i >= middle) then
            takes_left = .false.
         else if (j >= last) then
            takes_left = .true.
         else
            takes_left = keys(order(i)) <= keys(order(j))
         end if
      end function takes_left
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
