!> The pattern of the tangent: compressed columns, built once from the connectivity and the equation numbers.
!>
!> Two node-adjacency passes, no sorting and no searching: time and memory are linear in the number of elements. Rows
!> come out ascending because equations are visited in ascending order and each one is appended to the columns it meets.
module finshell_sparsity
   use finshell_cliques, only: cliques_t, cliques_at
   use finshell_kinds, only: dp, i4
   use finshell_freedoms, only: n_corners, n_nodal
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_invalid_argument
   use finshell_team, only: add_up, team_t
   implicit none
   private
   public :: sparsity_t, new_sparsity, element_positions

   !> Compressed columns, numbered from 1. The diagonal is always part of the pattern. Each member of a team has the pattern of its
   !> own elements, and the matrix is the sum of all.
   type :: sparsity_t
      integer :: n = 0 !< equations
      logical :: symmetric = .true. !< only the lower triangle is stored
      integer(i4), allocatable :: column_pointer(:) !< (n + 1): column j is at column_pointer(j) .. column_pointer(j+1) - 1
      integer(i4), allocatable :: row(:) !< ascending within a column
      class(team_t), pointer :: team => null()
   contains
      procedure :: entries
      procedure :: find
      procedure :: multiply
      procedure :: diagonal
   end type sparsity_t

   !> Which elements meet at a node.
   type :: incidence_t
      integer(i4), allocatable :: first(:) !< (nodes + 1)
      integer(i4), allocatable :: corner(:) !< 3 (element - 1) + local node
   end type incidence_t

