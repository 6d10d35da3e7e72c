!> Meshes of rectangles and of quadrilaterals given by their corners (Cook's membrane, skew plates, hyperbolic paraboloids).
module finshell_mesh_rectangle
   use finshell_kinds, only: wp
   use finshell_rotation, only: cross_product
   use finshell_error, only: error_t, raise
   use finshell_status, only: status_input_error
   use finshell_mesh, only: mesh_t, new_mesh
   use finshell_mesh_grid, only: grid_t, new_grid, add_grid_sets, require_positive
   use finshell_surface, only: surface_t, surface_bilinear, surface_flat
   implicit none
   private
   public :: rectangle_mesh, quadrilateral_mesh

   character(len=*), parameter :: sides(4) = [character(len=2) :: 'x0', 'x1', 'y0', 'y1']

contains

   !> Rectangle 0 <= x <= lengths(1), 0 <= y <= lengths(2) in the plane z = 0, normal +z.
   !>
   !> Sets: edge_x0, edge_x1, edge_y0, edge_y1; corner_x0_y0, corner_x1_y0, corner_x0_y1, corner_x1_y1; where the number of
   !> divisions is even mid_x0, mid_x1 (middle of the edge x = 0, x = lengths(1)), mid_y0, mid_y1, centre.
   subroutine rectangle_mesh(mesh, lengths, divisions, error, diagonal, distortion)
      type(mesh_t), intent(out) :: mesh
      real(wp), intent(in) :: lengths(2)
      integer, intent(in) :: divisions(2) !< cells along x and y
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: diagonal !< default 'alternating'
      real(wp), intent(in), optional :: distortion !< default 0
      real(wp) :: corners(3, 4)

      call require_positive('lengths(1)', lengths(1), error)
      call require_positive('lengths(2)', lengths(2), error)
      if (allocated(error)) return
      corners = 0.0_wp
      corners(1, 2:3) = lengths(1)
      corners(2, 3:4) = lengths(2)
      call quadrilateral_mesh(mesh, corners, divisions, error, diagonal, distortion)
   end subroutine rectangle_mesh

   !> Quadrilateral with straight edges: corners(:, 1:4) counterclockwise seen from the tip of the normal, interior bilinear.
   !>
   !> Sets as for the rectangle: y0 is the side from corner 1 to 2, x1 from 2 to 3, y1 from 4 to 3, x0 from 1 to 4.
   subroutine quadrilateral_mesh(mesh, corners, divisions, error, diagonal, distortion)
      type(mesh_t), intent(out) :: mesh
      real(wp), intent(in) :: corners(3, 4)
      integer, intent(in) :: divisions(2) !< cells along the side from corner 1 to 2, and from corner 2 to 3
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: diagonal !< default 'alternating'
      real(wp), intent(in), optional :: distortion !< default 0
      type(grid_t) :: grid
      character(len=:), allocatable :: chosen_diagonal
      real(wp), allocatable :: x(:, :)
      real(wp) :: amount
      integer :: i

      chosen_diagonal = 'alternating'
      if (present(diagonal)) chosen_diagonal = diagonal
      amount = 0.0_wp
      if (present(distortion)) amount = distortion
      call check_convex(corners, error)
      if (allocated(error)) return
      call new_grid(grid, divisions, chosen_diagonal, error, distortion=amount)
      if (allocated(error)) return
      allocate (x(3, size(grid%parameters, 2)))
      do i = 1, size(x, 2)
         associate (s => grid%parameters(1, i), t => grid%parameters(2, i))
            x(:, i) = (1.0_wp - s)*(1.0_wp - t)*corners(:, 1) + s*(1.0_wp - t)*corners(:, 2) + s*t*corners(:, 3) &
               + (1.0_wp - s)*t*corners(:, 4)
         end associate
      end do
      call new_mesh(mesh, x, grid%triangles)
      call add_grid_sets(mesh, grid, sides)
      mesh%surface%kind = surface_flat
      if (.not. warped(corners)) return
      mesh%surface = surface_t(surface_bilinear, reshape(corners, [12]))
      allocate (mesh%normal, source=x)
      do i = 1, size(x, 2)
         associate (s => grid%parameters(1, i), t => grid%parameters(2, i))
            mesh%normal(:, i) = cross_product((1 - t)*(corners(:, 2) - corners(:, 1)) + t*(corners(:, 3) - corners(:, 4)), &
                                      (1 - s)*(corners(:, 4) - corners(:, 1)) + s*(corners(:, 3) - corners(:, 2)))
         end associate
      end do
   end subroutine quadrilateral_mesh

   !> Are the corners not in one plane?
   pure logical function warped(corners)
      real(wp), intent(in) :: corners(3, 4)
      real(wp) :: normal(3), size_of_it
      normal = cross_product(corners(:, 3) - corners(:, 1), corners(:, 4) - corners(:, 2))
      size_of_it = max(norm2(corners(:, 3) - corners(:, 1)), norm2(corners(:, 4) - corners(:, 2)))
      warped = abs(dot_product(normal, corners(:, 2) - corners(:, 1))) > 1.0e-12_wp*norm2(normal)*size_of_it
   end function warped

   subroutine check_convex(corners, error)
      real(wp), intent(in) :: corners(3, 4)
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: normal(3), ahead(3), behind(3), size_of_it
      integer :: k

      normal = cross_product(corners(:, 3) - corners(:, 1), corners(:, 4) - corners(:, 2))
      size_of_it = max(norm2(corners(:, 3) - corners(:, 1)), norm2(corners(:, 4) - corners(:, 2)))
      do k = 1, 4
         ahead = corners(:, mod(k, 4) + 1) - corners(:, k)
         behind = corners(:, mod(k + 2, 4) + 1) - corners(:, k)
         if (dot_product(cross_product(ahead, behind), normal) > 1.0e-12_wp*size_of_it**4) cycle
         call raise(error, status_input_error, 'corners: the quadrilateral must be convex, its four corners in cyclic order')
         return
      end do
   end subroutine check_convex
end module finshell_mesh_rectangle
