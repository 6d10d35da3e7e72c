!> From what an input says to a problem that can be solved: what every run and every host begins with.
module finshell_preparation
   use finshell_equilibrium, only: equilibrium_t, new_equilibrium
   use finshell_error, only: error_t, text_of
   use finshell_input, only: input_t
   use finshell_job, only: may_float
   use finshell_solver_choice, only: choose_solver
   use finshell_team, only: shared, team_t
   use finshell_trial, only: check_steps, place_load_error
   implicit none
   private
   public :: prepare

contains

   !> The problem of an input, unloaded; it refers to the input. Errors, with file and line: a solver that is not there; what is
   !> wrong with supports or loads; a step that cannot be followed.
   subroutine prepare(input, problem, team, error)
      type(input_t), intent(in), target :: input
      type(equilibrium_t), intent(inout) :: problem
      class(team_t), pointer, intent(in) :: team !< each member calls
      type(error_t), allocatable, intent(out) :: error
      call choose_solver(input, shared(team), problem%solver%options, error)
      if (allocated(error)) return
      problem%may_float = may_float(input%structure, input%steps, 1)
      call new_equilibrium(problem, input%structure, error, team)
      if (allocated(error)) then
         call place_load_error(input, problem, error)
         if (verify(error%message(1:1), '0123456789') > 0) error%message = ' '//error%message
         error%message = input%file//':'//error%message
         return
      end if
      call check_steps(input, problem, error)
   end subroutine prepare
end module finshell_preparation
