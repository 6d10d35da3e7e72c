!> Meshes of paraboloids over a rectangle: shallow caps, saddles, troughs.
module finshell_mesh_paraboloid
   use finshell_kinds, only: wp
   use finshell_error, only: error_t, raise
   use finshell_status, only: status_input_error
   use finshell_mesh, only: mesh_t, new_mesh
   use finshell_mesh_grid, only: grid_t, new_grid, add_grid_sets, require_positive
   use finshell_surface, only: surface_t, surface_paraboloid
   implicit none
   private
   public :: paraboloid_mesh

contains

   !> z = (k1 x**2 + k2 y**2)/2 + k12 x y over |x| <= lengths(1)/2, |y| <= lengths(2)/2; the normal has a positive z.
   !>
   !> Sets as for the rectangle: edge_x0, edge_x1, edge_y0, edge_y1; corner_x0_y0, corner_x1_y0, corner_x0_y1, corner_x1_y1; where
   !> the number of divisions is even mid_x0, mid_x1, mid_y0, mid_y1 (middle of that edge), centre (the apex).
   subroutine paraboloid_mesh(mesh, lengths, curvatures, divisions, error, diagonal, distortion)
      type(mesh_t), intent(out) :: mesh
      real(wp), intent(in) :: lengths(2)
      real(wp), intent(in) :: curvatures(3) !< k1, k2, k12: of the surface at its apex, 1/length
      integer, intent(in) :: divisions(2) !< cells along x and y
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: diagonal !< default 'alternating'
      real(wp), intent(in), optional :: distortion !< interior nodes are moved by up to this fraction of a cell; default 0
      type(grid_t) :: grid
      character(len=:), allocatable :: chosen_diagonal
      real(wp), allocatable :: x(:, :)
      integer :: i

      chosen_diagonal = 'alternating'
      if (present(diagonal)) chosen_diagonal = diagonal
      call require_positive('lengths(1)', lengths(1), error)
      call require_positive('lengths(2)', lengths(2), error)
      if (allocated(error)) return
      if (.not. all(abs(curvatures) <= huge(1.0_wp))) then
         call raise(error, status_input_error, 'curvatures must be finite')
         return
      end if
      call new_grid(grid, divisions, chosen_diagonal, error, distortion=distortion)
      if (allocated(error)) return
      allocate (x(3, size(grid%parameters, 2)))
      do i = 1, size(x, 2)
         x(:2, i) = lengths*(grid%parameters(:, i) - 0.5_wp)
         x(3, i) = 0.5_wp*(curvatures(1)*x(1, i)**2 + curvatures(2)*x(2, i)**2) + curvatures(3)*x(1, i)*x(2, i)
      end do
      call new_mesh(mesh, x, grid%triangles)
      mesh%surface = surface_t(surface_paraboloid, curvatures)
      call add_grid_sets(mesh, grid, [character(len=2) :: 'x0', 'x1', 'y0', 'y1'])
      if (.not. any(abs(curvatures) > 0)) return
      allocate (mesh%normal, source=x)
      do i = 1, size(x, 2)
         mesh%normal(:, i) = [-curvatures(1)*x(1, i) - curvatures(3)*x(2, i), -curvatures(2)*x(2, i) - curvatures(3)*x(1, i), &
                              1.0_wp]
      end do
   end subroutine paraboloid_mesh
end module finshell_mesh_paraboloid
