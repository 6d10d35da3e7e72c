!> Keeps the account of an increment of a structure: what the energy balance (finshell_balance) begins and ends with.
module finshell_ledger
   use finshell_kinds, only: wp
   use finshell_state, only: state_t
   use finshell_equations, only: equations_t
   use finshell_held_motion, only: motion_at, motion_of
   use finshell_external, only: external_t, on_nothing, displacements_only, with_rotations
   use finshell_freedoms, only: n_nodal
   use finshell_factor, only: factors_at, slopes, unscaled
   use finshell_assembly, only: assembly_t
   use finshell_balance, only: balance_t, work_along
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: entry_t, motion_times, motions_times, balance_between

   !> What is known of a state.
   type :: entry_t
      real(wp), allocatable :: unit_force(:, :, :) !< (n_nodal, nodes, factors) external force for factors of 1 (finshell_factor)
      real(wp), allocatable :: bulges(:, :, :) !< (n_nodal, nodes, factors) what loads that depend on rotations add to it
      real(wp) :: energy = 0 !< stored, also by what no factor scales
      real(wp), allocatable :: reaction(:) !< (factors) of the moved supports, times their motion per factor
      real(wp), allocatable :: grown(:) !< (factors) derivatives of the energy with respect to those that make something grow
   end type entry_t

contains

   !> Forces on the moved components, and on what depends on them, times their motion per factor.
   pure function motion_times(equations, state, active, force) result(product)
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      integer, intent(in) :: active !< factor that changes
      real(wp), intent(in) :: force(:, :) !< (n_nodal, nodes)
      real(wp) :: product
      real(wp), allocatable :: all(:, :)
      integer :: i
      product = 0
      if (size(equations%moved) == 0) return
      all = equations%links%folded(force)
      do i = 1, size(equations%moved)
         product = product + dot_product(motion_at(equations, i, active, state), all(:, equations%moved(i)))
      end do
   end function motion_times

   !> The same for each of the factors that move supports.
   pure function motions_times(equations, state, force) result(products)
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: force(:, :) !< (n_nodal, nodes)
      real(wp) :: products(size(equations%motion, 3))
      real(wp), allocatable :: all(:, :)
      integer :: i, k
      products = 0
      if (size(equations%moved) == 0) return
      all = equations%links%folded(force)
      do k = 1, size(products)
         do i = 1, size(equations%moved)
            if (.not. any(abs(equations%motion(:, i, k)) > 0)) cycle
            products(k) = products(k) + dot_product(motion_of(equations, i, k, state), all(:, equations%moved(i)))
         end do
      end do
   end function motions_times

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
      real(wp), allocatable :: mean(:, :, :), start(:, :, :)
      real(wp), allocatable :: way(:), before(:), after(:), first(:), last(:), change(:), share(:)
      integer :: i, many

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
         if (allocated(from%bulges)) then
            mean = mean + 0.5_wp*from%bulges
         else
            allocate (start(n_nodal, size(mean, 2), loads%factors), source=0.0_wp)
            call loads%add(with_rotations, structure, equations, base, assembly, start)
            mean = mean + 0.5_wp*start
         end if
      end if
      many = max(loads%factors, size(equations%motion, 3))
      allocate (way(many), first(many), last(many), source=0.0_wp)
      do i = 1, loads%factors
         if (i == unscaled) cycle
         call work_along(base, state, mean(:, :, i), way(i), value%known)
         if (.not. value%known) return
      end do
      if (allocated(from%reaction)) first(:size(from%reaction)) = from%reaction
      if (allocated(to%reaction)) last(:size(to%reaction)) = to%reaction
      before = factors_at(base, many)
      after = factors_at(state, many)
      change = after - before
      value%by_factor = 0.5_wp*(before + after)*way
      value%supports = dot_product(0.5_wp*(first + last), change)
      if (allocated(from%grown) .and. allocated(to%grown)) then
         associate (n => size(to%grown))
            value%by_factor(:n) = value%by_factor(:n) + 0.5_wp*(from%grown + to%grown)*change(:n)
            first(:n) = first(:n) + from%grown
            last(:n) = last(:n) + to%grown
         end associate
      end if
      ! what follows the factor that changes counts with the slope of its chord
      share = slopes(state, active, many)
      if (abs(change(active)) > 0) then
         do i = 1, many
            if (i /= active .and. abs(share(i)) > 0) share(i) = change(i)/change(active)
         end do
      end if
      associate (one => loads%chambers%before + 1, all => loads%chambers%before + loads%chambers%n)
         if (all >= one) then
            value%pressure = change(one:all)
            value%volume = way(one:all)
            value%throughput = sum(max(abs(before(one:all)), abs(after(one:all)))*abs(way(one:all)))
         end if
      end associate
      value%level = to%energy
      value%energy = to%energy - from%energy
      value%work = sum(value%by_factor) + value%supports
      value%duality = dot_product(share, way - (last - first))
      value%least = sum(min(before*way, after*way)) + sum(min(first, last)*change)
      value%throughput = value%throughput + sum(max(abs(before), abs(after))*abs(way) + max(abs(first), abs(last))*abs(change), &
                                                mask=abs(share) > 0)
   end subroutine balance_between
end module finshell_ledger
