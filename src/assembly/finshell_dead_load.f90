!> Dead loads: nodal forces that depend on nothing. All with the same factor are one item of the list of loads, summed up once.
!>
!> Distributed loads are lumped consistently with the linear interpolation of the translations: a third of an element's load to each
!> of its nodes, half of an edge's. Moments work on the spins and so have a potential only where a node turns about one axis
!> (finshell_external).
module finshell_dead_load
   use finshell_kinds, only: wp
   use finshell_acting_load, only: acting_load_t, on_nothing
   use finshell_equations, only: equations_t
   use finshell_error, only: error_t
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_load, only: load_t, load_gravity
   use finshell_loaded_set, only: loaded_nodes, loaded_elements, mass_per_area
   use finshell_mesh, only: mesh_t
   use finshell_rotation, only: cross_product
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: dead_load_t, new_dead_load, add_nodal, add_edge, add_edge_moment, add_area

   type, extends(acting_load_t) :: dead_load_t
   contains
      procedure :: evaluate
      procedure :: energy
   end type dead_load_t

contains

   !> No forces yet.
   pure subroutine new_dead_load(self, nodes, scaling)
      type(dead_load_t), intent(out) :: self
      integer, intent(in) :: nodes, scaling
      allocate (self%elements(0))
      allocate (self%nodal(n_nodal, nodes), source=0.0_wp)
      self%rows = on_nothing
      self%scaling = scaling
      self%has_energy = .true.
   end subroutine new_dead_load

   !> Forces and moments at nodes. Error: no such set.
   subroutine add_nodal(load, structure, dead, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      type(dead_load_t), intent(inout) :: dead
      type(error_t), allocatable, intent(inout) :: error
      integer, allocatable :: nodes(:)
      real(wp) :: share
      integer :: i
      call loaded_nodes(load, structure, nodes, error)
      if (allocated(error)) return
      share = 1
      if (load%total) share = 1.0_wp/size(nodes)
      do i = 1, size(nodes)
         associate (force => dead%nodal(:, nodes(i)))
            force(ux:uz) = force(ux:uz) + share*load%vector
            force(rx:rz) = force(rx:rz) + share*load%moment
         end associate
      end do
      dead%has_energy = dead%has_energy .and. .not. any(abs(load%moment) > 0)
   end subroutine add_nodal

   !> Forces along edges (2, :).
   pure subroutine add_edge(load, mesh, edges, dead)
      type(load_t), intent(in) :: load
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: edges(:, :)
      type(dead_load_t), intent(inout) :: dead
      real(wp) :: length
      integer :: i, k
      do i = 1, size(edges, 2)
         length = norm2(mesh%coordinates(:, edges(2, i)) - mesh%coordinates(:, edges(1, i)))
         do k = 1, 2
            associate (force => dead%nodal(ux:uz, edges(k, i)))
               force = force + 0.5_wp*length*load%vector
            end associate
         end do
      end do
   end subroutine add_edge

   !> Moments along edges (2, :).
   pure subroutine add_edge_moment(load, mesh, edges, dead)
      type(load_t), intent(in) :: load
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: edges(:, :)
      type(dead_load_t), intent(inout) :: dead
      real(wp) :: length
      integer :: i, k
      do i = 1, size(edges, 2)
         length = norm2(mesh%coordinates(:, edges(2, i)) - mesh%coordinates(:, edges(1, i)))
         do k = 1, 2
            associate (moment => dead%nodal(rx:rz, edges(k, i)))
               moment = moment + 0.5_wp*length*load%moment
            end associate
         end do
      end do
      dead%has_energy = .false.
   end subroutine add_edge_moment

   !> Traction and gravity. Errors: no such set, no density.
   subroutine add_area(load, structure, dead, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      type(dead_load_t), intent(inout) :: dead
      type(error_t), allocatable, intent(inout) :: error
      integer, allocatable :: elements(:)
      real(wp), allocatable :: mass(:)
      real(wp) :: area, per_area(3)
      integer :: i, k
      call loaded_elements(load, structure, elements, error)
      if (allocated(error)) return
      if (load%kind == load_gravity) call mass_per_area(load, structure, elements, mass, error)
      if (allocated(error)) return
      per_area = load%vector
      do i = 1, size(elements)
         associate (nodes => structure%mesh%triangles(:, elements(i)), x => structure%mesh%coordinates)
            area = 0.5_wp*norm2(cross_product(x(:, nodes(2)) - x(:, nodes(1)), x(:, nodes(3)) - x(:, nodes(1))))
            if (allocated(mass)) per_area = mass(i)*load%vector
            do k = 1, 3
               associate (force => dead%nodal(ux:uz, nodes(k)))
                  force = force + area/3*per_area
               end associate
            end do
         end associate
      end do
   end subroutine add_area

   !> It acts through no element.
   subroutine evaluate(self, structure, equations, state, force, factor, stiffness)
      class(dead_load_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(out), contiguous :: force(:, :)
      real(wp), intent(in), optional :: factor
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :)
      force = 0*self%scaling*state%load_factor*size(structure%sections)*equations%n
      if (present(stiffness)) stiffness = 0*factor
   end subroutine evaluate

   !> Minus the work of the forces.
   function energy(self, structure, equations, state)
      class(dead_load_t), intent(in) :: self
      type(structure_t), intent(in) :: structure
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp) :: energy
      energy = -sum(self%nodal(ux:uz, :)*state%displacement) + 0*size(structure%sections)*equations%n
   end function energy
end module finshell_dead_load
