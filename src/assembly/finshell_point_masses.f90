!> Masses beside those of elements: at nodes, with an inertia that is the same about all axes, and those of bars, half at each end.
module finshell_point_masses
   use finshell_acting_load, only: append, load_item_t
   use finshell_blocks, only: blocks_t, new_blocks
   use finshell_connector, only: bar, point_mass
   use finshell_equations, only: equations_t
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_joined_load, only: joined_load_t
   use finshell_kinds, only: wp
   use finshell_load, only: load_t
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: mass_blocks_t, point_masses, new_mass_blocks, pull_masses, spin_masses

   !> In a mass matrix.
   type :: mass_blocks_t
      type(blocks_t) :: blocks
      real(wp), allocatable :: mass(:, :) !< (n_nodal, blocks)
      logical :: in_matrix = .true. !< see joined_load_t
   contains
      procedure :: add
   end type mass_blocks_t

   !> Seen in a frame that spins about an axis (finshell_centrifugal).
   type, extends(joined_load_t) :: spinning_masses_t
      real(wp), allocatable :: mass(:) !< (blocks) times the square of the angular velocity
      real(wp) :: point(3) = 0
      real(wp) :: across(3, 3) = 0
   contains
      procedure :: evaluate
      procedure :: energy
   end type spinning_masses_t

contains

   !> Masses and rotatory inertias of all nodes, (n_nodal, nodes).
   pure function point_masses(structure) result(mass)
      type(structure_t), intent(in) :: structure
      real(wp) :: mass(n_nodal, size(structure%mesh%coordinates, 2))
      integer :: c, i
      mass = 0
      if (.not. allocated(structure%connectors)) return
      do c = 1, size(structure%connectors)
         associate (it => structure%connectors(c), x => structure%mesh%coordinates)
            do i = 1, size(it%node, 2)
               if (it%kind == point_mass) then
                  mass(ux:uz, it%node(1, i)) = mass(ux:uz, it%node(1, i)) + it%share*it%mass
                  mass(rx:rz, it%node(1, i)) = mass(rx:rz, it%node(1, i)) + it%share*it%inertia
               else if (it%kind == bar .and. size(it%node, 1) == 2) then
                  mass(ux:uz, it%node(:, i)) = mass(ux:uz, it%node(:, i)) &
                                               + 0.5_wp*it%mass*norm2(x(:, it%node(1, i)) - x(:, it%node(2, i)))
               end if
            end do
         end associate
      end do
   end function point_masses

   pure subroutine new_mass_blocks(self, structure, equations)
      type(mass_blocks_t), intent(out) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      real(wp), allocatable :: mass(:, :)
      integer, allocatable :: nodes(:)
      integer :: i
      mass = point_masses(structure)
      nodes = pack([(i, i=1, size(mass, 2))], any(mass > 0, dim=1))
      self%mass = mass(:, nodes)
      call new_blocks(self%blocks, equations, [(i, i=1, size(nodes) + 1)], nodes, n_nodal)
   end subroutine new_mass_blocks

   !> values <- values + the masses.
   pure subroutine add(self, rotatory, values)
      class(mass_blocks_t), intent(in) :: self
      logical, intent(in) :: rotatory
      real(wp), intent(inout) :: values(:)
      real(wp) :: m(n_nodal, n_nodal)
      integer :: b, k
      if (.not. self%in_matrix) return
      do b = 1, self%blocks%count()
         m = 0
         do k = 1, merge(n_nodal, uz, rotatory)
            m(k, k) = self%mass(k, b)
         end do
         call self%blocks%add(b, m, values)
      end do
   end subroutine add

   !> Gravity on them: add to the forces of a dead load.
   pure subroutine pull_masses(load, structure, nodal)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      real(wp), intent(inout) :: nodal(:, :) !< (n_nodal, nodes)
      real(wp) :: mass(n_nodal, size(nodal, 2))
      integer :: k
      mass = point_masses(structure)
      do k = ux, uz
         nodal(k, :) = nodal(k, :) + load%vector(k)*mass(k, :)
      end do
   end subroutine pull_masses

   !> A centrifugal load on them: `point`, `direction` and first number of the load are axis and angular velocity.
   subroutine spin_masses(load, structure, equations, list)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(load_item_t), allocatable, intent(inout) :: list(:)
      type(spinning_masses_t) :: self
      real(wp), allocatable :: mass(:, :)
      integer, allocatable :: nodes(:)
      integer :: i
      mass = point_masses(structure)
      nodes = pack([(i, i=1, size(mass, 2))], mass(ux, :) > 0)
      if (size(nodes) == 0) return
      self%mass = load%numbers(1)**2*mass(ux, nodes)
      self%point = load%point
      self%across = -spread(load%direction, 2, 3)*spread(load%direction, 1, 3)/dot_product(load%direction, load%direction)
      do i = 1, 3
         self%across(i, i) = self%across(i, i) + 1
      end do
      self%scaling = load%scaling
      self%has_energy = .true.
      call self%join(equations, reshape(nodes, [1, size(nodes)]), .false.)
      call append(list, self)
   end subroutine spin_masses

   subroutine evaluate(self, structure, equations, state, force, factor, stiffness)
      class(spinning_masses_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: force(:, :)
      real(wp), intent(in), optional :: factor
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :)
      integer :: b
      do b = 1, self%count()
         force(:, b) = self%mass(b)*matmul(self%across, self%position(1, b, structure, state) - self%point)
         if (present(stiffness)) stiffness(:, :, b) = factor*self%mass(b)*self%across
      end do
      if (equations%n < 0) force = 0
   end subroutine evaluate

   function energy(self, structure, equations, state)
      class(spinning_masses_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp) :: energy, r(3)
      integer :: b
      energy = 0*equations%n
      do b = 1, self%count()
         r = self%position(1, b, structure, state) - self%point
         energy = energy - 0.5_wp*self%mass(b)*dot_product(r, matmul(self%across, r))
      end do
   end function energy
end module finshell_point_masses
