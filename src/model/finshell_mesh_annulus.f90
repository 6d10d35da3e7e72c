!> Meshes of annuli and annular sectors, slit or closed.
module finshell_mesh_annulus
   use finshell_kinds, only: wp, dp
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_input_error
   use finshell_mesh, only: mesh_t, new_mesh
   use finshell_mesh_grid, only: grid_t, new_grid, add_grid_sets, require_positive, snap_to_planes
   use finshell_surface, only: surface_t, surface_flat
   implicit none
   private
   public :: annulus_mesh

   real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp

contains

   !> Annulus in the plane z = 0, normal +z: radii(1) <= r <= radii(2), angle a in degrees from +x towards +y.
   !>
   !> A full turn (360 degrees) has a slit along the first angle unless slit = .false.; the lips of the slit are separate nodes at
   !> the same places. Sets: edge_inner, edge_outer; unless closed edge_a0, edge_a1 (radial edges at the first and last angle),
   !> corner_a0_inner, corner_a1_inner, corner_a0_outer, corner_a1_outer; where the number of divisions is even mid_a0, mid_a1,
   !> mid_inner, mid_outer (middle of that edge), centre.
   subroutine annulus_mesh(mesh, radii, angles, divisions, error, diagonal, slit, distortion)
      type(mesh_t), intent(out) :: mesh
      real(wp), intent(in) :: radii(2) !< 0 < inner < outer
      real(wp), intent(in) :: angles(2) !< first and last, in degrees
      integer, intent(in) :: divisions(2) !< cells around and across
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: diagonal !< default 'alternating'
      logical, intent(in), optional :: slit !< default .true.
      real(wp), intent(in), optional :: distortion !< interior nodes are moved by up to this fraction of a cell; default 0
      type(grid_t) :: grid
      character(len=:), allocatable :: chosen_diagonal
      real(wp), allocatable :: x(:, :)
      real(wp) :: a, r, span
      logical :: closed
      integer :: i

      chosen_diagonal = 'alternating'
      if (present(diagonal)) chosen_diagonal = diagonal
      call require_positive('radii(1)', radii(1), error)
      call require_positive('radii(2) - radii(1)', radii(2) - radii(1), error)
      if (allocated(error)) return
      span = angles(2) - angles(1)
      if (.not. (span > 0.0_wp .and. span <= 360.0_wp)) then
         call raise(error, status_input_error, 'angles = '//text_of(real(angles(1), dp))//', '//text_of(real(angles(2), dp)) &
            //' must ascend and span at most 360 degrees')
         return
      end if
      closed = .false.
      if (present(slit)) closed = span >= 360.0_wp .and. .not. slit
      call new_grid(grid, divisions, chosen_diagonal, error, closed=closed, distortion=distortion)
      if (allocated(error)) return
      allocate (x(3, size(grid%parameters, 2)))
      do i = 1, size(x, 2)
         ! t runs inwards, so that the normal is +z.
         a = (angles(1) + span*grid%parameters(1, i))*degree
         r = radii(2) + (radii(1) - radii(2))*grid%parameters(2, i)
         x(:, i) = [r*cos(a), r*sin(a), 0.0_wp]
      end do
      call snap_to_planes(x)
      call new_mesh(mesh, x, grid%triangles)
      mesh%surface = surface_t(surface_flat, radii)
      mesh%coincident_nodes_allowed = span >= 360.0_wp .and. .not. closed
      call add_grid_sets(mesh, grid, [character(len=5) :: 'a0', 'a1', 'outer', 'inner'])
   end subroutine annulus_mesh
end module finshell_mesh_annulus
