!> Columns of the balance of energy (energy in &output), behind all others.
!>
!> In inputs with steps in time there are columns stored_energy, work and damped anyway; those of static steps are put there.
module finshell_energy_columns
   use finshell_field, only: motion_columns, name_t
   use finshell_kinds, only: wp
   use finshell_observer, only: record_t
   use finshell_step, only: is_in_time, leaves_state
   implicit none
   private
   public :: add_static_energy, energy_names, energy_values

contains

   !> Names of the columns.
   pure function energy_names(cases, in_time) result(names)
      type(name_t), intent(in) :: cases(:)
      logical, intent(in) :: in_time !< there are steps in time
      type(name_t), allocatable :: names(:)
      integer :: first, i
      first = merge(0, 3, in_time)
      allocate (names(first + 1 + size(cases) + 1))
      if (.not. in_time) then
         names(1)%text = 'stored_energy'
         names(2)%text = 'work'
         names(3)%text = 'damped'
      end if
      names(first + 1)%text = 'work_supports'
      do i = 1, size(cases)
         names(first + 1 + i)%text = 'work_'//cases(i)%text
      end do
      names(size(names))%text = 'energy_residual'
   end function energy_names

   !> Their values at an increment, and which are not known: those of linear solutions and modes, of increments after one whose work
   !> is not known, and parts of the work in explicit steps.
   pure subroutine energy_values(record, factors, in_time, values, missing)
      type(record_t), intent(in) :: record
      integer, intent(in) :: factors(:) !< of the cases (finshell_load_case)
      logical, intent(in) :: in_time
      real(wp), allocatable, intent(out) :: values(:)
      logical, allocatable, intent(out) :: missing(:)
      real(wp) :: parts(1 + size(factors)), residual
      logical :: known
      associate (account => record%account)
         known = account%begun .and. account%known .and. .not. leaves_state(record%control)
         parts = 0
         if (known) parts = [account%supports, account%work(factors)]
         residual = account%misfit()
         if (is_in_time(record%control)) residual = record%motion%misfit
         values = [parts, residual]
         missing = [spread(.not. known, 1, size(parts)), .not. (known .or. is_in_time(record%control))]
         if (in_time) return
         values = [account%stored, account%total(), account%damped, values]
         missing = [spread(.not. known, 1, 3), missing]
      end associate
   end subroutine energy_values

   !> Work and damping of a static increment where those of motion stand.
   pure subroutine add_static_energy(record, motion)
      type(record_t), intent(in) :: record
      real(wp), intent(inout) :: motion(:) !< values of motion_columns
      if (is_in_time(record%control) .or. .not. record%account%begun) return
      motion(findloc(motion_columns, 'work', dim=1)) = record%account%total()
      motion(findloc(motion_columns, 'damped', dim=1)) = record%account%damped
   end subroutine add_static_energy
end module finshell_energy_columns
