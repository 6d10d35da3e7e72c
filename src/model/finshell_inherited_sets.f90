!> The sets of a refined mesh: those of the mesh before.
module finshell_inherited_sets
   use finshell_edges, only: find_edge
   use finshell_lineage, only: children_of, inherited_nodes, lineage_t, nodes_of_edges
   use finshell_mesh, only: add_edge_set, add_element_set, add_node_set, find_edge_set, mesh_t
   implicit none
   private
   public :: inherit_sets

contains

   !> Element sets get the parts of their elements, edge sets those of their edges. A node set of the name of an edge set gets the
   !> nodes of its edges; others among the first `points` get none unless they
   !> grow; those behind get what `inherited_nodes` says.
   pure subroutine inherit_sets(mesh, lineage, fine, points)
      type(mesh_t), intent(in) :: mesh !< before
      type(lineage_t), intent(in) :: lineage
      type(mesh_t), intent(inout) :: fine
      integer, intent(in), optional :: points
      integer, allocatable :: first(:), list(:), line(:)
      logical, allocatable :: before(:)
      integer, allocatable :: parts(:, :)
      integer :: edge, i, k, n, s
      do i = 1, size(mesh%element_sets)
         if (mesh%element_sets(i)%name /= 'all') &
            call add_element_set(fine, mesh%element_sets(i)%name, children_of(lineage, mesh%element_sets(i)%members))
      end do
      ! in their order, which messages show
      do i = 1, size(mesh%node_sets)
         if (mesh%node_sets(i)%name == 'all') cycle
         call add_node_set(fine, mesh%node_sets(i)%name, mesh%node_sets(i)%members, mesh%node_sets(i)%grows)
         if (find_edge_set(mesh, mesh%node_sets(i)%name) > 0) cycle
         if (present(points)) then
            if (i <= points .and. .not. mesh%node_sets(i)%grows) cycle
         end if
         allocate (before(size(mesh%coordinates, 2)), source=.false.)
         before(mesh%node_sets(i)%members) = .true.
         before = inherited_nodes(lineage, before)
         call add_node_set(fine, mesh%node_sets(i)%name, pack([(k, k=1, size(before))], before))
         deallocate (before)
      end do
      call nodes_of_edges(lineage, first, list)
      do i = 1, size(mesh%edge_sets)
         associate (edges => mesh%edge_sets(i)%edges)
            allocate (parts(2, size(edges, 2) + size(list)))
            n = 0
            do k = 1, size(edges, 2)
               edge = find_edge(lineage%edges, edges(1, k), edges(2, k))
               line = list(first(edge):first(edge + 1) - 1)
               if (edges(1, k) > edges(2, k)) line = line(size(line):1:-1)
               line = [edges(1, k), line, edges(2, k)]
               do s = 1, size(line) - 1
                  parts(:, n + s) = line(s:s + 1)
               end do
               n = n + size(line) - 1
            end do
            call add_edge_set(fine, mesh%edge_sets(i)%name, parts(:, :n))
            deallocate (parts)
         end associate
      end do
   end subroutine inherit_sets
end module finshell_inherited_sets
