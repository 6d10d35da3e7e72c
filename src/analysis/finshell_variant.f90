!> A structure in which one parameter is a little different, seen at the states of the one that is solved: what the parameter does
!> to the residual, with everything that depends on it (forces of elements, loads, weights, held motions, normals, volumes).
!>
!> The variant has the unknowns of the structure; its elements are added up by the assembly of that. Held nodes are where the
!> variant's supports would have them.
module finshell_variant
   use finshell_assembly, only: assemble
   use finshell_equations, only: new_equations, unknowns_of
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise
   use finshell_external, only: new_external
   use finshell_factor, only: factor_at, number_of_factors, scaled_sum
   use finshell_freedoms, only: n_nodal, rx, rz
   use finshell_held_motion, only: turn_held
   use finshell_kinds, only: i4, wp
   use finshell_section, only: set_points
   use finshell_state, only: move_state, state_t
   use finshell_status, only: status_input_error, status_not_converged, status_ok
   use finshell_structure, only: structure_t, turning_nodes
   implicit none
   private
   public :: variant_t, new_variant

   type :: variant_t
      type(structure_t), pointer :: structure => null()
      !> What monitors see: structure, equations, loads and forces; it is not solved.
      type(equilibrium_t), pointer :: problem => null()
      integer, private :: stage = 0
   contains
      procedure :: follow
      procedure :: residual
      procedure :: place
   end type variant_t

contains

   !> Keep a changed copy of a structure. Error: mesh, sets or elements are others, not only numbers.
   subroutine new_variant(self, changed, structure, error)
      type(variant_t), intent(inout) :: self
      type(structure_t), intent(in) :: changed, structure
      type(error_t), allocatable, intent(out) :: error
      integer :: i, k
      logical :: same
      same = size(changed%mesh%coordinates, 2) == size(structure%mesh%coordinates, 2) .and. &
             size(changed%mesh%triangles, 2) == size(structure%mesh%triangles, 2) .and. &
             size(changed%sections) == size(structure%sections)
      if (same) same = all(changed%mesh%triangles == structure%mesh%triangles) .and. &
                       all(changed%element_section == structure%element_section)
      if (same) same = (allocated(changed%normal) .eqv. allocated(structure%normal)) .and. &
                       (allocated(changed%joints) .eqv. allocated(structure%joints)) .and. &
                       all([(size(changed%sections(i)%layers) == size(structure%sections(i)%layers), &
                             i=1, size(structure%sections))])
      if (.not. same) then
         call raise(error, status_input_error, 'it changes the mesh, or what the model is made of: only numbers may change')
         return
      end if
      allocate (self%structure, source=changed)
      allocate (self%problem)
      ! as many points through the thickness, also where their number hangs on what changes
      do i = 1, size(structure%sections)
         ! and the thickness stretch of the same layer: where two meet at the surface of the nodes a small change takes the other
         self%structure%sections(i)%midsurface_layer = structure%sections(i)%midsurface_layer
         do k = 1, size(structure%sections(i)%layers)
            call set_points(self%structure%sections(i)%layers(k), structure%sections(i)%layers(k)%points)
         end do
      end do
   end subroutine new_variant

   !> Equations and loads of the step that the problem is in. Errors: those of these; other unknowns.
   subroutine follow(self, problem, error)
      class(variant_t), intent(inout) :: self
      type(equilibrium_t), intent(in) :: problem
      type(error_t), allocatable, intent(out) :: error
      associate (mine => self%problem, s => self%structure)
         if (self%stage /= problem%stage) then
            self%stage = problem%stage
            mine%structure => self%structure
            call new_equations(mine%equations, s%mesh, s%supports, error, turning_nodes(s), number_of_factors(s%cases), &
                               self%stage, s%joints)
            if (.not. allocated(error)) call new_external(mine%external, s, mine%equations, error, self%stage)
            if (allocated(error)) return
            if (any(mine%equations%number /= problem%equations%number)) then
               call raise(error, status_input_error, 'it changes what is held')
               return
            end if
            mine%n = problem%n
            mine%size = problem%size
            mine%detail = problem%detail
            mine%stage = problem%stage
            mine%factor_of_case = problem%factor_of_case
            if (allocated(mine%internal_force)) deallocate (mine%internal_force, mine%external_force)
            allocate (mine%internal_force(n_nodal, size(s%mesh%coordinates, 2)), source=0.0_wp)
            mine%external_force = mine%internal_force
         end if
         if (allocated(problem%equations%anchor_rotation)) mine%equations%anchor_rotation = problem%equations%anchor_rotation
         if (allocated(problem%equations%anchor_factor)) mine%equations%anchor_factor = problem%equations%anchor_factor
      end associate
   end subroutine follow

   !> The state of the problem with held nodes where the variant has them, left in `problem%state` of the variant.
   subroutine place(self, problem)
      class(variant_t), intent(inout) :: self
      type(equilibrium_t), intent(in) :: problem
      real(wp), allocatable :: motion(:, :)
      associate (mine => self%problem)
         mine%state = problem%state
         motion = held_motion(self%problem, problem%state) - held_motion(problem, problem%state)
         if (any(abs(motion) > 0)) call move_state(mine%state, motion)
         call turn_held(mine%equations, mine%state)
         if (.not. mine%equations%links%any()) return
         call mine%equations%links%settle(mine%state)
         call mine%equations%links%refresh(mine%state)
         call mine%external%refresh(mine%equations)
      end associate
   end subroutine place

   !> (n_nodal, nodes) What supports have moved in all; whole rotations count by `turn_held`.
   function held_motion(problem, state) result(motion)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp), allocatable :: motion(:, :)
      real(wp) :: factor
      integer :: k
      allocate (motion(n_nodal, size(state%displacement, 2)), source=0.0_wp)
      associate (e => problem%equations)
         do k = 1, size(e%motion, 3)
            factor = factor_at(state, k)
            if (allocated(e%anchor_factor)) factor = factor - e%anchor_factor(k)
            motion(:, e%moved) = motion(:, e%moved) + factor*e%motion(:, :, k)
         end do
         where (spread(e%turned, 1, rz - rx + 1)) motion(rx:rz, e%moved) = 0
      end associate
   end function held_motion

   !> External minus internal forces of the variant at the state of the problem, over its unknowns. The forces stay in the variant.
   subroutine residual(self, problem, r, error)
      class(variant_t), intent(inout) :: self
      type(equilibrium_t), intent(in) :: problem
      real(wp), intent(out) :: r(:) !< (n)
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: unit_force(:, :, :), bulges(:, :, :), out_of_balance(:, :)
      real(wp) :: misfit
      integer(i4) :: status
      integer :: bad
      call self%place(problem)
      associate (mine => self%problem)
         call assemble(problem%assembly, self%structure, mine%state, mine%internal_force, status, bad, energy=mine%entry%energy)
         if (status /= status_ok) then
            call raise(error, status_not_converged, 'an element cannot be evaluated with the changed parameter')
            return
         end if
         call mine%external%evaluate(self%structure, mine%equations, mine%state, problem%assembly, unit_force, bulges)
         mine%external_force = scaled_sum(mine%state, unit_force + bulges)
         out_of_balance = mine%external_force - mine%internal_force
         call mine%equations%links%fold(out_of_balance)
         call unknowns_of(mine%equations, out_of_balance, r(:mine%equations%n))
         call mine%external%chambers%equilibrium(self%structure, mine%equations, mine%state, &
                                                   r(mine%equations%n + 1:), misfit, error)
      end associate
   end subroutine residual
end module finshell_variant
