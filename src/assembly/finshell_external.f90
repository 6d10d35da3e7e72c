!> External forces of a structure: a list of loads, the dead ones first.
!>
!> `new_external` is the table of kinds: what the input states becomes items of the list.
module finshell_external
   use finshell_kinds, only: wp, i4
   use finshell_freedoms, only: n_nodal, rx, rz
   use finshell_acting_load, only: load_item_t, append, on_nothing, displacements_only, with_rotations
   use finshell_assembly, only: assembly_t
   use finshell_centrifugal, only: add_centrifugal
   use finshell_cliques, only: cliques_t, joined
   use finshell_connectors, only: add_connectors, expand_blocks, find_places, join_cliques, lead, tauten_lines
   use finshell_dashpots, only: dashpots_t, new_dashpots
   use finshell_dead_load, only: dead_load_t, new_dead_load, add_nodal, add_area
   use finshell_edge_load, only: add_edge_load
   use finshell_equations, only: equations_t
   use finshell_error, only: error_t, raise
   use finshell_factor, only: by_load_factor, by_constant_factor, by_release, unscaled, number_of_factors
   use finshell_chambers, only: chambers_t, new_chambers
   use finshell_follower_load, only: add_pressure_load, pressed_region_t
   use finshell_foundation, only: add_foundation
   use finshell_hydrostatic, only: add_hydrostatic
   use finshell_load, only: load_t, load_nodal, load_edge, load_traction, load_gravity, load_pressure
   use finshell_point_masses, only: mass_blocks_t, new_mass_blocks, pull_masses, spin_masses
   use finshell_sparsity, only: sparsity_t
   use finshell_state, only: state_t, move_state
   use finshell_status, only: status_invalid_argument
   use finshell_structure, only: structure_t
   use finshell_team, only: leads, shared, team_t
   use finshell_turning_nodes, only: find_turning
   implicit none
   private
   public :: external_t, new_external
   public :: on_nothing, displacements_only, with_rotations

   type :: external_t
      integer :: factors = by_constant_factor !< that scale loads (finshell_factor)
      type(load_item_t), allocatable :: list(:)
      type(load_item_t), allocatable :: own(:) !< the same through the elements of this member of a team; unallocated: no team
      type(pressed_region_t), allocatable :: pressures(:) !< where uniform pressures act
      type(chambers_t) :: chambers !< of gas and liquid
      !> Nodes with dead moments that are free to turn about two axes or more, and an element and its corner at each: such a
      !> moment is not conservative and has an unsymmetric stiffness.
      integer, allocatable :: turning_nodes(:), turning_elements(:), turning_corners(:)
      logical :: symmetric = .true. !< all load stiffnesses are symmetric
      logical :: has_constants = .false.
      type(dashpots_t) :: dashpots !< of steps in time
      type(mass_blocks_t) :: masses !< beside those of elements
   contains
      procedure :: keep_own
      procedure :: let_go
      procedure :: cliques
      procedure :: locate
      procedure :: refresh
      procedure :: exchange
      procedure :: any_with
      procedure :: add
      procedure :: add_forces
      procedure :: stands
      procedure :: tauten
      procedure :: place
      procedure :: evaluate
      procedure :: add_change
      procedure :: standing_energy
   end type external_t

