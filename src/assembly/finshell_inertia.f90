!> Inertia and damping as one more load of an equilibrium (d'Alembert): -M a - C v, with velocities and accelerations at the end
!> of an increment that are linear in its motion d, as all schemes of Newmark's family have them:
!>
!>     v = v0 + v1 d,   a = a0 + a1 d.
!>
!> Masses are lumped at the nodes and the inertia of a node against rotation is the same about all axes: the rate of the angular
!> momentum J w of a node is then J times that of its spin w, in space. Rotations of d are the rotation vectors of the relative
!> rotations or, of the conserving scheme, those of Rodrigues, 2 tan(angle/2) along the axis: a rigid body whose nodes go along
!> chords, h times the mean of their velocities, turns by these.
!>
!> What they add to the tangent is its symmetric part, on the diagonal. Left out are, of the rotatory inertia only, skew terms of
!> the first order and symmetric ones of the second order in the rotation of an increment.
module finshell_inertia
   use finshell_assembly, only: assembly_t
   use finshell_dashpots, only: dashpots_t
   use finshell_equations, only: equations_t, free_part
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_inertia_damper, only: damper_t
   use finshell_joint_stiffness, only: add_at_node
   use finshell_kinds, only: wp
   use finshell_linked_elements, only: linked_elements_t
   use finshell_quaternion, only: quaternion_conjugate, quaternion_product
   use finshell_state, only: state_t, motion_between
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: inertia_t, stiffen

   type :: inertia_t
      real(wp), allocatable :: mass(:, :) !< (n_nodal, nodes) masses and rotatory inertias
      real(wp) :: mass_damping = 0 !< Rayleigh: of this times the masses
      type(damper_t) :: damper !< and of the stiffness of the material
      type(dashpots_t) :: dashpots
      logical :: rodrigues = .false. !< rotations of d
      !> Dependent nodes have the rates that their masters give them, not those that the scheme finds from their own motion. The
      !> latter keep momenta far better, but only a scheme that dissipates keeps the two together (Arnold and Bruels 2007).
      logical :: rates_of_masters = .false.
      real(wp) :: v1 = 0, a1 = 0
      real(wp), allocatable :: v0(:, :), a0(:, :) !< (n_nodal, nodes)
      real(wp), allocatable :: held_velocity(:, :), held_acceleration(:, :) !< (n_nodal, nodes) of moved supports; 0 elsewhere

      ! Left by `act`, at the state, (n_nodal, nodes):
      real(wp), allocatable :: velocity(:, :), acceleration(:, :)
      real(wp), allocatable :: damping(:, :) !< forces of damping, along the velocities
      real(wp) :: level(2) = 0 !< Euclidean norms of forces and moments of inertia
   contains
      procedure :: act
   end type inertia_t

contains

   !> Add inertia and damping to the external forces and, with `tangent`, to the matrix.
   subroutine act(self, structure, equations, assembly, base, state, external_force, tangent, diagonal, values)
      class(inertia_t), intent(inout) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(assembly_t), intent(in) :: assembly
      type(state_t), intent(in) :: base, state
      real(wp), intent(inout) :: external_force(:, :) !< (n_nodal, nodes)
      logical, intent(in) :: tangent
      integer, intent(in) :: diagonal(:) !< (n) where it stands among the values; 0: another member of the team adds to it
      real(wp), intent(inout) :: values(:)
      real(wp), allocatable :: motion(:, :), force(:, :)

      motion = motion_between(base, state)
      if (self%rodrigues) call to_rodrigues(base, state, motion)
      self%velocity = free_part(equations, self%v0 + self%v1*motion) + self%held_velocity
      self%acceleration = free_part(equations, self%a0 + self%a1*motion) + self%held_acceleration
      if (self%rates_of_masters .and. equations%links%any()) then
         call equations%links%extend(self%velocity)
         call equations%links%extend(self%acceleration)
         self%acceleration = self%acceleration + equations%links%turning_rates(state, self%velocity)
      end if
      allocate (force(n_nodal, size(motion, 2)), source=0.0_wp)
      force = -self%mass_damping*self%mass*self%velocity
      if (tangent) then
         call self%damper%add(structure, assembly, state, self%velocity, force, self%v1, values)
         call self%dashpots%add(structure, state, self%velocity, force, self%v1, values)
         call stiffen(self, equations, diagonal, assembly%linked, values)
      else
         call self%damper%add(structure, assembly, state, self%velocity, force, self%v1)
         call self%dashpots%add(structure, state, self%velocity, force)
      end if
      self%damping = -force
      motion = self%mass*self%acceleration
      self%level = [norm2(motion(ux:uz, :)), norm2(motion(rx:rz, :))]
      external_force = external_force + force - motion
   end subroutine act

   !> Add to the diagonal of the matrix: masses are the same along all axes of a node.
   subroutine stiffen(self, equations, diagonal, linked, values)
      class(inertia_t), intent(in) :: self
      type(equations_t), intent(in) :: equations
      integer, intent(in) :: diagonal(:)
      type(linked_elements_t), intent(in) :: linked !< those of dependent nodes go to what these depend on
      real(wp), intent(inout) :: values(:)
      real(wp) :: own(n_nodal, n_nodal)
      integer :: at, i, k
      do i = 1, size(self%mass, 2)
         if (equations%links%any()) then
            if (any(equations%links%row(:, i) > 0)) then
               own = 0
               do k = 1, n_nodal
                  own(k, k) = (self%a1 + self%mass_damping*self%v1)*self%mass(k, i)
               end do
               call add_at_node(linked, i, own, values)
               cycle
            end if
         end if
         do k = 1, n_nodal
            if (equations%number(k, i) == 0) cycle
            at = diagonal(equations%number(k, i))
            if (at > 0) values(at) = values(at) + (self%a1 + self%mass_damping*self%v1)*self%mass(k, i)
         end do
      end do
   end subroutine stiffen

   !> Replace rotation vectors by 2 tan(angle/2) along the axis.
   pure subroutine to_rodrigues(base, state, motion)
      type(state_t), intent(in) :: base, state
      real(wp), intent(inout) :: motion(:, :) !< (n_nodal, nodes)
      real(wp) :: q(4)
      integer :: i
      do i = 1, size(motion, 2)
         q = quaternion_product(state%rotation(:, i), quaternion_conjugate(base%rotation(:, i)))
         ! beyond half a turn there is none; an iteration that far out is lost in any case
         motion(rx:rz, i) = 2*q(2:4)/sign(max(abs(q(1)), 1.0e-3_wp), q(1))
      end do
   end subroutine to_rodrigues
end module finshell_inertia
