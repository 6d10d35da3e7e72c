!> Finer meshes: every triangle in four, as often as wanted, with all sets.
module finshell_mesh_refinement
   use finshell_kinds, only: wp
   use finshell_edges, only: find_edge, new_edges
   use finshell_lineage, only: lineage_t, children_of, edge_node, inherited_nodes, inner_node, node_count
   use finshell_mesh, only: mesh_t, add_edge_set, add_element_set, add_node_set, find_edge_set, new_mesh
   use finshell_patches, only: patches_t, edge_point, flat_patches, new_patches, patch_normal, patch_point
   implicit none
   private
   public :: refine_mesh

contains

   !> Cut every triangle in four, `levels` times.
   !>
   !> With `crease_angle` new nodes lie on a smooth surface through the old ones (finshell_patches), else on the facets. Nodes keep
   !> their numbers, triangles their order and orientation; mesh%normal, if the mesh has it, is that of the smooth surface. A node
   !> set of the name of an edge set gets the nodes of its edges; others among the first `points` get none; those behind get what
   !> `inherited_nodes` says.
   pure subroutine refine_mesh(mesh, levels, fine, crease_angle, normal, crease, points)
      type(mesh_t), intent(in) :: mesh !< that has passed check_mesh
      integer, intent(in) :: levels !< >= 1
      type(mesh_t), intent(out) :: fine
      real(wp), intent(in), optional :: crease_angle !< degrees; see new_patches
      real(wp), intent(in), optional :: normal(:, :, :) !< (3, 3, elements)
      integer, intent(in), optional :: crease(:, :) !< (2, :) pairs of nodes
      integer, intent(in), optional :: points
      type(lineage_t) :: lineage
      type(patches_t) :: patches
      real(wp), allocatable :: x(:, :)
      integer, allocatable :: triangles(:, :)
      integer :: a, b, e, i, m

      m = 2**levels
      lineage%cuts = m
      lineage%nodes = size(mesh%coordinates, 2)
      lineage%triangles = mesh%triangles
      call new_edges(lineage%edges, mesh%triangles)
      if (present(crease_angle)) then
         call new_patches(patches, mesh, lineage%edges, crease_angle, normal, crease)
      else
         call flat_patches(patches, mesh, lineage%edges)
      end if
      allocate (x(3, node_count(lineage)), triangles(3, m**2*size(mesh%triangles, 2)))
      x(:, :lineage%nodes) = mesh%coordinates
      do i = 1, size(lineage%edges%nodes, 2)
         do a = 1, m - 1
            x(:, edge_node(lineage, i, a)) = edge_point(patches, mesh, lineage%edges, i, real(a, wp)/m)
         end do
      end do
      do e = 1, size(mesh%triangles, 2)
         do a = 1, m - 2
            do b = 1, m - 1 - a
               x(:, inner_node(lineage, e, a, b)) = patch_point(patches, mesh, lineage%edges, e, barycentric(a, b))
            end do
         end do
         associate (n => m**2*(e - 1))
            triangles(:, n + 1:n + m**2) = parts_of(lineage, e)
         end associate
      end do
      call new_mesh(fine, x, triangles)
      if (allocated(mesh%normal)) fine%normal = normals_of(patches, mesh, lineage, fine)
      fine%coincident_nodes_allowed = mesh%coincident_nodes_allowed
      if (allocated(mesh%empty_sets)) fine%empty_sets = mesh%empty_sets
      call refine_sets(mesh, lineage, fine, points)
      fine%lineage = lineage

   contains

      pure function barycentric(a, b) result(u)
         integer, intent(in) :: a, b
         real(wp) :: u(3)
         u = [real(m - a - b, wp), real(a, wp), real(b, wp)]/m
      end function barycentric
   end subroutine refine_mesh

   !> The triangles into which an element is cut, row by row.
   pure function parts_of(lineage, e) result(triangles)
      type(lineage_t), intent(in) :: lineage
      integer, intent(in) :: e
      integer :: triangles(3, lineage%cuts**2)
      integer :: a, b, n
      n = 0
      do b = 0, lineage%cuts - 1
         do a = 0, lineage%cuts - 1 - b
            n = n + 1
            triangles(:, n) = [grid_node(lineage, e, a, b), grid_node(lineage, e, a + 1, b), grid_node(lineage, e, a, b + 1)]
            if (a + b == lineage%cuts - 1) cycle
            n = n + 1
            triangles(:, n) = [grid_node(lineage, e, a + 1, b), grid_node(lineage, e, a + 1, b + 1), &
                               grid_node(lineage, e, a, b + 1)]
         end do
      end do
   end function parts_of

   !> Node of element `e` at a, b >= 0, a + b <= cuts.
   pure integer function grid_node(lineage, e, a, b) result(node)
      type(lineage_t), intent(in) :: lineage
      integer, intent(in) :: e, a, b
      associate (m => lineage%cuts, t => lineage%triangles(:, e))
         if (a == m) then
            node = t(2)
         else if (b == m) then
            node = t(3)
         else if (a == 0 .and. b == 0) then
            node = t(1)
         else if (b == 0) then
            node = side_node(1, a)
         else if (a == 0) then
            node = side_node(3, m - b)
         else if (a + b == m) then
            node = side_node(2, b)
         else
            node = inner_node(lineage, e, a, b)
         end if
      end associate

   contains

      !> `s` parts along side `k`.
      pure integer function side_node(k, s)
         integer, intent(in) :: k, s
         associate (edge => lineage%edges%of_side(k, e))
            if (lineage%edges%nodes(1, edge) == lineage%triangles(k, e)) then
               side_node = edge_node(lineage, edge, s)
            else
               side_node = edge_node(lineage, edge, lineage%cuts - s)
            end if
         end associate
      end function side_node
   end function grid_node

   !> Normals at the nodes: those given, and between them the mean of the patches'.
   pure function normals_of(patches, mesh, lineage, fine) result(normal)
      type(patches_t), intent(in) :: patches
      type(mesh_t), intent(in) :: mesh, fine
      type(lineage_t), intent(in) :: lineage
      real(wp), allocatable :: normal(:, :)
      real(wp) :: n(3)
      integer :: a, b, e, m, node
      allocate (normal(3, size(fine%coordinates, 2)), source=0.0_wp)
      m = lineage%cuts
      do e = 1, size(mesh%triangles, 2)
         do a = 0, m
            do b = 0, m - a
               node = grid_node(lineage, e, a, b)
               if (node <= lineage%nodes) cycle
               n = patch_normal(patches, mesh, lineage%edges, e, [real(m - a - b, wp), real(a, wp), real(b, wp)]/m)
               ! normals of the mesh may point to either side
               if (dot_product(n, sum(mesh%normal(:, mesh%triangles(:, e)), 2)) < 0) n = -n
               normal(:, node) = normal(:, node) + n
            end do
         end do
      end do
      normal(:, :lineage%nodes) = mesh%normal
   end function normals_of

   pure subroutine refine_sets(mesh, lineage, fine, points)
      type(mesh_t), intent(in) :: mesh
      type(lineage_t), intent(in) :: lineage
      type(mesh_t), intent(inout) :: fine
      integer, intent(in), optional :: points
      integer, allocatable :: parts(:, :)
      logical, allocatable :: before(:)
      integer :: edge, i, k, s
      do i = 1, size(mesh%element_sets)
         if (mesh%element_sets(i)%name /= 'all') &
            call add_element_set(fine, mesh%element_sets(i)%name, children_of(lineage, mesh%element_sets(i)%members))
      end do
      ! in their order, which messages show
      do i = 1, size(mesh%node_sets)
         if (mesh%node_sets(i)%name == 'all') cycle
         call add_node_set(fine, mesh%node_sets(i)%name, mesh%node_sets(i)%members)
         if (find_edge_set(mesh, mesh%node_sets(i)%name) > 0) cycle
         if (present(points)) then
            if (i <= points) cycle
         end if
         allocate (before(size(mesh%coordinates, 2)), source=.false.)
         before(mesh%node_sets(i)%members) = .true.
         before = inherited_nodes(lineage, before)
         call add_node_set(fine, mesh%node_sets(i)%name, pack([(k, k=1, size(before))], before))
         deallocate (before)
      end do
      do i = 1, size(mesh%edge_sets)
         associate (edges => mesh%edge_sets(i)%edges, m => lineage%cuts)
            allocate (parts(2, m*size(edges, 2)))
            do k = 1, size(edges, 2)
               edge = find_edge(lineage%edges, edges(1, k), edges(2, k))
               do s = 0, m - 1
                  parts(:, m*(k - 1) + s + 1) = [on_edge(k, s), on_edge(k, s + 1)]
               end do
            end do
            call add_edge_set(fine, mesh%edge_sets(i)%name, parts)
            deallocate (parts)
         end associate
      end do

   contains

      !> Node `s` parts from the first to the second node of an edge as the set has it.
      pure integer function on_edge(k, s)
         integer, intent(in) :: k, s
         associate (ends => mesh%edge_sets(i)%edges(:, k), m => lineage%cuts)
            if (s == 0) then
               on_edge = ends(1)
            else if (s == m) then
               on_edge = ends(2)
            else
               on_edge = edge_node(lineage, edge, merge(s, m - s, ends(1) < ends(2)))
            end if
         end associate
      end function on_edge
   end subroutine refine_sets
end module finshell_mesh_refinement
