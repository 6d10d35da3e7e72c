!> What is told about an increment of a step in time that looks for equilibrium at its end.
module finshell_course_report
   use finshell_course, only: course_t
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: text_of
   use finshell_kinds, only: wp, dp
   use finshell_newton, only: newton_result_t
   use finshell_observer, only: record_t
   use finshell_path, only: path_t
   use finshell_step, only: step_t
   implicit none
   private
   public :: fill_record, where_text

contains

   !> The record of a converged increment, which the path counts.
   subroutine fill_record(self, problem, step, h, result, path, record)
      type(course_t), intent(in) :: self
      class(equilibrium_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      real(wp), intent(in) :: h
      type(newton_result_t), intent(in) :: result
      type(path_t), intent(inout) :: path
      type(record_t), intent(inout) :: record !< with iterations, cuts, and what the kind of step has beyond these
      path%increments = path%increments + 1
      path%iterations = path%iterations + record%iterations
      path%cuts = path%cuts + record%cuts
      call cpu_time(record%cpu_time)
      record%increment = problem%state%increment
      record%control = step%control
      record%load_factor = problem%state%load_factor
      record%size = h
      record%residual = result%residual
      record%correction = result%correction
      record%rounding = result%rounding
      record%motion = self%motion
      record%account = path%account
      record%cpu_time = record%cpu_time - path%started
      record%total_increments = path%increments
      record%total_iterations = path%iterations
      record%total_cuts = path%cuts
      path%last = record
   end subroutine fill_record

   !> "step 'name' at time t: "
   pure function where_text(self, step) result(text)
      type(course_t), intent(in) :: self
      type(step_t), intent(in) :: step
      character(len=:), allocatable :: text
      text = 'step'
      if (allocated(step%name)) text = "step '"//step%name//"'"
      text = text//' at time '//text_of(real(self%time, dp))//': '
   end function where_text
end module finshell_course_report
