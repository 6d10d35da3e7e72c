!> The energy of a step: what is stored, and what loads, moved supports and damping have brought in or taken since it began.
!>
!> Work is that of the trapezoidal rule over each increment (finshell_balance): its error is of third order in the length of an
!> increment, of second over a step. What the balance does not explain is that error, and what a snap has dissipated.
module finshell_account
   use finshell_balance, only: balance_t
   use finshell_kinds, only: wp
   use finshell_memo, only: memo_t
   implicit none
   private
   public :: account_t

   type :: account_t
      logical :: kept = .false. !< it was asked for
      logical :: known = .false. !< all work since the step began
      logical :: begun = .false. !< there was an increment
      real(wp) :: at_start = 0, stored = 0 !< energy when the step began; now
      real(wp), allocatable :: work(:) !< of loads, by factor (finshell_factor)
      real(wp) :: supports = 0 !< work of moved supports
      real(wp) :: damped = 0 !< taken by stabilisation
   contains
      procedure :: begin
      procedure :: add
      procedure :: total
      procedure :: misfit
      procedure :: carry
   end type account_t

contains

   !> A step begins.
   subroutine begin(self)
      class(account_t), intent(inout) :: self
      self%begun = .false.
      self%known = self%kept
      self%supports = 0
      self%damped = 0
      if (allocated(self%work)) deallocate (self%work)
   end subroutine begin

   !> An increment is about to be accepted.
   subroutine add(self, balance, taken)
      class(account_t), intent(inout) :: self
      type(balance_t), intent(in) :: balance !< of it
      real(wp), intent(in) :: taken !< by stabilisation, which the balance has taken from the work
      self%known = self%known .and. balance%known
      if (.not. balance%known) return
      if (.not. self%begun) then
         self%at_start = balance%level - balance%energy
         self%work = 0*balance%by_factor
      end if
      self%begun = .true.
      self%stored = balance%level
      self%work = self%work + balance%by_factor
      self%supports = self%supports + balance%supports
      self%damped = self%damped + taken
   end subroutine add

   !> Work of loads and moved supports.
   pure real(wp) function total(self)
      class(account_t), intent(in) :: self
      total = self%supports
      if (allocated(self%work)) total = total + sum(self%work)
   end function total

   !> What is stored and not explained.
   pure real(wp) function misfit(self)
      class(account_t), intent(in) :: self
      misfit = 0
      if (self%begun) misfit = (self%stored - self%at_start) - self%total() + self%damped
   end function misfit

   !> For a run that goes on.
   subroutine carry(self, memo)
      class(account_t), intent(inout) :: self
      type(memo_t), intent(inout) :: memo
      logical :: known
      known = self%known .and. self%kept
      call memo%carry(known)
      self%known = known
      call memo%carry(self%begun)
      call memo%carry(self%at_start)
      call memo%carry(self%stored)
      call memo%carry(self%work)
      call memo%carry(self%supports)
      call memo%carry(self%damped)
      if (memo%reading .and. .not. self%begun) self%known = self%kept ! from here on
   end subroutine carry
end module finshell_account
