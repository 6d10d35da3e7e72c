!> What a path remembers from increment to increment, for a run that goes on from there: all that makes its next increments what
!> they are, bit for bit. Components that only an increment itself uses are left out.
module finshell_path_memory
   use finshell_balance, only: tangent_t
   use finshell_memo, only: memo_t
   use finshell_past, only: past_t
   use finshell_path, only: path_t
   use finshell_predictor, only: history_t
   use finshell_problem, only: problem_t
   use finshell_progress, only: progress_t
   use finshell_stability, only: stability_t
   use finshell_state, only: state_t
   use finshell_targets, only: targets_t
   implicit none
   private
   public :: carry_path, carry_state

contains

   !> The path, and what the problem has left for it.
   subroutine carry_path(memo, path, problem)
      type(memo_t), intent(inout) :: memo
      class(path_t), intent(inout) :: path
      class(problem_t), intent(inout) :: problem
      integer :: k
      call memo%carry(path%case)
      call memo%carry(path%underway)
      call memo%carry(path%ramping)
      call memo%carry(path%done)
      call memo%carry(path%course)
      call carry_targets(memo, path%targets)
      call memo%carry(path%increments)
      call memo%carry(path%iterations)
      call memo%carry(path%cuts)
      call memo%carry(path%bifurcations)
      call memo%carry(path%laboured)
      call memo%carry(path%largest)
      call memo%carry(path%grip)
      call memo%carry(path%falls)
      call memo%carry(path%stabiliser%part)
      call memo%carry(path%stabiliser%viscosity)
      call memo%carry(path%stabiliser%taken)
      call memo%carry(path%stabiliser%stored)
      call path%account%carry(memo)
      call carry_progress(memo, path%progress)
      call carry_stability(memo, path%stability)
      do k = 1, size(path%mean_levels)
         call memo%carry(path%mean_levels(k))
      end do
      call carry_history(memo, path%history)
      call carry_tangent(memo, path%tangent)
      call memo%carry(path%size)
      call memo%carry(path%load_weight)
      call memo%carry(path%length_per_factor)
      call memo%carry(path%substitute)
      call memo%carry(path%rough)
      call memo%carry(path%hampered)
      call memo%carry(path%smooth)
      call memo%carry(path%young)
      call memo%carry(path%kinked)
      call memo%carry(path%branch)
      call memo%carry(path%snapped_size)
      call memo%carry(path%snapped_control)
      call memo%carry(path%leaping)
      call memo%carry(problem%negative_pivots)
      call memo%carry(problem%determinant_sign)
      call memo%carry(problem%force_level)
      call memo%carry(problem%moment_level)
   end subroutine carry_path

   subroutine carry_state(memo, state)
      type(memo_t), intent(inout) :: memo
      type(state_t), intent(inout) :: state
      call memo%carry(state%displacement)
      call memo%carry(state%rotation)
      call memo%carry(state%load_factor)
      call memo%carry(state%constant_factor)
      call memo%carry(state%release_factor)
      call memo%carry(state%rises)
      call memo%carry(state%case_factor)
      call memo%carry(state%increment)
      call memo%carry(state%stage)
      call memo%carry(state%time)
      call memo%carry(state%velocity)
      call memo%carry(state%acceleration)
      call carry_past(memo, state%past)
   end subroutine carry_state

   !> Of an accepted state: an increment ends where the next one begins.
   subroutine carry_past(memo, past)
      type(memo_t), intent(inout) :: memo
      type(past_t), allocatable, intent(inout) :: past
      integer :: remembers
      remembers = merge(1, 0, allocated(past))
      call memo%carry(remembers)
      if (.not. memo%whole) return
      memo%whole = (remembers > 0) .eqv. allocated(past)
      if (remembers == 0 .or. .not. memo%whole) return
      call memo%carry(past%since)
      call memo%carry(past%end)
      if (memo%reading .and. memo%whole) memo%whole = allocated(past%end)
      if (memo%reading .and. memo%whole) memo%whole = all(shape(past%end) == shape(past%begin))
      if (memo%reading .and. memo%whole) past%begin = past%end
   end subroutine carry_past

   subroutine carry_targets(memo, targets)
      type(memo_t), intent(inout) :: memo
      type(targets_t), intent(inout) :: targets
      call memo%carry(targets%level)
      call memo%carry(targets%value)
      call memo%carry(targets%corner)
      call memo%carry(targets%at_level)
      call memo%carry(targets%at_value)
      call memo%carry(targets%ends_at_level)
      call memo%carry(targets%ends_at_value)
      call memo%carry(targets%of_volume)
      call memo%carry(targets%first_size)
      call memo%carry(targets%largest_size)
      call memo%carry(targets%smallest_size)
      call memo%carry(targets%sense)
   end subroutine carry_targets

   subroutine carry_progress(memo, progress)
      type(memo_t), intent(inout) :: memo
      type(progress_t), intent(inout) :: progress
      call memo%carry(progress%nearest)
      call memo%carry(progress%stalled)
      call memo%carry(progress%origin)
      call memo%carry(progress%farthest)
      call memo%carry(progress%farthest_load)
      call memo%carry(progress%has_come_back)
      call memo%carry(progress%load)
      call memo%carry(progress%negative_pivots)
   end subroutine carry_progress

   subroutine carry_stability(memo, stability)
      type(memo_t), intent(inout) :: memo
      type(stability_t), intent(inout) :: stability
      call memo%carry(stability%known)
      call memo%carry(stability%negative_pivots)
      call memo%carry(stability%determinant_sign)
      call memo%carry(stability%sense)
      call memo%carry(stability%change)
   end subroutine carry_stability

   subroutine carry_history(memo, history)
      type(memo_t), intent(inout) :: memo
      type(history_t), intent(inout) :: history
      integer :: k
      call memo%carry(history%count)
      call memo%carry(history%vector)
      do k = 1, size(history%factor)
         call memo%carry(history%factor(k))
         call memo%carry(history%monitored(k))
         call memo%carry(history%length(k))
      end do
      call memo%carry(history%has_tangent)
      call memo%carry(history%direction)
      call memo%carry(history%factor_rate)
      call memo%carry(history%monitored_rate)
   end subroutine carry_history

   subroutine carry_tangent(memo, tangent)
      type(memo_t), intent(inout) :: memo
      type(tangent_t), intent(inout) :: tangent
      call memo%carry(tangent%known)
      call memo%carry(tangent%x)
      call memo%carry(tangent%length)
      call memo%carry(tangent%sense)
      call memo%carry(tangent%stiffness)
      call memo%carry(tangent%held)
      call memo%carry(tangent%pressure)
      call memo%carry(tangent%volume)
   end subroutine carry_tangent
end module finshell_path_memory
