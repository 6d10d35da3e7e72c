!> Meshes of spheres, hemispheres and their sectors, with or without holes at the poles.
module finshell_mesh_sphere
   use finshell_kinds, only: wp, dp
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_input_error
   use finshell_mesh, only: mesh_t, new_mesh
   use finshell_mesh_grid, only: grid_t, new_grid, add_grid_sets, require_positive, snap_to_planes
   use finshell_surface, only: surface_sphere
   implicit none
   private
   public :: sphere_mesh

   real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp

contains

   !> Sphere about the origin: radius (sin c cos a, sin c sin a, cos c), colatitude c in degrees from +z, azimuth a in degrees
   !> from +x. The normal points outward. An azimuth range of 360 degrees closes on itself; a colatitude of 0 or 180 is a pole.
   !>
   !> Sets: edge_top (first colatitude), edge_bottom (last), or pole_top, pole_bottom; unless closed edge_a0, edge_a1 (meridians
   !> at the first and second azimuth), corner_a0_top, corner_a1_top, corner_a0_bottom, corner_a1_bottom; where the number of
   !> divisions is even mid_a0, mid_a1, mid_top, mid_bottom (middle of that edge), centre.
   subroutine sphere_mesh(mesh, radius, colatitudes, azimuths, divisions, error, diagonal, distortion)
      type(mesh_t), intent(out) :: mesh
      real(wp), intent(in) :: radius
      real(wp), intent(in) :: colatitudes(2) !< 0 <= first < last <= 180
      real(wp), intent(in) :: azimuths(2) !< first and last, in degrees
      integer, intent(in) :: divisions(2) !< cells along the azimuth and along the colatitude
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: diagonal !< default 'alternating'
      real(wp), intent(in), optional :: distortion !< interior nodes are moved by up to this fraction of a cell; default 0
      type(grid_t) :: grid
      character(len=:), allocatable :: chosen_diagonal
      real(wp), allocatable :: x(:, :)
      real(wp) :: a, c, span
      integer :: i

      chosen_diagonal = 'alternating'
      if (present(diagonal)) chosen_diagonal = diagonal
      call require_positive('radius', radius, error)
      if (allocated(error)) return
      if (.not. (colatitudes(1) >= 0.0_wp .and. colatitudes(1) < colatitudes(2) .and. colatitudes(2) <= 180.0_wp)) then
         call raise(error, status_input_error, 'colatitudes = '//text_of(real(colatitudes(1), dp))//', ' &
            //text_of(real(colatitudes(2), dp))//' must ascend and lie between 0 and 180 degrees')
         return
      end if
      span = azimuths(2) - azimuths(1)
      if (.not. (span > 0.0_wp .and. span <= 360.0_wp)) then
         call raise(error, status_input_error, 'azimuths = '//text_of(real(azimuths(1), dp))//', ' &
            //text_of(real(azimuths(2), dp))//' must ascend and span at most 360 degrees')
         return
      end if
      ! t runs upwards, from the last colatitude to the first, so that the normal points outward.
      call new_grid(grid, divisions, chosen_diagonal, error, closed=span >= 360.0_wp, &
         pole=[colatitudes(2) >= 180.0_wp, colatitudes(1) <= 0.0_wp], distortion=distortion)
      if (allocated(error)) return
      allocate (x(3, size(grid%parameters, 2)))
      do i = 1, size(x, 2)
         a = (azimuths(1) + span*grid%parameters(1, i))*degree
         c = (colatitudes(2) + (colatitudes(1) - colatitudes(2))*grid%parameters(2, i))*degree
         x(:, i) = radius*[sin(c)*cos(a), sin(c)*sin(a), cos(c)]
      end do
      call snap_to_planes(x)
      call new_mesh(mesh, x, grid%triangles)
      mesh%surface%kind = surface_sphere
      mesh%normal = x
      call add_grid_sets(mesh, grid, [character(len=6) :: 'a0', 'a1', 'bottom', 'top'])
   end subroutine sphere_mesh
end module finshell_mesh_sphere
