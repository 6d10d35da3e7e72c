!> Size of the increments: grow when the iteration was easy, shrink when it was hard, cut to a quarter when it failed, and
!> arrive exactly (Abaqus-like; Sze, Liu & Lo 2004 used the same).
module finshell_increment
   use finshell_kinds, only: wp
   use finshell_step, only: step_t
   implicit none
   private
   public :: next_size, planned_size, toward, snapped, fraction_passed, cut_ratio

   real(wp), parameter :: cut_ratio = 0.25_wp !< of the failed increment
   real(wp), parameter :: shrink = 0.5_wp !< at most, after a hard but successful increment
   real(wp), parameter :: stretch = 1.25_wp !< an increment may be longer by this to arrive at a target

contains

   !> Size after a converged increment.
   pure function next_size(size, iterations, cuts, step) result(next)
      real(wp), intent(in) :: size
      integer, intent(in) :: iterations !< of the successful attempt
      integer, intent(in) :: cuts !< before it
      type(step_t), intent(in) :: step
      real(wp) :: next
      real(wp) :: ratio
      next = size
      if (.not. step%automatic) return
      ratio = real(wanted(step), wp)/max(iterations, 1)
      ratio = min(max(ratio, shrink), step%growth)
      if (cuts > 0) ratio = min(ratio, 1.0_wp)
      next = size*ratio
   end function next_size

   !> Iterations to aim at: tight tolerances cost two more of a quadratic iteration, whatever the size.
   pure function wanted(step) result(iterations)
      type(step_t), intent(in) :: step
      integer :: iterations
      iterations = step%wanted_iterations
      if (iterations <= 0) iterations = merge(7, 5, step%convergence%residual < 1.0e-5_wp)
   end function wanted

   !> The next increment on the way to a target: all of what remains when that is little more than one increment, half of it when
   !> it is less than two, so that no tiny increment is left over.
   pure function planned_size(size, remaining) result(planned)
      real(wp), intent(in) :: size, remaining !< magnitudes
      real(wp) :: planned
      if (remaining <= stretch*size) then
         planned = remaining
      else if (remaining < 2*size) then
         planned = 0.5_wp*remaining
      else
         planned = size
      end if
   end function planned_size

   !> Signed size of the next increment from a value to a target.
   pure function toward(size, from, to) result(signed)
      real(wp), intent(in) :: size, from, to
      real(wp) :: signed
      signed = sign(planned_size(size, abs(to - from)), to - from)
   end function toward

   !> A target within rounding of where the increment leads: the target itself.
   pure function snapped(value, target, size) result(exact)
      real(wp), intent(in) :: value, target, size
      real(wp) :: exact
      exact = value
      if (abs(value - target) <= 1.0e-6_wp*abs(size)) exact = target
   end function snapped

   !> Part of the way from a to b at which `target` is passed; 2 when it is not.
   pure function fraction_passed(a, b, target) result(fraction)
      real(wp), intent(in) :: a, b, target
      real(wp) :: fraction
      fraction = 2
      if ((target - a)*(b - target) > 0) fraction = (target - a)/(b - a)
   end function fraction_passed
end module finshell_increment
