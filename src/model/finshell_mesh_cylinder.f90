!> Meshes of panels of cylinders and cones, and of whole ones.
module finshell_mesh_cylinder
   use finshell_kinds, only: wp, dp
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_input_error
   use finshell_mesh, only: mesh_t, new_mesh
   use finshell_mesh_grid, only: grid_t, new_grid, add_grid_sets, require_positive, snap_to_planes
   use finshell_surface, only: surface_t, surface_cone
   implicit none
   private
   public :: cylinder_mesh, cone_mesh

   real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp

contains

   !> Cylinder about the y axis: (radius sin a, y, radius cos a), angle a in degrees measured from +z towards +x, 0 <= y <= length.
   !> The normal points outward. A range of 360 degrees closes on itself.
   !>
   !> Sets: edge_y0, edge_y1 (the curved edges); unless closed edge_a0, edge_a1 (straight edges at the first and second angle),
   !> corner_a0_y0, corner_a1_y0, corner_a0_y1, corner_a1_y1; where the number of divisions is even mid_a0, mid_a1, mid_y0,
   !> mid_y1 (middle of that edge), centre.
   subroutine cylinder_mesh(mesh, radius, length, angles, divisions, error, diagonal, distortion)
      type(mesh_t), intent(out) :: mesh
      real(wp), intent(in) :: radius
      real(wp), intent(in) :: length
      real(wp), intent(in) :: angles(2) !< first and last angle in degrees
      integer, intent(in) :: divisions(2) !< cells around and along
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: diagonal !< default 'alternating'
      real(wp), intent(in), optional :: distortion !< interior nodes are moved by up to this fraction of a cell; default 0

      call require_positive('radius', radius, error)
      if (.not. allocated(error)) call cone_mesh(mesh, [radius, radius], length, angles, divisions, error, diagonal, distortion)
   end subroutine cylinder_mesh

   !> Cone about the y axis, its radius going from radii(1) at y = 0 to radii(2) at y = length. Otherwise as the cylinder.
   subroutine cone_mesh(mesh, radii, length, angles, divisions, error, diagonal, distortion)
      type(mesh_t), intent(out) :: mesh
      real(wp), intent(in) :: radii(2)
      real(wp), intent(in) :: length
      real(wp), intent(in) :: angles(2) !< first and last angle in degrees
      integer, intent(in) :: divisions(2) !< cells around and along
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: diagonal !< default 'alternating'
      real(wp), intent(in), optional :: distortion !< interior nodes are moved by up to this fraction of a cell; default 0
      type(grid_t) :: grid
      character(len=:), allocatable :: chosen_diagonal
      real(wp), allocatable :: x(:, :)
      real(wp) :: a, radius, span
      integer :: i

      chosen_diagonal = 'alternating'
      if (present(diagonal)) chosen_diagonal = diagonal
      call require_positive('radii(1)', radii(1), error)
      call require_positive('radii(2)', radii(2), error)
      call require_positive('length', length, error)
      if (allocated(error)) return
      span = angles(2) - angles(1)
      if (.not. (span > 0.0_wp .and. span <= 360.0_wp)) then
         call raise(error, status_input_error, 'angles = '//text_of(real(angles(1), dp))//', '//text_of(real(angles(2), dp)) &
            //' must ascend and span at most 360 degrees')
         return
      end if
      call new_grid(grid, divisions, chosen_diagonal, error, closed=span >= 360.0_wp, distortion=distortion)
      if (allocated(error)) return
      allocate (x(3, size(grid%parameters, 2)))
      do i = 1, size(x, 2)
         a = (angles(1) + span*grid%parameters(1, i))*degree
         radius = radii(1) + (radii(2) - radii(1))*grid%parameters(2, i)
         x(:, i) = [radius*sin(a), length*grid%parameters(2, i), radius*cos(a)]
      end do
      call snap_to_planes(x)
      call new_mesh(mesh, x, grid%triangles)
      mesh%surface = surface_t(surface_cone, [(radii(2) - radii(1))/length])
      mesh%normal = x
      mesh%normal(2, :) = norm2(x([1, 3], :), dim=1)*(radii(1) - radii(2))/length
      call add_grid_sets(mesh, grid, [character(len=2) :: 'a0', 'a1', 'y0', 'y1'])
   end subroutine cone_mesh
end module finshell_mesh_cylinder
