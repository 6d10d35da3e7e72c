!> Which sides of the elements do supports hold, so that nothing bends them?
!>
!> Drilling rotations that differ between the ends of a side bend it in the plane of the element (finshell_drilling). Where both
!> ends are held along the normal of the side in that plane, the side is held, so it cannot bend: what the support does to it is a
!> traction, which would do work on the bulge, and no nodal reaction could do that work if the drilling rotations are free.
!> With the side kept straight, a constant stress is exact whether the drilling rotations of a prescribed edge are held or not.
!>
!> Where the ends are held along the normal of the element too, its slopes do not bow the side either (finshell_reference).
module finshell_held_side
   use finshell_kinds, only: wp, i8
   use finshell_batch, only: side_free, side_straight, side_fixed
   use finshell_mesh, only: mesh_t, twice_area_vector
   use finshell_mesh_sorting, only: sorted_order
   use finshell_rotation, only: cross_product
   use finshell_support, only: node_support_t
   implicit none
   private
   public :: find_held_sides

   !> Cosine between a direction and the held ones: on a curved edge the normals of a side and of its nodes differ. A side between
   !> two elements may lie on a line of support, but also run from one edge to another at a small angle to what is held.
   real(wp), parameter :: along = 0.9_wp, along_inside = 1 - 1.0e-6_wp

contains

   !> What holds the sides (1-2, 2-3, 3-1) of the elements; unallocated when nothing does. Sides whose ends cannot drill are left
   !> alone.
   pure subroutine find_held_sides(mesh, supported, support_of, held)
      type(mesh_t), intent(in) :: mesh
      type(node_support_t), intent(in) :: supported(:)
      integer, intent(in) :: support_of(:) !< (nodes) index into supported, 0: free
      integer, allocatable, intent(out) :: held(:, :) !< (3, elements)
      integer, allocatable :: found(:, :), order(:)
      integer(i8), allocatable :: key(:) !< of the sides whose ends have supports: their nodes
      integer, allocatable :: side(:, :) !< their elements and numbers
      real(wp) :: limit
      integer :: e, i, k, n

      n = 3*size(mesh%triangles, 2)
      allocate (key(n), side(2, n))
      n = 0
      do e = 1, size(mesh%triangles, 2)
         if (count(support_of(mesh%triangles(:, e)) > 0) < 2) cycle
         do k = 1, 3
            associate (ends => mesh%triangles([k, 1 + mod(k, 3)], e))
               if (any(support_of(ends) == 0)) cycle
               n = n + 1
               side(:, n) = [e, k]
               key(n) = minval(ends)*(size(support_of) + 1_i8) + maxval(ends)
            end associate
         end do
      end do

      allocate (found(3, size(mesh%triangles, 2)), source=side_free)
      order = sorted_order(key(:n))
      do i = 1, n
         limit = along
         if (i > 1) limit = merge(along_inside, limit, key(order(i)) == key(order(i - 1)))
         if (i < n) limit = merge(along_inside, limit, key(order(i)) == key(order(i + 1)))
         associate (e => side(1, order(i)), k => side(2, order(i)))
            found(k, e) = what_holds(mesh, e, k, supported(support_of(mesh%triangles(k, e))), &
                                     supported(support_of(mesh%triangles(1 + mod(k, 3), e))), limit)
         end associate
      end do
      if (any(found /= side_free)) call move_alloc(found, held)
   end subroutine find_held_sides

   !> What the supports of its ends do to side k of element e.
   pure integer function what_holds(mesh, e, k, a, b, limit) result(kind)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: e, k
      type(node_support_t), intent(in) :: a, b
      real(wp), intent(in) :: limit
      real(wp) :: normal(3), side(3)
      normal = twice_area_vector(mesh, e)
      normal = normal/norm2(normal)
      side = mesh%coordinates(:, mesh%triangles(1 + mod(k, 3), e)) - mesh%coordinates(:, mesh%triangles(k, e))
      kind = side_free
      if (holds(a%rotations, a%rotation_axes, normal, along) .and. holds(b%rotations, b%rotation_axes, normal, along)) return
      if (.not. held_along(cross_product(normal, side/norm2(side)))) return
      kind = merge(side_fixed, side_straight, held_along(normal))

   contains

      pure logical function held_along(direction)
         real(wp), intent(in) :: direction(3)
         held_along = holds(a%displacements, a%displacement_axes, direction, limit) &
            .and. holds(b%displacements, b%displacement_axes, direction, limit)
      end function held_along
   end function what_holds

   !> Is a unit direction among those that are held?
   pure logical function holds(count, axes, direction, limit)
      integer, intent(in) :: count
      real(wp), intent(in) :: axes(3, 3), direction(3), limit
      holds = norm2(matmul(direction, axes(:, :count))) > limit
   end function holds
end module finshell_held_side
