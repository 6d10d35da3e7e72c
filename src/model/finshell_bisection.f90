!> Newest-vertex bisection: marked triangles are cut, and those beside them as far as needed for a mesh without hanging nodes.
!>
!> Each triangle has a side that is cut first: at the start its longest, of its parts the one opposite to the newest node. Where all
!> three sides are cut the triangle becomes four of its own shape, as in uniform refinement (of one mark on all elements it is
!> that). So all descendants of a flat triangle have one of four shapes, however many there are. The closure marks edges only, of
!> which there are finitely many: it ends for any mesh and any choice of sides (Karkulik, Pavlicek, Praetorius, Constr. Approx. 38,
!> 2013).
module finshell_bisection
   use finshell_edges, only: edges_t, new_edges
   use finshell_inherited_sets, only: inherit_sets
   use finshell_kinds, only: wp
   use finshell_lineage, only: add_middles, lineage_t, unrefined
   use finshell_mesh, only: mesh_t, new_mesh, set_t
   use finshell_patches, only: edge_point, flat_patches, new_patches, patch_normal, patches_t
   use finshell_surface, only: surface_middle, surface_none, surface_normal
   implicit none
   private
   public :: bisection_t, begin_bisection, bisect

   type :: bisection_t
      type(mesh_t) :: base !< the mesh at the start, with the sets that it has of itself
      type(set_t), allocatable :: former_node_sets(:) !< of the start, named ones too
      type(mesh_t) :: mesh !< the present one, with the sets of `base`
      integer :: points = 0 !< so many of the node sets of `base` get no new nodes, but with an edge set
      integer, allocatable :: side(:) !< (elements) the side, from node k to node k + 1, that is cut first
      integer, allocatable :: ends(:, :) !< (2, nodes that came last) edges whose middles they are
      integer, allocatable :: parent(:) !< (elements) which they were part of before the last cut
   end type bisection_t

   real(wp), parameter :: short = 0.3_wp !< a side, beside the longest of its triangle

