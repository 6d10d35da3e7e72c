!> Meshes of a quarter of a rectangular sheet with a round hole.
module finshell_mesh_hole
   use finshell_kinds, only: wp
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_input_error
   use finshell_mesh, only: mesh_t, add_edge_set, add_node_set, new_mesh
   use finshell_mesh_grid, only: grid_t, new_grid, add_grid_sets, require_positive, snap_to_planes
   use finshell_surface, only: surface_t, surface_flat
   implicit none
   private
   public :: hole_mesh

contains

   !> The quarter 0 <= x <= lengths(1), 0 <= y <= lengths(2) in the plane z = 0, normal +z, without the disk of a radius about the
   !> origin. Cells become larger outwards, each by the same ratio: as `grading` says, else so that they are about as long as wide
   !> at the hole.
   !>
   !> Sets: edge_hole; edge_x0, edge_y0 (the planes of symmetry); edge_x1, edge_y1 (the outer sides); corner_hole_y0, corner_hole_x0
   !> (on the hole), corner_x1_y0, corner_y1_x0, corner_x1_y1.
   subroutine hole_mesh(mesh, lengths, radius, divisions, error, diagonal, distortion, grading)
      type(mesh_t), intent(out) :: mesh
      real(wp), intent(in) :: lengths(2)
      real(wp), intent(in) :: radius !< below both lengths
      integer, intent(in) :: divisions(2) !< cells around, an even number: as many to either outer side; and from the hole outwards
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: diagonal !< default 'alternating'
      real(wp), intent(in), optional :: distortion !< interior nodes are moved by up to this fraction of a cell; default 0
      real(wp), intent(in), optional :: grading !< length of the outermost cells over that of those at the hole
      type(mesh_t) :: plain
      type(grid_t) :: grid
      character(len=:), allocatable :: chosen_diagonal
      real(wp), allocatable :: x(:, :)
      real(wp) :: inner(2), outer(2), ratio, s, way
      integer :: i, half

      chosen_diagonal = 'alternating'
      if (present(diagonal)) chosen_diagonal = diagonal
      call require_positive('radius', radius, error)
      call require_positive('lengths(1) - radius', lengths(1) - radius, error)
      call require_positive('lengths(2) - radius', lengths(2) - radius, error)
      if (allocated(error)) return
      if (mod(divisions(1), 2) /= 0) then
         call raise(error, status_input_error, 'divisions(1) = '//text_of(divisions(1))//' must be even: half of the cells go to ' &
            //'either outer side')
         return
      end if
      call new_grid(grid, divisions, chosen_diagonal, error, distortion=distortion)
      if (allocated(error)) return
      allocate (x(3, size(grid%parameters, 2)), source=0.0_wp)
      ratio = outer_ratio(divisions, (0.5_wp*sum(lengths) - radius)/radius)
      if (present(grading)) ratio = grading**(1.0_wp/max(1, divisions(2) - 1))
      do i = 1, size(x, 2)
         s = grid%parameters(1, i)
         inner = radius*[cos(0.5_wp*acos(-1.0_wp)*s), sin(0.5_wp*acos(-1.0_wp)*s)]
         outer = lengths*[min(1.0_wp, 2 - 2*s), min(1.0_wp, 2*s)]
         ! t runs inwards, so that the normal is +z
         way = 1 - grid%parameters(2, i)
         if (abs(ratio - 1) > 1.0e-6_wp) way = (ratio**(way*divisions(2)) - 1)/(ratio**divisions(2) - 1)
         x(:2, i) = inner + way*(outer - inner)
      end do
      call snap_to_planes(x)
      call new_mesh(plain, x, grid%triangles)
      call add_grid_sets(plain, grid, [character(len=5) :: 'y0', 'x0', 'outer', 'hole'])
      call new_mesh(mesh, x, grid%triangles)
      mesh%surface = surface_t(surface_flat, [radius])
      half = divisions(1)/2
      call take_edges('edge_y0', 'edge_y0', 1, divisions(2))
      call take_edges('edge_x0', 'edge_x0', 1, divisions(2))
      call take_edges('edge_outer', 'edge_x1', 1, half)
      call take_edges('edge_outer', 'edge_y1', half + 1, divisions(1))
      call take_edges('edge_hole', 'edge_hole', 1, divisions(1))
      call add_node_set(mesh, 'corner_hole_y0', [grid%node(0, divisions(2))])
      call add_node_set(mesh, 'corner_hole_x0', [grid%node(divisions(1), divisions(2))])
      call add_node_set(mesh, 'corner_x1_y0', [grid%node(0, 0)])
      call add_node_set(mesh, 'corner_x1_y1', [grid%node(half, 0)])
      call add_node_set(mesh, 'corner_y1_x0', [grid%node(divisions(1), 0)])

   contains

      !> Some edges of a side of the grid, by another name.
      subroutine take_edges(side, name, first, last)
         character(len=*), intent(in) :: side, name
         integer, intent(in) :: first, last
         integer :: k
         do k = 1, size(plain%edge_sets)
            if (plain%edge_sets(k)%name == side) call add_edge_set(mesh, name, plain%edge_sets(k)%edges(:, first:last))
         end do
      end subroutine take_edges
   end subroutine hole_mesh

   !> Ratio of the length of a cell to that of the one inside of it, 1 to 4, for cells at the hole that are as long as wide.
   pure real(wp) function outer_ratio(divisions, way) result(ratio)
      integer, intent(in) :: divisions(2)
      real(wp), intent(in) :: way !< from hole to outer side, in radii
      real(wp) :: first, low, high
      integer :: i
      first = 0.5_wp*acos(-1.0_wp)/divisions(1)
      ratio = 1
      if (first*divisions(2) >= way) return
      low = 1
      high = 4
      do i = 1, 60
         ratio = 0.5_wp*(low + high)
         if (first*(ratio**divisions(2) - 1)/(ratio - 1) < way) then
            low = ratio
         else
            high = ratio
         end if
      end do
   end function outer_ratio
end module finshell_mesh_hole
