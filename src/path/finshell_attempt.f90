!> An attempt at an increment: data only.
module finshell_attempt
   use finshell_kinds, only: wp
   use finshell_step, only: control_load
   implicit none
   private
   public :: attempt_t

   !> What an increment prescribes.
   type :: attempt_t
      integer :: control = control_load
      real(wp) :: size = 0 !< signed, in the measure of the control
      logical :: again = .false. !< an attempt from here has failed
      logical :: plain = .false. !< plain Newton, even where the step asks for mixed
      logical :: softly = .false. !< by finshell_start
      real(wp) :: turn = 0 !< rotation of the linear answer to it
      logical :: descends = .false. !< by finshell_descent, without prediction; load control only
      real(wp) :: reach = huge(1.0_wp) !< of a descent
      logical :: relaxes = .false. !< by finshell_relaxation, without prediction; load control only
      logical :: landing = .false. !< a load level or monitored value is to be met, in another measure than the step's
      real(wp) :: prescribed = 0 !< the value that is prescribed, set by `try`
      real(wp) :: interpolate = 0 !< > 0: start at this fraction of the increment that overshot
      logical :: along = .false. !< predicted along the tangent; set by `try`
      logical :: chord = .false. !< not to be predicted along the tangent
      real(wp), allocatable :: predicted(:) !< the predicted increment, unallocated without a prediction; set by `try`
   end type attempt_t
end module finshell_attempt
