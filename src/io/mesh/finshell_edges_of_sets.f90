!> The edges of all edge sets of a mesh, each once, and which node sets are sets of nodes only.
module finshell_edges_of_sets
   use finshell_edges, only: edge_key
   use finshell_kinds, only: i8
   use finshell_mesh, only: find_edge_set, mesh_t
   use finshell_mesh_sorting, only: sorted_order
   implicit none
   private
   public :: edges_of_sets, is_of_nodes

contains

   !> The edges, and in which edge sets each is.
   subroutine edges_of_sets(mesh, edges, of)
      type(mesh_t), intent(in) :: mesh
      integer, allocatable, intent(out) :: edges(:, :) !< (2, n) nodes
      logical, allocatable, intent(out) :: of(:, :) !< (edge sets, n)
      integer(i8), allocatable :: key(:)
      integer, allocatable :: all_edges(:, :), order(:), owner(:)
      integer :: i, n, s
      n = 0
      do s = 1, size(mesh%edge_sets)
         n = n + size(mesh%edge_sets(s)%edges, 2)
      end do
      allocate (all_edges(2, n), owner(n), key(n))
      n = 0
      do s = 1, size(mesh%edge_sets)
         associate (e => mesh%edge_sets(s)%edges)
            all_edges(:, n + 1:n + size(e, 2)) = e
            owner(n + 1:n + size(e, 2)) = s
            n = n + size(e, 2)
         end associate
      end do
      do i = 1, n
         key(i) = edge_key(all_edges(1, i), all_edges(2, i))
      end do
      order = sorted_order(key)
      allocate (edges(2, n), of(size(mesh%edge_sets), n))
      of = .false.
      n = 0
      do i = 1, size(order)
         if (i == 1) then
            n = 1
         else if (key(order(i)) /= key(order(i - 1))) then
            n = n + 1
         end if
         edges(:, n) = all_edges(:, order(i))
         of(owner(order(i)), n) = .true.
      end do
      edges = edges(:, :n)
      of = of(:, :n)
   end subroutine edges_of_sets

   !> Whether a node set is neither 'all' nor that of an edge set.
   logical function is_of_nodes(mesh, s)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: s
      is_of_nodes = mesh%node_sets(s)%name /= 'all' .and. find_edge_set(mesh, mesh%node_sets(s)%name) == 0
   end function is_of_nodes
end module finshell_edges_of_sets
