!> A cut through a structure: the elements on one side of it, and its nodes.
module finshell_cut
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t, find_element_set, find_node_set
   implicit none
   private
   public :: cut_t, new_cut, cut_nodes

   type :: cut_t
      integer, allocatable :: elements(:) !< of the set that touch the cut
      logical, allocatable :: member(:) !< (nodes) of the cut
      real(wp), allocatable :: point(:) !< (3) of moments, in space; unallocated: the mean place of the nodes of the cut
   end type cut_t

contains

   !> The nodes where a set of elements is cut: those of a set of nodes or, without one, those that the elements share with others.
   pure function cut_nodes(mesh, element_set, node_set) result(member)
      type(mesh_t), intent(in) :: mesh
      character(len=*), intent(in) :: element_set
      character(len=*), intent(in), optional :: node_set
      logical, allocatable :: member(:)
      logical, allocatable :: inside(:), within(:), beyond(:)
      integer :: e
      allocate (within(size(mesh%coordinates, 2)), beyond(size(mesh%coordinates, 2)), inside(size(mesh%triangles, 2)), &
                source=.false.)
      inside(mesh%element_sets(find_element_set(mesh, element_set))%members) = .true.
      do e = 1, size(inside)
         if (inside(e)) then
            within(mesh%triangles(:, e)) = .true.
         else
            beyond(mesh%triangles(:, e)) = .true.
         end if
      end do
      if (present(node_set)) then
         beyond = .false.
         beyond(mesh%node_sets(find_node_set(mesh, node_set))%members) = .true.
      end if
      member = within .and. beyond
   end function cut_nodes

   !> The sets exist, the input was checked.
   pure subroutine new_cut(cut, mesh, element_set, node_set, point)
      type(cut_t), intent(out) :: cut
      type(mesh_t), intent(in) :: mesh
      character(len=*), intent(in) :: element_set
      character(len=*), intent(in), optional :: node_set
      real(wp), intent(in), optional :: point(:) !< (3)
      integer :: i
      cut%member = cut_nodes(mesh, element_set, node_set)
      if (present(point)) cut%point = point
      associate (list => mesh%element_sets(find_element_set(mesh, element_set))%members)
         cut%elements = pack(list, [(any(cut%member(mesh%triangles(:, list(i)))), i=1, size(list))])
      end associate
   end subroutine new_cut
end module finshell_cut
