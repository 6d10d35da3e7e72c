!> Second thoughts about a converged increment: is it the continuation of the path, or has the iteration gone elsewhere?
module finshell_caution
   use finshell_kinds, only: wp, dp
   use finshell_error, only: text_of
   use finshell_problem, only: problem_t
   use finshell_step, only: step_t, control_load, control_arc_length, prescribes_monitored, snap_ignore, snap_refuse
   use finshell_balance, only: tangent_t, verdict_t, judge, judge_descent
   use finshell_newton, only: newton_result_t
   use finshell_control, only: arc_norm, arc_product
   use finshell_stability, only: stability_t, hidden_pair
   use finshell_tracker, only: tracker_t, attempt_t, monitored
   implicit none
   private
   public :: objection, at_fold, fold_text, grip_of, grip_is_back

   !> Cosine between an increment and the one before: below the first the path has turned back, which a path does not do in
   !> one increment that is short enough; below the second it is too sharp a bend for a cautious step.
   real(wp), parameter :: reversal = -0.5_wp, sharp_bend = 0.5_wp
   !> The grip of a control is the change of its quantity per length of the increment. Where it falls below this part of what it
   !> was, the quantity is about to turn round, or the structure has jumped across such a turn.
   real(wp), parameter :: grip_lost = 0.4_wp, grip_regained = 0.6_wp
   real(wp), parameter :: same_way = 0.95_wp !< cosine between a refused increment and a shorter one that confirms it
   real(wp), parameter :: finest = 1.0_wp/16 !< part of the first increment that was refused for a snap
   real(wp), parameter :: surprise = 0.5_wp !< distance from the prediction, part of the increment, that a cautious step refuses

