!> Predictor: the path so far, extrapolated. Remembers the last increments and where they led in three measures: load factor,
!> monitored displacement or volume, and length; each control extrapolates in its own measure.
module finshell_predictor
   use finshell_kinds, only: wp
   use finshell_step, only: control_load, control_displacement, control_arc_length, control_volume
   implicit none
   private
   public :: history_t

   integer, parameter :: depth = 2 !< remembered increments: quadratic extrapolation
   !> Beyond this many times the remembered path the parabola is not trusted, the straight line is.
   real(wp), parameter :: reach = 1.5_wp

   type :: history_t
      integer :: count = 0
      real(wp), allocatable :: vector(:, :) !< (n, depth) corrections that led from state to state, latest first
      real(wp) :: factor(depth) = 0 !< change of the load factor
      real(wp) :: monitored(depth) = 0 !< change of the monitored quantity
      real(wp) :: length(depth) = 0 !< of the increment (finshell_control)
   contains
      procedure :: remember
      procedure :: forget
      procedure :: predict
      procedure :: way_to_limit
      procedure, private :: measure
   end type history_t

contains

   !> A converged increment.
   pure subroutine remember(self, vector, factor, monitored, length)
      class(history_t), intent(inout) :: self
      real(wp), intent(in) :: vector(:), factor, monitored, length
      integer :: k
      if (.not. allocated(self%vector)) allocate (self%vector(size(vector), depth), source=0.0_wp)
      do k = depth, 2, -1
         self%vector(:, k) = self%vector(:, k - 1)
         self%factor(k) = self%factor(k - 1)
         self%monitored(k) = self%monitored(k - 1)
         self%length(k) = self%length(k - 1)
      end do
      self%vector(:, 1) = vector
      self%factor(1) = factor
      self%monitored(1) = monitored
      self%length(1) = length
      self%count = min(self%count + 1, depth)
   end subroutine remember

   !> The path has a kink here (a new step, say): do not extrapolate across it.
   pure subroutine forget(self)
      class(history_t), intent(inout) :: self
      self%count = 0
   end subroutine forget

   !> Extrapolated correction x and change of the factor for an increment of `size` in the measure of a control; `ok` is false
   !> where nothing can be said: no history, or the measure has just turned round.
   pure subroutine predict(self, control, size, x, change, ok)
      class(history_t), intent(in) :: self
      integer, intent(in) :: control
      real(wp), intent(in) :: size
      real(wp), intent(out) :: x(:), change
      logical, intent(out) :: ok
      real(wp) :: h(depth), t1, t2, first, second, c(depth)

      x = 0
      change = 0
      h = self%measure(control)
      ok = self%count >= 1
      if (ok) ok = abs(h(1)) > 0 .and. size*h(1) > 0
      if (.not. ok) return
      c = [size/h(1), 0.0_wp]
      if (self%count >= 2 .and. h(1)*h(2) > 0 .and. abs(size) <= reach*abs(h(1) + h(2))) then
         t1 = -h(1)
         t2 = -h(1) - h(2)
         first = size*(size - t2)/(t1*(t1 - t2))
         second = size*(size - t1)/(t2*(t2 - t1))
         c = [-first - second, -second]
      end if
      x = c(1)*self%vector(:, 1)
      if (abs(c(2)) > 0) x = x + c(2)*self%vector(:, 2)
      change = dot_product(c, self%factor)
      if (control == control_load) change = size
   end subroutine predict

   !> Change of the load factor to the limit point that the last two increments point to; huge where they point to none.
   !>
   !> Near a limit point the load factor is a parabola over the path: the square of d factor / d length falls linearly to zero.
   pure function way_to_limit(self) result(way)
      class(history_t), intent(in) :: self
      real(wp) :: way
      real(wp) :: slope(2)
      way = huge(way)
      if (self%count < 2) return
      if (.not. (self%factor(1)*self%factor(2) > 0 .and. all(self%length(:2) > 0))) return
      slope = (self%factor(:2)/self%length(:2))/(self%factor(2)/self%length(2))
      if (.not. slope(1) < 1) return
      ! The slopes are those half-way through their increments.
      way = 0.5_wp*(self%factor(1) + self%factor(2))*slope(1)**2/(1 - slope(1)**2) - 0.5_wp*self%factor(1)
   end function way_to_limit

   pure function measure(self, control) result(h)
      class(history_t), intent(in) :: self
      integer, intent(in) :: control
      real(wp) :: h(depth)
      select case (control)
      case (control_displacement, control_volume); h = self%monitored
      case (control_arc_length); h = self%length
      case default; h = self%factor
      end select
   end function measure
end module finshell_predictor
