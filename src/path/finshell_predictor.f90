!> Predictor: the path so far, extrapolated. Remembers the last increments and where they led in three measures: load factor,
!> monitored displacement or volume, and length; each control extrapolates in its own measure.
!>
!> With a tangent (`point`): the parabola over the length of the path that begins along it where the path has led, and comes through
!> the state before. What grows with a root of the load, as a flat sheet under pressure does, is no polynomial in the load
!> but nearly one in the length. And as stretching goes with the square of bending, a straight extrapolation of a bending sheet
!> stretches it. Without a tangent, or too far along it: the parabola through the last three states, or a straight line.
module finshell_predictor
   use finshell_kinds, only: wp
   use finshell_step, only: control_load, control_displacement, control_arc_length, control_volume
   implicit none
   private
   public :: history_t

   integer, parameter :: depth = 2 !< remembered increments: quadratic extrapolation
   !> Beyond this many times the remembered path the parabola through states is not trusted, the straight line is.
   real(wp), parameter :: reach = 1.5_wp
   real(wp), parameter :: reach_of_tangent = 2.1_wp !< in lengths of the last increment; an increment may grow twofold

   type :: history_t
      integer :: count = 0
      real(wp), allocatable :: vector(:, :) !< (n, depth) corrections that led from state to state, latest first
      real(wp) :: factor(depth) = 0 !< change of the load factor
      real(wp) :: monitored(depth) = 0 !< change of the monitored quantity
      real(wp) :: length(depth) = 0 !< of the increment (finshell_control)
      logical :: has_tangent = .false.
      real(wp), allocatable :: direction(:) !< (n) tangent to the path where it has led, per length; so are the rates
      real(wp) :: factor_rate = 0, monitored_rate = 0
   contains
      procedure :: remember
      procedure :: point
      procedure :: forget
      procedure :: predict
      procedure :: way_to_limit
      procedure, private :: measure, way_by_tangent, predict_by_states
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
      self%has_tangent = .false.
   end subroutine remember

   !> The tangent to the path where the increment remembered last has led; all per change of the load factor.
   pure subroutine point(self, x, monitored, length, sense)
      class(history_t), intent(inout) :: self
      real(wp), intent(in) :: x(:), monitored
      real(wp), intent(in) :: length !< of the path, > 0
      real(wp), intent(in) :: sense !< its sign: that of the load factor along the path
      self%factor_rate = sign(1.0_wp, sense)/length
      self%monitored_rate = self%factor_rate*monitored
      self%direction = self%factor_rate*x
      self%has_tangent = .true.
   end subroutine point

   !> The path has a kink here (a new step, say): do not extrapolate across it.
   pure subroutine forget(self)
      class(history_t), intent(inout) :: self
      self%count = 0
   end subroutine forget

   !> Extrapolated correction x and change of the factor for an increment of `size` in the measure of a control; `ok` is false
   !> where nothing can be said: no history, or the measure has just turned round.
   pure subroutine predict(self, control, size, x, change, ok, along, by_states)
      class(history_t), intent(in) :: self
      integer, intent(in) :: control
      real(wp), intent(in) :: size
      real(wp), intent(out) :: x(:), change
      logical, intent(out) :: ok
      logical, intent(out), optional :: along !< the tangent was taken
      logical, intent(in), optional :: by_states !< it is not to be taken
      real(wp) :: h(depth), s, part

      x = 0
      change = 0
      if (present(along)) along = .false.
      h = self%measure(control)
      ok = self%count >= 1
      if (ok) ok = abs(h(1)) > 0 .and. size*h(1) > 0
      if (.not. ok) return
      s = self%way_by_tangent(control, size)
      if (present(by_states)) s = merge(0.0_wp, s, by_states)
      if (present(along)) along = s > 0
      if (s > 0) then
         part = (s/self%length(1))**2
         x = (s + part*self%length(1))*self%direction - part*self%vector(:, 1)
         change = (s + part*self%length(1))*self%factor_rate - part*self%factor(1)
      else
         call self%predict_by_states(size, h, x, change)
      end if
      if (control == control_load) change = size
   end subroutine predict

   !> Length of the path to where the parabola has changed the measure of a control by `size`; 0: nowhere near.
   pure function way_by_tangent(self, control, size) result(s)
      class(history_t), intent(in) :: self
      integer, intent(in) :: control
      real(wp), intent(in) :: size
      real(wp) :: s
      real(wp) :: h, rate, bend, part

      s = 0
      h = self%length(1)
      if (.not. (self%has_tangent .and. h > 0)) return
      select case (control)
      case (control_arc_length)
         rate = 1
         bend = 0
      case (control_displacement, control_volume)
         rate = self%monitored_rate
         bend = (h*rate - self%monitored(1))/h**2
      case default
         rate = self%factor_rate
         bend = (h*rate - self%factor(1))/h**2
      end select
      if (.not. rate*size > 0) return
      s = size/rate
      part = rate**2 + 4*bend*size
      if (part > 0) then
         part = 2*size/(rate + sign(sqrt(part), rate))
         if (part <= reach_of_tangent*h) s = part
      end if
      if (s > reach_of_tangent*h) s = 0
   end function way_by_tangent

   !> Without a tangent: the parabola through the last three states in the measure h of the control, or the straight line.
   pure subroutine predict_by_states(self, size, h, x, change)
      class(history_t), intent(in) :: self
      real(wp), intent(in) :: size, h(depth)
      real(wp), intent(out) :: x(:), change
      real(wp) :: t1, t2, first, second, c(depth)
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
   end subroutine predict_by_states

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
