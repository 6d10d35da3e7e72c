!> The size of the next increment, after one that has converged and after one that has failed.
module finshell_next_size
   use finshell_caution, only: grip_is_back, grip_of
   use finshell_control, only: control_vector
   use finshell_increment, only: cut_ratio, next_size
   use finshell_kinds, only: wp
   use finshell_newton_result, only: newton_result_t
   use finshell_step, only: control_arc_length, control_load, prescribes_monitored, step_t
   use finshell_targets, only: targets_t
   use finshell_tracker, only: attempt_t, tracker_t
   implicit none
   private
   public :: fall_back, adapt

contains

   !> After a failed attempt: the next size, or another control.
   subroutine fall_back(self, step, targets, attempt, cuts, turning, no_landing)
      class(tracker_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      type(targets_t), intent(in) :: targets
      type(attempt_t), intent(in) :: attempt
      integer, intent(inout) :: cuts
      logical, intent(in) :: turning
      logical, intent(inout) :: no_landing
      logical :: can_switch

      can_switch = step%switch_control .and. prescribes_monitored(attempt%control) .and. prescribes_monitored(step%control) &
         .and. .not. self%substitute .and. self%history%count > 0
      if (can_switch) can_switch = self%history%length(1) > 0 .and. grip_of(self) > 0
      if (can_switch .and. (turning .or. cuts >= 2)) then
         self%substitute = .true.
         self%grip = grip_of(self)
         self%size = min(self%history%length(1), abs(attempt%size)/self%grip)
         self%length_per_factor = 1/self%grip
      else if (attempt%landing) then
         ! The value to land on lies beyond a limit point, or far: come nearer first.
         no_landing = .true.
         self%size = 0.5_wp*self%size
      else
         self%size = cut_ratio*abs(attempt%size)
      end if
   end subroutine fall_back

   !> The size of the next increment, and whether the control of the step takes over again.
   subroutine adapt(self, step, targets, attempt, result, cuts, first, length, change, value)
      class(tracker_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      type(targets_t), intent(in) :: targets
      type(attempt_t), intent(in) :: attempt
      type(newton_result_t), intent(in) :: result
      integer, intent(in) :: cuts
      logical, intent(in) :: first
      real(wp), intent(in) :: length, change !< of the increment
      real(wp), intent(in) :: value !< of the monitored quantity

      if (attempt%control == control_vector) then
         deallocate (self%branch)
         self%size = length
         if (step%control == control_load) self%size = targets%first_size
         if (prescribes_monitored(step%control)) self%size = max(abs(self%history%monitored(1)), targets%smallest_size)
      else if (step%control == control_arc_length .and. first) then
         if (abs(change) > 0) self%length_per_factor = length/abs(change)
         self%size = next_size(length, result%iterations, cuts, step)
      else if (self%rough .or. attempt%softly .or. attempt%relaxes) then
         ! How hard a descent or a soft start was says nothing about the next increment.
         self%size = max(abs(attempt%size), merge(self%size, 0.0_wp, cuts == 0))
      else if (.not. attempt%landing) then
         self%size = next_size(max(abs(attempt%size), merge(self%size, 0.0_wp, cuts == 0)), result%iterations, cuts, step)
      end if
      if (.not. self%substitute .or. .not. targets%has_value()) return
      if (.not. grip_is_back(self, self%grip, targets%next_value() - value)) return
      self%substitute = .false.
      self%length_per_factor = 1
      self%size = abs(self%history%monitored(1))
   end subroutine adapt
end module finshell_next_size
