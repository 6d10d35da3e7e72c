!> Dead loads as nodal forces, summed up once: they depend on nothing.
!>
!> Distributed loads are lumped consistently with the linear interpolation of the translations: a third of an element's load to each
!> of its nodes, half of an edge's.
module finshell_dead_load
   use finshell_kinds, only: wp
   use finshell_freedoms, only: rx, rz, ux, uz
   use finshell_error, only: error_t
   use finshell_load, only: load_t, load_gravity
   use finshell_loaded_set, only: loaded_nodes, loaded_elements, mass_per_area
   use finshell_mesh, only: mesh_t
   use finshell_rotation, only: cross_product
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: add_nodal, add_edge, add_area

contains

   !> Forces and moments at nodes. Error: no such set.
   subroutine add_nodal(load, structure, dead, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      real(wp), intent(inout) :: dead(:, :, :) !< (n_nodal, nodes, factors)
      type(error_t), allocatable, intent(inout) :: error
      integer, allocatable :: nodes(:)
      real(wp) :: share
      integer :: i
      call loaded_nodes(load, structure, nodes, error)
      if (allocated(error)) return
      share = 1
      if (load%total) share = 1.0_wp/size(nodes)
      do i = 1, size(nodes)
         associate (force => dead(:, nodes(i), load%scaling))
            force(ux:uz) = force(ux:uz) + share*load%vector
            force(rx:rz) = force(rx:rz) + share*load%moment
         end associate
      end do
   end subroutine add_nodal

   !> Forces along edges (2, :).
   pure subroutine add_edge(load, mesh, edges, dead)
      type(load_t), intent(in) :: load
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: edges(:, :)
      real(wp), intent(inout) :: dead(:, :, :)
      real(wp) :: length
      integer :: i, k
      do i = 1, size(edges, 2)
         length = norm2(mesh%coordinates(:, edges(2, i)) - mesh%coordinates(:, edges(1, i)))
         do k = 1, 2
            associate (force => dead(ux:uz, edges(k, i), load%scaling))
               force = force + 0.5_wp*length*load%vector
            end associate
         end do
      end do
   end subroutine add_edge

   !> Traction and gravity. Errors: no such set, no density.
   subroutine add_area(load, structure, dead, error)
      type(load_t), intent(in) :: load
      type(structure_t), intent(in) :: structure
      real(wp), intent(inout) :: dead(:, :, :)
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
               associate (force => dead(ux:uz, nodes(k), load%scaling))
                  force = force + area/3*per_area
               end associate
            end do
         end associate
      end do
   end subroutine add_area
end module finshell_dead_load
