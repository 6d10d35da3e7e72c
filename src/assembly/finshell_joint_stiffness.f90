!> The place of joints in the matrix: elements with dependent nodes, the stiffness of arms that turn, masses of dependent nodes.
module finshell_joint_stiffness
   use finshell_assembly, only: assembly_t, link_elements
   use finshell_blocks, only: new_blocks
   use finshell_equations, only: equations_t
   use finshell_freedoms, only: n_corners, n_nodal
   use finshell_kinds, only: wp
   use finshell_linked_elements, only: linked_elements_t
   use finshell_links, only: forces_at_joints
   use finshell_mesh, only: elements_at, mesh_t
   use finshell_sparsity, only: sparsity_t
   use finshell_state, only: state_t
   implicit none
   private
   public :: link_nodes, place_links, add_joint_stiffness, add_at_node

contains

   !> Blocks of all elements with a dependent node, then of the masters of each joint, then of each dependent node and of those that
   !> belong to no element; and what must be in the pattern for them.
   subroutine link_nodes(linked, elements, mesh, equations)
      type(linked_elements_t), intent(out) :: linked
      integer, allocatable, intent(out) :: elements(:) !< with a dependent node
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      integer, allocatable :: first(:), node(:)
      logical, allocatable :: alone(:)
      integer :: b, e, i, joints, nodes

      nodes = size(mesh%coordinates, 2)
      allocate (elements(0))
      allocate (alone(nodes), source=.false.)
      alone(nodes - mesh%loose + 1:) = .true.
      joints = 0
      if (equations%links%any()) then
         elements = elements_at(mesh, any(equations%links%row > 0, dim=1))
         alone = alone .or. any(equations%links%row > 0, dim=1)
         joints = size(equations%links%joints)
      end if
      linked%elements = size(elements)
      linked%joints = joints
      allocate (linked%block_of(nodes), source=0)
      allocate (first(size(elements) + joints + count(alone) + 1))
      allocate (node(n_corners*(size(elements) + joints) + count(alone)))
      first(1) = 1
      do b = 1, size(elements)
         e = first(b)
         node(e:e + n_corners - 1) = mesh%triangles(:, elements(b))
         first(b + 1) = e + n_corners
      end do
      do i = 1, joints
         b = size(elements) + i
         associate (joint => equations%links%joints(i))
            first(b + 1) = first(b) + joint%masters
            node(first(b):first(b + 1) - 1) = joint%master(:joint%masters)
         end associate
      end do
      b = size(elements) + joints
      do i = 1, nodes
         if (.not. alone(i)) cycle
         b = b + 1
         node(first(b)) = i
         first(b + 1) = first(b) + 1
         linked%block_of(i) = b
      end do
      call new_blocks(linked%blocks, equations, first, node(:first(size(first)) - 1), n_nodal)
   end subroutine link_nodes

   !> Give the blocks to an assembly with a pattern that has their cliques.
   subroutine place_links(assembly, linked, elements, pattern)
      type(assembly_t), intent(inout) :: assembly
      type(linked_elements_t), intent(in) :: linked
      integer, intent(in) :: elements(:)
      type(sparsity_t), intent(in) :: pattern
      assembly%linked = linked
      call link_elements(assembly, elements)
      call assembly%linked%blocks%find_places(pattern)
   end subroutine place_links

   !> Add to the matrix what the arms of joints turn.
   subroutine add_joint_stiffness(equations, state, force, linked, values)
      type(equations_t), intent(in) :: equations
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: force(:, :) !< (n_nodal, nodes) internal minus external
      type(linked_elements_t), intent(in) :: linked
      real(wp), intent(inout) :: values(:)
      real(wp), allocatable :: at_joints(:, :)
      real(wp) :: matrix(n_corners*n_nodal, n_corners*n_nodal)
      integer :: j, n
      if (.not. equations%links%any()) return
      associate (links => equations%links)
         at_joints = forces_at_joints(links, force)
         do j = 1, size(links%joints)
            if (.not. (links%joints(j)%on_arm .or. (links%joints(j)%turns .and. links%joints(j)%masters > 1))) cycle
            n = n_nodal*links%joints(j)%masters
            call links%hessian(j, state, at_joints(:, j), matrix(:n, :n))
            call linked%blocks%add(linked%elements + j, matrix(:n, :n), values)
         end do
      end associate
   end subroutine add_joint_stiffness

   !> Add a matrix between the components of a node, global axes, that is dependent or belongs to no element.
   pure subroutine add_at_node(linked, node, matrix, values)
      type(linked_elements_t), intent(in) :: linked
      integer, intent(in) :: node
      real(wp), intent(in) :: matrix(n_nodal, n_nodal)
      real(wp), intent(inout) :: values(:)
      call linked%blocks%add(linked%block_of(node), matrix, values)
   end subroutine add_at_node
end module finshell_joint_stiffness
