!> Where a path stands and how the next equilibrium state is tried: what an attempt prescribes, from where it starts, and whether
!> it passed something that was to be met. finshell_path decides what to make of the result.
module finshell_tracker
   use finshell_kinds, only: wp
   use finshell_factor, only: factor_at, set_factor
   use finshell_problem, only: problem_t
   use finshell_state, only: state_t
   use finshell_step, only: convergence_t, step_t, control_load, control_displacement, control_arc_length, control_volume, &
      prescribes_monitored, snap_refuse, mixed_auto, mixed_never, tangent_always, tangent_auto, tangent_never
   use finshell_control, only: constraint_t, control_vector, arc_norm, arc_product
   use finshell_attempt, only: attempt_t
   use finshell_newton, only: newton_result_t, solve_increment, too_soft
   use finshell_descent, only: descend
   use finshell_relaxation, only: relax
   use finshell_stabilisation, only: stabiliser_t
   use finshell_start, only: start_softly
   use finshell_predictor, only: history_t
   use finshell_balance, only: tangent_t
   use finshell_increment, only: toward, snapped, fraction_passed, cut_ratio
   use finshell_targets, only: targets_t
   implicit none
   private
   public :: tracker_t, attempt_t, monitored

   type :: tracker_t
      real(wp) :: mean_levels(2) = 0 !< force and moment level, mean over the converged increments
      type(history_t) :: history
      real(wp) :: size = 0 !< next increment of the step, magnitude; arc-length: 0 before the first
      real(wp) :: load_weight = 0
      real(wp) :: length_per_factor = 1 !< arc-length after its first increment: bounds are stated as load factors
      real(wp) :: grip = 0 !< of the control before arc-length stood in for it
      logical :: substitute = .false. !< arc-length stands in for a control whose quantity turns round
      logical :: rough = .false. !< the last increment was found by a descent only, so the next is sought by one at once
      logical :: hampered = .false. !< the last increment was cut
      !> So far the path is that of a stable structure, found by Newton's method, not by rounding.
      logical :: smooth = .true.
      logical :: young = .false. !< the last increment began a branch
      logical :: kinked = .false. !< it ended at a corner of a table: the path has a kink there
      real(wp), allocatable :: branch(:) !< the next increment leaves the path along this vector
      integer :: bifurcations = 0 !< located in this step
      type(stabiliser_t) :: stabiliser
      integer :: falls = 0 !< increments of this step that were left to dynamic relaxation, all else having failed
      type(tangent_t) :: tangent !< to the path at the last converged state; not known at the start of a step
      real(wp) :: snapped_size = 0 !< of the first increment from here that was refused for a snap; 0: none
      integer :: snapped_control = 0
      logical :: leaping = .false. !< the path ends here: the next increment may snap
      real(wp), allocatable :: refused(:) !< an increment from here that was not believed
      real(wp), allocatable :: overshoot(:) !< an increment that is to be interpolated
      real(wp) :: overshoot_change = 0
      real(wp), allocatable :: course(:) !< what a step in time carries from increment to increment, while it is under way
   contains
      procedure :: plan
      procedure :: try
      procedure :: look_back
      procedure :: keep_increment
      procedure :: pass_bifurcation
      procedure :: remember
      procedure :: turn_corner
      procedure :: may_start_softly
      procedure :: may_descend
      procedure :: may_fall_back
   end type tracker_t

   !> A descent that moves the structure by more than this part of all it has moved is a snap, not the way on.
   real(wp), parameter :: near = 0.5_wp
   integer, parameter :: most_falls = 20 !< in a step

