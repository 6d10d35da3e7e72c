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
      integer, allocatable :: run(:) ! (nodes) freedoms, from the first, whose equations follow one another
      integer :: e, j, k, lacking, n(2), width
      integer(i8) :: hi, lo

      self%symmetric = pattern%symmetric
      allocate (self%start, source=pattern%start)
      allocate (run(size(eq, 2)))
      do j = 1, size(eq, 2)
         run(j) = 0
         if (eq(1, j) > 0) run(j) = 1
         do k = 2, n_nodal
            if (run(j) == k - 1 .and. eq(k, j) - eq(1, j) == k - 1) run(j) = k
         end do
      end do
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
            call find_offsets()
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

      subroutine find_offsets()
         if (self%symmetric) then
            do j = 1, size(pair_row)
               associate (a => self%equation(pair_row(j), e), b => self%equation(pair_column(j), e))
                  hi = max(a, b)
                  lo = min(a, b)
               end associate
               self%offset(j, e) = int(place_of(pattern, int(hi), int(lo)) - self%start(lo) - width, i4)
            end do
         else
            do j = 1, n_corners
               lo = self%equation(j, e)
               do k = 1, n_corners
                  self%offset(n_corners*(j - 1) + k, e) = &
                     int(max(-1_i8, place_of(pattern, int(self%equation(k, e)), int(lo)) - self%start(lo)), i4)
               end do
            end do
         end if
      end subroutine find_offsets

      !> Are the offsets those in all columns of a node? Not where some of its components meet others in cliques.
      logical function in_runs()
         integer :: c
         integer(i8) :: p
         in_runs = .true.
         do j = 1, size(self%offset, 1)
            if (self%symmetric) then
               hi = max(self%equation(pair_row(j), e), self%equation(pair_column(j), e))
               lo = min(self%equation(pair_row(j), e), self%equation(pair_column(j), e))
            else
               lo = self%equation((j - 1)/n_corners + 1, e)
               hi = self%equation(mod(j - 1, n_corners) + 1, e)
            end if
            do c = 1, width
               p = self%start(lo + c - 1) + self%offset(j, e)
               if (self%symmetric) p = p + width - c + 1
               in_runs = in_runs .and. p >= 1 .and. p + width - 1 <= size(pattern%row, kind=i8)
               if (.not. in_runs) return
               in_runs = pattern%row(p) == hi .and. pattern%row(p + width - 1) == hi + width - 1
               if (.not. in_runs) return
            end do
         end do
         if (.not. self%symmetric) return
         do j = 1, n_corners ! diagonal blocks, which another pattern than ours may have interrupted
            do c = 1, width
               lo = self%equation(j, e) + c - 1
               p = self%start(lo)
               in_runs = in_runs .and. p + width - c <= size(pattern%row, kind=i8)
               if (.not. in_runs) return
               in_runs = pattern%row(p) == lo .and. pattern%row(p + width - c) == self%equation(j, e) + width - 1
               if (.not. in_runs) return
            end do
         end do
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
         call add_lower_runs(n_nodal, self%start, self%equation(:, e), self%offset(:, e), k, values)
      else
         call add_full_runs(n_nodal, self%start, self%equation(:, e), self%offset(:, e), k, values)
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
         call add_lower_runs(uz, self%start, self%equation(:, e), self%offset(:, e), k, values)
      else
         call add_full_runs(uz, self%start, self%equation(:, e), self%offset(:, e), k, values)
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

   pure subroutine add_lower_runs(w, start, equation, offset, k, values)
      integer, intent(in) :: w !< freedoms of a node
      integer(i8), intent(in), contiguous :: start(:)
      integer(i4), intent(in) :: equation(n_corners), offset(size(pair_row))
      real(wp), intent(in) :: k(n_corners*w, n_corners*w)
      real(wp), intent(inout) :: values(*)
      integer :: j, c, hi, i, lo, node
      integer(i8) :: p
      do node = 1, n_corners
         do c = 1, w
            p = start(equation(node) + c - 1) - c
            do i = c, w
               values(p + i) = values(p + i) + k(w*(node - 1) + i, w*(node - 1) + c)
            end do
         end do
      end do
      do j = 1, size(pair_row)
         hi = pair_row(j)
         lo = pair_column(j)
         if (equation(hi) < equation(lo)) then
            hi = pair_column(j)
            lo = pair_row(j)
         end if
         do c = 1, w
            p = start(equation(lo) + c - 1) + w - c + offset(j) + 1
            call add_run(w, k(w*(hi - 1) + 1, w*(lo - 1) + c), values(p))
         end do
      end do
   end subroutine add_lower_runs

   pure subroutine add_full_runs(w, start, equation, offset, k, values)
      integer, intent(in) :: w !< freedoms of a node
      integer(i8), intent(in), contiguous :: start(:)
      integer(i4), intent(in) :: equation(n_corners), offset(n_corners**2)
      real(wp), intent(in) :: k(n_corners*w, n_corners*w)
      real(wp), intent(inout) :: values(*)
      integer :: c, column
      integer(i8) :: p
      do column = 1, n_corners
         associate (at => offset(n_corners*(column - 1) + 1:n_corners*column))
            do c = 1, w
               p = start(equation(column) + c - 1)
               call add_run(w, k(1, w*(column - 1) + c), values(p + at(1)))
               call add_run(w, k(w + 1, w*(column - 1) + c), values(p + at(2)))
               call add_run(w, k(2*w + 1, w*(column - 1) + c), values(p + at(3)))
            end do
         end associate
      end do
   end subroutine add_full_runs

   !> One run. Loops of a length that the compiler knows become a few instructions, others dozens.
   pure subroutine add_run(w, k, values)
      integer, intent(in) :: w
      real(wp), intent(in) :: k(*)
      real(wp), intent(inout) :: values(*)
      if (w == n_nodal) then
         values(:n_nodal) = values(:n_nodal) + k(:n_nodal)
      else
         values(:uz) = values(:uz) + k(:uz)
      end if
   end subroutine add_run
end module finshell_scatter
