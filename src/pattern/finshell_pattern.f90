!> The pattern of a matrix: compressed columns, built once from the connectivity and the equation numbers.
!>
!> Column after column, twice: counted, then written. Equations that follow one another on a node meet the same ones, which are then
!> found and sorted once: time and memory are linear in the number of elements.
!> (Who meets whom is mutual, so that the same arrays are compressed rows; the lower triangle by columns is the upper one by rows.)
module finshell_pattern
   use finshell_cliques, only: cliques_t, cliques_at
   use finshell_freedoms, only: n_corners
   use finshell_kinds, only: i4, i8
   implicit none
   private
   public :: pattern_t, new_pattern, new_positions, place_of

   !> Numbered from 1. The diagonal is always part of a pattern made here.
   type :: pattern_t
      integer :: n = 0 !< equations
      logical :: symmetric = .true. !< only the lower triangle is stored
      integer(i8), allocatable :: start(:) !< (n + 1): column j is at start(j) .. start(j + 1) - 1
      integer(i4), allocatable :: row(:) !< ascending within a column
   end type pattern_t

   !> Which elements meet at a node.
   type :: incidence_t
      integer(i4), allocatable :: first(:) !< (nodes + 1)
      integer(i4), allocatable :: corner(:) !< 3 (element - 1) + local node
   end type incidence_t

