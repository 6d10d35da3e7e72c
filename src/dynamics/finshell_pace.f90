!> How long the increments of time are: as the estimated error allows, and so that they end where something is to be landed on.
!>
!> The error of an increment is that of its displacements, c h^2 |vdot_{n+1} - vdot_n| with the constant c of the scheme (Xie
!> and Zienkiewicz 1991), in the norm of the masses; it is measured by h V, how far the structure moves in an increment where it is
!> fast. V is the largest norm of the velocities of late: it fades slowly, so that turning points are not taken for rest. Motions
!> that are nothing beside the displacements with which the step begins count as those: what a static step leaves out of balance
!> is not worth increments.
module finshell_pace
   use finshell_kinds, only: wp
   use finshell_memo, only: memo_t
   use finshell_step, only: step_t
   implicit none
   private
   public :: pace_t, landing_size

   type :: pace_t
      real(wp) :: size = 0 !< of the next increment
      real(wp) :: tolerance = 0, largest = huge(1.0_wp), smallest = 0, growth = 1
      logical :: automatic = .true.
      real(wp), private :: speed = 0 !< V
      real(wp), private :: least = 0 !< motion that is worth an increment
      real(wp), private :: wish = 0 !< of the step, where increments are not automatic
   contains
      procedure :: begin
      procedure :: error_of
      procedure :: refuses
      procedure :: take
      procedure :: fail
      procedure :: exhausted
      procedure :: carry
   end type pace_t

   real(wp), parameter :: fading = 0.98_wp !< of V, from increment to increment
   real(wp), parameter :: leniency = 2 !< above so many tolerances an increment is taken back
   real(wp), parameter :: margin = 0.9_wp, most_shorter = 0.2_wp, cut = 0.35_wp
   integer, parameter :: many_iterations = 10 !< after which the increment does not grow
   real(wp), parameter :: rounding = 1.0e-9_wp, negligible = 1.0e-6_wp

contains

   subroutine begin(self, step, first, displaced)
      class(pace_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: first !< what the motion suggests, where the step has no wish
      real(wp), intent(in) :: displaced !< norm of the displacements
      self%tolerance = step%time_tolerance
      self%automatic = step%automatic
      self%growth = step%growth
      self%smallest = step%smallest_increment
      if (.not. self%smallest > 0) self%smallest = 1.0e-9_wp*step%time%duration
      if (step%largest_increment > 0) self%largest = step%largest_increment
      self%size = first
      if (step%first_increment > 0) self%size = step%first_increment
      self%size = min(self%size, self%largest)
      self%wish = self%size
      self%speed = 0
      self%least = negligible*displaced
   end subroutine begin

   !> Estimated error relative to the motion.
   pure real(wp) function error_of(self, increment, jump, moved, speed)
      class(pace_t), intent(in) :: self
      real(wp), intent(in) :: increment !< h
      real(wp), intent(in) :: jump !< c |vdot_{n+1} - vdot_n|
      real(wp), intent(in) :: moved !< |d|
      real(wp), intent(in) :: speed !< |v|, the larger at both ends
      real(wp) :: scale
      scale = max(fading*self%speed*increment, speed*increment, moved, self%least)
      error_of = 0
      if (jump > 0 .and. scale > 0) error_of = jump*increment**2/scale
   end function error_of

   pure logical function refuses(self, error, increment)
      class(pace_t), intent(in) :: self
      real(wp), intent(in) :: error, increment
      refuses = self%automatic .and. error > leniency*self%tolerance .and. increment > self%smallest
   end function refuses

   !> After an increment with an error that was taken (or taken back): the next size.
   pure subroutine take(self, error, increment, iterations, speed)
      class(pace_t), intent(inout) :: self
      real(wp), intent(in) :: error, increment
      integer, intent(in) :: iterations
      real(wp), intent(in) :: speed
      real(wp) :: ratio
      self%speed = max(fading*self%speed, speed)
      if (.not. self%automatic) self%size = self%wish
      if (.not. self%automatic) return
      ratio = self%growth
      if (error > 0) ratio = min(self%growth, max(most_shorter, margin*sqrt(self%tolerance/error)))
      if (iterations > many_iterations) ratio = min(ratio, 1.0_wp)
      ! An increment that was shortened to land does not hold up the next.
      self%size = max(ratio*increment, merge(self%size, 0.0_wp, ratio >= 1))
      self%size = min(self%size, self%largest)
   end subroutine take

   !> After an iteration that has failed.
   pure subroutine fail(self, increment)
      class(pace_t), intent(inout) :: self
      real(wp), intent(in) :: increment
      self%size = cut*increment
   end subroutine fail

   !> For a run that goes on; the bounds are those of its step.
   subroutine carry(self, memo)
      class(pace_t), intent(inout) :: self
      type(memo_t), intent(inout) :: memo
      call memo%carry(self%size)
      call memo%carry(self%speed)
      call memo%carry(self%wish)
      call memo%carry(self%least)
   end subroutine carry

   pure logical function exhausted(self)
      class(pace_t), intent(in) :: self
      exhausted = self%size < self%smallest
   end function exhausted

   !> A part of the way to a landing that is not longer than a size, such that equal ones lead there.
   pure real(wp) function landing_size(size, way)
      real(wp), intent(in) :: size, way
      landing_size = size
      if (way < size*1.0e6_wp) landing_size = way/max(1, ceiling(way/size*(1 - rounding)))
   end function landing_size
end module finshell_pace
