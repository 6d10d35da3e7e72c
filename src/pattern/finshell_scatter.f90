!> Adding element matrices to the values of a sparse matrix.
!>
!> Nodes whose equations are all there and consecutive (all but the supported ones, usually) meet in runs of neighbouring
!> entries: an offset for each pair of nodes then says it all, and whole runs are added at once. Other elements have the place of
!> every entry written down.
module finshell_scatter
   use finshell_freedoms, only: n_corners, n_membrane, n_nodal, n_shell, shell_displacements, uz
   use finshell_kinds, only: wp, i4, i8
   use finshell_pattern, only: new_positions, pattern_t, place_of
   implicit none
   private
   public :: scatter_t, new_scatter, add_element_matrix

   !> Elements whose entries are written down one by one, all of one kind.
   type :: listed_t
      integer(i8), allocatable :: base(:, :) !< (freedoms, elements) one before the column in the values; columns that are held: any
      integer(i4), allocatable :: place(:, :) !< (entries, elements) as new_positions has them
   end type listed_t

   type :: scatter_t
      private
      logical :: symmetric = .true.
      integer(i8), allocatable :: start(:) ! of the columns
      integer(i4), allocatable :: equation(:, :) ! (3, elements) first equation of each node
      ! (pairs, elements) where the run of the row node begins in a column of the column node: from the start of the column
      ! (full; pairs 11, 21, 31, 12, ... 33), or from the end of its diagonal block (symmetric; pairs 21, 31, 32, the node with
      ! the smaller equations being the column).
      integer(i4), allocatable :: offset(:, :)
      integer(i4), allocatable :: listed(:) ! (elements) where they stand in one of the lists below, 0: made of runs
      logical, allocatable :: membrane(:) ! (elements) those that have displacements only
      type(listed_t) :: shells, membranes
   end type scatter_t

   !> Pairs (row node, column node) of the lower triangle.
   integer, parameter :: pair_row(3) = [2, 3, 3], pair_column(3) = [1, 1, 2]