contains

   !> Place of an entry in the values, or 0.
   pure integer(i8) function place_of(self, row, column) result(find)
      type(pattern_t), intent(in) :: self
      integer, intent(in) :: row, column
      integer(i8) :: low, high
      low = self%start(column)
      high = self%start(column + 1) - 1
      do while (low <= high)
         find = low + (high - low)/2
         if (self%row(find) == row) return
         if (self%row(find) < row) low = find + 1
         if (self%row(find) > row) high = find - 1
      end do
      find = 0
   end function place_of

   !> Build a pattern.
   !>
   !> No element meets an equation twice. Equations of nodes without an element keep their diagonal.
   subroutine new_pattern(pattern, n, triangles, eq, symmetric, cliques)
      type(pattern_t), intent(out) :: pattern
      integer, intent(in) :: n !< equations
      integer, intent(in) :: triangles(:, :) !< (3, elements) node numbers
      integer, intent(in) :: eq(:, :) !< (freedoms of a node, nodes) equation numbers, 0 = held
      logical, intent(in) :: symmetric !< store the lower triangle only
      type(cliques_t), intent(in), optional :: cliques !< equations that meet beside those of the elements
      type(incidence_t) :: at_node
      integer(i4), allocatable :: clique_first(:), clique(:)
      integer(i4), allocatable :: neighbour_first(:), neighbour(:), home_first(:), home(:), mark(:), met(:)

      pattern%n = n
      pattern%symmetric = symmetric
      call node_incidence(triangles, size(eq, 2), at_node)
      call node_neighbours(triangles, eq, at_node, neighbour_first, neighbour)
      call equation_homes(eq, n, home_first, home)
      if (present(cliques)) call cliques_at(cliques, n, clique_first, clique)

      allocate (pattern%start(n + 1), mark(n), met(n))
      pattern%start(1) = 1
      call visit(counting=.true.)
      allocate (pattern%row(pattern%start(n + 1) - 1))
      call visit(counting=.false.)

   contains

      !> Count the entries of all columns, or write them.
      subroutine visit(counting)
         logical, intent(in) :: counting
         integer :: c, from, many
         mark = 0
         many = 0
         do c = 1, n
            if (.not. as_before(c)) then
               call meet(c, many)
               from = 1
            end if
            if (symmetric) then
               do while (from <= many)
                  if (met(from) >= c) exit
                  from = from + 1
               end do
            end if
            if (counting) then
               pattern%start(c + 1) = pattern%start(c) + many - from + 1
            else
               pattern%row(pattern%start(c):pattern%start(c + 1) - 1) = met(from:many)
            end if
         end do
      end subroutine visit

      !> Does an equation meet those that the one before it meets? Both are of one node, alone, and in no clique.
      pure logical function as_before(c)
         integer, intent(in) :: c
         as_before = .false.
         if (c == 1) return
         if (any(home_first(c - 1:c) + 1 /= home_first(c:c + 1))) return
         if (home(home_first(c - 1)) /= home(home_first(c))) return
         as_before = .true.
         if (present(cliques)) as_before = clique_first(c - 1) == clique_first(c + 1)
      end function as_before

      !> The equations that one meets, ascending: met(:many).
      subroutine meet(c, many)
         integer, intent(in) :: c
         integer, intent(out) :: many
         integer :: h, k
         many = 0
         do h = home_first(c), home_first(c + 1) - 1
            do k = neighbour_first(home(h)), neighbour_first(home(h) + 1) - 1
               call insert(eq(:, neighbour(k)), c, mark, met, many)
            end do
         end do
         if (.not. present(cliques)) return
         do h = clique_first(c), clique_first(c + 1) - 1
            associate (k => clique(h))
               call insert(int(cliques%equation(cliques%first(k):cliques%first(k + 1) - 1)), c, mark, met, many)
            end associate
         end do
      end subroutine meet
   end subroutine new_pattern

   !> Put numbers that are not marked yet into an ascending list. They come in order, nearly, so that there is little to move.
   pure subroutine insert(equations, label, mark, list, many)
      integer, intent(in) :: equations(:)
      integer, intent(in) :: label
      integer(i4), intent(inout), contiguous :: mark(:), list(:)
      integer, intent(inout) :: many !< numbers in the list
      integer :: at, i
      do i = 1, size(equations)
         associate (equation => equations(i))
            if (equation == 0) cycle
            if (mark(equation) == label) cycle
            mark(equation) = label
            many = many + 1
            at = many
            do while (at > 1)
               if (list(at - 1) < equation) exit
               list(at) = list(at - 1)
               at = at - 1
            end do
            list(at) = equation
         end associate
      end do
   end subroutine insert

   !> Entries of an element matrix that a pattern takes: its lower triangle by columns, or all by columns.
   pure integer function entries_of(pattern, freedoms)
      type(pattern_t), intent(in) :: pattern
      integer, intent(in) :: freedoms
      entries_of = merge(freedoms*(freedoms + 1)/2, freedoms**2, pattern%symmetric)
   end function entries_of

   !> Where each entry of each element matrix goes.
   !>
   !> places(k, e) is the place of local entry k (lower triangle by columns for a symmetric pattern, else all entries by columns)
   !> in its column, from 1: the values have it at start(column) + places(k, e) - 1. Where the row of a symmetric pattern is above
   !> the column, it is minus the place in the column of the row. 0 where row or column are held. Freedoms are ordered by nodes.
   subroutine new_positions(pattern, triangles, eq, places, missing)
      type(pattern_t), intent(in) :: pattern
      integer, intent(in) :: triangles(:, :) !< (3, elements)
      integer, intent(in) :: eq(:, :) !< (freedoms of a node, nodes): those that the elements have
      integer(i4), allocatable, intent(out) :: places(:, :) !< (entries_of, elements)
      integer, intent(out), optional :: missing !< an element that the pattern has no room for, 0: none
      type(incidence_t) :: at_node
      integer(i8), allocatable :: place(:)
      integer(i8) :: p
      integer :: node, i, c, r, k, e, a, b, m, n

      m = size(eq, 1)
      n = n_corners*m
      if (present(missing)) missing = 0
      allocate (places(entries_of(pattern, n), size(triangles, 2)), source=0_i4)
      allocate (place(pattern%n), source=0_i8)
      call node_incidence(triangles, size(eq, 2), at_node)
      do node = 1, size(eq, 2)
         do i = 1, m
            c = eq(i, node)
            if (c == 0 .or. at_node%first(node) == at_node%first(node + 1)) cycle
            do p = pattern%start(c), pattern%start(c + 1) - 1
               place(pattern%row(p)) = p
            end do
            do k = at_node%first(node), at_node%first(node + 1) - 1
               e = (at_node%corner(k) - 1)/n_corners + 1
               b = m*mod(at_node%corner(k) - 1, n_corners) + i
               do a = 1, n
                  r = eq(mod(a - 1, m) + 1, triangles((a - 1)/m + 1, e))
                  if (r == 0 .or. (pattern%symmetric .and. r < c)) cycle
                  if (place(r) < pattern%start(c) .or. place(r) >= pattern%start(c + 1)) then
                     if (present(missing)) missing = e
                     cycle
                  end if
                  associate (found => int(place(r) - pattern%start(c), i4) + 1_i4)
                     if (pattern%symmetric) then
                        places(packed_index(n, max(a, b), min(a, b)), e) = merge(found, -found, a >= b)
                     else
                        places(n*(b - 1) + a, e) = found
                     end if
                  end associate
               end do
            end do
         end do
      end do
   end subroutine new_positions

   !> Position of (a, b), a >= b, in the lower triangle of n rows stored by columns.
   pure integer function packed_index(n, a, b)
      integer, intent(in) :: n, a, b
      packed_index = (b - 1)*n - (b*(b - 1))/2 + a
   end function packed_index

   !> Elements at each node, by counting.
   subroutine node_incidence(triangles, nodes, at_node)
      integer, intent(in) :: triangles(:, :), nodes
      type(incidence_t), intent(out) :: at_node
      integer, allocatable :: fill(:)
      integer :: e, k, node

      allocate (fill(nodes), source=0)
      do e = 1, size(triangles, 2)
         do k = 1, 3
            fill(triangles(k, e)) = fill(triangles(k, e)) + 1
         end do
      end do
      allocate (at_node%first(nodes + 1), at_node%corner(size(triangles)))
      call offsets_from_counts(fill, at_node%first)
      fill = at_node%first(:nodes)
      do e = 1, size(triangles, 2)
         do k = 1, 3
            node = triangles(k, e)
            at_node%corner(fill(node)) = n_corners*(e - 1) + k
            fill(node) = fill(node) + 1
         end do
      end do
   end subroutine node_incidence

   !> Nodes that share an element with each node, itself included, in the order of their equations.
   subroutine node_neighbours(triangles, eq, at_node, first, neighbour)
      integer, intent(in) :: triangles(:, :), eq(:, :)
      type(incidence_t), intent(in) :: at_node
      integer(i4), allocatable, intent(out) :: first(:), neighbour(:)
      integer(i4), allocatable :: mark(:), rank(:)
      integer :: nodes, node, k, l, e, fill

      nodes = size(eq, 2)
      rank = int(maxval(eq, dim=1), i4)
      ! An element brings at most two new neighbours to each of its nodes.
      allocate (first(nodes + 1), neighbour(nodes + 2*size(triangles)), mark(nodes))
      mark = 0
      fill = 1
      do node = 1, nodes
         first(node) = fill
         call append(node)
         do k = at_node%first(node), at_node%first(node + 1) - 1
            e = (at_node%corner(k) - 1)/n_corners + 1
            do l = 1, n_corners
               if (mark(triangles(l, e)) /= node) call append(triangles(l, e))
            end do
         end do
      end do
      first(nodes + 1) = fill

   contains

      subroutine append(other)
         integer, intent(in) :: other
         integer :: at
         mark(other) = node
         at = fill
         fill = fill + 1
         do while (at > first(node))
            if (rank(neighbour(at - 1)) <= rank(other)) exit
            neighbour(at) = neighbour(at - 1)
            at = at - 1
         end do
         neighbour(at) = other
      end subroutine append
   end subroutine node_neighbours

   !> The nodes that carry each equation.
   subroutine equation_homes(eq, n, first, home)
      integer, intent(in) :: eq(:, :), n
      integer(i4), allocatable, intent(out) :: first(:), home(:)
      integer, allocatable :: fill(:)
      integer :: i, j

      allocate (fill(n), source=0)
      do j = 1, size(eq, 2)
         do i = 1, size(eq, 1)
            if (eq(i, j) > 0) fill(eq(i, j)) = fill(eq(i, j)) + 1
         end do
      end do
      allocate (first(n + 1))
      call offsets_from_counts(fill, first)
      allocate (home(first(n + 1) - 1))
      fill = first(:n)
      do j = 1, size(eq, 2)
         do i = 1, size(eq, 1)
            if (eq(i, j) == 0) cycle
            home(fill(eq(i, j))) = j
            fill(eq(i, j)) = fill(eq(i, j)) + 1
         end do
      end do
   end subroutine equation_homes

   !> Running sums from 1.
   pure subroutine offsets_from_counts(counts, first)
      integer, intent(in) :: counts(:)
      integer(i4), intent(out) :: first(:) !< (size(counts) + 1)
      integer :: i
      first(1) = 1
      do i = 1, size(counts)
         first(i + 1) = first(i) + int(counts(i), i4)
      end do
   end subroutine offsets_from_counts
end module finshell_pattern