contains

   !> Begin with a mesh; what `base` and `former_node_sets` hold is given, `mesh` is it or its refinement.
   pure subroutine begin_bisection(self, mesh)
      type(bisection_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh !< with the sets of `base`
      type(edges_t) :: edges
      integer :: e
      self%mesh = mesh
      call new_edges(edges, mesh%triangles)
      allocate (self%side(size(mesh%triangles, 2)))
      do e = 1, size(self%side)
         self%side(e) = longest_side(mesh, edges%of_side(:, e), edges)
      end do
   end subroutine begin_bisection

   !> The longest of three edges; of equal ones that with the lowest number, so that neighbours agree.
   pure integer function longest_side(mesh, three, edges) result(side)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: three(3)
      type(edges_t), intent(in) :: edges
      real(wp), parameter :: longer = 1 + 1.0e-6_wp
      real(wp) :: length(3)
      integer :: k
      do k = 1, 3
         associate (ends => edges%nodes(:, three(k)))
            length(k) = norm2(mesh%coordinates(:, ends(2)) - mesh%coordinates(:, ends(1)))
         end associate
      end do
      side = 1
      do k = 2, 3
         if (length(k) > longer*length(side)) then
            side = k
         else if (length(k)*longer >= length(side) .and. three(k) < three(side)) then
            side = k
         end if
      end do
   end function longest_side

   !> Cut the marked triangles, each into four; of slender ones the long sides only, so that they become less so, unless
   !> all are to be cut in four.
   !>
   !> New nodes lie on the surface of the generator where that is known, else on the smooth surface through the old ones that
   !> `crease_angle`, `normal` and `crease` say (finshell_patches), without `crease_angle` on the facets.
   subroutine bisect(self, marked, crease_angle, normal, crease)
      type(bisection_t), intent(inout) :: self
      logical, intent(in), optional :: marked(:) !< (elements); absent: all
      real(wp), intent(in), optional :: crease_angle !< degrees
      real(wp), intent(in), optional :: normal(:, :, :) !< (3, 3, elements)
      integer, intent(in), optional :: crease(:, :) !< (2, :) pairs of nodes
      type(edges_t) :: edges
      type(lineage_t) :: lineage
      type(mesh_t) :: fine
      real(wp), allocatable :: normals(:, :), x(:, :)
      integer, allocatable :: at(:), middle(:), parent(:), side(:), triangles(:, :)
      logical, allocatable :: cut(:)
      integer :: i, n

      call new_edges(edges, self%mesh%triangles)
      if (present(marked)) then
         call close_up(self%mesh, edges, self%side, marked, cut)
      else
         allocate (cut(size(edges%nodes, 2)), source=.true.)
      end if
      ! middles in the order of the edges
      allocate (middle(size(cut)), source=0)
      n = size(self%mesh%coordinates, 2)
      at = pack([(i, i=1, size(cut))], cut)
      do i = 1, size(at)
         middle(at(i)) = n + i
      end do
      self%ends = edges%nodes(:, at)
      call place_middles(self%mesh, edges, at, x, normals, crease_angle, normal, crease)
      call cut_triangles(self%mesh%triangles, edges, self%side, middle, triangles, side, parent)

      if (allocated(self%mesh%lineage)) then
         lineage = self%mesh%lineage
      else
         call unrefined(lineage, n, self%mesh%triangles)
      end if
      call add_middles(lineage, self%ends, [(edges%elements(1, at(i)), i=1, size(at))])
      lineage%parent = lineage%parent(parent)
      call new_mesh(fine, reshape([self%mesh%coordinates, x], [3, n + size(at)]), triangles)
      if (allocated(normals)) fine%normal = reshape([self%mesh%normal, normals], [3, n + size(at)])
      fine%surface = self%mesh%surface
      fine%coincident_nodes_allowed = self%base%coincident_nodes_allowed
      if (allocated(self%base%results)) fine%results = self%base%results
      if (allocated(self%base%empty_sets)) fine%empty_sets = self%base%empty_sets
      call inherit_sets(self%base, lineage, fine, self%points)
      fine%lineage = lineage
      self%mesh = fine
      call move_alloc(side, self%side)
      call move_alloc(parent, self%parent)
   end subroutine bisect

   !> Edges to cut: those of the marked triangles that are not short, and the first side of every triangle that has one of them,
   !> until none is left.
   subroutine close_up(mesh, edges, side, marked, cut)
      type(mesh_t), intent(in) :: mesh
      type(edges_t), intent(in) :: edges
      integer, intent(in) :: side(:)
      logical, intent(in) :: marked(:)
      logical, allocatable, intent(out) :: cut(:)
      integer, allocatable :: stack(:)
      real(wp) :: length(3)
      integer :: e, i, k, n
      allocate (cut(size(edges%nodes, 2)), source=.false.)
      allocate (stack(size(cut)))
      n = 0
      do e = 1, size(marked)
         if (.not. marked(e)) cycle
         do k = 1, 3
            associate (ends => edges%nodes(:, edges%of_side(k, e)))
               length(k) = norm2(mesh%coordinates(:, ends(2)) - mesh%coordinates(:, ends(1)))
            end associate
         end do
         do k = 1, 3
            if (length(k) > short*maxval(length)) call push(edges%of_side(k, e))
         end do
      end do
      do while (n > 0)
         i = stack(n)
         n = n - 1
         do k = 1, 2
            e = edges%elements(k, i)
            if (e > 0) call push(edges%of_side(side(e), e))
         end do
      end do

   contains

      subroutine push(edge)
         integer, intent(in) :: edge
         if (cut(edge)) return
         cut(edge) = .true.
         n = n + 1
         stack(n) = edge
      end subroutine push
   end subroutine close_up

   !> New nodes, and the normals there if the mesh has normals.
   pure subroutine place_middles(mesh, edges, at, x, normals, crease_angle, normal, crease)
      type(mesh_t), intent(in) :: mesh
      type(edges_t), intent(in) :: edges
      integer, intent(in) :: at(:)
      real(wp), allocatable, intent(out) :: x(:, :), normals(:, :)
      real(wp), intent(in), optional :: crease_angle
      real(wp), intent(in), optional :: normal(:, :, :)
      integer, intent(in), optional :: crease(:, :)
      type(patches_t) :: patches
      real(wp) :: n(3), u(3)
      integer :: e, i, k, s

      allocate (x(3, size(at)))
      if (allocated(mesh%normal)) allocate (normals(3, size(at)), source=0.0_wp)
      if (mesh%surface%kind /= surface_none) then
         do i = 1, size(at)
            x(:, i) = surface_middle(mesh%surface, mesh%coordinates(:, edges%nodes(:, at(i))), edges%elements(2, at(i)) == 0)
            if (allocated(normals)) normals(:, i) = surface_normal(mesh%surface, x(:, i))
         end do
         return
      end if
      if (present(crease_angle)) then
         call new_patches(patches, mesh, edges, crease_angle, normal, crease)
      else
         call flat_patches(patches, mesh, edges)
      end if
      do i = 1, size(at)
         x(:, i) = edge_point(patches, mesh, edges, at(i), 0.5_wp)
         if (.not. allocated(normals)) cycle
         do k = 1, 2
            e = edges%elements(k, at(i))
            if (e == 0) cycle
            s = findloc(edges%of_side(:, e), at(i), dim=1)
            u = 0.5_wp
            u(1 + mod(s + 1, 3)) = 0
            n = patch_normal(patches, mesh, edges, e, u)
            ! normals of the mesh may point to either side
            if (dot_product(n, sum(mesh%normal(:, mesh%triangles(:, e)), 2)) < 0) n = -n
            normals(:, i) = normals(:, i) + n
         end do
      end do
   end subroutine place_middles

   !> Triangles with their first side behind the bisection, each in the place of the one that it is part of.
   subroutine cut_triangles(before, edges, first, middle, triangles, side, parent)
      integer, intent(in) :: before(:, :) !< (3, elements before)
      type(edges_t), intent(in) :: edges
      integer, intent(in) :: first(:) !< sides before
      integer, intent(in) :: middle(:) !< (edges) node there, or 0
      integer, allocatable, intent(out) :: triangles(:, :), side(:), parent(:)
      integer :: e, k, n, m(3), v(3)
      allocate (triangles(3, 4*size(first)), side(4*size(first)), parent(4*size(first)))
      n = 0
      do e = 1, size(first)
         k = first(e)
         m = middle(edges%of_side(:, e))
         if (m(k) == 0) then
            call append(before(:, e), k)
            cycle
         end if
         if (all(m > 0)) then
            ! side for side parallel to the triangle
            v = before(:, e)
            call append([v(1), m(1), m(3)], k)
            call append([m(1), v(2), m(2)], k)
            call append([m(2), m(3), m(1)], k)
            call append([m(3), m(2), v(3)], k)
            cycle
         end if
         v = cshift(before(:, e), k - 1)
         m = cshift(m, k - 1)
         ! both parts have the side that is cut next first, and the new node last
         call part(v(3), v(1), m(1), m(3))
         call part(v(2), v(3), m(1), m(2))
      end do
      triangles = triangles(:, :n)
      side = side(:n)
      parent = parent(:n)

   contains

      subroutine part(a, b, apex, between)
         integer, intent(in) :: a, b, apex, between !< node between a and b, or 0
         if (between == 0) then
            call append([a, b, apex], 1)
         else
            call append([apex, a, between], 1)
            call append([b, apex, between], 1)
         end if
      end subroutine part

      subroutine append(triangle, cut_first)
         integer, intent(in) :: triangle(3), cut_first
         n = n + 1
         triangles(:, n) = triangle
         side(n) = cut_first
         parent(n) = e
      end subroutine append
   end subroutine cut_triangles
end module finshell_bisection
