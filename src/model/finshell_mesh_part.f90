!> Some elements of a mesh as a mesh of its own, with their nodes and what of the sets lies in them.
module finshell_mesh_part
   use finshell_edges, only: edges_t, find_edge, new_edges
   use finshell_mesh, only: add_edge_set, add_element_set, add_node_set, find_edge_set, mesh_t, new_mesh
   implicit none
   private
   public :: part_of_mesh

contains

   !> Nodes and elements are numbered in the order of the lists. Sets of which nothing is left are dropped.
   subroutine part_of_mesh(mesh, nodes, elements, part)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: nodes(:), elements(:) !< of the part; nodes are those of the elements
      type(mesh_t), intent(out) :: part
      type(edges_t) :: edges
      integer, allocatable :: node(:), element(:), members(:), pairs(:, :)
      integer :: e, k, s
      allocate (node(size(mesh%coordinates, 2)), element(size(mesh%triangles, 2)), source=0)
      node(nodes) = [(k, k=1, size(nodes))]
      element(elements) = [(k, k=1, size(elements))]
      call new_mesh(part, mesh%coordinates(:, nodes), reshape([(node(mesh%triangles(:, elements(e))), e=1, size(elements))], &
                                                             [3, size(elements)]))
      call new_edges(edges, part%triangles)
      do s = 1, size(mesh%edge_sets)
         associate (all_edges => mesh%edge_sets(s)%edges)
            allocate (pairs(2, size(all_edges, 2)))
            k = 0
            do e = 1, size(all_edges, 2)
               if (any(node(all_edges(:, e)) == 0)) cycle
               if (find_edge(edges, node(all_edges(1, e)), node(all_edges(2, e))) == 0) cycle
               k = k + 1
               pairs(:, k) = node(all_edges(:, e))
            end do
            if (k > 0) call add_edge_set(part, mesh%edge_sets(s)%name, pairs(:, :k))
            deallocate (pairs)
         end associate
      end do
      do s = 1, size(mesh%node_sets)
         associate (set => mesh%node_sets(s))
            if (set%name == 'all' .or. find_edge_set(mesh, set%name) > 0) cycle
            members = node(set%members)
            members = pack(members, members > 0)
            if (size(members) > 0) call add_node_set(part, set%name, members, set%grows)
         end associate
      end do
      do s = 1, size(mesh%element_sets)
         associate (set => mesh%element_sets(s))
            if (set%name == 'all') cycle
            members = element(set%members)
            members = pack(members, members > 0)
            if (size(members) > 0) call add_element_set(part, set%name, members)
         end associate
      end do
   end subroutine part_of_mesh
end module finshell_mesh_part
