!> Adding element matrices to the values of a sparse matrix.
!>
!> Nodes whose equations are all there and consecutive (all but the supported ones, usually) meet in runs of neighbouring
!> entries: an offset for each pair of nodes then says it all, and whole runs are added at once. Other elements have the place of
!> every entry written down.
module finshell_scatter
   use finshell_freedoms, only: n_corners, n_membrane, n_nodal, n_shell, shell_displacements, uz
   use finshell_kinds, only: wp, i4
   use finshell_sparsity, only: sparsity_t, element_positions
   implicit none
   private
   public :: scatter_t, new_scatter, add_element_matrix

   type :: scatter_t
      private
      logical :: symmetric = .true.
      integer(i4), allocatable :: column_pointer(:)
      integer(i4), allocatable :: equation(:, :) ! (3, elements) first equation of each node
      ! (pairs, elements) where the run of the row node begins in a column of the column node: from the start of the column
      ! (full; pairs 11, 21, 31, 12, ... 33), or from the end of its diagonal block (symmetric; pairs 21, 31, 32, the node with
      ! the smaller equations being the column).
      integer(i4), allocatable :: offset(:, :)
      integer(i4), allocatable :: irregular(:) ! (elements) index into position, 0: made of runs
      integer(i4), allocatable :: position(:, :) ! (entries, irregular elements) 0: constrained
      ! Elements that have displacements only: (elements) index into displacements, 0: others.
      integer(i4), allocatable :: membrane(:)
      integer(i4), allocatable :: displacements(:, :) ! (entries, membranes) as position
   end type scatter_t

   !> Pairs (row node, column node) of the lower triangle.
   integer, parameter :: pair_row(3) = [2, 3, 3], pair_column(3) = [1, 1, 2]

