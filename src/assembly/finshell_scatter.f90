!> Adding element matrices to the values of a sparse matrix.
!>
!> Nodes whose six equations are consecutive (all but the supported ones, usually) meet in runs of six neighbouring
!> entries: an offset for each pair of nodes then says it all, and whole runs are added at once. Other elements have the place of
!> every entry written down.
module finshell_scatter
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
      integer, intent(in) :: eq(:, :) !< (6, nodes) equations, 0 = constrained
      logical, intent(in), optional :: membranes(:) !< (elements) those that have displacements only
      integer(i4), allocatable :: list(:)
      logical, allocatable :: regular(:)
      integer :: e, j, k, n, hi, lo

      self%symmetric = pattern%symmetric
      self%column_pointer = pattern%column_pointer
      allocate (regular(size(eq, 2)))
      do j = 1, size(eq, 2)
         regular(j) = eq(1, j) > 0 .and. all(eq(2:, j) - eq(:5, j) == 1)
      end do
      allocate (self%equation(3, size(triangles, 2)), self%offset(merge(3, 9, self%symmetric), size(triangles, 2)))
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
         if (.not. all(regular(triangles(:, e)))) then
            n = n + 1
            list(n) = int(e, i4)
            self%irregular(e) = int(n, i4)
         else if (self%symmetric) then
            do j = 1, 3
               associate (a => self%equation(pair_row(j), e), b => self%equation(pair_column(j), e))
                  hi = max(a, b)
                  lo = min(a, b)
               end associate
               self%offset(j, e) = int(pattern%find(hi, lo) - self%column_pointer(lo) - 6, i4)
            end do
         else
            do j = 1, 3
               lo = self%equation(j, e)
               do k = 1, 3
                  self%offset(3*j - 3 + k, e) = int(pattern%find(self%equation(k, e), lo) - self%column_pointer(lo), i4)
               end do
            end do
         end if
      end do
      call element_positions(pattern, triangles(:, list(:n)), eq, self%position)

   contains

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
         call element_positions(pattern, triangles(:, pack([(i, i=1, size(membranes))], membranes)), eq(:3, :), self%displacements)
      end subroutine scatter_membranes
   end subroutine new_scatter

   !> values <- values + k of element e. A symmetric pattern reads k as symmetric.
   pure subroutine add_element_matrix(self, e, k, values)
      type(scatter_t), intent(in) :: self
      integer, intent(in) :: e
      real(wp), intent(in), contiguous :: k(:, :) !< (18, 18); of an element that has displacements only, (9, 9) will do
      real(wp), intent(inout) :: values(:)
      integer, parameter :: displacements(9) = [1, 2, 3, 7, 8, 9, 13, 14, 15]
      integer(i4) :: membrane
      membrane = 0
      if (allocated(self%membrane)) membrane = self%membrane(e)
      if (membrane > 0) then
         if (size(k, 1) == 9) then
            call add_entries(self%symmetric, self%displacements(:, membrane), k, values)
         else
            call add_entries(self%symmetric, self%displacements(:, membrane), k(displacements, displacements), values)
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
      integer(i4), intent(in) :: column_pointer(:), equation(3), offset(3)
      real(wp), intent(in) :: k(18, 18)
      real(wp), intent(inout) :: values(:)
      integer :: j, c, p, hi, lo, node
      do node = 1, 3
         do c = 1, 6
            p = column_pointer(equation(node) + c - 1) - c
            values(p + c:p + 6) = values(p + c:p + 6) + k(6*node - 6 + c:6*node, 6*node - 6 + c)
         end do
      end do
      do j = 1, 3
         hi = pair_row(j)
         lo = pair_column(j)
         if (equation(hi) < equation(lo)) then
            hi = pair_column(j)
            lo = pair_row(j)
         end if
         do c = 1, 6
            p = column_pointer(equation(lo) + c - 1) + 6 - c + offset(j)
            values(p + 1:p + 6) = values(p + 1:p + 6) + k(6*hi - 5:6*hi, 6*lo - 6 + c)
         end do
      end do
   end subroutine add_lower_runs

   pure subroutine add_full_runs(column_pointer, equation, offset, k, values)
      integer(i4), intent(in) :: column_pointer(:), equation(3), offset(9)
      real(wp), intent(in) :: k(18, 18)
      real(wp), intent(inout) :: values(:)
      integer :: c, p, row, column
      do column = 1, 3
         do c = 1, 6
            do row = 1, 3
               p = column_pointer(equation(column) + c - 1) + offset(3*column - 3 + row)
               values(p:p + 5) = values(p:p + 5) + k(6*row - 5:6*row, 6*column - 6 + c)
            end do
         end do
      end do
   end subroutine add_full_runs
end module finshell_scatter
