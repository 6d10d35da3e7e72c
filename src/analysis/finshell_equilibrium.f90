!> Equilibrium of a structure as a problem for path following: internal forces against loads, under the supports.
!>
!> Unknowns are displacements and spins in the axes of the nodes. The elements give the Hessian along exp(spin) R, symmetric; the
!> derivative of the moments with respect to spins, K - spin(m)/2, differs from it where the internal moments m of a node have
!> a sum: at nodes with dead moments. The matrix is symmetric for dead forces, closed pressures, and moments at nodes that
!> turn about one axis only; else it is unsymmetric and exact.
module finshell_equilibrium
   use finshell_kinds, only: wp
   use finshell_freedoms, only: n_nodal, ux, uz
   use finshell_status, only: status_ok, status_not_a_number, status_not_converged, status_singular_matrix, &
      status_invalid_argument, status_input_error
   use finshell_error, only: error_t, raise
   use finshell_mesh, only: elements_at
   use finshell_moving_structure, only: moving_structure_t
   use finshell_motion_size, only: size_of_motion
   use finshell_structure, only: structure_t, is_membrane, turning_nodes
   use finshell_cliques, only: cliques_t, joined
   use finshell_equations, only: field_displacement, gather, new_equations, unknowns_of
   use finshell_external, only: new_external
   use finshell_stress_free, only: largest_rate
   use finshell_factor, only: by_case, by_load_factor, factors_at, unscaled, number_of_factors, scaled_sum, slopes
   use finshell_sparsity, only: sparsity_t, new_sparsity
   use finshell_assembly, only: new_assembly, assemble
   use finshell_linear_solver, only: linear_solver_t
   use finshell_symmetric_part, only: symmetric_part_t
   use finshell_joint_stiffness, only: add_joint_stiffness, link_nodes, place_links
   use finshell_linked_elements, only: linked_elements_t
   use finshell_tangent_factors, only: tangent_factors_t
   use finshell_load_terms, only: add_turning, add_motion, add_rate, moving_nodes
   use finshell_linked_parts, only: check_held, name_mode
   use finshell_levels, only: force_levels
   use finshell_balance, only: balance_t
   use finshell_ledger, only: entry_t, motion_times, motions_times, balance_between
   use finshell_host, only: host_t
   use finshell_inertia, only: inertia_t
   use finshell_fictitious_mass, only: fictitious_mass
   use finshell_ground, only: add_ground
   use finshell_growing, only: growth_along, growth_levels, growth_powers, growth_rate_t
   use finshell_element_limit, only: element_trouble
   use finshell_team, only: leads, own_elements, shared, team_t
   implicit none
   private
   public :: equilibrium_t, new_equilibrium

   type, extends(moving_structure_t) :: equilibrium_t
      type(linear_solver_t) :: solver
      type(symmetric_part_t) :: half !< of an unsymmetric matrix, for descents
      type(tangent_factors_t), private :: factors !< what was factorised last
      real(wp), allocatable :: internal_force(:, :) !< (n_nodal, nodes) at the last evaluation; global axes
      real(wp), allocatable :: external_force(:, :) !< (n_nodal, nodes); reactions are internal minus external force
      type(entry_t) :: entry, base_entry !< at the last evaluation; at the last accepted state
      real(wp), allocatable :: bulge_force(:, :) !< (n_nodal, nodes) part of external_force that depends on rotations, too
      logical :: may_float = .false. !< rigid motions may be free; to be set before `new_equilibrium`
      integer :: stage = 1 !< the step whose loads and supports these are (finshell_stage), likewise
      type(host_t), allocatable :: host !< forces and displacements from outside; to be set before `new_equilibrium`
      real(wp), allocatable :: released(:, :) !< (n_nodal, nodes) forces that are let go before it; unallocated: none
      integer :: assemblies = 0, force_evaluations = 0
      integer, allocatable :: factor_of_case(:) !< finshell_factor; the first is that without a name (finshell_load_case)
      type(inertia_t), allocatable :: inertia !< of steps in time
      type(inertia_t), allocatable :: kept_inertia !< of one that was left under way, to go on with from this very state
      class(team_t), pointer :: team => null() !< processes that share the work
      integer, allocatable :: own_elements(:) !< of this process
      real(wp), allocatable :: values(:) !< of the matrix, left by `evaluate`
      type(cliques_t) :: cliques !< of the pattern, beside those of the elements
      real(wp), allocatable, private :: ground(:) !< values of the stand-in of a soft structure, once it was needed
      integer, allocatable, private :: moved_elements(:) !< elements at moved nodes
      integer, allocatable, private :: diagonal(:) !< (n) where it stands among the values
      type(growth_rate_t) :: growth !< left by `evaluate` with tangent; its force is unallocated where nothing grows
   contains
      procedure :: evaluate
      procedure :: evaluate_toward
      procedure :: diagonal_places
      procedure :: take_host
      procedure :: factorise
      procedure :: solve
      procedure :: balance
      procedure :: keep_base
      procedure :: magnitude
      procedure :: fictitious_masses
   end type equilibrium_t

   !> Of the factorisation: a law without stiffness leaves more than the rounding of the matrix, up to 4 epsilons measured.
   real(wp), parameter :: soft_tolerance = 50*epsilon(1.0_wp)
   !> Part of the energy of growth, with everything held, that differences leave of the balance of a sheet that grows freely.
   real(wp), parameter :: negligible_growth = 1.0e-7_wp

