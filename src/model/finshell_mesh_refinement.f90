!> Finer meshes: every triangle in four, as often as wanted, with all sets.
module finshell_mesh_refinement
   use finshell_kinds, only: wp
   use finshell_inherited_sets, only: inherit_sets
   use finshell_lineage, only: lineage_t, node_count, unrefined
   use finshell_mesh, only: mesh_t, new_mesh
   use finshell_patches, only: patches_t, edge_point, flat_patches, new_patches, patch_normal, patch_point
   implicit none
   private
   public :: refine_mesh

   !> Numbers of new nodes: behind those of the mesh before come those on its edges, then those inside its triangles.
   type :: grid_t
      integer :: cuts = 1 !< parts of every side
      integer :: nodes = 0, edges = 0 !< of the mesh before
   end type grid_t

contains

   !> Cut every triangle in four, `levels` times.
   !>
   !> With `crease_angle` new nodes lie on a smooth surface through the old ones (finshell_patches), else on the facets. Nodes keep
   !> their numbers, triangles their order and orientation; mesh%normal, if the mesh has it, is that of the smooth surface. A node
   !> set of the name of an edge set gets the nodes of its edges; others among the first `points` get none unless they grow; those
   !> behind get what `inherited_nodes` says.
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
      type(grid_t) :: grid
      real(wp), allocatable :: x(:, :)
      integer, allocatable :: triangles(:, :)
      integer :: a, b, e, i, m

      m = 2**levels
      call unrefined(lineage, size(mesh%coordinates, 2), mesh%triangles)
      grid = grid_t(m, lineage%nodes, size(lineage%edges%nodes, 2))
      call place_nodes(grid, lineage)
      if (present(crease_angle)) then
         call new_patches(patches, mesh, lineage%edges, crease_angle, normal, crease)
      else
         call flat_patches(patches, mesh, lineage%edges)
      end if
      allocate (x(3, node_count(lineage)), triangles(3, m**2*size(mesh%triangles, 2)))
      x(:, :lineage%nodes) = mesh%coordinates
      do i = 1, size(lineage%edges%nodes, 2)
         do a = 1, m - 1
            x(:, edge_node(grid, i, a)) = edge_point(patches, mesh, lineage%edges, i, real(a, wp)/m)
         end do
      end do
      do e = 1, size(mesh%triangles, 2)
         do a = 1, m - 2
            do b = 1, m - 1 - a
               x(:, inner_node(grid, e, a, b)) = patch_point(patches, mesh, lineage%edges, e, barycentric(a, b))
            end do
         end do
         associate (n => m**2*(e - 1))
            triangles(:, n + 1:n + m**2) = parts_of(grid, lineage, e)
         end associate
      end do
      call new_mesh(fine, x, triangles)
      if (allocated(mesh%normal)) fine%normal = normals_of(patches, mesh, grid, lineage, fine)
      fine%coincident_nodes_allowed = mesh%coincident_nodes_allowed
      if (allocated(mesh%results)) fine%results = mesh%results
      if (allocated(mesh%empty_sets)) fine%empty_sets = mesh%empty_sets
      call inherit_sets(mesh, lineage, fine, points)
      fine%lineage = lineage

   contains

      pure function barycentric(a, b) result(u)
         integer, intent(in) :: a, b
         real(wp) :: u(3)
         u = [real(m - a - b, wp), real(a, wp), real(b, wp)]/m
      end function barycentric
   end subroutine refine_mesh

   !> Where the new nodes and elements lie.
   pure subroutine place_nodes(grid, lineage)
      type(grid_t), intent(in) :: grid
      type(lineage_t), intent(inout) :: lineage
      integer :: e, i, k, inside, m
      m = grid%cuts
      inside = (m - 1)*(m - 2)/2
      lineage%parent = [((e, k=1, m**2), e=1, size(lineage%triangles, 2))]
      lineage%edge = [((i, k=1, m - 1), i=1, grid%edges), (0, i=1, inside*size(lineage%triangles, 2))]
      lineage%share = [((real(k, wp)/m, k=1, m - 1), i=1, grid%edges), (0.0_wp, i=1, inside*size(lineage%triangles, 2))]
      lineage%element = [(0, i=1, (m - 1)*grid%edges), ((e, k=1, inside), e=1, size(lineage%triangles, 2))]
   end subroutine place_nodes

   !> Node number `s` (1 to cuts - 1) of edge `i`, from its first node to its second.
   elemental integer function edge_node(grid, i, s)
      type(grid_t), intent(in) :: grid
      integer, intent(in) :: i, s
      edge_node = grid%nodes + (i - 1)*(grid%cuts - 1) + s
   end function edge_node

   !> Node inside of element `e` at a, b > 0, a + b < cuts parts from its first node towards its second and third.
   elemental integer function inner_node(grid, e, a, b)
      type(grid_t), intent(in) :: grid
      integer, intent(in) :: e, a, b
      associate (m => grid%cuts)
         inner_node = grid%nodes + grid%edges*(m - 1) + (e - 1)*((m - 1)*(m - 2)/2) + (a - 1)*(m - 2) - (a - 1)*(a - 2)/2 + b
      end associate
   end function inner_node

   !> The triangles into which an element is cut, row by row.
   pure function parts_of(grid, lineage, e) result(triangles)
      type(grid_t), intent(in) :: grid
      type(lineage_t), intent(in) :: lineage
      integer, intent(in) :: e
      integer :: triangles(3, grid%cuts**2)
      integer :: a, b, n
      n = 0
      do b = 0, grid%cuts - 1
         do a = 0, grid%cuts - 1 - b
            n = n + 1
            triangles(:, n) = [grid_node(grid, lineage, e, a, b), grid_node(grid, lineage, e, a + 1, b), &
                               grid_node(grid, lineage, e, a, b + 1)]
            if (a + b == grid%cuts - 1) cycle
            n = n + 1
            triangles(:, n) = [grid_node(grid, lineage, e, a + 1, b), grid_node(grid, lineage, e, a + 1, b + 1), &
                               grid_node(grid, lineage, e, a, b + 1)]
         end do
      end do
   end function parts_of

   !> Node of element `e` at a, b >= 0, a + b <= cuts.
   pure integer function grid_node(grid, lineage, e, a, b) result(node)
      type(grid_t), intent(in) :: grid
      type(lineage_t), intent(in) :: lineage
      integer, intent(in) :: e, a, b
      associate (m => grid%cuts, t => lineage%triangles(:, e))
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
            node = inner_node(grid, e, a, b)
         end if
      end associate

   contains

      !> `s` parts along side `k`.
      pure integer function side_node(k, s)
         integer, intent(in) :: k, s
         associate (edge => lineage%edges%of_side(k, e))
            if (lineage%edges%nodes(1, edge) == lineage%triangles(k, e)) then
               side_node = edge_node(grid, edge, s)
            else
               side_node = edge_node(grid, edge, grid%cuts - s)
            end if
         end associate
      end function side_node
   end function grid_node

   !> Normals at the nodes: those given, and between them the mean of the patches'.
   pure function normals_of(patches, mesh, grid, lineage, fine) result(normal)
      type(patches_t), intent(in) :: patches
      type(mesh_t), intent(in) :: mesh, fine
      type(grid_t), intent(in) :: grid
      type(lineage_t), intent(in) :: lineage
      real(wp), allocatable :: normal(:, :)
      real(wp) :: n(3)
      integer :: a, b, e, m, node
      allocate (normal(3, size(fine%coordinates, 2)), source=0.0_wp)
      m = grid%cuts
      do e = 1, size(mesh%triangles, 2)
         do a = 0, m
            do b = 0, m - a
               node = grid_node(grid, lineage, e, a, b)
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
end module finshell_mesh_refinement
