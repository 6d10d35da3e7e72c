!> Tables: a factor over another one or over time, along straight lines or smoothly between points; before the first point and
!> behind the last one it stays.
module finshell_table
   use finshell_kinds, only: wp
   implicit none
   private
   public :: table_t, follower_t, by_time

   integer, parameter :: by_time = -1 !< a follower follows the time

   type :: table_t
      real(wp), allocatable :: x(:), y(:) !< x ascending
      logical :: smooth = .false. !< along 3 s^2 - 2 s^3: rates are zero at the points
   contains
      procedure :: value => value_at
      procedure :: rates
      procedure :: arrivals
   end type table_t

   !> A factor that is a table of another factor, or of the time.
   type :: follower_t
      integer :: factor = 0 !< which one (finshell_factor)
      integer :: parent = 0 !< what it follows: a factor that steps change, or by_time
      type(table_t) :: table
   end type follower_t

contains

   pure real(wp) function value_at(self, x) result(y)
      class(table_t), intent(in) :: self
      real(wp), intent(in) :: x
      real(wp) :: part
      integer :: i
      i = count(self%x <= x)
      if (i == 0) then
         y = self%y(1)
      else if (i == size(self%x)) then
         y = self%y(i)
      else
         part = (x - self%x(i))/(self%x(i + 1) - self%x(i))
         if (self%smooth) part = part**2*(3 - 2*part)
         y = self%y(i) + part*(self%y(i + 1) - self%y(i))
      end if
   end function value_at

   !> First and second derivative; at a point those of what comes before it or, with `after`, behind it.
   pure function rates(self, x, after)
      class(table_t), intent(in) :: self
      real(wp), intent(in) :: x
      logical, intent(in) :: after
      real(wp) :: rates(2), part, length
      integer :: i
      rates = 0
      i = merge(count(self%x <= x), count(self%x < x), after)
      if (i == 0 .or. i == size(self%x)) return
      length = self%x(i + 1) - self%x(i)
      rates(1) = (self%y(i + 1) - self%y(i))/length
      if (.not. self%smooth) return
      part = (x - self%x(i))/length
      rates = 3*rates(1)*[2*part*(1 - part), (2 - 4*part)/length]
   end function rates

   !> Where between its points the table takes a value.
   pure function arrivals(self, y) result(x)
      class(table_t), intent(in) :: self
      real(wp), intent(in) :: y
      real(wp), allocatable :: x(:)
      real(wp) :: part
      integer :: i
      allocate (x(0))
      do i = 1, size(self%x) - 1
         if (.not. (y - self%y(i))*(self%y(i + 1) - y) > 0) cycle
         part = (y - self%y(i))/(self%y(i + 1) - self%y(i))
         ! 3 s^2 - 2 s^3 = part, by the trigonometric solution of the cubic
         if (self%smooth) part = 0.5_wp - sin(asin(1 - 2*part)/3)
         x = [x, self%x(i) + part*(self%x(i + 1) - self%x(i))]
      end do
   end function arrivals
end module finshell_table
