!> Meshes of pretwisted strips (the twisted beam of MacNeal and Harder).
module finshell_mesh_strip
   use finshell_kinds, only: wp
   use finshell_error, only: error_t, raise
   use finshell_status, only: status_input_error
   use finshell_mesh, only: mesh_t, new_mesh
   use finshell_mesh_grid, only: grid_t, new_grid, add_grid_sets, require_positive, snap_to_planes
   use finshell_surface, only: surface_t, surface_strip
   implicit none
   private
   public :: strip_mesh

   real(wp), parameter :: degree = acos(-1.0_wp)/180.0_wp

contains

   !> Strip along x, 0 <= x <= length, its width direction (0, cos a, sin a) turning about x in proportion to x, from a = 0 to
   !> a = twist (degrees). The position across is -width/2 <= w <= width/2.
   !>
   !> Sets: edge_x0, edge_x1 (the ends), edge_w0, edge_w1 (the long edges at -width/2, +width/2); corner_x0_w0, corner_x1_w0,
   !> corner_x0_w1, corner_x1_w1; where the number of divisions is even mid_x0, mid_x1, mid_w0, mid_w1 (middle of that edge),
   !> centre.
   subroutine strip_mesh(mesh, length, width, twist, divisions, error, diagonal, distortion)
      type(mesh_t), intent(out) :: mesh
      real(wp), intent(in) :: length
      real(wp), intent(in) :: width
      real(wp), intent(in) :: twist !< total turn in degrees
      integer, intent(in) :: divisions(2) !< cells along and across
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: diagonal !< default 'alternating'
      real(wp), intent(in), optional :: distortion !< interior nodes are moved by up to this fraction of a cell; default 0
      type(grid_t) :: grid
      character(len=:), allocatable :: chosen_diagonal
      real(wp), allocatable :: x(:, :)
      real(wp) :: a, rate, w
      integer :: i

      chosen_diagonal = 'alternating'
      if (present(diagonal)) chosen_diagonal = diagonal
      call require_positive('length', length, error)
      call require_positive('width', width, error)
      if (allocated(error)) return
      if (.not. abs(twist) <= huge(twist)) then
         call raise(error, status_input_error, 'twist must be a finite number of degrees')
         return
      end if
      call new_grid(grid, divisions, chosen_diagonal, error, distortion=distortion)
      if (allocated(error)) return
      allocate (x(3, size(grid%parameters, 2)))
      do i = 1, size(x, 2)
         a = twist*degree*grid%parameters(1, i)
         w = width*(grid%parameters(2, i) - 0.5_wp)
         x(:, i) = [length*grid%parameters(1, i), w*cos(a), w*sin(a)]
      end do
      call snap_to_planes(x)
      call new_mesh(mesh, x, grid%triangles)
      call add_grid_sets(mesh, grid, [character(len=2) :: 'x0', 'x1', 'w0', 'w1'])
      mesh%surface = surface_t(surface_strip, [twist*degree/length])
      if (.not. abs(twist) > 0) return
      ! d/dx x d/dw of (x, w cos a, w sin a), a = rate x
      rate = twist*degree/length
      allocate (mesh%normal, source=x)
      do i = 1, size(x, 2)
         a = twist*degree*grid%parameters(1, i)
         mesh%normal(:, i) = [-rate*width*(grid%parameters(2, i) - 0.5_wp), -sin(a), cos(a)]
      end do
   end subroutine strip_mesh
end module finshell_mesh_strip
