!> Does a step come nearer to its end? Two signs that it does not: the path wanders, or it has come back.
module finshell_progress
   use finshell_kinds, only: wp, dp
   use finshell_error, only: text_of
   use finshell_state, only: state_t
   use finshell_step, only: step_t, control_arc_length
   use finshell_predictor, only: history_t
   use finshell_targets, only: targets_t
   implicit none
   private
   public :: progress_t, continues

   type :: progress_t
      real(wp) :: nearest = huge(1.0_wp) !< to the end of the step so far
      integer :: stalled = 0 !< increments since then
      real(wp), allocatable :: origin(:, :) !< displacements where the step began
      real(wp) :: farthest = 0 !< distance from there so far
      real(wp) :: farthest_load = 0 !< load factor so far, of the sign of the target
      logical :: has_come_back = .false.
      real(wp) :: load = 0 !< load factor now
      integer :: negative_pivots = 0
   contains
      procedure :: begin
      procedure :: note
      procedure :: complaint
   end type progress_t

   !> A snap-through carries a structure away while the load falls below zero, with one negative pivot. Nearer to its start than
   !> this part of the largest distance so far it is on its way back; beyond this number of pivots other modes have taken over.
   real(wp), parameter :: way_back = 0.3_wp
   integer, parameter :: most_pivots = 1

contains

   subroutine begin(self, state)
      class(progress_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      self%nearest = huge(1.0_wp)
      self%stalled = 0
      self%origin = state%displacement
      self%farthest = 0
      self%farthest_load = 0
      self%has_come_back = .false.
   end subroutine begin

   !> After each increment.
   subroutine note(self, state, targets, factor, monitored, negative_pivots)
      class(progress_t), intent(inout) :: self
      type(state_t), intent(in) :: state
      type(targets_t), intent(in) :: targets
      real(wp), intent(in) :: factor, monitored
      integer, intent(in) :: negative_pivots
      real(wp) :: distance, side

      distance = targets%distance(factor, monitored)
      self%stalled = self%stalled + 1
      if (distance < self%nearest) self%stalled = 0
      self%nearest = min(self%nearest, distance)

      ! Only where nothing but a load factor ends the step, and no level says that the load falls below zero on the way.
      self%has_come_back = .false.
      if (.not. targets%has_level() .or. targets%ends_at_value .or. .not. allocated(self%origin)) return
      side = sign(1.0_wp, targets%next_level())
      if (any(targets%level(targets%at_level:)*side <= 0)) return
      distance = norm2(state%displacement - self%origin)
      self%farthest = max(self%farthest, distance)
      self%farthest_load = max(self%farthest_load, side*factor)
      self%load = factor
      self%negative_pivots = negative_pivots
      self%has_come_back = side*factor < 0 .and. self%farthest_load > 0 &
                           .and. (distance < way_back*self%farthest .or. negative_pivots > most_pivots)
   end subroutine note

   !> Why the step should not go on; empty when it may.
   function complaint(self, step) result(text)
      class(progress_t), intent(in) :: self
      type(step_t), intent(in) :: step
      character(len=:), allocatable :: text
      text = ''
      if (self%has_come_back) then
         text = 'the load factor has come back through zero on its way to '//text_of(real(step%final_load_factor, dp))
         if (self%negative_pivots > most_pivots) text = text//', with '//text_of(self%negative_pivots)//' negative pivots'
         text = text//': the path has turned round, or has left for another one at a bifurcation point. Look at the critical ' &
                //'points of the history; try load control, a finer mesh or shorter increments (largest_increment, cautious). ' &
                //'If the load is meant to fall below zero, say where the path leads by displacements or load_levels'
      else if (step%patience > 0 .and. self%stalled >= step%patience) then
         text = 'the path wanders: in '//text_of(self%stalled) &
                //' increments it has not come nearer to the end of the step than before. It may have left for another one at a ' &
                //'bifurcation point: look at the critical points of the history; try load control, which finds stable ' &
                //'states, or a finer mesh; more patience (of &step) lets it go on'
      end if
   end function complaint

   !> Does an arc-length step go on along the path of the step before? Else it starts with an increment of the load factor, which
   !> would leave a branch that descends.
   pure function continues(history, step, targets, factor) result(yes)
      type(history_t), intent(in) :: history
      type(step_t), intent(in) :: step
      type(targets_t), intent(in) :: targets
      real(wp), intent(in) :: factor
      logical :: yes
      yes = step%control == control_arc_length .and. history%count > 0
      if (yes) yes = history%length(1) > 0
      if (yes .and. targets%has_level()) yes = (targets%next_level() - factor)*history%factor(1) > 0
   end function continues
end module finshell_progress
