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
      if (self%reading) then
         self%whole = self%whole .and. self%at < size(self%numbers)
         if (.not. self%whole) return
         self%at = self%at + 1
         x = self%numbers(self%at)
         return
      end if
      call make_room(self, 1)
      self%at = self%at + 1
      self%numbers(self%at) = x
   end subroutine carry_real

   !> For n numbers more.
   subroutine make_room(self, n)
      class(memo_t), intent(inout) :: self
      integer, intent(in) :: n
      real(wp), allocatable :: grown(:)
      if (.not. allocated(self%numbers)) allocate (self%numbers(max(n, 1000)))
      if (self%at + n <= size(self%numbers)) return
      allocate (grown(2*self%at + n))
      grown(:self%at) = self%numbers(:self%at)
      call move_alloc(grown, self%numbers)
   end subroutine make_room

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
      integer :: n
      n = -1
      if (allocated(x)) n = size(x)
      call self%carry(n)
      if (self%reading) then
         if (allocated(x)) deallocate (x)
         self%whole = self%whole .and. n <= size(self%numbers) - self%at
         if (n < 0 .or. .not. self%whole) return
         x = self%numbers(self%at + 1:self%at + n)
      else if (n > 0) then
         call make_room(self, n)
         self%numbers(self%at + 1:self%at + n) = x
      end if
      self%at = self%at + max(n, 0)
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
