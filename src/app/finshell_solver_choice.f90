!> From what the input says about the solver to the options of the solver.
module finshell_solver_choice
   use finshell_back_ends, only: lack_of_solver
   use finshell_direct_solver, only: solver_options_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_input, only: input_t
   use finshell_status, only: status_input_error
   implicit none
   private
   public :: choose_solver

contains

   !> Errors: a solver that this build does not have.
   subroutine choose_solver(input, in_parts, options, error)
      type(input_t), intent(in) :: input
      logical, intent(in) :: in_parts !< many processes work together
      type(solver_options_t), intent(out) :: options
      type(error_t), allocatable, intent(out) :: error
      character(len=:), allocatable :: reason
      options%solver = 'auto'
      if (allocated(input%solver%solver)) options%solver = input%solver%solver
      options%low_rank = input%solver%low_rank
      options%out_of_core = input%solver%out_of_core
      reason = lack_of_solver(options, in_parts)
      if (reason /= '') call raise(error, status_input_error, input%file//':'//text_of(input%solver%line)//': &job: '//reason)
   end subroutine choose_solver
end module finshell_solver_choice
