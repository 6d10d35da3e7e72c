!> Cutting a symmetric matrix into parts that know nothing of each other, and what separates them.
module finshell_dissection
   use finshell_cholmod, only: bisect, cholmod_t
   use finshell_error, only: error_t
   use finshell_kinds, only: i4
   use finshell_sparsity, only: sparsity_t
   implicit none
   private
   public :: separator, dissect, sub_pattern, elimination_order

   integer, parameter :: separator = 0

contains

   !> (n) The part of each equation, or `separator`: each cut halves the largest part. There may be fewer parts where one cannot be
   !> cut.
   subroutine dissect(pattern, parts, part_of, error)
      type(sparsity_t), intent(in) :: pattern
      integer, intent(in) :: parts
      integer, allocatable, intent(out) :: part_of(:)
      type(error_t), allocatable, intent(out) :: error
      type(sparsity_t) :: inner
      integer, allocatable :: members(:), side(:), sizes(:)
      integer :: i, largest, next

      allocate (part_of(pattern%n), source=1)
      do next = 2, parts
         sizes = [(count(part_of == i), i=1, next - 1)]
         largest = maxloc(sizes, 1)
         members = pack([(i, i=1, pattern%n)], part_of == largest)
         if (size(members) == pattern%n) then
            call bisect(pattern, side, error)
         else
            call sub_pattern(pattern, members, inner)
            call bisect(inner, side, error)
         end if
         if (allocated(error)) return
         if (count(side == 0) == 0 .or. count(side == 1) == 0) return
         do i = 1, size(members)
            if (side(i) == 1) part_of(members(i)) = next
            if (side(i) == 2) part_of(members(i)) = separator
         end do
      end do
   end subroutine dissect

   !> The entries of a pattern between some of its equations, in the order of these, and where they stand among its entries.
   pure subroutine sub_pattern(pattern, members, sub, source)
      type(sparsity_t), intent(in) :: pattern !< symmetric
      integer, intent(in) :: members(:)
      type(sparsity_t), intent(out) :: sub
      integer, intent(out), allocatable, optional :: source(:) !< (entries of sub) index into those of the pattern
      integer, allocatable :: place(:), fill(:), row(:), from(:), low(:), high(:)
      integer :: a, b, i, j, k, p, pass

      sub%n = size(members)
      sub%symmetric = .true.
      allocate (place(pattern%n), source=0)
      place(members) = [(i, i=1, sub%n)]
      ! By rows first: taken up row after row, the columns come out ascending.
      allocate (fill(sub%n + 1), source=0)
      do pass = 1, 2
         do i = 1, sub%n
            j = members(i)
            do p = pattern%column_pointer(j), pattern%column_pointer(j + 1) - 1
               k = place(pattern%row(p))
               if (k == 0) cycle
               a = max(i, k)
               b = min(i, k)
               if (pass == 1) then
                  fill(a + 1) = fill(a + 1) + 1
               else
                  low(fill(a)) = b
                  from(fill(a)) = p
                  fill(a) = fill(a) + 1
               end if
            end do
         end do
         if (pass == 2) exit
         fill(1) = 1
         do i = 1, sub%n
            fill(i + 1) = fill(i + 1) + fill(i)
         end do
         allocate (low(fill(sub%n + 1) - 1), from(fill(sub%n + 1) - 1), high(fill(sub%n + 1) - 1))
         do i = 1, sub%n
            high(fill(i):fill(i + 1) - 1) = i
         end do
      end do
      allocate (sub%column_pointer(sub%n + 1), source=0_i4)
      do p = 1, size(low)
         sub%column_pointer(low(p) + 1) = sub%column_pointer(low(p) + 1) + 1_i4
      end do
      sub%column_pointer(1) = 1
      do i = 1, sub%n
         sub%column_pointer(i + 1) = sub%column_pointer(i + 1) + sub%column_pointer(i)
      end do
      allocate (row(size(low)))
      if (present(source)) allocate (source(size(low)))
      fill = int(sub%column_pointer)
      do p = 1, size(low)
         row(fill(low(p))) = high(p)
         if (present(source)) source(fill(low(p))) = from(p)
         fill(low(p)) = fill(low(p)) + 1
      end do
      sub%row = int(row, i4)
   end subroutine sub_pattern

   !> An order of elimination with little fill, after which columns come as their supernodes want them.
   subroutine elimination_order(pattern, order, error)
      type(sparsity_t), intent(in) :: pattern
      integer, allocatable, intent(out) :: order(:)
      type(error_t), allocatable, intent(out) :: error
      type(cholmod_t) :: solver
      call solver%analyse(pattern, order, error)
   end subroutine elimination_order
end module finshell_dissection
