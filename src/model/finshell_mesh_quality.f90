!> How good the triangles of a mesh are, and what its surface is like.
module finshell_mesh_quality
   use finshell_edges, only: edges_t, new_edges
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t, twice_area_vector
   use finshell_union_find, only: join, new_forest
   implicit none
   private
   public :: quality_t, mesh_quality

   type :: quality_t
      real(wp) :: shortest = huge(1.0_wp), longest = 0 !< sides
      real(wp) :: aspect = 0 !< largest ratio of the longest side to the height over it
      integer :: worst = 0 !< element that has it
      real(wp) :: angle = 180 !< smallest, degrees
      real(wp) :: kink = 0 !< largest between neighbours, degrees
      integer :: free = 0, junctions = 0 !< edges of one triangle, and of more than two
      integer :: parts = 0 !< that are not connected by an edge
   end type quality_t

   real(wp), parameter :: degree = acos(-1.0_wp)/180

contains

   pure function mesh_quality(mesh) result(q)
      type(mesh_t), intent(in) :: mesh
      type(quality_t) :: q
      type(edges_t) :: edges
      real(wp) :: area(3), cosine, other(3), side(3), x(3, 3), aspect
      integer :: e, k
      call new_edges(edges, mesh%triangles)
      do e = 1, size(mesh%triangles, 2)
         x = mesh%coordinates(:, mesh%triangles(:, e))
         side = [(norm2(x(:, 1 + mod(k, 3)) - x(:, k)), k=1, 3)]
         q%shortest = min(q%shortest, minval(side))
         q%longest = max(q%longest, maxval(side))
         aspect = maxval(side)**2/norm2(twice_area_vector(mesh, e))
         if (aspect > q%aspect) then
            q%aspect = aspect
            q%worst = e
         end if
         do k = 1, 3
            ! between the sides that meet at node k
            cosine = dot_product(x(:, 1 + mod(k, 3)) - x(:, k), x(:, 1 + mod(k + 1, 3)) - x(:, k)) &
                     /(side(k)*side(1 + mod(k + 1, 3)))
            q%angle = min(q%angle, acos(max(-1.0_wp, min(1.0_wp, cosine)))/degree)
         end do
      end do
      q%junctions = count(edges%junction)
      q%free = count(edges%elements(2, :) == 0) - q%junctions
      do k = 1, size(edges%nodes, 2)
         if (edges%elements(2, k) == 0) cycle
         area = twice_area_vector(mesh, edges%elements(1, k))
         other = twice_area_vector(mesh, edges%elements(2, k))
         cosine = dot_product(area, other)/(norm2(area)*norm2(other))
         q%kink = max(q%kink, acos(max(-1.0_wp, min(1.0_wp, cosine)))/degree)
      end do
      q%parts = parts_of(mesh)
   end function mesh_quality

   !> Parts that share no node.
   pure integer function parts_of(mesh) result(parts)
      type(mesh_t), intent(in) :: mesh
      integer, allocatable :: root(:)
      integer :: e, i, k
      root = new_forest(size(mesh%coordinates, 2))
      do e = 1, size(mesh%triangles, 2)
         do k = 2, 3
            call join(root, mesh%triangles(1, e), mesh%triangles(k, e))
         end do
      end do
      parts = count([(root(i) == i, i=1, size(root))])
   end function parts_of
end module finshell_mesh_quality