contains

   !> Number the unknowns, sum up the loads, find the pattern of the matrix; the state is the unloaded one. Options of the solver
   !> are to be set before. Errors: what is wrong with supports or loads; a free rigid-body motion, named.
   subroutine new_equilibrium(self, structure, error, team)
      type(equilibrium_t), intent(inout) :: self
      type(structure_t), intent(in), target :: structure !< is referred to, not copied
      type(error_t), allocatable, intent(out) :: error
      class(team_t), pointer, intent(in), optional :: team !< each member calls with the same structure
      type(sparsity_t) :: pattern
      type(linked_elements_t) :: linked
      integer, allocatable :: linked_elements(:)
      integer :: nodes, i
      self%structure => structure
      nodes = size(structure%mesh%coordinates, 2)
      if (.not. allocated(structure%supports)) then
         call raise(error, status_input_error, 'the structure has no supports')
         return
      end if
      call new_equations(self%equations, structure%mesh, structure%supports, error, turning_nodes(structure), &
                         number_of_factors(structure%cases), self%stage, structure%joints)
      if (allocated(error)) return
      if (present(team)) self%team => team
      if (shared(self%team) .and. self%equations%links%any()) call raise(error, status_invalid_argument, 'joints (&tie, &equal, ' &
         //'&equation, &rigid_body) run on one process only: take finshell instead of finshell_mpi')
      if (allocated(error)) return
      call own_elements(self%team, structure%mesh%triangles, nodes, self%own_elements)
      call new_external(self%external, structure, self%equations, error, self%stage)
      if (allocated(error)) return
      call self%external%keep_own(self%own_elements, size(structure%mesh%triangles, 2), self%team)
      if (allocated(self%host)) call self%host%join(structure, self%equations, self%external, error)
      if (allocated(error)) return
      if (.not. self%may_float) call check_held(structure, self%equations, self%external, error)
      if (allocated(error)) return
      call link_nodes(linked, linked_elements, structure%mesh, self%equations)
      self%cliques = joined(self%external%cliques(), linked%blocks%equations)
      call new_sparsity(pattern, structure%mesh%triangles(:, self%own_elements), self%equations%number, self%external%symmetric, &
         error, self%team, self%cliques)
      if (allocated(error)) return
      call self%external%locate(pattern)
      call new_assembly(self%assembly, pattern, structure%mesh%triangles, structure%element_section, self%equations%number, &
         error, self%equations%frame, self%equations%frames, self%equations%held, &
         is_membrane(structure, self%own_elements), self%own_elements)
      if (allocated(error)) return
      call place_links(self%assembly, linked, linked_elements, pattern)
      call self%half%take(pattern)
      self%half%solver%options = self%solver%options
      self%diagonal = pattern%diagonal_places()
      ! the pattern is given away: a copy would be half as large as the matrix
      call self%solver%analyse(sparsity_t(team=pattern%team), error)
      if (allocated(error)) return
      call pattern%hand_over(self%solver%pattern)
      call self%begin_unloaded(self%stage)
      if (self%soft) self%solver%singular_tolerance = soft_tolerance
      if (allocated(self%residual)) &
         deallocate (self%residual, self%rate, self%values, self%internal_force, self%external_force)
      if (allocated(self%ground)) deallocate (self%ground)
      if (allocated(self%compliance)) deallocate (self%compliance, self%inflow, self%gradient)
      self%entry = entry_t()
      allocate (self%residual(self%n), self%rate(self%n), source=0.0_wp)
      allocate (self%values(self%solver%pattern%entries())) ! left to `evaluate`, which begins with zeros
      allocate (self%internal_force(n_nodal, nodes), self%external_force(n_nodal, nodes), source=0.0_wp)
      if (allocated(self%growth%force)) deallocate (self%growth%force)
      if (allocated(structure%growths)) allocate (self%growth%force(n_nodal, nodes), source=0.0_wp)
      self%moved_elements = elements_at(structure%mesh, moving_nodes(self%equations))
      self%entry%energy = self%external%standing_energy(structure, self%equations, self%state) ! what tension stores at the start
      self%base_entry = self%entry
      self%factor_of_case = [by_load_factor, (by_case + i, i=1, structure%cases - structure%hosted)]
   end subroutine new_equilibrium

   !> What the host gives has changed. Errors: it is to move what no support holds.
   subroutine take_host(self, error)
      class(equilibrium_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      call self%host%renew(self%structure, self%equations, self%external, error)
      self%moved_elements = elements_at(self%structure%mesh, moving_nodes(self%equations))
   end subroutine take_host

   !> Forces, and with `tangent` the matrix.
   subroutine evaluate(self, tangent, error, stand_in, stress, scaling)
      class(equilibrium_t), intent(inout) :: self
      logical, intent(in) :: tangent
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: stand_in
      real(wp), intent(in), optional :: stress(:, :)
      integer, intent(in), optional :: scaling
      call self%evaluate_toward(tangent, error, stand_in=stand_in, stress=stress, scaling=scaling)
   end subroutine evaluate

   !> The same with the one-sided tangent in a direction of motion, for laws with switches. The one place that calls the elements.
   subroutine evaluate_toward(self, tangent, error, toward, stand_in, stress, scaling)
      class(equilibrium_t), intent(inout) :: self
      logical, intent(in) :: tangent
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: toward(:, :) !< (n_nodal, nodes) see `assemble`
      real(wp), intent(in), optional :: stand_in
      real(wp), intent(in), optional :: stress(:, :)
      integer, intent(in), optional :: scaling
      real(wp), allocatable :: unit_force(:, :, :), bulges(:, :, :), out_of_balance(:, :)
      real(wp), allocatable :: remembered(:, :)
      real(wp) :: levels(2), part
      integer :: status, bad_element, active
      call self%refresh()
      if (self%condensed) call self%external%chambers%follow(self%structure, self%equations, self%state, error)
      if (allocated(error)) return
      if (allocated(self%state%past)) call move_alloc(self%state%past%end, remembered)
      if (tangent) then
         self%assemblies = self%assemblies + 1
         call assemble(self%assembly, self%structure, self%state, self%internal_force, status, bad_element, self%values, &
                       self%entry%energy, resultants=stress, toward=toward, remembered=remembered)
      else
         self%force_evaluations = self%force_evaluations + 1
         call assemble(self%assembly, self%structure, self%state, self%internal_force, status, bad_element, &
                       energy=self%entry%energy, remembered=remembered)
      end if
      if (allocated(self%state%past)) call move_alloc(remembered, self%state%past%end)
      if (status /= status_ok) then
         ! An infinite displacement is a diverged iteration, not a mistake of the input.
         call raise(error, merge(status_not_converged, status, status == status_not_a_number), &
            element_trouble(self%structure, bad_element, status, self%base, self%state))
         return
      end if
      part = 0
      if (present(stand_in)) part = stand_in
      active = by_load_factor
      if (present(scaling)) active = scaling
      allocate (out_of_balance(n_nodal, size(self%internal_force, 2)), source=0.0_wp)
      associate (loads => self%external, s => self%structure, e => self%equations)
         if (tangent .and. part > 0) call add_ground(self%assembly, s, loads, self%state, part, self%ground, self%values, error)
         if (allocated(error)) return
         if (tangent) then
            call loads%evaluate(s, e, self%state, self%assembly, unit_force, bulges, self%values)
         else
            call loads%evaluate(s, e, self%state, self%assembly, unit_force, bulges)
         end if
         self%entry%energy = self%entry%energy + loads%standing_energy(s, e, self%state)
      end associate
      self%entry%unit_force = unit_force
      unit_force = unit_force + bulges
      self%bulge_force = scaled_sum(self%state, bulges)
      call move_alloc(bulges, self%entry%bulges)
      self%external_force = scaled_sum(self%state, unit_force)
      if (tangent) then
         call add_turning(self%external, turning_moments(self), self%assembly, self%values)
         ! Moving the held components by the factor puts the structure out of balance too.
         call add_motion(self%structure, self%equations, self%external, self%moved_elements, self%state, active, &
            self%internal_force, self%external_force, out_of_balance, toward)
         self%motion_stiffness = -motion_times(self%equations, self%state, active, out_of_balance)
         call add_rate(self%state, active, unit_force, out_of_balance)
         if (allocated(self%structure%growths)) then
            call growth_along(self%structure, self%equations%held, self%state, &
                              slopes(self%state, active, size(self%equations%motion, 3)), self%growth)
            out_of_balance = out_of_balance - self%growth%force
            self%motion_stiffness = self%motion_stiffness + self%growth%stiffness
         end if
         call gather(self%equations, out_of_balance, self%rate(:self%equations%n))
         call self%external%chambers%linearise(self%equations, self%state, active, unit_force, self%gradient, self%compliance, &
            self%inflow, self%rate(self%equations%n + 1:))
         call self%renew_watched()
      end if
      if (allocated(self%inertia)) call self%inertia%act(self%structure, self%equations, self%assembly, self%base, self%state, &
         self%external_force, tangent, merge(self%diagonal, 0, leads(self%team)), self%values)
      out_of_balance = self%external_force - self%internal_force
      if (tangent) call add_joint_stiffness(self%equations, self%state, -out_of_balance, self%assembly%linked, self%values)
      self%entry%reaction = -motions_times(self%equations, self%state, out_of_balance)
      call self%equations%links%fold(out_of_balance)
      call unknowns_of(self%equations, out_of_balance, self%residual(:self%equations%n))
      call self%external%chambers%equilibrium(self%structure, self%equations, self%state, self%residual(self%equations%n + 1:), &
         self%misfit, error)
      levels = force_levels(self%equations, scaled_sum(self%state, unit_force), out_of_balance, unit_force(:, :, unscaled:))
      if (allocated(self%inertia)) levels = max(levels, self%inertia%level)
      if (allocated(self%structure%growths)) levels = max(levels, &
         growth_levels(self%structure, self%equations%held, self%state, size(self%equations%motion, 3), self%detail))
      self%force_level = levels(1)
      self%moment_level = levels(2)
      if (.not. self%drag > 0) return
      if (tangent .and. leads(self%team)) self%values(self%diagonal) = self%values(self%diagonal) &
         + self%drag*self%weight(:self%equations%n)
      call self%resist()
   end subroutine evaluate_toward

   !> (n) Where the diagonal stands among the values.
   pure function diagonal_places(self) result(places)
      class(equilibrium_t), intent(in) :: self
      integer, allocatable :: places(:)
      places = self%diagonal
   end function diagonal_places

   !> Internal moments without those that bulges balance, and on masters the moments of what is on their arms.
   function turning_moments(self) result(moments)
      class(equilibrium_t), intent(in) :: self
      real(wp), allocatable :: moments(:, :)
      moments = self%internal_force - self%bulge_force
      if (.not. self%equations%links%any()) return
      moments(ux:uz, :) = self%internal_force(ux:uz, :) - self%external_force(ux:uz, :)
      call self%equations%links%fold(moments)
   end function turning_moments

   subroutine keep_base(self)
      class(equilibrium_t), intent(inout) :: self
      self%base_entry = self%entry
      if (allocated(self%structure%growths)) self%base_entry%grown = powers_of_growth(self)
   end subroutine keep_base

   !> (factors) Derivatives of the stored energy with respect to the factors of growth.
   function powers_of_growth(self) result(powers)
      class(equilibrium_t), intent(in) :: self
      real(wp), allocatable :: powers(:)
      powers = growth_powers(self%structure, self%equations%held, self%state, size(self%equations%motion, 3))
   end function powers_of_growth

   function balance(self, scaling) result(value)
      class(equilibrium_t), intent(inout) :: self
      integer, intent(in) :: scaling
      type(balance_t) :: value
      if (allocated(self%structure%growths)) self%entry%grown = powers_of_growth(self)
      if (allocated(self%entry%unit_force)) call balance_between(self%base_entry, self%entry, self%base, self%state, &
         scaling, self%external, self%structure, self%equations, self%assembly, value)
      if (allocated(self%state%past)) value%known = .false. ! laws that remember may dissipate
      value%negligible = negligible_growth*abs(self%growth%stiffness)*self%change(scaling)**2
      call value%spend(self%taken)
   end function balance

   !> Factorise the tangent. A singular one is an error that names the node and component where the free motion is largest.
   subroutine factorise(self, error, damping)
      class(equilibrium_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      real(wp), intent(in), optional :: damping
      call self%factors%factorise(self%solver, self%half, self%values, self%diagonal, self%weight, damping, self%gradient, &
                                  self%compliance, self%team, error)
      self%negative_pivots = self%factors%negative_pivots
      self%determinant_sign = self%factors%determinant_sign
      if (.not. allocated(error) .or. self%factors%by_half) return
      if (error%code == status_singular_matrix .and. allocated(self%solver%null_vector)) &
         error%message = name_mode(self%structure%mesh, self%equations, self%solver%null_vector)
   end subroutine factorise

   subroutine solve(self, b, x, error)
      class(equilibrium_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: b(:)
      real(wp), intent(out), contiguous :: x(:)
      type(error_t), allocatable, intent(out) :: error
      call self%factors%solve(self%solver, self%half, b, x, error)
   end subroutine solve

   !> See finshell_problem: displacements and, up to half a turn, rotations (radian), in the axes of the nodes.
   subroutine magnitude(self, x, added)
      class(equilibrium_t), intent(in) :: self
      real(wp), intent(out) :: x(:)
      real(wp), intent(out), optional :: added(:)
      x = 0
      call unknowns_of(self%equations, size_of_motion(self%structure, self%state), x(:self%equations%n))
      ! strains are counted from the grown state: where nothing moves this is what is rounded
      if (allocated(self%structure%growths)) where (self%field == field_displacement) x = x + self%detail &
         *largest_rate(self%structure%growths, self%state, factors_at(self%state, size(self%equations%motion, 3)))
      if (present(added)) added = 0
      if (present(added)) call self%solver%magnitude(x(:self%equations%n), added(:self%equations%n))
   end subroutine magnitude

   !> See finshell_fictitious_mass.
   subroutine fictitious_masses(self, mass)
      class(equilibrium_t), intent(in) :: self
      real(wp), intent(out) :: mass(:)
      mass = fictitious_mass(self%equations, self%detail, self%solver, self%values, self%gradient, self%compliance)
   end subroutine fictitious_masses
end module finshell_equilibrium
