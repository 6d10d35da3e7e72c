!> Which sides of the elements stay straight because supports prescribe where they are?
!>
!> Drilling rotations that differ between the ends of a side bend it in the plane of the element (finshell_drilling). Where both
!> ends are held along the normal of the side in that plane, the side is held, so it cannot bend: what the support does to it is a
!> traction, which would do work on the bulge, and no nodal reaction could do that work if the drilling rotations are free.
!> With the side kept straight, a constant stress is exact whether the drilling rotations of a prescribed edge are held or not.
module finshell_straight_side
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t
   use finshell_rotation, only: cross_product
   use finshell_support, only: node_support_t
   implicit none
   private
   public :: find_straight_sides

   !> Cosine between a direction and the held ones: on a curved edge the normals of a side and of its nodes differ.
   real(wp), parameter :: along = 0.9_wp

contains

   !> Sides (1-2, 2-3, 3-1) of the elements that are kept straight; unallocated when there are none. Sides whose ends cannot drill
   !> are left alone.
   pure subroutine find_straight_sides(mesh, supported, support_of, straight)
      type(mesh_t), intent(in) :: mesh
      type(node_support_t), intent(in) :: supported(:)
      integer, intent(in) :: support_of(:) !< (nodes) index into supported, 0: free
      logical, allocatable, intent(out) :: straight(:, :) !< (3, elements)
      logical, allocatable :: found(:, :)
      real(wp) :: side(3), normal(3), inward(3)
      integer :: e, k, a, b

      allocate (found(3, size(mesh%triangles, 2)), source=.false.)
      do e = 1, size(mesh%triangles, 2)
         if (count(support_of(mesh%triangles(:, e)) > 0) < 2) cycle
         associate (x => mesh%coordinates(:, mesh%triangles(:, e)))
            normal = cross_product(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1))
            normal = normal/norm2(normal)
            do k = 1, 3
               a = support_of(mesh%triangles(k, e))
               b = support_of(mesh%triangles(1 + mod(k, 3), e))
               if (a == 0 .or. b == 0) cycle
               side = x(:, 1 + mod(k, 3)) - x(:, k)
               inward = cross_product(normal, side/norm2(side))
               found(k, e) = holds(supported(a)%displacements, supported(a)%displacement_axes, inward) &
                  .and. holds(supported(b)%displacements, supported(b)%displacement_axes, inward) &
                  .and. .not. (holds(supported(a)%rotations, supported(a)%rotation_axes, normal) &
                               .and. holds(supported(b)%rotations, supported(b)%rotation_axes, normal))
            end do
         end associate
      end do
      if (any(found)) call move_alloc(found, straight)
   end subroutine find_straight_sides

   !> Is a unit direction among those that are held?
   pure logical function holds(count, axes, direction)
      integer, intent(in) :: count
      real(wp), intent(in) :: axes(3, 3), direction(3)
      holds = norm2(matmul(direction, axes(:, :count))) > along
   end function holds
end module finshell_straight_side
