!> What an implicit step in time, or a static one that takes time, carries from one increment to the next beside the state, as
!> numbers that a run leaves for its continuation (finshell_dynamic, finshell_timed_step).
module finshell_course
   use finshell_kinds, only: wp
   use finshell_memo, only: memo_t
   use finshell_newmark, only: newmark_t
   use finshell_observer, only: motion_t
   use finshell_pace, only: landing_size, pace_t
   use finshell_time_plan, only: time_plan_t
   implicit none
   private
   public :: course_t, carry_course, course_of, numbers_of

   type :: course_t
      type(newmark_t) :: method
      type(pace_t) :: pace
      real(wp) :: time = 0, duration = 0 !< since the step began; of the step
      real(wp) :: begun = 0 !< when it did
      real(wp) :: at_start = 0 !< load factor that the step has found
      !> (n_nodal, nodes) finshell_newmark; of a static step (n + 1, 1) rates of the unknowns and of the load factor.
      real(wp), allocatable :: auxiliary(:, :)
      real(wp), allocatable :: damping(:, :) !< (n_nodal, nodes) forces of damping
      real(wp), allocatable :: load(:, :) !< (n_nodal, nodes) forces of loads and damping
      real(wp), allocatable :: reaction(:) !< of moved supports, to inertia too (finshell_ledger)
      logical :: conserves = .false. !< energy and momenta
      real(wp) :: energy = 0 !< when the step began
      real(wp) :: mean_levels(2) = 0
      integer :: increments = 0
      logical :: flies = .false. !< nothing holds a displacement: the mean velocity says nothing about the size of increments
      type(motion_t) :: motion !< works since the step began
      !> (3, nodes) and quaternions (4, nodes) when the step began, where damping goes by them
      real(wp), allocatable :: first_displacement(:, :), first_rotation(:, :)
      real(wp), allocatable :: first_past(:, :) !< what laws remembered then, likewise (finshell_past)
      real(wp) :: way = 0 !< of a static step: how far it has moved (finshell_timed_step)
      integer :: seen = 0 !< likewise: number of the increment that it has made last; there may be others, of a host
   contains
      procedure :: aim
   end type course_t

contains

   !> The next increment: as large as its pace, but ending where the step is to be seen or its loads have corners.
   pure subroutine aim(self, plan, h, end_time)
      class(course_t), intent(in) :: self
      type(time_plan_t), intent(in) :: plan
      real(wp), intent(out) :: h, end_time !< its size; since the step began
      real(wp) :: landing
      landing = plan%next_landing(self%time)
      h = landing_size(self%pace%size, landing - self%time)
      end_time = merge(landing, self%time + h, self%time + 1.5_wp*h > landing)
   end subroutine aim

   !> What goes from increment to increment beside the state.
   subroutine carry_course(memo, self)
      type(memo_t), intent(inout) :: memo
      type(course_t), intent(inout) :: self
      call self%pace%carry(memo)
      call memo%carry(self%time)
      call memo%carry(self%at_start)
      call memo%carry(self%begun)
      call memo%carry(self%auxiliary)
      call memo%carry(self%damping)
      call memo%carry(self%load)
      call memo%carry(self%reaction)
      call memo%carry(self%energy)
      call memo%carry(self%mean_levels(1))
      call memo%carry(self%mean_levels(2))
      call memo%carry(self%increments)
      call memo%carry(self%motion%work)
      call memo%carry(self%motion%damped)
      call memo%carry(self%first_displacement)
      call memo%carry(self%first_rotation)
      call memo%carry(self%first_past)
      call memo%carry(self%way)
      call memo%carry(self%seen)
   end subroutine carry_course

   !> A course of these numbers; what goes by the step alone has its initial values.
   function course_of(numbers) result(course)
      real(wp), intent(in) :: numbers(:)
      type(course_t) :: course
      type(memo_t) :: memo
      memo = memo_t(numbers=numbers, reading=.true.)
      call carry_course(memo, course)
   end function course_of

   function numbers_of(course) result(numbers)
      type(course_t), intent(in) :: course
      real(wp), allocatable :: numbers(:)
      type(course_t) :: copy
      type(memo_t) :: memo
      copy = course
      call carry_course(memo, copy)
      numbers = memo%numbers(:memo%at)
   end function numbers_of
end module finshell_course
