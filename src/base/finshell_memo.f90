!> Numbers that a run leaves for its continuation. What carries itself into a memo carries itself out of it by the same statements,
!> so both go by one order.
module finshell_memo
   use finshell_kinds, only: wp
   implicit none
   private
   public :: memo_t

   type :: memo_t
      real(wp), allocatable :: numbers(:) !< the first `at` have been carried
      integer :: at = 0
      logical :: reading = .false. !< from `numbers`, else into them
      logical :: whole = .true. !< so far there was as much to read as was asked for
   contains
      generic :: carry => carry_real, carry_integer, carry_logical, carry_list, carry_table
      procedure, private :: carry_real, carry_integer, carry_logical, carry_list, carry_table
   end type memo_t

contains

   subroutine carry_real(self, x)
      class(memo_t), intent(inout) :: self
      real(wp), intent(inout) :: x
      real(wp), allocatable :: grown(:)
      if (self%reading) then
         self%whole = self%whole .and. self%at < size(self%numbers)
         if (.not. self%whole) return
         self%at = self%at + 1
         x = self%numbers(self%at)
         return
      end if
      if (.not. allocated(self%numbers)) allocate (self%numbers(1000))
      if (self%at == size(self%numbers)) then
         allocate (grown(2*self%at))
         grown(:self%at) = self%numbers
         call move_alloc(grown, self%numbers)
      end if
      self%at = self%at + 1
      self%numbers(self%at) = x
   end subroutine carry_real

   subroutine carry_integer(self, i)
      class(memo_t), intent(inout) :: self
      integer, intent(inout) :: i
      real(wp) :: x
      x = i
      call self%carry(x)
      i = nint(x)
   end subroutine carry_integer

   subroutine carry_logical(self, yes)
      class(memo_t), intent(inout) :: self
      logical, intent(inout) :: yes
      real(wp) :: x
      x = merge(1, 0, yes)
      call self%carry(x)
      yes = x > 0.5_wp
   end subroutine carry_logical

   !> A list that may be unallocated.
   subroutine carry_list(self, x)
      class(memo_t), intent(inout) :: self
      real(wp), allocatable, intent(inout) :: x(:)
      integer :: i, n
      n = -1
      if (allocated(x)) n = size(x)
      call self%carry(n)
      if (self%reading) then
         if (allocated(x)) deallocate (x)
         self%whole = self%whole .and. n <= size(self%numbers) - self%at
         if (n < 0 .or. .not. self%whole) return
         allocate (x(n))
      end if
      do i = 1, n
         call self%carry(x(i))
      end do
   end subroutine carry_list

   !> A table that may be unallocated.
   subroutine carry_table(self, x)
      class(memo_t), intent(inout) :: self
      real(wp), allocatable, intent(inout) :: x(:, :)
      real(wp), allocatable :: flat(:)
      integer :: rows
      rows = 0
      if (allocated(x)) rows = size(x, 1)
      if (allocated(x) .and. .not. self%reading) flat = reshape(x, [size(x)])
      call self%carry(rows)
      call self%carry(flat)
      if (.not. self%reading) return
      if (allocated(x)) deallocate (x)
      if (allocated(flat)) x = reshape(flat, [rows, size(flat)/max(1, rows)])
   end subroutine carry_table
end module finshell_memo
