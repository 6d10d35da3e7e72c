!> A smooth surface through the nodes of a mesh: a cubic triangle over each element.
!>
!> Edges inside are arcs along the normals at their ends; edges at the boundary and at creases are arcs along the line that they
!> form, so that a boundary in a plane stays there, and both sides of a crease meet. An arc is a cubic whose middle lies on the
!> circle where there is one. Where normals are those of the facets the patches are the facets.
module finshell_patches
   use finshell_kinds, only: wp
   use finshell_edges, only: edges_t, find_edge
   use finshell_mesh, only: mesh_t, twice_area_vector
   use finshell_rotation, only: cross_product
   implicit none
   private
   public :: patches_t, new_patches, flat_patches, patch_point, patch_normal, edge_point

   type :: patches_t
      real(wp), allocatable :: handles(:, :, :) !< (3, 2, edges) inner control points, from the first node of an edge to its second
      real(wp), allocatable :: centre(:, :) !< (3, elements) control point in the middle
   end type patches_t

   integer, parameter :: of_centre = 6
   real(wp), parameter :: degree = acos(-1.0_wp)/180
   !> Sine of the angle between a chord and the surface below which the edge is straight.
   real(wp), parameter :: straight = 1.0e-12_wp

contains

   !> The facets themselves.
   pure subroutine flat_patches(patches, mesh, edges)
      type(patches_t), intent(out) :: patches
      type(mesh_t), intent(in) :: mesh
      type(edges_t), intent(in) :: edges
      integer :: i
      allocate (patches%handles(3, 2, size(edges%nodes, 2)))
      do i = 1, size(edges%nodes, 2)
         associate (a => mesh%coordinates(:, edges%nodes(1, i)), b => mesh%coordinates(:, edges%nodes(2, i)))
            patches%handles(:, :, i) = reshape([(2*a + b)/3, (a + 2*b)/3], [3, 2])
         end associate
      end do
      call set_centres(patches, mesh, edges)
   end subroutine flat_patches

   !> Curved patches. Facets that meet at more than `crease_angle` degrees, and those at the edges in `crease`, meet in a crease;
   !> lines at boundaries and creases that turn by more have a corner.
   pure subroutine new_patches(patches, mesh, edges, crease_angle, normal, crease)
      type(patches_t), intent(out) :: patches
      type(mesh_t), intent(in) :: mesh
      type(edges_t), intent(in) :: edges
      real(wp), intent(in) :: crease_angle
      real(wp), intent(in), optional :: normal(:, :, :) !< (3, 3, elements) at the nodes of the elements; without: they are flat
      integer, intent(in), optional :: crease(:, :) !< (2, :) pairs of nodes
      logical, allocatable :: line(:)
      real(wp), allocatable :: tangent(:, :, :), along(:, :)
      integer, allocatable :: at(:, :)
      integer :: i, k
      real(wp) :: cosine
      logical :: known(2)

      cosine = cos(crease_angle*degree)
      call flat_patches(patches, mesh, edges)
      ! a surface with one normal at every node has no creases
      call find_lines(mesh, edges, merge(-2.0_wp, cosine, allocated(mesh%normal)), line, crease)
      ! the two edges of a line at each node
      allocate (at(3, size(mesh%coordinates, 2)), source=0)
      do i = 1, size(line)
         if (.not. line(i)) cycle
         do k = 1, 2
            associate (here => at(:, edges%nodes(k, i)))
               here(3) = here(3) + 1
               if (here(3) <= 2) here(here(3)) = i
            end associate
         end do
      end do
      ! of each edge, unit vectors along it at both ends
      allocate (tangent(3, 2, size(line)), along(3, size(line)))
      do i = 1, size(line)
         along(:, i) = mesh%coordinates(:, edges%nodes(2, i)) - mesh%coordinates(:, edges%nodes(1, i))
      end do
      do i = 1, size(line)
         associate (length => norm2(along(:, i)), chord => along(:, i)/norm2(along(:, i)))
            known = .false.
            if (line(i)) then
               do k = 1, 2
                  call line_tangent(edges, along, at(:, edges%nodes(k, i)), i, k, cosine, tangent(:, k, i), known(k))
               end do
               ! an arc of a circle turns as much at one end as at the other
               do k = 1, 2
                  if (known(k) .or. .not. known(3 - k)) cycle
                  tangent(:, k, i) = 2*dot_product(chord, tangent(:, 3 - k, i))*chord - tangent(:, 3 - k, i)
               end do
            end if
            if (.not. any(known)) then
               do k = 1, 2
                  tangent(:, k, i) = chord
                  if (present(normal)) tangent(:, k, i) = surface_tangent(mesh, edges, normal, i, k, chord)
               end do
            end if
            call set_handles(patches%handles(:, :, i), mesh%coordinates(:, edges%nodes(:, i)), tangent(:, :, i), chord, length)
         end associate
      end do
      call set_centres(patches, mesh, edges)
   end subroutine new_patches

   !> Which edges are boundaries or creases.
   pure subroutine find_lines(mesh, edges, cosine, line, crease)
      type(mesh_t), intent(in) :: mesh
      type(edges_t), intent(in) :: edges
      real(wp), intent(in) :: cosine
      logical, allocatable, intent(out) :: line(:)
      integer, intent(in), optional :: crease(:, :)
      real(wp) :: n(3, 2)
      integer :: i, k
      line = edges%elements(2, :) == 0
      do i = 1, size(line)
         if (line(i)) cycle
         do k = 1, 2
            n(:, k) = twice_area_vector(mesh, edges%elements(k, i))
         end do
         line(i) = dot_product(n(:, 1), n(:, 2)) < cosine*norm2(n(:, 1))*norm2(n(:, 2))
      end do
      if (.not. present(crease)) return
      do i = 1, size(crease, 2)
         k = find_edge(edges, crease(1, i), crease(2, i))
         if (k > 0) line(k) = .true.
      end do
   end subroutine find_lines

   !> Direction of a line at end `k` of its edge `i`: that of the circle through the ends of both edges there, if the line goes on
   !> without a corner.
   pure subroutine line_tangent(edges, along, at, i, k, cosine, tangent, known)
      type(edges_t), intent(in) :: edges
      real(wp), intent(in) :: along(:, :) !< (3, edges) from the first to the second node
      integer, intent(in) :: at(3), i, k !< edges of lines at the node, and their number
      real(wp), intent(in) :: cosine
      real(wp), intent(out) :: tangent(3)
      logical, intent(out) :: known
      real(wp) :: mine(3), next(3)
      integer :: other
      tangent = 0
      known = .false.
      if (at(3) /= 2) return
      other = merge(at(2), at(1), at(1) == i)
      mine = along(:, i)
      next = along(:, other)
      ! both in the direction in which edge i runs
      if (edges%nodes(k, other) == edges%nodes(k, i)) next = -next
      if (dot_product(mine, next) < cosine*norm2(mine)*norm2(next)) return
      tangent = mine/dot_product(mine, mine) + next/dot_product(next, next)
      tangent = tangent/norm2(tangent)
      known = .true.
   end subroutine line_tangent

   !> The chord of edge `i` as it leaves end `k` along the surface; where two surfaces meet in a crease, along both.
   pure function surface_tangent(mesh, edges, normal, i, k, chord) result(tangent)
      type(mesh_t), intent(in) :: mesh
      type(edges_t), intent(in) :: edges
      real(wp), intent(in) :: normal(:, :, :), chord(3)
      integer, intent(in) :: i, k
      real(wp) :: tangent(3), n(3, 2)
      integer :: e, side
      do side = 1, 2
         e = edges%elements(side, i)
         if (e == 0) e = edges%elements(1, i)
         n(:, side) = normal(:, findloc(mesh%triangles(:, e), edges%nodes(k, i), dim=1), e)
      end do
      tangent = cross_product(n(:, 1), n(:, 2))
      if (norm2(tangent) > 0.1_wp) then
         tangent = sign(1.0_wp, dot_product(tangent, chord))*tangent/norm2(tangent)
         if (dot_product(tangent, chord) > 0.5_wp) return
      end if
      tangent = chord
      n(:, 1) = n(:, 1) + n(:, 2)
      n(:, 1) = n(:, 1)/norm2(n(:, 1))
      if (abs(dot_product(chord, n(:, 1))) < straight) return
      tangent = chord - dot_product(chord, n(:, 1))*n(:, 1)
      tangent = tangent/norm2(tangent)
   end function surface_tangent

   !> Inner control points of a cubic along given directions. Where these are those of an arc of a circle the middles of both curves
   !> are the same.
   pure subroutine set_handles(handles, ends, tangent, chord, length)
      real(wp), intent(inout) :: handles(3, 2)
      real(wp), intent(in) :: ends(3, 2), tangent(3, 2), chord(3), length
      real(wp) :: reach
      if (all(abs(tangent - spread(chord, 2, 2)) < straight)) return
      reach = 2*length/3/(1 + 0.5_wp*dot_product(chord, sum(tangent, 2)))
      handles(:, 1) = ends(:, 1) + reach*tangent(:, 1)
      handles(:, 2) = ends(:, 2) - reach*tangent(:, 2)
   end subroutine set_handles

   !> The middle control points that reproduce quadratic surfaces.
   pure subroutine set_centres(patches, mesh, edges)
      type(patches_t), intent(inout) :: patches
      type(mesh_t), intent(in) :: mesh
      type(edges_t), intent(in) :: edges
      integer :: e, k
      real(wp) :: around(3), corners(3)
      if (.not. allocated(patches%centre)) allocate (patches%centre(3, size(mesh%triangles, 2)))
      do e = 1, size(mesh%triangles, 2)
         corners = sum(mesh%coordinates(:, mesh%triangles(:, e)), 2)/3
         around = 0
         do k = 1, 3
            around = around + sum(patches%handles(:, :, edges%of_side(k, e)), 2)/2
         end do
         patches%centre(:, e) = 0.5_wp*(around - corners)
      end do
   end subroutine set_centres

   !> Point of edge `i` at the share `s` of the way from its first node to its second.
   pure function edge_point(patches, mesh, edges, i, s) result(x)
      type(patches_t), intent(in) :: patches
      type(mesh_t), intent(in) :: mesh
      type(edges_t), intent(in) :: edges
      integer, intent(in) :: i
      real(wp), intent(in) :: s
      real(wp) :: x(3)
      associate (t => 1 - s, a => mesh%coordinates(:, edges%nodes(1, i)), b => mesh%coordinates(:, edges%nodes(2, i)), &
                 c => patches%handles(:, :, i))
         x = t**3*a + 3*t**2*s*c(:, 1) + 3*t*s**2*c(:, 2) + s**3*b
      end associate
   end function edge_point

   !> Point of the patch of element `e` with the barycentric coordinates `u`.
   pure function patch_point(patches, mesh, edges, e, u) result(x)
      type(patches_t), intent(in) :: patches
      type(mesh_t), intent(in) :: mesh
      type(edges_t), intent(in) :: edges
      integer, intent(in) :: e
      real(wp), intent(in) :: u(3)
      real(wp) :: x(3), c(3, 2)
      integer :: k, l
      x = of_centre*product(u)*patches%centre(:, e)
      do k = 1, 3
         l = 1 + mod(k, 3)
         c = side_handles(patches, mesh, edges, e, k)
         x = x + u(k)**3*mesh%coordinates(:, mesh%triangles(k, e)) + 3*u(k)*u(l)*(u(k)*c(:, 1) + u(l)*c(:, 2))
      end do
   end function patch_point

   !> Unit normal of the patch there.
   pure function patch_normal(patches, mesh, edges, e, u) result(n)
      type(patches_t), intent(in) :: patches
      type(mesh_t), intent(in) :: mesh
      type(edges_t), intent(in) :: edges
      integer, intent(in) :: e
      real(wp), intent(in) :: u(3)
      real(wp) :: n(3), d(3, 3), c(3, 2)
      integer :: k, l
      do k = 1, 3
         d(:, k) = of_centre*u(1 + mod(k, 3))*u(1 + mod(k + 1, 3))*patches%centre(:, e) &
            + 3*u(k)**2*mesh%coordinates(:, mesh%triangles(k, e))
      end do
      do k = 1, 3
         l = 1 + mod(k, 3)
         c = side_handles(patches, mesh, edges, e, k)
         d(:, k) = d(:, k) + 3*u(l)*(2*u(k)*c(:, 1) + u(l)*c(:, 2))
         d(:, l) = d(:, l) + 3*u(k)*(u(k)*c(:, 1) + 2*u(l)*c(:, 2))
      end do
      n = cross_product(d(:, 2) - d(:, 1), d(:, 3) - d(:, 1))
      n = n/norm2(n)
   end function patch_normal

   !> Control points of side `k` of an element, in its own direction.
   pure function side_handles(patches, mesh, edges, e, k) result(c)
      type(patches_t), intent(in) :: patches
      type(mesh_t), intent(in) :: mesh
      type(edges_t), intent(in) :: edges
      integer, intent(in) :: e, k
      real(wp) :: c(3, 2)
      c = patches%handles(:, :, edges%of_side(k, e))
      if (edges%nodes(1, edges%of_side(k, e)) /= mesh%triangles(k, e)) c = c(:, [2, 1])
   end function side_handles
end module finshell_patches
