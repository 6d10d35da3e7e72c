!> Nodes with dead moments that are free to turn about two axes or more: such a moment is not conservative and has an unsymmetric
!> stiffness.
module finshell_turning_nodes
   use finshell_dead_load, only: dead_load_t
   use finshell_equations, only: equations_t
   use finshell_freedoms, only: rx, rz, ux, uz
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t
   implicit none
   private
   public :: find_turning

contains

   !> List the nodes whose dead moments have a stiffness.
   pure subroutine find_turning(mesh, equations, dead, nodes, elements, corners)
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      type(dead_load_t), intent(in) :: dead(:)
      integer, allocatable, intent(out) :: nodes(:), elements(:), corners(:) !< an element at each, and its corner there
      integer, allocatable :: at(:)
      real(wp), allocatable :: moments(:, :)
      integer :: e, i, k, node
      allocate (at(size(mesh%coordinates, 2)), source=0)
      do k = 1, size(dead)
         moments = dead(k)%nodal
         moments(ux:uz, :) = 0
         call equations%links%fold(moments)
         do i = 1, size(at)
            if (any(abs(moments(rx:rz, i)) > 0) .and. count(equations%number(rx:rz, i) > 0) >= 2) at(i) = 1
         end do
      end do
      nodes = pack([(i, i=1, size(at))], at > 0)
      allocate (elements(size(nodes)), corners(size(nodes)), source=0)
      do i = 1, size(nodes)
         at(nodes(i)) = i
      end do
      do e = 1, size(mesh%triangles, 2)
         do k = 1, 3
            node = mesh%triangles(k, e)
            if (at(node) == 0) cycle
            elements(at(node)) = e
            corners(at(node)) = k
         end do
      end do
   end subroutine find_turning
end module finshell_turning_nodes
