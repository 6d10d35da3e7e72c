!> Structured grids of triangles in a parameter square: the topology shared by all generators but the disk.
!>
!> Parameters s, t run from 0 to 1 over n(1) by n(2) cells. A grid may close on itself in s, and its sides t = 0 and t = 1
!> may shrink to a single node (a pole). A triangle's normal is d/ds x d/dt. A generator maps the parameters to space.
module finshell_mesh_grid
   use finshell_kinds, only: wp, dp, i8
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_input_error
   use finshell_mesh, only: mesh_t, add_node_set, add_edge_set
   implicit none
   private
   public :: grid_t, new_grid, add_grid_sets, require_positive, snap_to_planes, diagonal_names

   character(len=*), parameter :: diagonal_names = 'forward, backward, alternating, cross'

   type :: grid_t
      integer :: n(2) = 0 !< cells along s and t
      logical :: closed = .false. !< s = 1 is s = 0
      logical :: pole(2) = .false. !< the side t = 0, t = 1 is one node
      integer, allocatable :: node(:, :) !< (0:n(1), 0:n(2)): node number of a grid point
      real(wp), allocatable :: parameters(:, :) !< (2, nodes): s and t of every node
      integer, allocatable :: triangles(:, :) !< (3, elements)
   end type grid_t

contains

   !> Build the grid.
   !>
   !> diagonal: 'forward' joins (s, t) to (s+, t+), 'backward' the other two corners of a cell, 'alternating' changes from cell to
   !> cell, 'cross' puts a node into the centre of the cell (four triangles). Cells at a pole are one triangle.
   !> distortion: interior nodes are moved by up to this fraction of a cell (below 0.25), the same way every time.
   subroutine new_grid(grid, n, diagonal, error, closed, pole, distortion)
      type(grid_t), intent(out) :: grid
      integer, intent(in) :: n(2)
      character(len=*), intent(in) :: diagonal
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: closed
      logical, intent(in), optional :: pole(2)
      real(wp), intent(in), optional :: distortion

      if (present(closed)) grid%closed = closed
      if (present(pole)) grid%pole = pole
      grid%n = n
      select case (diagonal)
      case ('forward', 'backward', 'alternating', 'cross')
      case default
         call raise(error, status_input_error, "diagonal = '"//diagonal//"' is not known; known are: "//diagonal_names)
         return
      end select
      if (any(n < 1) .or. (grid%closed .and. n(1) < 3) .or. (all(grid%pole) .and. n(2) < 2)) then
         call raise(error, status_input_error, 'divisions = '//text_of(n(1))//', '//text_of(n(2)) &
            //' are too few: at least 1 is needed, 3 around a closed surface, 2 from pole to pole')
         return
      end if
      if (real(n(1), wp)*n(2) > 2.0e8_wp) then
         call raise(error, status_input_error, 'divisions = '//text_of(n(1))//', '//text_of(n(2))//' give too many elements')
         return
      end if
      call number_nodes(grid)
      if (present(distortion)) then
         if (.not. (distortion >= 0.0_wp .and. distortion < 0.25_wp)) then
            call raise(error, status_input_error, 'distortion = '//text_of(real(distortion, dp)) &
               //' is outside 0 <= distortion < 0.25')
            return
         end if
         call distort(grid, distortion)
      end if
      call cut_cells(grid, diagonal)
   end subroutine new_grid

   !> Nodes are numbered along t first.
   subroutine number_nodes(grid)
      type(grid_t), intent(inout) :: grid
      integer :: i, j, last, nodes

      associate (n => grid%n)
         allocate (grid%node(0:n(1), 0:n(2)))
         allocate (grid%parameters(2, (n(1) + 1)*(n(2) + 1)))
         last = n(1)
         if (grid%closed) last = n(1) - 1
         nodes = 0
         do i = 0, last
            do j = 0, n(2)
               if (i > 0 .and. ((j == 0 .and. grid%pole(1)) .or. (j == n(2) .and. grid%pole(2)))) then
                  grid%node(i, j) = grid%node(0, j)
                  cycle
               end if
               nodes = nodes + 1
               grid%node(i, j) = nodes
               grid%parameters(:, nodes) = [real(i, wp)/n(1), real(j, wp)/n(2)]
            end do
         end do
         if (grid%closed) grid%node(n(1), :) = grid%node(0, :)
         grid%parameters = grid%parameters(:, :nodes)
      end associate
   end subroutine number_nodes

   subroutine distort(grid, amount)
      type(grid_t), intent(inout) :: grid
      real(wp), intent(in) :: amount
      integer(i8) :: seed
      integer :: i, j, k

      seed = 20260701_i8
      do i = 1, grid%n(1) - 1
         do j = 1, grid%n(2) - 1
            do k = 1, 2
               seed = mod(seed*16807_i8, 2147483647_i8)
               associate (p => grid%parameters(k, grid%node(i, j)))
                  p = p + amount*(2.0_wp*real(seed, wp)/2147483647.0_wp - 1.0_wp)/grid%n(k)
               end associate
            end do
         end do
      end do
   end subroutine distort

   subroutine cut_cells(grid, diagonal)
      type(grid_t), intent(inout) :: grid
      character(len=*), intent(in) :: diagonal
      real(wp), allocatable :: parameters(:, :)
      integer, allocatable :: triangles(:, :)
      integer :: i, j, elements, nodes, a, b, c, d
      logical :: forward

      nodes = size(grid%parameters, 2)
      allocate (triangles(3, 4*grid%n(1)*grid%n(2)))
      allocate (parameters(2, nodes + grid%n(1)*grid%n(2)))
      parameters(:, :nodes) = grid%parameters
      elements = 0
      do i = 0, grid%n(1) - 1
         do j = 0, grid%n(2) - 1
            a = grid%node(i, j)
            b = grid%node(i + 1, j)
            c = grid%node(i + 1, j + 1)
            d = grid%node(i, j + 1)
            if (a == b) then
               call append(a, c, d)
            else if (c == d) then
               call append(a, b, c)
            else if (diagonal == 'cross') then
               nodes = nodes + 1
               parameters(:, nodes) = centre(i, j)
               call append(a, b, nodes)
               call append(b, c, nodes)
               call append(c, d, nodes)
               call append(d, a, nodes)
            else
               forward = diagonal == 'forward' .or. (diagonal == 'alternating' .and. mod(i + j, 2) == 0)
               if (forward) then
                  call append(a, b, c)
                  call append(a, c, d)
               else
                  call append(a, b, d)
                  call append(b, c, d)
               end if
            end if
         end do
      end do
      grid%triangles = triangles(:, :elements)
      grid%parameters = parameters(:, :nodes)

   contains

      subroutine append(p, q, r)
         integer, intent(in) :: p, q, r
         elements = elements + 1
         triangles(:, elements) = [p, q, r]
      end subroutine append

      !> The seam of a closed grid has s = 0 as its parameter, so the mean of the corners would be wrong there.
      function centre(i, j) result(p)
         integer, intent(in) :: i, j
         real(wp) :: p(2)
         if (grid%closed .and. i == grid%n(1) - 1) then
            p = [(i + 0.5_wp)/grid%n(1), (j + 0.5_wp)/grid%n(2)]
         else
            p = 0.25_wp*sum(grid%parameters(:, [grid%node(i, j), grid%node(i + 1, j), grid%node(i + 1, j + 1), &
               grid%node(i, j + 1)]), dim=2)
         end if
      end function centre
   end subroutine cut_cells

   !> Name the sides s = 0, s = 1, t = 0, t = 1 and what lies on them.
   !>
   !> Sets: edge_<side> (edges and nodes), corner_<s side>_<t side>, mid_<side> (middle node of a side with an even number of
   !> cells), centre (even number of cells both ways), pole_<t side>. A closed grid has no s sides.
   subroutine add_grid_sets(mesh, grid, sides)
      type(mesh_t), intent(inout) :: mesh
      type(grid_t), intent(in) :: grid
      character(len=*), intent(in) :: sides(4) !< names of s = 0, s = 1, t = 0, t = 1
      integer :: side, p, q, at

      associate (n => grid%n)
         do side = 1, 2
            at = (side - 1)*n(1)
            if (.not. grid%closed) then
               call add_side(trim(sides(side)), grid%node(at, :))
               do q = 1, 2
                  if (grid%pole(q)) cycle
                  call add_node_set(mesh, 'corner_'//trim(sides(side))//'_'//trim(sides(2 + q)), [grid%node(at, (q - 1)*n(2))])
               end do
            end if
            at = (side - 1)*n(2)
            if (grid%pole(side)) then
               call add_node_set(mesh, 'pole_'//trim(sides(2 + side)), [grid%node(0, at)])
            else
               call add_side(trim(sides(2 + side)), grid%node(:, at))
            end if
         end do
         p = n(1)/2
         q = n(2)/2
         if (2*p == n(1) .and. 2*q == n(2) .and. .not. grid%closed) call add_node_set(mesh, 'centre', [grid%node(p, q)])
      end associate

   contains

      subroutine add_side(name, nodes)
         character(len=*), intent(in) :: name
         integer, intent(in) :: nodes(:)
         integer :: edges(2, size(nodes) - 1)
         edges(1, :) = nodes(:size(nodes) - 1)
         edges(2, :) = nodes(2:)
         call add_edge_set(mesh, 'edge_'//name, edges)
         if (mod(size(nodes), 2) == 1 .and. nodes(1) /= nodes(size(nodes))) then
            call add_node_set(mesh, 'mid_'//name, [nodes((size(nodes) + 1)/2)])
         end if
      end subroutine add_side
   end subroutine add_grid_sets

   !> Raise an error unless value > 0 (and not NaN or infinite); an error already there is kept.
   subroutine require_positive(name, value, error)
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: value
      type(error_t), allocatable, intent(inout) :: error
      if (allocated(error)) return
      if (value > 0.0_wp .and. value <= huge(value)) return
      call raise(error, status_input_error, name//' = '//text_of(real(value, dp))//' must be positive')
   end subroutine require_positive

   !> Remove the rounding errors of sines and cosines, so that nodes of a symmetry plane through the origin lie exactly on it.
   pure subroutine snap_to_planes(x)
      real(wp), intent(inout) :: x(:, :)
      where (abs(x) < 8.0_wp*epsilon(x)*maxval(abs(x))) x = 0.0_wp
   end subroutine snap_to_planes
end module finshell_mesh_grid
