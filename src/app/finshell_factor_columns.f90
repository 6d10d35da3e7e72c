!> Columns of the history after those of the monitors: factors of cases, and what is in the chambers.
module finshell_factor_columns
   use finshell_equilibrium, only: equilibrium_t
   use finshell_factor, only: factor_at
   use finshell_field, only: name_t
   use finshell_kinds, only: wp
   use finshell_state, only: state_t
   implicit none
   private
   public :: factor_names, factor_values

contains

   pure function factor_names(problem, cases) result(names)
      type(equilibrium_t), intent(in) :: problem
      type(name_t), intent(in) :: cases(:)
      type(name_t), allocatable :: names(:)
      integer :: c, i
      names = [(name_t('factor_'//cases(i)%text), i=1, size(cases))]
      do c = 1, problem%external%chambers%n
         associate (name => problem%external%chambers%fluid(c)%name)
            names = [names, name_t('pressure_'//name), name_t('volume_'//name), name_t('amount_'//name)]
         end associate
      end do
   end function factor_names

   function factor_values(problem, cases, state) result(values)
      type(equilibrium_t), intent(in) :: problem
      type(name_t), intent(in) :: cases(:)
      type(state_t), intent(in) :: state
      real(wp), allocatable :: values(:)
      integer :: i
      values = [(factor_at(state, problem%factor_of_case(1 + i)), i=1, size(cases))]
      associate (chambers => problem%external%chambers)
         if (chambers%n > 0) values = [values, reshape(transpose(reshape([chambers%pressures(state), &
            chambers%volumes(problem%structure, problem%equations, state), chambers%amounts(state)], [chambers%n, 3])), &
            [3*chambers%n])]
      end associate
   end function factor_values
end module finshell_factor_columns