contains

   !> Prepare for the elements of a pattern.
   subroutine new_scatter(self, pattern, triangles, eq, membranes, missing)
      type(scatter_t), intent(out) :: self
      type(pattern_t), intent(in) :: pattern
      integer, intent(in) :: triangles(:, :) !< (3, elements) nodes
      integer, intent(in) :: eq(:, :) !< (n_nodal, nodes) equations, 0 = constrained
      logical, intent(in), optional :: membranes(:) !< (elements) those that have displacements only
      integer, intent(out), optional :: missing !< an element that the pattern has no room for, 0: none
      integer, allocatable :: run(:) ! (nodes) freedoms, from the first, that `run_of` finds
      integer :: e, j, k, lacking, n(2), width
      integer(i8) :: hi, lo

      self%symmetric = pattern%symmetric
      allocate (self%start, source=pattern%start)
      run = [(run_of(eq(:, j)), j=1, size(eq, 2))]
      allocate (self%equation(n_corners, size(triangles, 2)))
      allocate (self%offset(merge(size(pair_row), n_corners**2, self%symmetric), size(triangles, 2)), source=0_i4)
      allocate (self%listed(size(triangles, 2)), source=0_i4)
      allocate (self%membrane(size(triangles, 2)), source=.false.)
      if (present(membranes)) self%membrane = membranes
      n = 0
      do e = 1, size(triangles, 2)
         do j = 1, n_corners
            self%equation(j, e) = int(eq(1, triangles(j, e)), i4)
         end do
         width = merge(uz, n_nodal, self%membrane(e))
         if (minval(run(triangles(:, e))) >= width) then
            if (in_runs()) cycle
         end if
         k = merge(2, 1, self%membrane(e))
         n(k) = n(k) + 1
         self%listed(e) = int(n(k), i4)
      end do
      if (present(missing)) missing = 0
      call new_list(self%shells, n(1), .false., n_nodal)
      call new_list(self%membranes, n(2), .true., uz)

   contains

      !> Freedoms, from the first, whose equations follow one another, and whose columns hold the same rows (from their diagonal
      !> block on). So they do but where some components of a node meet others in cliques, or a pattern is not ours.
      pure integer function run_of(equations)
         integer, intent(in) :: equations(:)
         integer(i8) :: first, last, more
         run_of = 0
         if (equations(1) == 0) return
         associate (start => pattern%start, row => pattern%row, c => equations(1))
            if (pattern%symmetric) then
               if (start(c) == start(c + 1)) return
               if (row(start(c)) /= c) return
            end if
            do
               run_of = run_of + 1
               if (run_of == size(equations)) return
               if (equations(run_of + 1) /= c + run_of) return
               first = start(c + run_of - 1)
               last = start(c + run_of) - 1
               if (pattern%symmetric) first = first + 1
               more = start(c + run_of)
               if (first > last .or. start(c + run_of + 1) - more /= last - first + 1) return
               if (pattern%symmetric .and. row(more) /= c + run_of) return
               if (any(row(first:last) /= row(more:more + last - first))) return
            end do
         end associate
      end function run_of

      !> Find the offsets. Are all pairs of nodes there, each in one run?
      logical function in_runs()
         integer(i8) :: p
         in_runs = .false.
         do j = 1, size(self%offset, 1)
            if (self%symmetric) then
               hi = max(self%equation(pair_row(j), e), self%equation(pair_column(j), e))
               lo = min(self%equation(pair_row(j), e), self%equation(pair_column(j), e))
            else
               lo = self%equation((j - 1)/n_corners + 1, e)
               hi = self%equation(mod(j - 1, n_corners) + 1, e)
            end if
            p = place_of(pattern, int(hi), int(lo))
            if (p == 0) return
            if (p + width > self%start(lo + 1)) return
            if (pattern%row(p + width - 1) /= hi + width - 1) return
            self%offset(j, e) = int(p - self%start(lo), i4)
            if (self%symmetric) self%offset(j, e) = self%offset(j, e) - int(width, i4)
         end do
         in_runs = .true.
      end function in_runs

      !> Write down the entries of the listed elements of one kind.
      subroutine new_list(list, elements, of_membranes, freedoms)
         type(listed_t), intent(inout) :: list
         integer, intent(in) :: elements, freedoms
         logical, intent(in) :: of_membranes
         integer, allocatable :: corners(:, :)
         integer :: column
         allocate (corners(n_corners, elements), list%base(n_corners*freedoms, elements))
         do e = 1, size(triangles, 2)
            if (self%listed(e) == 0 .or. (self%membrane(e) .neqv. of_membranes)) cycle
            corners(:, self%listed(e)) = triangles(:, e)
            do j = 1, n_corners
               do k = 1, freedoms
                  column = max(1, eq(k, triangles(j, e)))
                  list%base(freedoms*(j - 1) + k, self%listed(e)) = 0
                  if (pattern%n > 0) list%base(freedoms*(j - 1) + k, self%listed(e)) = self%start(column) - 1
               end do
            end do
         end do
         call new_positions(pattern, corners, eq(:freedoms, :), list%place, lacking)
         if (.not. present(missing) .or. lacking == 0) return
         do e = 1, size(triangles, 2)
            if (self%listed(e) == lacking .and. (self%membrane(e) .eqv. of_membranes)) missing = e
         end do
      end subroutine new_list
   end subroutine new_scatter

   !> values <- values + k of element e. A symmetric pattern reads k as symmetric.
   pure subroutine add_element_matrix(self, e, k, values)
      type(scatter_t), intent(in) :: self
      integer, intent(in) :: e
      real(wp), intent(in), contiguous :: k(:, :) !< (n_shell, n_shell), or of a membrane (n_membrane, n_membrane)
      real(wp), intent(inout), contiguous :: values(:)
      if (self%membrane(e)) then
         if (size(k, 1) == n_membrane) then
            call add_of_membrane(self, e, k, values)
         else
            call add_of_membrane(self, e, k(shell_displacements, shell_displacements), values)
         end if
      else if (self%listed(e) > 0) then
         call add_entries(self%symmetric, n_shell, self%shells%base(:, self%listed(e)), self%shells%place(:, self%listed(e)), k, &
                          values)
      else if (self%symmetric) then
         call add_lower_runs(self%start, self%equation(:, e), self%offset(:, e), k, values)
      else
         call add_full_runs(self%start, self%equation(:, e), self%offset(:, e), k, values)
      end if
   end subroutine add_element_matrix

   pure subroutine add_of_membrane(self, e, k, values)
      type(scatter_t), intent(in) :: self
      integer, intent(in) :: e
      real(wp), intent(in) :: k(n_membrane, n_membrane)
      real(wp), intent(inout), contiguous :: values(:)
      if (self%listed(e) > 0) then
         call add_entries(self%symmetric, n_membrane, self%membranes%base(:, self%listed(e)), &
                          self%membranes%place(:, self%listed(e)), k, values)
      else if (self%symmetric) then
         call add_short_lower_runs(self%start, self%equation(:, e), self%offset(:, e), k, values)
      else
         call add_short_full_runs(self%start, self%equation(:, e), self%offset(:, e), k, values)
      end if
   end subroutine add_of_membrane

   pure subroutine add_entries(symmetric, n, base, place, k, values)
      logical, intent(in) :: symmetric
      integer, intent(in) :: n
      integer(i8), intent(in) :: base(n)
      integer(i4), intent(in) :: place(:)
      real(wp), intent(in) :: k(n, n)
      real(wp), intent(inout), contiguous :: values(:)
      integer :: a, b, l
      l = 0
      do b = 1, n
         do a = merge(b, 1, symmetric), n
            l = l + 1
            if (place(l) > 0) then
               values(base(b) + place(l)) = values(base(b) + place(l)) + k(a, b)
            else if (place(l) < 0) then
               values(base(a) - place(l)) = values(base(a) - place(l)) + k(a, b)
            end if
         end do
      end do
   end subroutine add_entries

   ! Runs of six and of three, in procedures of their own: loops of a length that the compiler knows become a few instructions,
   ! others dozens.

   pure subroutine add_lower_runs(start, equation, offset, k, values)
      integer(i8), intent(in), contiguous :: start(:)
      integer(i4), intent(in) :: equation(n_corners), offset(size(pair_row))
      real(wp), intent(in) :: k(n_nodal, n_corners, n_nodal, n_corners)
      real(wp), intent(inout) :: values(*)
      integer :: j, c, hi, i, lo, node
      integer(i8) :: p
      do node = 1, n_corners
         do c = 1, n_nodal
            p = start(equation(node) + c - 1) - c
            do i = c, n_nodal
               values(p + i) = values(p + i) + k(i, node, c, node)
            end do
         end do
      end do
      do j = 1, size(pair_row)
         call order_pair(equation, j, hi, lo)
         do c = 1, n_nodal
            p = start(equation(lo) + c - 1) + n_nodal - c + offset(j) + 1
            call add_run(k(:, hi, c, lo), values(p))
         end do
      end do
   end subroutine add_lower_runs

   pure subroutine add_short_lower_runs(start, equation, offset, k, values)
      integer(i8), intent(in), contiguous :: start(:)
      integer(i4), intent(in) :: equation(n_corners), offset(size(pair_row))
      real(wp), intent(in) :: k(uz, n_corners, uz, n_corners)
      real(wp), intent(inout) :: values(*)
      integer :: j, c, hi, i, lo, node
      integer(i8) :: p
      do node = 1, n_corners
         do c = 1, uz
            p = start(equation(node) + c - 1) - c
            do i = c, uz
               values(p + i) = values(p + i) + k(i, node, c, node)
            end do
         end do
      end do
      do j = 1, size(pair_row)
         call order_pair(equation, j, hi, lo)
         do c = 1, uz
            p = start(equation(lo) + c - 1) + uz - c + offset(j) + 1
            call add_short_run(k(:, hi, c, lo), values(p))
         end do
      end do
   end subroutine add_short_lower_runs

   !> The nodes of a pair by their equations.
   pure subroutine order_pair(equation, j, hi, lo)
      integer(i4), intent(in) :: equation(n_corners)
      integer, intent(in) :: j
      integer, intent(out) :: hi, lo
      hi = pair_row(j)
      lo = pair_column(j)
      if (equation(hi) > equation(lo)) return
      hi = pair_column(j)
      lo = pair_row(j)
   end subroutine order_pair

   pure subroutine add_full_runs(start, equation, offset, k, values)
      integer(i8), intent(in), contiguous :: start(:)
      integer(i4), intent(in) :: equation(n_corners), offset(n_corners, n_corners)
      real(wp), intent(in) :: k(n_nodal, n_corners, n_nodal, n_corners)
      real(wp), intent(inout) :: values(*)
      integer :: c, column
      integer(i8) :: p
      do column = 1, n_corners
         do c = 1, n_nodal
            p = start(equation(column) + c - 1)
            call add_run(k(:, 1, c, column), values(p + offset(1, column)))
            call add_run(k(:, 2, c, column), values(p + offset(2, column)))
            call add_run(k(:, 3, c, column), values(p + offset(3, column)))
         end do
      end do
   end subroutine add_full_runs

   pure subroutine add_short_full_runs(start, equation, offset, k, values)
      integer(i8), intent(in), contiguous :: start(:)
      integer(i4), intent(in) :: equation(n_corners), offset(n_corners, n_corners)
      real(wp), intent(in) :: k(uz, n_corners, uz, n_corners)
      real(wp), intent(inout) :: values(*)
      integer :: c, column
      integer(i8) :: p
      do column = 1, n_corners
         do c = 1, uz
            p = start(equation(column) + c - 1)
            call add_short_run(k(:, 1, c, column), values(p + offset(1, column)))
            call add_short_run(k(:, 2, c, column), values(p + offset(2, column)))
            call add_short_run(k(:, 3, c, column), values(p + offset(3, column)))
         end do
      end do
   end subroutine add_short_full_runs

   pure subroutine add_run(k, values)
      real(wp), intent(in) :: k(n_nodal)
      real(wp), intent(inout) :: values(n_nodal)
      values = values + k
   end subroutine add_run

   pure subroutine add_short_run(k, values)
      real(wp), intent(in) :: k(uz)
      real(wp), intent(inout) :: values(uz)
      values = values + k
   end subroutine add_short_run
end module finshell_scatter
