!> States of laws at the points of a block of elements: gathered for a law, taken back from it.
module finshell_point_states
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use finshell_kinds, only: wp, i4, lanes
   use finshell_law_states, only: law_states_t
   use finshell_material, only: material_t
   use finshell_status, only: status_not_a_number, status_ok
   implicit none
   private
   public :: point_states_t, new_point_states, judge_states, remembered_stress, remembered_at

   type :: point_states_t
      type(law_states_t) :: all
      integer :: element(lanes) = 0 !< in `all`
      integer :: used = 0 !< elements of the block that are not copies of the first
   end type point_states_t

contains

   !> States of the elements first + 1 ... of a batch of n.
   subroutine new_point_states(states, first, n, block)
      type(law_states_t), intent(in) :: states
      integer, intent(in) :: first, n
      type(point_states_t), intent(out) :: block
      integer :: l
      block%all = states
      block%used = min(lanes, n - first)
      block%element = [(first + merge(l, 1, l <= block%used), l=1, lanes)]
   end subroutine new_point_states

   !> Plane stress of a law with states, at points of a block: those of the first in-plane point, side by side, then the next.
   pure subroutine remembered_stress(law, block, place, stride, groups, n, level, e, w, s, d, status)
      class(material_t), intent(in) :: law
      type(point_states_t), intent(inout) :: block
      integer, intent(in) :: place !< of the first number of the first in-plane point, from 0
      integer, intent(in) :: stride !< from in-plane point to in-plane point
      integer, intent(in) :: groups !< in-plane points
      integer, intent(in) :: n, level !< n >= groups*lanes
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6)
      integer(i4), intent(inout) :: status(n)
      real(wp) :: begin(n, law%states), end(n, law%states)
      integer :: g, l, v
      do v = 1, law%states
         do g = 0, groups - 1
            do l = 1, lanes
               begin(g*lanes + l, v) = block%all%begin(place + g*stride + v, block%element(l))
            end do
         end do
         begin(groups*lanes + 1:, v) = begin(1, v)
      end do
      end = begin
      call law%plane_stress_from(n, level, e, block%all%time, block%all%step, begin, w, s, d, end, status)
      if (.not. associated(block%all%end)) return
      do v = 1, law%states
         do g = 0, groups - 1
            do l = 1, block%used
               block%all%end(place + g*stride + v, block%element(l)) = end(g*lanes + l, v)
            end do
         end do
      end do
   end subroutine remembered_stress

   !> Plane stress of such a law at one point of each element where there are no states: between points through the thickness, or
   !> outside of them, states are interpolated, of the mean of the in-plane points.
   pure subroutine remembered_at(law, block, place, points, z, height, n, level, e, w, s, d, status)
      class(material_t), intent(in) :: law
      type(point_states_t), intent(in) :: block
      integer, intent(in) :: place, points !< of the layer
      real(wp), intent(in) :: z(points), height !< of the points, and where
      integer, intent(in) :: n, level !< n >= lanes
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6)
      integer(i4), intent(inout) :: status(n)
      real(wp) :: begin(n, law%states), end(n, law%states), weight
      integer :: l, p, v
      p = max(1, min(count(z <= height), points - 1))
      weight = 0
      if (points > 1) weight = (height - z(p))/(z(p + 1) - z(p))
      do v = 1, law%states
         do l = 1, lanes
            begin(l, v) = (1 - weight)*mean(p, l, v)
            if (points > 1) begin(l, v) = begin(l, v) + weight*mean(p + 1, l, v)
         end do
         begin(lanes + 1:, v) = begin(1, v)
      end do
      end = begin
      call law%plane_stress_from(n, level, e, block%all%time, block%all%step, begin, w, s, d, end, status)

   contains

      pure real(wp) function mean(point, lane, variable)
         integer, intent(in) :: point, lane, variable
         integer :: g
         mean = 0
         do g = 0, 2
            mean = mean + block%all%begin(place + (g*points + point - 1)*law%states + variable, block%element(lane))/3
         end do
      end function mean
   end subroutine remembered_at

   !> NaN and infinity among the states of the beginning. What an element that fails has at the end is what it had then.
   pure subroutine judge_states(block, status)
      type(point_states_t), intent(inout) :: block
      integer(i4), intent(inout) :: status(lanes)
      integer :: l
      do l = 1, block%used
         if (.not. all(ieee_is_finite(block%all%begin(:, block%element(l))))) status(l) = status_not_a_number
         if (.not. associated(block%all%end)) cycle
         if (status(l) /= status_ok) block%all%end(:, block%element(l)) = block%all%begin(:, block%element(l))
      end do
   end subroutine judge_states
end module finshell_point_states