contains

   !> What speaks against an increment; empty when nothing does. A cautious step believes a shorter increment that goes the same way
   !> as the one it refused: the path does bend there. `turning`: the controlled quantity loses its grip.
   subroutine objection(tracker, problem, step, attempt, result, before, after, text, turning, verdict)
      class(tracker_t), intent(inout) :: tracker
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(attempt_t), intent(in) :: attempt
      type(newton_result_t), intent(in) :: result
      type(stability_t), intent(in) :: before, after
      character(len=:), allocatable, intent(out) :: text
      logical, intent(out) :: turning
      type(verdict_t), intent(out) :: verdict
      real(wp), allocatable :: x(:)
      real(wp) :: length, cosine, old

      text = ''
      turning = .false.
      if (allocated(tracker%branch)) return
      allocate (x(problem%n))
      call problem%increment(x)
      if (step%snap /= snap_ignore) then
         if ((attempt%descends .or. attempt%relaxes) .and. result%regularised > 0) then
            verdict = judge_descent(problem%balance(step%scaling))
            if (allocated(attempt%predicted)) verdict%snap = verdict%snap .or. arc_norm(x - attempt%predicted, problem%field, &
               0.0_wp, 0.0_wp) > surprise*arc_norm(x, problem%field, 0.0_wp, 0.0_wp)
            if (verdict%snap .and. step%snap == snap_refuse) text = 'a descent leads to another state and dissipates ' &
                                                                  //text_of(real(100*verdict%misfit, dp))//' % of the work'
         else
            call object_to_snap(tracker, problem, step%scaling, attempt, result, x, text, verdict)
         end if
      end if
      if (tracker%history%count == 0) return
      length = arc_norm(x, problem%field, 0.0_wp, 0.0_wp)
      old = arc_norm(tracker%history%vector(:, 1), problem%field, 0.0_wp, 0.0_wp)
      if (.not. (length > 0 .and. old > 0)) return
      cosine = arc_product(x, tracker%history%vector(:, 1), problem%field)/(length*old)
      if (text /= '') return
      if (attempt%control == control_arc_length .and. cosine < reversal) then
         text = 'the increment would turn back on the path'
      else if (prescribes_monitored(attempt%control) .and. step%switch_control .and. .not. attempt%landing) then
         turning = abs(monitored(problem, problem%state) - monitored(problem, problem%base)) &
            < grip_lost*grip_of(tracker)*arc_norm(x, problem%field, 0.0_wp, 0.0_wp)
         if (turning) text = 'the prescribed quantity hardly moves along the path: it may turn round'
      end if
      if (text == '' .and. (step%cautious .or. step%locate) .and. hidden_pair(before, after)) &
         text = 'the load factor would pass two limit points in one increment'
      if (text /= '' .or. .not. step%cautious) return
      if (allocated(tracker%refused)) then
         if (arc_product(x, tracker%refused, problem%field) &
             > same_way*length*arc_norm(tracker%refused, problem%field, 0.0_wp, 0.0_wp)) return
      end if
      tracker%refused = x
      if (cosine < sharp_bend) then
         text = 'the path would bend sharply (cosine '//text_of(real(cosine, kind(1.0d0)))//' to the increment before)'
      else if (min(before%negative_pivots, after%negative_pivots) >= 0 &
               .and. abs(before%negative_pivots - after%negative_pivots) > 1) then
         text = 'the number of negative pivots would jump from '//text_of(before%negative_pivots)//' to ' &
            //text_of(after%negative_pivots)
      else if (allocated(attempt%predicted)) then
         x = x - attempt%predicted
         if (arc_norm(x, problem%field, 0.0_wp, 0.0_wp) > surprise*length) text = 'the increment is far from its prediction'
      end if
      if (text == '') deallocate (tracker%refused)
   end subroutine objection

   !> Refuse an increment that snaps, unless the path is to leap. A path that ends at a fold would ask for ever smaller
   !> increments, so the size of the first one is remembered until an increment of half of it succeeds.
   subroutine object_to_snap(tracker, problem, scaling, attempt, result, x, text, verdict)
      class(tracker_t), intent(inout) :: tracker
      class(problem_t), intent(inout) :: problem
      integer, intent(in) :: scaling !< the factor that changed
      type(attempt_t), intent(in) :: attempt
      type(newton_result_t), intent(in) :: result
      real(wp), intent(in) :: x(:)
      character(len=:), allocatable, intent(inout) :: text
      type(verdict_t), intent(out) :: verdict
      type(tangent_t) :: from

      from = tracker%tangent
      if (.not. from%known .and. .not. allocated(attempt%predicted)) from = result%first
      if (.not. (from%known .and. result%last%known)) return
      verdict = judge(problem%balance(scaling), from, result%last, x, problem%change(scaling), &
                      attempt%control == control_load .and. .not. attempt%landing, tracker%tangent%known, problem%field)
      if (attempt%control /= tracker%snapped_control) tracker%snapped_size = 0
      tracker%snapped_control = attempt%control
      ! From close to a fold the tangent there says little: that shorter increments failed says more.
      if (tracker%leaping) verdict%snap = verdict%snap .or. abs(attempt%size) > 1.01_wp*finest*tracker%snapped_size
      if (verdict%snap .and. .not. tracker%leaping) then
         tracker%snapped_size = max(tracker%snapped_size, abs(attempt%size))
         text = 'the increment would snap to another state: its work and the stored energy differ by '// &
                text_of(real(100*abs(verdict%misfit), dp))//' %, and its change of the load is short by '// &
                text_of(real(100*verdict%shortfall, dp))//' % of what the tangents at both ends say'
      else if (tracker%leaping .or. abs(attempt%size) >= 0.5_wp*tracker%snapped_size) then
         tracker%snapped_size = 0
      end if
   end subroutine object_to_snap

   !> Has an attempt failed that is so small a part of one that would snap that the path must be taken to end here?
   pure function at_fold(tracker, attempt) result(yes)
      class(tracker_t), intent(in) :: tracker
      type(attempt_t), intent(in) :: attempt
      logical :: yes
      yes = tracker%snapped_size > 0 .and. attempt%control == tracker%snapped_control &
            .and. abs(attempt%size) <= 1.01_wp*finest*tracker%snapped_size
   end function at_fold

   !> What to do where the path ends at a fold.
   pure function fold_text(snapped_size) result(text)
      real(wp), intent(in) :: snapped_size
      character(len=:), allocatable :: text
      text = ''
      if (snapped_size > 0) text = '. Larger increments snap to another state: what is prescribed turns round here. ' &
                                   //"control = 'arc_length' follows the path, snap = 'mark' jumps where it can"
   end function fold_text

   !> Change of the monitored quantity per length in the last increment.
   pure function grip_of(tracker) result(grip)
      class(tracker_t), intent(in) :: tracker
      real(wp) :: grip
      grip = 0
      if (tracker%history%count == 0) return
      if (tracker%history%length(1) > 0) grip = abs(tracker%history%monitored(1))/tracker%history%length(1)
   end function grip_of

   !> Does the monitored quantity move towards its target again, as clearly as it did before it turned?
   pure function grip_is_back(tracker, grip, way) result(yes)
      class(tracker_t), intent(in) :: tracker
      real(wp), intent(in) :: grip !< before it turned
      real(wp), intent(in) :: way !< from the present value to the target
      logical :: yes
      yes = tracker%history%count >= 2
      if (yes) yes = all(tracker%history%monitored*way > 0) .and. grip_of(tracker) >= grip_regained*grip
   end function grip_is_back
end module finshell_caution
