!> Cases of loads and supports: the one that steps change follows the load factor, the others have factors of their own, which stay.
module finshell_load_case
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t
   use finshell_factor, only: by_load_factor, exchange_factors
   implicit none
   private
   public :: case_of_steps, arrange_cases, change_case

contains

   !> The case whose factor is the load factor.
   pure integer function case_of_steps(problem)
      type(equilibrium_t), intent(in) :: problem
      case_of_steps = findloc(problem%factor_of_case, by_load_factor, dim=1)
   end function case_of_steps

   !> Make a case the one whose factor is the load factor: its loads and supports change places with those of the first case, which
   !> is put back in its place before. Forces are as they were.
   subroutine arrange_cases(problem, case)
      type(equilibrium_t), intent(inout) :: problem
      integer, intent(in) :: case !< 1: that without a name
      call exchange_with_first(problem, case_of_steps(problem))
      call exchange_with_first(problem, case)
   end subroutine arrange_cases

   subroutine exchange_with_first(problem, case)
      type(equilibrium_t), intent(inout) :: problem
      integer, intent(in) :: case
      integer :: other
      if (case <= 1 .or. case > size(problem%factor_of_case)) return
      other = maxval(problem%factor_of_case([1, case]))
      problem%factor_of_case([1, case]) = problem%factor_of_case([case, 1])
      call problem%external%exchange(other)
      problem%equations%motion(:, :, [by_load_factor, other]) = problem%equations%motion(:, :, [other, by_load_factor])
      if (allocated(problem%equations%anchor_factor)) then
         associate (anchor => problem%equations%anchor_factor)
            anchor([by_load_factor, other]) = anchor([other, by_load_factor])
         end associate
      end if
      call exchange_factors(problem%state, other)
   end subroutine exchange_with_first

   !> The same at an equilibrium state, with the forces.
   subroutine change_case(problem, case, error)
      type(equilibrium_t), intent(inout) :: problem
      integer, intent(in) :: case
      type(error_t), allocatable, intent(out) :: error
      if (case == case_of_steps(problem)) return
      call arrange_cases(problem, case)
      call problem%evaluate(.false., error)
      call problem%accept()
   end subroutine change_case
end module finshell_load_case
