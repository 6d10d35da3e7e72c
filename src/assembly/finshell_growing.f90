!> What growth does to forces and to the stored energy when its factor changes: differences over a small change of the factor with
!> the nodes where they are.
!>
!> Central differences over a strain of 3e-5 to either side: first derivatives to 1e-9 of the largest, second ones to 1e-7.
module finshell_growing
   use finshell_discretisation, only: evaluate_gathered, freedoms, gather_elements, gathered_t
   use finshell_factor, only: factors_at
   use finshell_freedoms, only: n_corners, n_nodal, rx, rz, ux, uz
   use finshell_stress_free, only: largest_rate
   use finshell_kinds, only: wp, i4
   use finshell_state, only: linear_change_t, moved_state, new_state, state_t
   use finshell_status, only: status_ok
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: growth_rate_t, growth_along, growth_powers, growth_levels, part_of_growth, grown_by, changed_state

   !> Derivatives with respect to a factor, and to what follows it.
   type :: growth_rate_t
      real(wp), allocatable :: force(:, :) !< (n_nodal, nodes) of the internal forces
      real(wp) :: power = 0, stiffness = 0 !< of the stored energy: first and second
   end type growth_rate_t

   real(wp), parameter :: small_strain = 3.0e-5_wp
   real(wp), parameter :: small_power = 0.03_wp !< of it, for first derivatives of the energy alone
   integer, parameter :: at_once = 8192 !< elements gathered

contains

   !> A state whose growth goes by other factors.
   pure function grown_by(state, change) result(grown)
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: change(:) !< (factors)
      type(state_t) :: grown
      grown = state
      if (.not. allocated(grown%growing)) grown%growing = factors_at(state, size(change))
      grown%growing = grown%growing + change
   end function grown_by

   !> A state moved by a part of a linear change, with what grows.
   pure function changed_state(state, change, part) result(changed)
      type(state_t), intent(in) :: state
      type(linear_change_t), intent(in) :: change
      real(wp), intent(in) :: part
      type(state_t) :: changed
      changed = moved_state(state, change%motion, part)
      if (allocated(change%growing)) changed = grown_by(changed, part*change%growing)
   end function changed_state

   !> Part of a change of the factors that differences are taken over; 0: it makes nothing grow.
   pure real(wp) function part_of_growth(structure, state, way) result(part)
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: way(:) !< (factors)
      real(wp) :: rate
      part = 0
      if (.not. allocated(structure%growths)) return
      rate = largest_rate(structure%growths, state, way)
      if (rate > 0) part = small_strain/rate
   end function part_of_growth

   !> Derivatives along a change of the factors. Forces are added up if there is room for them.
   subroutine growth_along(structure, held, state, way, rates)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: held(:, :) !< see finshell_held_side
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: way(:) !< (factors)
      type(growth_rate_t), intent(inout) :: rates
      real(wp) :: part
      rates%power = 0
      rates%stiffness = 0
      if (allocated(rates%force)) rates%force = 0
      part = part_of_growth(structure, state, way)
      if (part > 0) call differences(structure, held, state, way, part, rates)
   end subroutine growth_along

   !> (factors) Derivatives of the stored energy with respect to each factor.
   function growth_powers(structure, held, state, factors) result(powers)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: held(:, :)
      type(state_t), intent(in) :: state
      integer, intent(in) :: factors
      real(wp) :: powers(factors)
      type(growth_rate_t) :: rates
      real(wp) :: part, way(factors)
      integer :: i, k
      do k = 1, factors
         way = [(merge(1.0_wp, 0.0_wp, i == k), i=1, factors)]
         part = small_power*part_of_growth(structure, state, way)
         powers(k) = 0
         if (.not. part > 0) cycle
         call differences(structure, held, state, way, part, rates)
         powers(k) = rates%power
      end do
   end function growth_powers

   !> Forces and moments that growth asks for at the present factors, by their derivatives in the reference state: what loads are
   !> where there are none. Where growth bends, the moments decide: the sheet itself gives way to the forces.
   function growth_levels(structure, held, state, factors, detail) result(levels)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: held(:, :)
      type(state_t), intent(in) :: state
      integer, intent(in) :: factors
      real(wp), intent(in) :: detail !< length of an element
      real(wp) :: levels(2)
      real(wp), parameter :: rounding = 1.0e-7_wp
      type(growth_rate_t) :: rates
      type(state_t) :: reference
      levels = 0
      if (.not. allocated(structure%growths)) return
      call new_state(reference, size(state%displacement, 2), size(state%case_factor))
      reference%stage = state%stage
      reference%exchanged = state%exchanged
      allocate (rates%force(n_nodal, size(state%displacement, 2)))
      call growth_along(structure, held, reference, factors_at(state, factors), rates)
      levels = [norm2(rates%force(ux:uz, :)), norm2(rates%force(rx:rz, :))]
      if (levels(2) > rounding*levels(1)*detail) levels(1) = min(levels(1), levels(2)/detail)
   end function growth_levels

   !> Central differences along a way in the space of the factors.
   subroutine differences(structure, held, state, way, part, rates)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: held(:, :)
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: way(:) !< (factors)
      real(wp), intent(in) :: part !< of it
      type(growth_rate_t), intent(inout) :: rates !< with force if that is allocated
      type(gathered_t) :: g
      type(state_t) :: before, after
      real(wp), allocatable :: energy(:, :), force(:, :, :), change(:)
      integer(i4), allocatable :: status(:, :)
      integer, allocatable :: list(:), mine(:)
      integer :: first, i, j, m, s
      before = grown_by(state, -part*way)
      after = grown_by(state, part*way)
      rates%power = 0
      rates%stiffness = 0
      do s = 1, size(structure%sections)
         list = pack(structure%growths%elements, structure%element_section(structure%growths%elements) == s)
         m = freedoms(structure%sections(s))
         do first = 1, size(list), at_once
            mine = list(first:min(size(list), first + at_once - 1))
            allocate (energy(size(mine), 3), status(size(mine), 3))
            if (allocated(rates%force)) allocate (force(m, size(mine), 3)) ! else it counts as absent below
            call one_side(state, 1)
            call one_side(before, 2)
            call one_side(after, 3)
            do i = 1, size(mine)
               if (any(status(i, :) /= status_ok)) cycle
               rates%power = rates%power + (energy(i, 3) - energy(i, 2))/(2*part)
               rates%stiffness = rates%stiffness + ((energy(i, 3) - energy(i, 1)) - (energy(i, 1) - energy(i, 2)))/part**2
               if (.not. allocated(force)) cycle
               change = (force(:, i, 3) - force(:, i, 2))/(2*part)
               do j = 1, n_corners
                  associate (node => structure%mesh%triangles(j, mine(i)))
                     rates%force(:m/3, node) = rates%force(:m/3, node) + change(m/3*(j - 1) + 1:m/3*j)
                  end associate
               end do
            end do
            deallocate (energy, status)
            if (allocated(force)) deallocate (force)
         end do
      end do

   contains

      subroutine one_side(at, side)
         type(state_t), intent(in) :: at
         integer, intent(in) :: side
         call gather_elements(structure, at, mine, g, held)
         if (allocated(force)) then
            call evaluate_gathered(structure%sections(s), g, status(:, side), energy=energy(:, side), force=force(:, :, side))
         else
            call evaluate_gathered(structure%sections(s), g, status(:, side), energy=energy(:, side))
         end if
      end subroutine one_side
   end subroutine differences
end module finshell_growing