contains

   !> May an increment that Newton's method has missed be the start from rest of a structure that is too soft for its load?
   !> Membranes and laws without stiffness at rest have a start of their own.
   function may_start_softly(self, problem, step, result, cuts, attempt) result(yes)
      class(tracker_t), intent(in) :: self
      class(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(newton_result_t), intent(in) :: result
      integer, intent(in) :: cuts
      type(attempt_t), intent(in) :: attempt
      logical :: yes
      yes = at_rest(self, problem, step, attempt) .and. cuts == 0 .and. result%first_pivots == 0 &
            .and. result%first_rotation > too_soft
   end function may_start_softly

   pure function at_rest(self, problem, step, attempt) result(yes)
      class(tracker_t), intent(in) :: self
      class(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(attempt_t), intent(in) :: attempt
      logical :: yes
      yes = self%history%count == 0 .and. attempt%control == control_load .and. .not. (attempt%descends .or. attempt%softly) &
         .and. step%control == control_load .and. step%tangent_predictor /= tangent_never &
         .and. step%convergence%mixed == mixed_auto .and. .not. (problem%soft .or. problem%limp)
      if (yes) yes = .not. any(abs(problem%base%displacement) > 0) .and. .not. problem%fills()
   end function at_rest

   !> May an increment that Newton's method has missed (`result`) after some cuts be sought by a descent? Under a prescribed load
   !> only, at the first increment of an arc-length step too. Sets how far the descent may lead.
   !>
   !> From a state without a path behind it: if the structure was too soft for a linear answer to the load (a flat sheet, a law
   !> without stiffness), else the load was too large. As slender strips are soft too, a quarter of the load is tried before
   !> the whole is left to a descent, unless the law is soft.
   function may_descend(self, problem, step, targets, result, cuts, attempt) result(yes)
      class(tracker_t), intent(in) :: self
      class(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(targets_t), intent(in) :: targets
      type(newton_result_t), intent(in) :: result
      integer, intent(in) :: cuts
      type(attempt_t), intent(inout) :: attempt
      logical :: yes
      real(wp) :: moved
      logical :: last !< there is no point in a quarter

      yes = step%descent .and. allocated(problem%weight) .and. attempt%control == control_load .and. .not. attempt%descends &
         .and. .not. attempt%relaxes &
         .and. .not. attempt%landing .and. (step%control == control_load .or. self%history%count == 0)
      ! Where larger increments snap (finshell_caution) a descent would do so too.
      yes = yes .and. .not. self%snapped_size > 0
      if (.not. yes) return
      last = self%hampered .or. cut_ratio*abs(attempt%size) < targets%smallest_size
      yes = cuts > 0 .or. problem%soft .or. self%rough .or. last .or. attempt%softly
      if (.not. yes) return
      moved = norm2(problem%base%displacement)
      if (self%history%count == 0 .and. .not. self%rough .and. &
          (problem%soft .or. result%first_rotation > abs(step%convergence%rotation_limit))) then
         attempt%reach = huge(moved)
      else
         yes = moved > 0
         attempt%reach = near*moved
         if (allocated(attempt%predicted)) &
            attempt%reach = max(attempt%reach, arc_norm(attempt%predicted, problem%field, 0.0_wp, 0.0_wp))
      end if
      if (yes .and. cuts == 1 .and. .not. last) attempt%size = attempt%size/cut_ratio
   end function may_descend

   !> May an increment be left to dynamic relaxation, all else having failed? Not where snaps are refused.
   pure logical function may_fall_back(self, problem, step, attempt) result(yes)
      class(tracker_t), intent(in) :: self
      class(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(attempt_t), intent(in) :: attempt
      yes = step%fallback .and. step%control == control_load .and. attempt%control == control_load .and. .not. attempt%relaxes &
         .and. step%snap /= snap_refuse .and. allocated(problem%weight) .and. .not. problem%confined .and. self%falls < most_falls
   end function may_fall_back

   !> Choose what the next increment prescribes.
   function plan(self, problem, step, targets, no_landing) result(attempt)
      class(tracker_t), intent(in) :: self
      class(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(targets_t), intent(in) :: targets
      logical, intent(in) :: no_landing
      type(attempt_t) :: attempt
      real(wp), allocatable :: x(:)
      real(wp) :: change, size, factor, way
      logical :: known

      size = self%size
      factor = factor_at(problem%state, step%scaling)
      if (allocated(self%branch)) then
         attempt%control = control_vector
         attempt%size = sign(size, step%branch_amplitude)
         return
      end if
      attempt%relaxes = step%relaxes
      if (step%relaxes) size = abs(targets%next_level() - factor)
      if (targets%largest_size > 0) size = min(size, targets%largest_size*self%length_per_factor)
      attempt%control = merge(control_arc_length, step%control, self%substitute)
      select case (attempt%control)
      case (control_displacement, control_volume)
         attempt%size = toward(size, monitored(problem, problem%state), targets%next_value())
      case (control_arc_length)
         attempt%size = size
         if (self%history%count == 0) then
            attempt%control = control_load
            attempt%size = targets%sense*size
            if (targets%has_level()) attempt%size = toward(size, factor, targets%next_level())
            return
         end if
      case default
         attempt%size = toward(size, factor, targets%next_level())
         return
      end select
      if (no_landing .or. self%kinked) return

      ! Would the extrapolated path arrive at the next load level, or corner? Then prescribe it.
      allocate (x(problem%n))
      call self%history%predict(attempt%control, attempt%size, x, change, known)
      if (.not. known) return
      way = targets%way_to_stop(factor, change)
      if (abs(change) < 0.85_wp*abs(way)) return
      attempt%control = control_load
      attempt%size = way
      attempt%landing = .true.
   end function plan

   !> Predict, constrain, iterate.
   subroutine try(self, problem, step, targets, attempt, result)
      class(tracker_t), intent(inout) :: self
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(targets_t), intent(in) :: targets
      type(attempt_t), intent(inout) :: attempt
      type(newton_result_t), intent(out) :: result
      type(constraint_t) :: constraint
      type(convergence_t) :: settings
      real(wp), allocatable :: x(:)
      real(wp) :: change, scale, length, angle
      logical :: known, young, complete

      problem%taken = 0
      allocate (x(problem%n))
      settings = step%convergence
      ! Mixed iteration leads away from a branch that has just begun.
      young = attempt%control == control_vector .or. self%young
      if (attempt%plain .or. (young .and. settings%mixed == mixed_auto)) settings%mixed = mixed_never
      constraint%control = attempt%control
      constraint%scaling = step%scaling
      constraint%load_weight = self%load_weight
      constraint%sense = sign(1.0_wp, attempt%size)
      constraint%target = attempt%size
      if (attempt%control == control_load) then
         constraint%target = factor_at(problem%base, step%scaling) + attempt%size
         if (targets%has_level()) constraint%target = snapped(constraint%target, targets%next_level(), attempt%size)
         constraint%target = targets%corner_at(constraint%target)
      else if (prescribes_monitored(attempt%control)) then
         constraint%target = monitored(problem, problem%base) + attempt%size
         if (targets%has_value()) constraint%target = snapped(constraint%target, targets%next_value(), attempt%size)
      end if
      attempt%prescribed = constraint%target
      if (allocated(attempt%predicted) .and. .not. attempt%descends) deallocate (attempt%predicted)

      known = .false.
      attempt%along = .false.
      if (attempt%control == control_vector) then
         constraint%vector = self%branch
         x = attempt%size*self%branch
         change = 0
         known = .true.
      else if (attempt%interpolate > 0) then
         x = attempt%interpolate*self%overshoot
         change = attempt%interpolate*self%overshoot_change
         known = .true.
      else if (step%extrapolate .and. .not. (self%kinked .or. attempt%descends .or. attempt%relaxes)) then
         call self%history%predict(attempt%control, attempt%size, x, change, known, attempt%along, attempt%chord)
      end if
      if (known) then
         if (attempt%control == control_load) change = attempt%size
         length = arc_norm(x, problem%field, change, self%load_weight)
         scale = 1
         if (attempt%control == control_arc_length .and. length > 0) scale = attempt%size/length
         angle = scale*problem%largest_rotation(x, change, step%scaling)
         if (step%convergence%rotation_limit > 0 .and. angle > step%convergence%rotation_limit) &
            scale = scale*step%convergence%rotation_limit/angle
         attempt%predicted = scale*x
         call problem%move(attempt%predicted, scale*change, scaling=step%scaling)
      else if (attempt%control == control_arc_length .and. self%kinked) then
         constraint%sense = sign(1.0_wp, self%history%factor(1)) ! the other way is that from which the path has come
      else if (attempt%control == control_arc_length) then
         constraint%previous = self%history%vector(:, 1)
         constraint%previous_change = self%history%factor(1)
      end if
      if (attempt%relaxes) then
         call relax(problem, constraint%target, step%convergence, self%mean_levels, result, step%scaling)
      else if (attempt%softly .and. .not. attempt%descends) then
         call start_softly(problem, constraint%target, attempt%turn, settings, self%mean_levels, step%scaling, result)
      else if (attempt%descends) then
         call descend(problem, constraint%target, step%convergence, self%mean_levels, attempt%reach, result, step%scaling)
      else
         if (attempt%control == control_load) call self%stabiliser%engage(problem, attempt%size)
         call solve_increment(problem, constraint, settings, self%mean_levels, result, &
                              stable=at_rest(self, problem, step, attempt) .and. .not. attempt%again)
         if (result%converged) then
            complete = .true.
            if (targets%has_level()) complete = abs(constraint%target - targets%next_level()) <= 0
            call self%stabiliser%release(problem, constraint, settings, self%mean_levels, complete, result)
         end if
         problem%drag = 0
      end if
      if (result%converged .and. attempt%control == control_load) &
         call set_factor(problem%state, step%scaling, constraint%target) ! its last bits may differ
   end subroutine try

   !> After convergence: has a level or a monitored value been passed? Then go back and prescribe it.
   subroutine look_back(self, problem, step, targets, attempt, overshot)
      class(tracker_t), intent(inout) :: self
      class(problem_t), intent(inout) :: problem
      type(step_t), intent(in) :: step
      type(targets_t), intent(in) :: targets
      type(attempt_t), intent(inout) :: attempt
      logical, intent(out) :: overshot
      real(wp) :: factor, value, old_factor, old_value, level_part, value_part, corner, corner_part

      factor = factor_at(problem%state, step%scaling)
      value = monitored(problem, problem%state)
      old_factor = factor_at(problem%base, step%scaling)
      old_value = monitored(problem, problem%base)
      level_part = 2
      value_part = 2
      if (targets%has_level() .and. attempt%control /= control_load) &
         level_part = fraction_passed(old_factor, factor, targets%next_level())
      if (targets%has_value() .and. .not. prescribes_monitored(attempt%control)) &
         value_part = fraction_passed(old_value, value, targets%next_value())
      corner = merge(factor, targets%passed_corner(old_factor, factor), attempt%control == control_load)
      corner_part = fraction_passed(old_factor, factor, corner)
      overshot = min(level_part, value_part, corner_part) < 1
      if (.not. overshot) return
      call self%keep_increment(problem, step%scaling)
      call problem%restore()
      attempt%landing = .true.
      attempt%interpolate = min(level_part, value_part, corner_part)
      if (corner_part < min(level_part, value_part)) then
         attempt%control = control_load
         attempt%size = corner - old_factor
      else if (level_part <= value_part) then
         attempt%control = control_load
         attempt%size = targets%next_level() - old_factor
      else
         attempt%control = merge(control_volume, control_displacement, targets%of_volume)
         attempt%size = targets%next_value() - old_value
      end if
   end subroutine look_back

   !> Remember the increment that has just converged, and the tangent to the path where it ended, to extrapolate.
   subroutine remember(self, problem, step, attempt, result, missed, x, change, moved, length)
      class(tracker_t), intent(inout) :: self
      class(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(attempt_t), intent(in) :: attempt
      type(newton_result_t), intent(in) :: result
      logical, intent(in) :: missed !< it was cut, and the one before
      real(wp), intent(in) :: x(:), change, moved, length !< increment, of the factor, of the monitored quantity, of the path
      real(wp), allocatable :: seen(:)
      real(wp) :: rate
      logical :: along
      integer :: k
      seen = x
      call problem%transport(seen)
      do k = 1, merge(0, self%history%count, self%kinked)
         call problem%transport(self%history%vector(:, k))
      end do
      if (self%kinked) call self%history%forget()
      call self%history%remember(seen, change, moved, length)
      self%smooth = self%smooth .and. problem%negative_pivots == 0 .and. .not. missed &
                    .and. .not. (attempt%descends .or. attempt%relaxes .or. result%rounding) &
                    .and. step%control /= control_arc_length .and. attempt%control /= control_arc_length
      ! The start of a branch was found from where the tangent is that of another path.
      self%young = allocated(self%branch)
      along = step%tangent_predictor == tangent_always .or. (step%tangent_predictor == tangent_auto .and. self%smooth)
      if (self%young .or. .not. (along .and. self%tangent%known)) return
      rate = 0
      if (allocated(problem%watched)) rate = dot_product(problem%watched, self%tangent%x) + problem%watched_rate
      call self%history%point(self%tangent%x, rate, arc_norm(self%tangent%x, problem%field, 1.0_wp, self%load_weight), &
                              arc_product(x, self%tangent%x, problem%field) + self%load_weight*change)
   end subroutine remember

   !> Where the increment that has just converged has led to a corner of a table, nothing of the path before it says how it goes on.
   pure subroutine turn_corner(self, targets, factor)
      class(tracker_t), intent(inout) :: self
      type(targets_t), intent(in) :: targets
      real(wp), intent(in) :: factor
      self%kinked = any(abs(targets%corner - factor) <= 0)
      if (.not. self%kinked) return
      self%tangent%known = .false.
      self%history%has_tangent = .false.
   end subroutine turn_corner

   !> At a located bifurcation point: if it is the one where the step asks for it, the next increment goes along the null vector.
   subroutine pass_bifurcation(self, problem, step, null_vector)
      class(tracker_t), intent(inout) :: self
      class(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      real(wp), allocatable, intent(in) :: null_vector(:)
      self%bifurcations = self%bifurcations + 1
      if (self%bifurcations /= step%switch_branch) return
      self%branch = null_vector
      self%size = abs(step%branch_amplitude)
      if (.not. self%size > 0) self%size = 0.01_wp*problem%size
      call self%history%forget()
   end subroutine pass_bifurcation

   !> Remember the increment that has just converged, to interpolate in it.
   subroutine keep_increment(self, problem, scaling)
      class(tracker_t), intent(inout) :: self
      class(problem_t), intent(in) :: problem
      integer, intent(in) :: scaling !< the factor that changed
      if (.not. allocated(self%overshoot)) allocate (self%overshoot(problem%n))
      call problem%increment(self%overshoot)
      self%overshoot_change = problem%change(scaling)
   end subroutine keep_increment

   !> Monitored displacement or volume at a state of the problem; 0 when none is watched.
   function monitored(problem, state) result(value)
      class(problem_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: value
      value = 0
      if (allocated(problem%watched)) value = problem%monitored(state)
   end function monitored
end module finshell_tracker