contains

   !> Number of stored entries.
   pure integer function entries(self)
      class(sparsity_t), intent(in) :: self
      entries = 0
      if (allocated(self%row)) entries = size(self%row)
   end function entries

   !> Place of an entry in the values, or 0.
   pure integer function find(self, row, column)
      class(sparsity_t), intent(in) :: self
      integer, intent(in) :: row, column
      integer :: low, high
      low = self%column_pointer(column)
      high = self%column_pointer(column + 1) - 1
      do while (low <= high)
         find = low + (high - low)/2
         if (self%row(find) == row) return
         if (self%row(find) < row) low = find + 1
         if (self%row(find) > row) high = find - 1
      end do
      find = 0
   end function find

   !> Build the pattern.
   !>
   !> Every equation 1 .. maxval(eq) must belong to some degree of freedom; equations of nodes without an element keep
   !> their diagonal, so that the solver can name them as singular. Errors: status_invalid_argument.
   subroutine new_sparsity(pattern, triangles, eq, symmetric, error, team, cliques)
      type(sparsity_t), intent(out) :: pattern
      integer, intent(in) :: triangles(:, :) !< (3, elements) node numbers; those of this member of the team
      integer, intent(in) :: eq(:, :) !< (n_nodal, nodes) equation numbers, 0 = constrained
      logical, intent(in) :: symmetric !< store the lower triangle only
      type(error_t), allocatable, intent(out) :: error
      class(team_t), pointer, intent(in), optional :: team
      type(cliques_t), intent(in), optional :: cliques !< equations that meet beside those of the elements; of this member, too
      type(incidence_t) :: at_node
      integer(i4), allocatable :: clique_first(:), clique(:)
      integer(i4), allocatable :: neighbour_first(:), neighbour(:), home_first(:), home(:), mark(:)
      integer, allocatable :: fill(:)
      integer(i4) :: total

      pattern%symmetric = symmetric
      if (present(team)) pattern%team => team
      call check_equations(triangles, eq, pattern%n, error)
      if (allocated(error)) return
      call node_incidence(triangles, size(eq, 2), at_node)
      call node_neighbours(triangles, size(eq, 2), at_node, neighbour_first, neighbour)
      call equation_homes(eq, pattern%n, home_first, home)
      if (present(cliques)) call cliques_at(cliques, pattern%n, clique_first, clique)

      allocate (mark(pattern%n), fill(pattern%n + 1), source=0_i4)
      call visit(counting=.true.)
      allocate (pattern%column_pointer(pattern%n + 1))
      call offsets_from_counts(fill(:pattern%n), pattern%column_pointer, total)
      if (total < 0) then
         call raise(error, status_invalid_argument, 'the matrix has more than 2147483647 entries')
         return
      end if
      allocate (pattern%row(total))
      fill(:pattern%n) = pattern%column_pointer(:pattern%n)
      mark = 0
      call visit(counting=.false.)

   contains

      !> Visit every entry by ascending row: count it in its column, or append it there.
      subroutine visit(counting)
         logical, intent(in) :: counting
         integer :: r, h, k, i, node
         do r = 1, pattern%n
            do h = home_first(r), home_first(r + 1) - 1
               node = home(h)
               do k = neighbour_first(node), neighbour_first(node + 1) - 1
                  do i = 1, n_nodal
                     call meet(r, eq(i, neighbour(k)), counting)
                  end do
               end do
            end do
            if (.not. present(cliques)) cycle
            do h = clique_first(r), clique_first(r + 1) - 1
               do k = cliques%first(clique(h)), cliques%first(clique(h) + 1) - 1
                  call meet(r, int(cliques%equation(k)), counting)
               end do
            end do
         end do
      end subroutine visit

      subroutine meet(r, c, counting)
         integer, intent(in) :: r, c
         logical, intent(in) :: counting
         if (c == 0) return
         if (symmetric .and. c > r) return
         if (mark(c) == r) return
         mark(c) = r
         if (.not. counting) pattern%row(fill(c)) = r
         fill(c) = fill(c) + 1
      end subroutine meet
   end subroutine new_sparsity

   !> Where each entry of each element matrix goes.
   !>
   !> positions(k, e) is the place in the values of local entry k (lower triangle by columns for a symmetric pattern, all entries
   !> by columns otherwise), or 0 when its row or column is constrained. Local degrees of freedom are ordered node by node.
   subroutine element_positions(pattern, triangles, eq, positions)
      type(sparsity_t), intent(in) :: pattern
      integer, intent(in) :: triangles(:, :) !< (3, elements)
      integer, intent(in) :: eq(:, :) !< (freedoms of a node, nodes): those that the elements have
      !> (entries of an element matrix, its lower triangle by columns if the pattern is symmetric; elements) 0: constrained
      integer(i4), allocatable, intent(out) :: positions(:, :)
      type(incidence_t) :: at_node
      integer(i4), allocatable :: place(:)
      integer :: node, i, c, r, k, p, e, a, b, m, n

      m = size(eq, 1)
      n = 3*m
      allocate (positions(merge(n*(n + 1)/2, n*n, pattern%symmetric), size(triangles, 2)), source=0_i4)
      allocate (place(pattern%n), source=0_i4)
      call node_incidence(triangles, size(eq, 2), at_node)
      do node = 1, size(eq, 2)
         do i = 1, m
            c = eq(i, node)
            if (c == 0) cycle
            do p = pattern%column_pointer(c), pattern%column_pointer(c + 1) - 1
               place(pattern%row(p)) = p
            end do
            do k = at_node%first(node), at_node%first(node + 1) - 1
               e = (at_node%corner(k) - 1)/3 + 1
               b = m*mod(at_node%corner(k) - 1, 3) + i
               do a = 1, n
                  r = eq(mod(a - 1, m) + 1, triangles((a - 1)/m + 1, e))
                  if (r == 0) cycle
                  if (pattern%symmetric) then
                     if (r < c) cycle
                     positions(packed_index(n, max(a, b), min(a, b)), e) = place(r)
                  else
                     positions(n*(b - 1) + a, e) = place(r)
                  end if
               end do
            end do
         end do
      end do
   end subroutine element_positions

   !> Position of (a, b), a >= b, in the lower triangle of n rows stored by columns.
   pure integer function packed_index(n, a, b)
      integer, intent(in) :: n, a, b
      packed_index = (b - 1)*n - (b*(b - 1))/2 + a
   end function packed_index

   !> y = A x, and optionally the same with absolute values throughout (the scale of its rounding errors).
   subroutine multiply(self, values, x, y, y_abs)
      class(sparsity_t), intent(in) :: self
      real(dp), intent(in) :: values(:), x(:)
      real(dp), intent(out), contiguous :: y(:)
      real(dp), optional, intent(out), contiguous :: y_abs(:)
      integer :: j, p, r
      real(dp) :: yj, aj, xj, t

      y(:self%n) = 0
      if (present(y_abs)) y_abs(:self%n) = 0
      do j = 1, self%n
         xj = x(j)
         yj = 0
         aj = 0
         do p = self%column_pointer(j), self%column_pointer(j + 1) - 1
            r = self%row(p)
            t = values(p)*xj
            y(r) = y(r) + t
            if (present(y_abs)) y_abs(r) = y_abs(r) + abs(t)
            if (self%symmetric .and. r /= j) then
               t = values(p)*x(r)
               yj = yj + t
               aj = aj + abs(t)
            end if
         end do
         y(j) = y(j) + yj
         if (present(y_abs)) y_abs(j) = y_abs(j) + aj
      end do
      call add_up(self%team, y)
      if (present(y_abs)) call add_up(self%team, y_abs)
   end subroutine multiply

   !> The diagonal of the matrix with these values.
   function diagonal(self, values) result(d)
      class(sparsity_t), intent(in) :: self
      real(dp), intent(in) :: values(:)
      real(dp) :: d(self%n)
      integer :: j, p
      do j = 1, self%n
         p = self%find(j, j)
         d(j) = 0
         if (p > 0) d(j) = values(p)
      end do
      call add_up(self%team, d)
   end function diagonal

   !> Number of equations; every number from 1 on must be used, and only once within an element.
   subroutine check_equations(triangles, eq, n, error)
      integer, intent(in) :: triangles(:, :), eq(:, :)
      integer, intent(out) :: n
      type(error_t), allocatable, intent(inout) :: error
      logical, allocatable :: used(:)
      integer, allocatable :: seen(:)
      integer :: i, j, e, k

      n = 0
      if (size(triangles, 1) /= n_corners .or. size(eq, 1) /= n_nodal) then
         call raise(error, status_invalid_argument, 'connectivity must have '//text_of(n_corners)//' rows and equation numbers ' &
            //text_of(n_nodal))
         return
      end if
      if (size(triangles) > 0) then
         if (minval(triangles) < 1 .or. maxval(triangles) > size(eq, 2)) then
            call raise(error, status_invalid_argument, 'a triangle names a node outside 1 .. '//text_of(size(eq, 2)))
            return
         end if
      end if
      if (size(eq) > 0) n = max(0, maxval(eq))
      allocate (used(n), source=.false.)
      do j = 1, size(eq, 2)
         do i = 1, n_nodal
            if (eq(i, j) < 0) then
               call raise(error, status_invalid_argument, 'node '//text_of(j)//' has a negative equation number')
               return
            end if
            if (eq(i, j) > 0) used(eq(i, j)) = .true.
         end do
      end do
      if (.not. all(used)) then
         call raise(error, status_invalid_argument, 'no degree of freedom has equation number '//text_of(findloc(used, .false., 1)))
         return
      end if
      allocate (seen(n), source=0)
      do e = 1, size(triangles, 2)
         do k = 1, 3
            do i = 1, n_nodal
               j = eq(i, triangles(k, e))
               if (j == 0) cycle
               if (seen(j) == e) then
                  call raise(error, status_invalid_argument, 'element '//text_of(e)//' meets equation '//text_of(j)//' twice')
                  return
               end if
               seen(j) = e
            end do
         end do
      end do
   end subroutine check_equations

   !> Elements at each node, by counting.
   subroutine node_incidence(triangles, nodes, at_node)
      integer, intent(in) :: triangles(:, :), nodes
      type(incidence_t), intent(out) :: at_node
      integer, allocatable :: fill(:)
      integer(i4) :: total
      integer :: e, k, node

      allocate (fill(nodes), source=0)
      do e = 1, size(triangles, 2)
         do k = 1, 3
            fill(triangles(k, e)) = fill(triangles(k, e)) + 1
         end do
      end do
      allocate (at_node%first(nodes + 1), at_node%corner(size(triangles)))
      call offsets_from_counts(fill, at_node%first, total)
      fill = at_node%first(:nodes)
      do e = 1, size(triangles, 2)
         do k = 1, 3
            node = triangles(k, e)
            at_node%corner(fill(node)) = 3*(e - 1) + k
            fill(node) = fill(node) + 1
         end do
      end do
   end subroutine node_incidence

   !> Nodes that share an element with each node, itself included.
   subroutine node_neighbours(triangles, nodes, at_node, first, neighbour)
      integer, intent(in) :: triangles(:, :), nodes
      type(incidence_t), intent(in) :: at_node
      integer(i4), allocatable, intent(out) :: first(:), neighbour(:)
      integer(i4), allocatable :: mark(:)
      integer :: node, k, l, e, other, fill

      ! An element brings at most two new neighbours to each of its nodes.
      allocate (first(nodes + 1), neighbour(nodes + 2*size(triangles)), mark(nodes))
      mark = 0
      fill = 1
      do node = 1, nodes
         first(node) = fill
         neighbour(fill) = node
         fill = fill + 1
         mark(node) = node
         do k = at_node%first(node), at_node%first(node + 1) - 1
            e = (at_node%corner(k) - 1)/3 + 1
            do l = 1, 3
               other = triangles(l, e)
               if (mark(other) == node) cycle
               mark(other) = node
               neighbour(fill) = other
               fill = fill + 1
            end do
         end do
      end do
      first(nodes + 1) = fill
   end subroutine node_neighbours

   !> The nodes that carry each equation.
   subroutine equation_homes(eq, n, first, home)
      integer, intent(in) :: eq(:, :), n
      integer(i4), allocatable, intent(out) :: first(:), home(:)
      integer, allocatable :: fill(:)
      integer(i4) :: total
      integer :: i, j

      allocate (fill(n), source=0)
      do j = 1, size(eq, 2)
         do i = 1, n_nodal
            if (eq(i, j) > 0) fill(eq(i, j)) = fill(eq(i, j)) + 1
         end do
      end do
      allocate (first(n + 1))
      call offsets_from_counts(fill, first, total)
      allocate (home(total))
      fill = first(:n)
      do j = 1, size(eq, 2)
         do i = 1, n_nodal
            if (eq(i, j) == 0) cycle
            home(fill(eq(i, j))) = j
            fill(eq(i, j)) = fill(eq(i, j)) + 1
         end do
      end do
   end subroutine equation_homes

   !> Running sums from 1; total is negative when it does not fit.
   pure subroutine offsets_from_counts(counts, first, total)
      integer, intent(in) :: counts(:)
      integer(i4), intent(out) :: first(:) !< (size(counts) + 1)
      integer(i4), intent(out) :: total
      integer :: i
      first(1) = 1
      do i = 1, size(counts)
         if (first(i) > huge(first) - counts(i)) then
            first(i + 1:) = 1
            total = -1
            return
         end if
         first(i + 1) = first(i) + counts(i)
      end do
      total = first(size(first)) - 1
   end subroutine offsets_from_counts
end module finshell_sparsity
