!> An observer that counts what the summary of a run tells.
module finshell_tally
   use finshell_kinds, only: wp
   use finshell_observer, only: observer_t, record_t
   use finshell_stability, only: no_event
   use finshell_step, only: is_in_time, leaves_state
   implicit none
   private
   public :: tally_t

   type, abstract, extends(observer_t) :: tally_t
      integer :: unstable = 0 !< increments with negative pivots
      integer :: descents = 0 !< increments found by a descent
      integer :: relaxations = 0, first_relaxed = 0 !< increments found by dynamic relaxation; the first of them
      integer :: steps = 0 !< of dynamic relaxation
      real(wp) :: stabilisation = 0 !< energy that it took in a step, in parts of the stored energy: the largest
      integer :: linear = 0 !< linear solutions and modes
      integer :: switched = 0 !< linear and buckling steps whose solution decided which fibres act
      integer :: critical_points = 0 !< limit and bifurcation points
      integer :: rounded = 0 !< increments that rounding kept from their tolerance
      real(wp) :: residual = 0, correction = 0 !< worst of all increments
      integer :: snaps = 0, first_snap = 0 !< increments that snapped; the first of them
      integer :: moved = 0 !< increments in time
   contains
      procedure :: count => count_increment
   end type tally_t

contains

   !> Count an increment.
   subroutine count_increment(self, record)
      class(tally_t), intent(inout) :: self
      type(record_t), intent(in) :: record
      if (record%descended) self%descents = self%descents + 1
      self%steps = self%steps + record%steps
      self%stabilisation = max(self%stabilisation, record%taken)
      if (record%relaxed) then
         self%relaxations = self%relaxations + 1
         if (self%first_relaxed == 0) self%first_relaxed = record%increment
      end if
      if (record%switched > 1) self%switched = self%switched + 1
      if (leaves_state(record%control)) self%linear = self%linear + 1
      if (is_in_time(record%control)) self%moved = self%moved + 1
      if (record%event /= no_event) self%critical_points = self%critical_points + 1
      if (record%rounding) self%rounded = self%rounded + 1
      self%residual = max(self%residual, record%residual)
      self%correction = max(self%correction, record%correction)
      if (record%negative_pivots > 0) self%unstable = self%unstable + 1
      if (.not. record%snap) return
      self%snaps = self%snaps + 1
      if (self%first_snap == 0) self%first_snap = record%increment
   end subroutine count_increment
end module finshell_tally
