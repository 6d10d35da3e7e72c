!> Where rounding leaves more of the residual than the tolerance allows, an iteration has converged all the same: the correction is
!> within its tolerance, or does not shrink any more because it is the answer to that rounding.
module finshell_rounding_limit
   use finshell_convergence, only: correction_ratio, field_norms, residual_ratio
   use finshell_kinds, only: wp
   use finshell_newton_result, only: newton_result_t
   use finshell_problem, only: problem_t
   use finshell_step, only: convergence_t
   implicit none
   private
   public :: weigh_rounding

   !> A correction that is more than `resting` times the one before shrinks no more. Beyond the second number, part of the
   !> increment, and the third, part of the displacements, no rounding is an excuse.
   real(wp), parameter :: resting = 0.1_wp, loosest_correction = 1.0e-2_wp, negligible = 1.0e-6_wp

contains

   !> The residual, or the correction, is above its tolerance: because of rounding? A residual within rounding and a correction
   !> within its tolerance do; or two residuals within rounding in a row, and a correction between them that shrinks no more: it
   !> is the answer to rounding. It has to be small beside the increment or, where nothing moves, beside the displacements.
   subroutine weigh_rounding(problem, settings, mean_levels, correction, before, likely, rounded, result)
      class(problem_t), intent(in) :: problem
      type(convergence_t), intent(in) :: settings
      real(wp), intent(in) :: mean_levels(2)
      real(wp), intent(in) :: correction(:), before !< the last one; ratio of the one before
      logical, intent(in) :: likely !< it is within its tolerance
      logical, intent(inout) :: rounded !< the residual before (in) and after the correction (out) is within rounding
      type(newton_result_t), intent(inout) :: result
      real(wp), allocatable :: unknowns(:), added(:)
      real(wp) :: least(2), part, tolerance
      logical :: rounded_before

      rounded_before = rounded
      rounded = .false.
      part = result%correction
      if (.not. likely .and. result%correction < resting*before) return
      allocate (unknowns(problem%n), added(problem%n))
      if (part > max(settings%correction, loosest_correction)) then
         call problem%magnitude(unknowns)
         part = correction_ratio(correction, unknowns, problem%field, problem%size, problem%detail)
         if (part > negligible) return
      end if
      call problem%magnitude(unknowns, added)
      least = epsilon(1.0_wp)*field_norms(added, problem%field)
      tolerance = max(settings%residual, epsilon(1.0_wp))
      rounded = ratio(least/tolerance) <= tolerance
      if (.not. rounded .or. .not. (likely .or. rounded_before)) return
      result%converged = .true.
      result%rounding = .true.
      result%correction = part
      result%residual = ratio(least)

   contains

      function ratio(reference)
         real(wp), intent(in) :: reference(2)
         real(wp) :: ratio
         ratio = residual_ratio(problem%residual, problem%field, [problem%force_level, problem%moment_level], mean_levels, &
                                problem%size, problem%detail, reference)
      end function ratio
   end subroutine weigh_rounding
end module finshell_rounding_limit
