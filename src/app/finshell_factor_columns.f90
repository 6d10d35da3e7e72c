!> Columns of the history after those of the monitors: factors of cases, and what is in the chambers.
module finshell_factor_columns
   use finshell_equilibrium, only: equilibrium_t
   use finshell_factor, only: factor_at
   use finshell_field, only: name_t
   use finshell_kinds, only: wp
   use finshell_state, only: linear_change_t, moved_state, small_part, state_t
   implicit none
   private
   public :: factor_names, add_factors

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

   !> Append the values; a mode has nothing in its chambers.
   subroutine add_factors(problem, cases, state, values, missing, change)
      type(equilibrium_t), intent(in) :: problem
      type(name_t), intent(in) :: cases(:)
      type(state_t), intent(in) :: state
      real(wp), allocatable, intent(inout) :: values(:)
      logical, allocatable, intent(inout) :: missing(:)
      type(linear_change_t), intent(in), optional :: change !< what is reported, instead of the state
      real(wp), allocatable :: volumes(:), table(:, :)
      real(wp) :: part
      logical :: mode
      integer :: i
      values = [values, (factor_at(state, problem%factor_of_case(1 + i)), i=1, size(cases))]
      missing = [missing, spread(.false., 1, size(cases))]
      associate (chambers => problem%external%chambers, structure => problem%structure, equations => problem%equations)
         if (chambers%n == 0) return
         mode = .false.
         if (present(change)) mode = change%alone
         volumes = chambers%volumes(structure, equations, state)
         if (present(change) .and. .not. mode) then
            part = small_part(change%motion, problem%detail)
            volumes = chambers%volumes(structure, equations, problem%state) &
                      + (chambers%volumes(structure, equations, moved_state(problem%state, change%motion, part)) &
                         - chambers%volumes(structure, equations, moved_state(problem%state, change%motion, -part)))/(2*part)
         end if
         allocate (table(3, chambers%n))
         table(1, :) = chambers%pressures(state)
         table(2, :) = volumes
         table(3, :) = chambers%amounts(state)
         if (mode) table = 0
         values = [values, reshape(table, [size(table)])]
         missing = [missing, spread(mode, 1, size(table))]
      end associate
   end subroutine add_factors
end module finshell_factor_columns