contains

   !> Prepare for the elements of a pattern.
   subroutine new_scatter(self, pattern, triangles, eq, membranes)
      type(scatter_t), intent(out) :: self
      type(sparsity_t), intent(in) :: pattern
      integer, intent(in) :: triangles(:, :) !< (3, elements) nodes
      integer, intent(in) :: eq(:, :) !< (n_nodal, nodes) equations, 0 = constrained
      logical, intent(in), optional :: membranes(:) !< (elements) those that have displacements only
      integer(i4), allocatable :: list(:)
      logical, allocatable :: regular(:)
      integer :: e, j, k, n, hi, lo

      self%symmetric = pattern%symmetric
      self%column_pointer = pattern%column_pointer
      allocate (regular(size(eq, 2)))
      do j = 1, size(eq, 2)
         regular(j) = eq(1, j) > 0 .and. all(eq(2:, j) - eq(:n_nodal - 1, j) == 1)
      end do
      allocate (self%equation(n_corners, size(triangles, 2)))
      allocate (self%offset(merge(size(pair_row), n_corners**2, self%symmetric), size(triangles, 2)))
      allocate (self%irregular(size(triangles, 2)), list(size(triangles, 2)))
      if (present(membranes)) then
         if (any(membranes)) call scatter_membranes()
      end if
      n = 0
      do e = 1, size(triangles, 2)
         self%equation(:, e) = eq(1, triangles(:, e))
         self%irregular(e) = 0
         if (allocated(self%membrane)) then
            if (self%membrane(e) > 0) cycle
         end if
         if (all(regular(triangles(:, e)))) then
            call find_offsets()
            if (in_runs()) cycle
         end if
         n = n + 1
         list(n) = int(e, i4)
         self%irregular(e) = int(n, i4)
      end do
      call element_positions(pattern, triangles(:, list(:n)), eq, self%position)

   contains

      subroutine find_offsets()
         if (self%symmetric) then
            do j = 1, size(pair_row)
               associate (a => self%equation(pair_row(j), e), b => self%equation(pair_column(j), e))
                  hi = max(a, b)
                  lo = min(a, b)
               end associate
               self%offset(j, e) = int(pattern%find(hi, lo) - self%column_pointer(lo) - n_nodal, i4)
            end do
         else
            do j = 1, n_corners
               lo = self%equation(j, e)
               do k = 1, n_corners
                  self%offset(n_corners*(j - 1) + k, e) = int(pattern%find(self%equation(k, e), lo) - self%column_pointer(lo), i4)
               end do
            end do
         end if
      end subroutine find_offsets

      !> Are the offsets those in all columns of a node? Not where some of its components meet others in cliques.
      logical function in_runs()
         integer :: c, p
         in_runs = .true.
         do j = 1, size(self%offset, 1)
            if (self%symmetric) then
               hi = max(self%equation(pair_row(j), e), self%equation(pair_column(j), e))
               lo = min(self%equation(pair_row(j), e), self%equation(pair_column(j), e))
            else
               lo = self%equation((j - 1)/n_corners + 1, e)
               hi = self%equation(mod(j - 1, n_corners) + 1, e)
            end if
            do c = 1, n_nodal
               p = self%column_pointer(lo + c - 1) + self%offset(j, e)
               if (self%symmetric) p = p + n_nodal - c + 1
               in_runs = in_runs .and. p >= 1 .and. p + n_nodal - 1 <= size(pattern%row)
               if (.not. in_runs) return
               in_runs = pattern%row(p) == hi .and. pattern%row(p + n_nodal - 1) == hi + n_nodal - 1
               if (.not. in_runs) return
            end do
         end do
      end function in_runs

      subroutine scatter_membranes()
         integer(i4) :: found
         integer :: i
         allocate (self%membrane(size(membranes)), source=0_i4)
         found = 0
         do i = 1, size(membranes)
            if (.not. membranes(i)) cycle
            found = found + 1_i4
            self%membrane(i) = found
         end do
         call element_positions(pattern, triangles(:, pack([(i, i=1, size(membranes))], membranes)), eq(:uz, :), self%displacements)
      end subroutine scatter_membranes
   end subroutine new_scatter

   !> values <- values + k of element e. A symmetric pattern reads k as symmetric.
   pure subroutine add_element_matrix(self, e, k, values)
      type(scatter_t), intent(in) :: self
      integer, intent(in) :: e
      real(wp), intent(in), contiguous :: k(:, :) !< (n_shell, n_shell), or of a membrane (n_membrane, n_membrane)
      real(wp), intent(inout) :: values(:)
      integer(i4) :: membrane
      membrane = 0
      if (allocated(self%membrane)) membrane = self%membrane(e)
      if (membrane > 0) then
         if (size(k, 1) == n_membrane) then
            call add_entries(self%symmetric, self%displacements(:, membrane), k, values)
         else
            call add_entries(self%symmetric, self%displacements(:, membrane), k(shell_displacements, shell_displacements), values)
         end if
      else if (self%irregular(e) > 0) then
         call add_entries(self%symmetric, self%position(:, self%irregular(e)), k, values)
      else if (self%symmetric) then
         call add_lower_runs(self%column_pointer, self%equation(:, e), self%offset(:, e), k, values)
      else
         call add_full_runs(self%column_pointer, self%equation(:, e), self%offset(:, e), k, values)
      end if
   end subroutine add_element_matrix

   pure subroutine add_entries(symmetric, position, k, values)
      logical, intent(in) :: symmetric
      integer(i4), intent(in) :: position(:)
      real(wp), intent(in) :: k(:, :)
      real(wp), intent(inout) :: values(:)
      integer :: a, b, l
      l = 0
      do b = 1, size(k, 1)
         do a = merge(b, 1, symmetric), size(k, 1)
            l = l + 1
            if (position(l) > 0) values(position(l)) = values(position(l)) + k(a, b)
         end do
      end do
   end subroutine add_entries

   pure subroutine add_lower_runs(column_pointer, equation, offset, k, values)
      integer(i4), intent(in) :: column_pointer(:), equation(n_corners), offset(size(pair_row))
      real(wp), intent(in) :: k(n_shell, n_shell)
      real(wp), intent(inout) :: values(:)
      integer :: j, c, p, hi, lo, node
      do node = 1, n_corners
         do c = 1, n_nodal
            p = column_pointer(equation(node) + c - 1) - c
            values(p + c:p + n_nodal) = values(p + c:p + n_nodal) &
               + k(n_nodal*(node - 1) + c:n_nodal*node, n_nodal*(node - 1) + c)
         end do
      end do
      do j = 1, size(pair_row)
         hi = pair_row(j)
         lo = pair_column(j)
         if (equation(hi) < equation(lo)) then
            hi = pair_column(j)
            lo = pair_row(j)
         end if
         do c = 1, n_nodal
            p = column_pointer(equation(lo) + c - 1) + n_nodal - c + offset(j)
            values(p + 1:p + n_nodal) = values(p + 1:p + n_nodal) &
               + k(n_nodal*(hi - 1) + 1:n_nodal*hi, n_nodal*(lo - 1) + c)
         end do
      end do
   end subroutine add_lower_runs

   pure subroutine add_full_runs(column_pointer, equation, offset, k, values)
      integer(i4), intent(in) :: column_pointer(:), equation(n_corners), offset(n_corners**2)
      real(wp), intent(in) :: k(n_shell, n_shell)
      real(wp), intent(inout) :: values(:)
      integer :: c, p, row, column
      do column = 1, n_corners
         do c = 1, n_nodal
            do row = 1, n_corners
               p = column_pointer(equation(column) + c - 1) + offset(n_corners*(column - 1) + row)
               values(p:p + n_nodal - 1) = values(p:p + n_nodal - 1) &
                  + k(n_nodal*(row - 1) + 1:n_nodal*row, n_nodal*(column - 1) + c)
            end do
         end do
      end do
   end subroutine add_full_runs
end module finshell_scatter
