!> What the listener to iterations (finshell_listener) is told about the attempts at an increment.
module finshell_attempt_text
   use finshell_error, only: text_of
   use finshell_factor, only: by_constant_factor, factor_at
   use finshell_kinds, only: dp
   use finshell_newton_result, only: newton_result_t
   use finshell_problem, only: problem_t
   use finshell_step, only: control_name, step_t
   use finshell_tracker, only: attempt_t
   implicit none
   private
   public :: announce_attempt, announce_outcome

contains

   !> What is about to be tried.
   subroutine announce_attempt(problem, step, attempt, increment, cuts)
      class(problem_t), intent(in) :: problem
      type(step_t), intent(in) :: step
      type(attempt_t), intent(in) :: attempt
      integer, intent(in) :: increment, cuts !< its number; attempts that were cut before
      character(len=:), allocatable :: name, way
      if (.not. associated(problem%listener)) return
      name = 'step'
      if (allocated(step%name)) name = "step '"//step%name//"'"
      if (step%scaling == by_constant_factor) name = name//', constant loads'
      way = control_name(attempt%control)
      if (attempt%relaxes) way = 'dynamic relaxation'
      if (attempt%descends) way = 'descent'
      if (attempt%softly) way = way//', soft start'
      if (attempt%landing) way = way//', lands'
      call problem%say('Increment '//text_of(increment)//' of '//name//': '//way//', size '//text_of(real(attempt%size, dp)) &
                       //' from factor '//text_of(real(factor_at(problem%base, step%scaling), dp))//', '//text_of(cuts)//' cuts')
   end subroutine announce_attempt

   !> Why it failed, if it did.
   subroutine announce_outcome(problem, result)
      class(problem_t), intent(in) :: problem
      type(newton_result_t), intent(in) :: result
      if (result%converged .or. .not. allocated(result%reason)) return
      call problem%say('     failed: '//result%reason)
   end subroutine announce_outcome
end module finshell_attempt_text
