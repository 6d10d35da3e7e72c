!> All steps of a job, one after the other.
module finshell_job
   use finshell_buckling, only: solve_buckling
   use finshell_dynamic, only: solve_dynamic
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t
   use finshell_explicit, only: solve_explicit
   use finshell_frequencies, only: solve_frequencies
   use finshell_linear_step, only: solve_linear
   use finshell_path, only: path_t
   use finshell_reporter, only: reporter_t
   use finshell_speaker, only: speaker_t
   use finshell_step, only: control_buckling, control_dynamic, control_explicit, control_frequencies, control_linear, step_t
   implicit none
   private
   public :: follow_steps

contains

   !> Follow them from the state of the problem. Errors: those of the first step that fails.
   subroutine follow_steps(steps, problem, path, reporter, speaker, error)
      type(step_t), intent(in) :: steps(:)
      type(equilibrium_t), intent(inout) :: problem
      type(path_t), intent(inout) :: path
      type(reporter_t), intent(inout) :: reporter
      type(speaker_t), intent(inout) :: speaker !< of the reporter
      type(error_t), allocatable, intent(out) :: error
      integer :: i
      do i = 1, size(steps)
         call reporter%begin_step()
         call problem%change_case(steps(i)%case, error)
         if (allocated(error)) return
         select case (steps(i)%control)
         case (control_linear); call solve_linear(problem, steps(i), speaker, error)
         case (control_buckling); call solve_buckling(problem, steps(i), speaker, error)
         case (control_dynamic); call solve_dynamic(problem, steps(i), path, speaker, error)
         case (control_frequencies); call solve_frequencies(problem, steps(i), speaker, error)
         case (control_explicit); call solve_explicit(problem, steps(i), speaker, path%increments, path%iterations, error)
         case default; call path%follow(problem, steps(i), speaker, error)
         end select
         if (allocated(error)) return
      end do
   end subroutine follow_steps
end module finshell_job