contains

   !> Sum up the loads of a structure. Errors: unknown set, no density, unknown kind.
   subroutine new_external(self, structure, equations, error, step)
      type(external_t), intent(out) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(error_t), allocatable, intent(out) :: error
      integer, intent(in), optional :: step !< whose loads these are; without it: of all
      type(load_t), allocatable :: loads(:)
      logical, allocatable :: there(:)
      type(load_item_t), allocatable :: acting(:)
      type(dead_load_t), allocatable :: dead(:)
      integer :: i, pressures

      allocate (loads(0), acting(0))
      if (allocated(structure%loads)) loads = structure%loads
      allocate (there(size(loads)), source=.true.)
      if (present(step)) there = loads%span%covers(step)
      self%factors = number_of_factors(structure%cases)
      allocate (dead(self%factors))
      do i = 1, self%factors
         call new_dead_load(dead(i), size(structure%mesh%coordinates, 2), i)
      end do
      allocate (self%pressures(count(loads%kind == load_pressure .and. there)))
      pressures = 0
      do i = 1, size(loads)
         if (.not. there(i)) cycle
         associate (load => loads(i))
            select case (load%kind)
            case (load_nodal); call add_nodal(load, structure, dead(load%scaling), error)
            case (load_edge, 'line_moment', 'follower_line')
               call add_edge_load(load, structure, equations, dead(load%scaling), acting, error)
            case (load_traction, load_gravity)
               call add_area(load, structure, dead(load%scaling), error)
               if (load%kind == load_gravity .and. load%set == 'all') call pull_masses(load, structure, dead(load%scaling)%nodal)
            case (load_pressure)
               pressures = pressures + 1
               call add_pressure_load(load, structure, equations, acting, self%pressures(pressures), error)
            case ('hydrostatic'); call add_hydrostatic(load, structure, equations, acting, error)
            case ('foundation'); call add_foundation(load, structure, acting, error)
            case ('centrifugal')
               if (load%set == 'all') call spin_masses(load, structure, equations, acting)
               call add_centrifugal(load, structure, acting, error)
            case default
               call raise(error, status_invalid_argument, "load: unknown kind '"//trim(load%kind)//"'")
            end select
         end associate
         if (allocated(error)) return
      end do
      call new_chambers(self%chambers, structure, equations, acting, error)
      if (allocated(error)) return
      call add_connectors(structure, equations, acting)
      call new_dashpots(self%dashpots, structure, equations)
      call new_mass_blocks(self%masses, structure, equations)
      self%has_constants = any(loads%scaling == by_constant_factor .and. there)
      if (self%chambers%n > 0) self%has_constants = self%has_constants .or. any(self%chambers%fluid%scaling == by_constant_factor)
      call list_all(self, dead, acting)
      call find_turning(structure%mesh, equations, dead, self%turning_nodes, self%turning_elements, self%turning_corners)
      self%symmetric = size(self%turning_nodes) == 0
      do i = 1, size(self%list)
         self%symmetric = self%symmetric .and. self%list(i)%load%symmetric
         self%factors = max(self%factors, self%list(i)%load%scaling)
      end do
   end subroutine new_external

   !> Equations that meet beside those of elements.
   function cliques(self)
      class(external_t), intent(in) :: self
      type(cliques_t) :: cliques
      cliques%first = [1_i4]
      allocate (cliques%equation(0))
      if (.not. self%masses%in_matrix) return ! another member of the team has them
      call join_cliques(self%list, cliques)
      cliques = joined(joined(cliques, self%dashpots%blocks%equations), self%masses%blocks%equations)
   end function cliques

   !> Find what has cliques in the matrix.
   subroutine locate(self, pattern)
      class(external_t), intent(inout) :: self
      type(sparsity_t), intent(in) :: pattern
      if (.not. self%masses%in_matrix) return
      call find_places(self%list, pattern)
      if (allocated(self%own)) call find_places(self%own, pattern)
      call self%dashpots%blocks%find_places(pattern)
      call self%masses%blocks%find_places(pattern)
   end subroutine locate

   !> Tell what has cliques that nodes depend on others in another way (finshell_links).
   subroutine refresh(self, equations)
      class(external_t), intent(inout) :: self
      type(equations_t), intent(in) :: equations
      call expand_blocks(self%list, equations)
      call self%dashpots%blocks%expand(equations)
      call self%masses%blocks%expand(equations)
   end subroutine refresh

   !> Let a member of a team act through its own elements only; what is no element is in the matrix of the one that leads.
   subroutine keep_own(self, own, elements, team)
      class(external_t), intent(inout) :: self
      integer, intent(in) :: own(:), elements !< element numbers; how many there are in all
      class(team_t), pointer, intent(in) :: team
      logical, allocatable :: mine(:)
      integer :: i
      if (.not. shared(team)) return
      allocate (mine(elements), source=.false.)
      mine(own) = .true.
      call lead(self%list, leads(team))
      self%dashpots%in_matrix = leads(team)
      self%masses%in_matrix = leads(team)
      self%own = self%list
      do i = 1, size(self%own)
         call self%own(i)%load%keep(mine(self%list(i)%load%elements))
      end do
   end subroutine keep_own

   !> Add nodal forces that are to be let go. (Where their moments act at nodes that turn, the tangent leaves out the little
   !> that these are not conservative.)
   subroutine let_go(self, nodal)
      class(external_t), intent(inout) :: self
      real(wp), intent(in) :: nodal(:, :) !< (n_nodal, nodes) for a factor of 1
      type(dead_load_t) :: dead
      call new_dead_load(dead, size(nodal, 2), by_release)
      dead%nodal = nodal
      dead%has_energy = .not. any(abs(nodal(rx:rz, :)) > 0)
      call put_release(self%list, dead)
      if (allocated(self%own)) call put_release(self%own, dead)
      self%factors = max(self%factors, by_release)
   end subroutine let_go

   !> Behind the others, or in the place of an earlier one: a state that is gone back to may let go what is there already.
   subroutine put_release(list, dead)
      type(load_item_t), allocatable, intent(inout) :: list(:)
      type(dead_load_t), intent(in) :: dead
      integer :: i
      do i = 1, size(list)
         if (list(i)%load%scaling /= by_release) cycle
         deallocate (list(i)%load)
         allocate (list(i)%load, source=dead)
         return
      end do
      call append(list, dead)
   end subroutine put_release

   !> Let the loads that follow the load factor and those of another factor change places.
   subroutine exchange(self, other)
      class(external_t), intent(inout) :: self
      integer, intent(in) :: other !< finshell_factor
      integer :: i
      do i = 1, size(self%list)
         self%list(i)%load%scaling = exchanged(self%list(i)%load%scaling, other)
      end do
      if (allocated(self%own)) then
         do i = 1, size(self%own)
            self%own(i)%load%scaling = exchanged(self%own(i)%load%scaling, other)
         end do
      end if
      self%pressures%scaling = exchanged(self%pressures%scaling, other)
      if (self%chambers%n > 0) self%chambers%fluid%scaling = exchanged(self%chambers%fluid%scaling, other)
   end subroutine exchange

   elemental integer function exchanged(scaling, other)
      integer, intent(in) :: scaling, other
      exchanged = scaling
      if (scaling == by_load_factor) exchanged = other
      if (scaling == other) exchanged = by_load_factor
   end function exchanged

   !> Dead loads, where there are any, then the others.
   subroutine list_all(self, dead, acting)
      type(external_t), intent(inout) :: self
      type(dead_load_t), intent(in) :: dead(:)
      type(load_item_t), intent(in) :: acting(:)
      integer :: i
      allocate (self%list(0))
      do i = 1, size(dead)
         if (any(abs(dead(i)%nodal) > 0)) call append(self%list, dead(i))
      end do
      do i = 1, size(acting)
         call append(self%list, acting(i)%load)
      end do
   end subroutine list_all

   !> Are there loads that depend on nothing, on displacements only, or with rotations?
   pure logical function any_with(self, rows)
      class(external_t), intent(in) :: self
      integer, intent(in) :: rows !< on_nothing, displacements_only or with_rotations
      integer :: i
      any_with = .false.
      do i = 1, size(self%list)
         any_with = any_with .or. self%list(i)%load%rows == rows
      end do
   end function any_with

   !> Add the forces of the loads of the list, for factors of 1; with values, take their stiffness at the present factors from the
   !> matrix.
   subroutine add(self, rows, structure, equations, state, assembly, unit_force, values)
      class(external_t), intent(in) :: self
      integer, intent(in) :: rows !< on_nothing, displacements_only or with_rotations
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      type(assembly_t), intent(in) :: assembly
      real(wp), intent(inout) :: unit_force(:, :, :) !< (n_nodal, nodes, factors)
      real(wp), intent(inout), optional :: values(:)
      if (allocated(self%own)) then
         call add_of(self%own)
      else
         call add_of(self%list)
      end if

   contains

      subroutine add_of(list)
         type(load_item_t), intent(in) :: list(:)
         integer :: i
         do i = 1, size(list)
            if (list(i)%load%rows == rows) call list(i)%load%add(structure, equations, state, assembly, unit_force, values)
         end do
      end subroutine add_of
   end subroutine add

   !> Add the forces of loads at the present factors: what `evaluate` is to a step in time. Either of those that no factor scales,
   !> which belong to the structure (`standing`), or of the others.
   subroutine add_forces(self, structure, equations, state, assembly, standing, total)
      class(external_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      type(assembly_t), intent(in) :: assembly
      logical, intent(in) :: standing
      real(wp), intent(inout), contiguous :: total(:, :) !< (n_nodal, nodes)
      integer :: i
      do i = 1, size(self%list)
         if ((self%list(i)%load%scaling == unscaled) .neqv. standing) cycle
         if (allocated(self%own)) then
            call self%own(i)%load%add_force(structure, equations, state, assembly, total)
         else
            call self%list(i)%load%add_force(structure, equations, state, assembly, total)
         end if
      end do
   end subroutine add_forces

   !> Does the structure have what no factor scales?
   pure logical function stands(self)
      class(external_t), intent(in) :: self
      integer :: i
      stands = any([(self%list(i)%load%scaling == unscaled, i=1, size(self%list))])
   end function stands

   !> Take lines that act in tension only as taut, or as they are.
   subroutine tauten(self, taut)
      class(external_t), intent(inout) :: self
      logical, intent(in) :: taut
      call tauten_lines(self%list, taut)
      if (allocated(self%own)) call tauten_lines(self%own, taut)
   end subroutine tauten

   !> Find the elements of all loads in the assembly, once for many calls of `add_forces`.
   subroutine place(self, assembly)
      class(external_t), intent(inout) :: self
      type(assembly_t), intent(in) :: assembly
      integer :: i
      do i = 1, size(self%list)
         if (allocated(self%own)) then
            call self%own(i)%load%place(assembly)
         else
            call self%list(i)%load%place(assembly)
         end if
      end do
   end subroutine place

   !> The forces of all loads for factors of 1; with values, their stiffness at the present factors is taken from the matrix.
   subroutine evaluate(self, structure, equations, state, assembly, unit_force, bulges, values)
      class(external_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      type(assembly_t), intent(in) :: assembly
      !> (n_nodal, nodes, factors) of those that do not depend on rotations, and of those that do
      real(wp), intent(out), allocatable :: unit_force(:, :, :), bulges(:, :, :)
      real(wp), intent(inout), optional :: values(:)
      allocate (unit_force(n_nodal, size(equations%number, 2), self%factors), source=0.0_wp)
      bulges = unit_force
      call self%add(on_nothing, structure, equations, state, assembly, unit_force)
      call self%add(displacements_only, structure, equations, state, assembly, unit_force, values)
      call self%add(with_rotations, structure, equations, state, assembly, bulges, values)
   end subroutine evaluate

   !> Add the change of all forces with a motion of the nodes, at the present factors.
   subroutine add_change(self, structure, equations, state, motion, change)
      class(external_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: motion(:, :) !< (n_nodal, nodes) displacements and spins
      real(wp), intent(inout) :: change(:, :) !< (n_nodal, nodes)
      integer :: i
      do i = 1, size(self%list)
         call self%list(i)%load%add_change(structure, equations, state, motion, change)
      end do
   end subroutine add_change

   !> Energy stored by what no factor scales: it belongs to the structure. With a motion, its change to second order.
   function standing_energy(self, structure, equations, state, motion) result(energy)
      class(external_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(in), optional :: motion(:, :) !< (n_nodal, nodes)
      real(wp) :: energy
      type(state_t) :: moved
      integer :: i
      energy = 0
      if (.not. self%stands()) return
      moved = state
      if (present(motion)) call move_state(moved, motion)
      do i = 1, size(self%list)
         if (self%list(i)%load%scaling /= unscaled) cycle
         energy = energy + self%list(i)%load%energy(structure, equations, moved)
         if (present(motion)) energy = energy - self%list(i)%load%energy(structure, equations, state)
      end do
   end function standing_energy
end module finshell_external
