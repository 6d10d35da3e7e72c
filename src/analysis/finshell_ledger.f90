!> Keeps the account of an increment of a structure: what the energy balance (finshell_balance) begins and ends with.
module finshell_ledger
   use finshell_kinds, only: wp
   use finshell_state, only: state_t
   use finshell_equations, only: equations_t, motion_at
   use finshell_external, only: external_t, on_nothing, displacements_only, with_rotations
   use finshell_freedoms, only: n_nodal
   use finshell_factor, only: factor_at, unscaled
   use finshell_assembly, only: assembly_t
   use finshell_balance, only: balance_t, work_along
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: entry_t, motion_times, balance_between

   !> What is known of a state.
   type :: entry_t
      real(wp), allocatable :: unit_force(:, :, :) !< (n_nodal, nodes, factors) external force for factors of 1 (finshell_factor)
      real(wp), allocatable :: bulges(:, :, :) !< (n_nodal, nodes, factors) what loads that depend on rotations add to it
      real(wp) :: energy = 0 !< stored, also by what no factor scales
      real(wp) :: reaction = 0 !< of the moved supports, times their motion per factor
   end type entry_t

contains

   !> Forces on the moved components times their motion per factor.
   pure function motion_times(equations, state, active, force) result(product)
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      integer, intent(in) :: active !< factor that changes
      real(wp), intent(in) :: force(:, :) !< (n_nodal, nodes)
      real(wp) :: product
      integer :: i
      product = 0
      do i = 1, size(equations%moved)
         product = product + dot_product(motion_at(equations, i, active, state), force(:, equations%moved(i)))
      end do
   end function motion_times

   !> Balance between two states. Forces that depend on displacements only are of third degree in them at most: Simpson's rule over
   !> the chord is exact, but where a level of fluid passes over an element. `from` may be empty: the reference state.
   subroutine balance_between(from, to, base, state, active, loads, structure, equations, assembly, value)
      type(entry_t), intent(in) :: from, to
      type(state_t), intent(in) :: base, state
      integer, intent(in) :: active
      type(external_t), intent(in) :: loads
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(assembly_t), intent(in) :: assembly
      type(balance_t), intent(out) :: value
      type(state_t) :: middle
      real(wp), allocatable :: mean(:, :, :)
      real(wp), allocatable :: way(:), before(:), after(:)
      integer :: i

      allocate (mean(n_nodal, size(state%displacement, 2), loads%factors), source=0.0_wp)
      call loads%add(on_nothing, structure, equations, state, assembly, mean)
      if (loads%any_with(displacements_only)) then
         middle = state
         middle%displacement = 0.5_wp*(base%displacement + state%displacement)
         call loads%add(displacements_only, structure, equations, middle, assembly, mean)
         mean = 4*mean + to%unit_force
         if (allocated(from%unit_force)) then
            mean = (mean + from%unit_force)/6
         else
            mean = mean/5
         end if
      end if
      if (loads%any_with(with_rotations)) then
         mean = mean + 0.5_wp*to%bulges
         if (allocated(from%bulges)) mean = mean + 0.5_wp*from%bulges
      end if
      allocate (way(loads%factors), source=0.0_wp)
      do i = 1, loads%factors
         if (i == unscaled) cycle
         call work_along(base, state, mean(:, :, i), way(i), value%known)
         if (.not. value%known) return
      end do
      before = [(factor_at(base, i), i=1, loads%factors)]
      after = [(factor_at(state, i), i=1, loads%factors)]
      value%level = to%energy
      value%energy = to%energy - from%energy
      value%by_factor = 0.5_wp*(before + after)*way
      value%supports = 0.5_wp*(from%reaction + to%reaction)*(after(active) - before(active))
      value%work = sum(value%by_factor) + value%supports
      value%duality = way(active) - (to%reaction - from%reaction)
      value%least = sum(min(before*way, after*way)) + min(from%reaction, to%reaction)*(after(active) - before(active))
      value%throughput = max(abs(before(active)), abs(after(active)))*abs(way(active)) &
                         + max(abs(from%reaction), abs(to%reaction))*abs(after(active) - before(active))
   end subroutine balance_between
end module finshell_ledger
