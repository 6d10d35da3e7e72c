!> The pattern of the tangent (finshell_pattern), checked, of a team of processes; and products with a matrix of it.
module finshell_sparsity
   use finshell_cliques, only: cliques_t
   use finshell_kinds, only: dp, i4
   use finshell_freedoms, only: n_corners, n_nodal
   use finshell_error, only: error_t, raise, text_of
   use finshell_status, only: status_invalid_argument
   use finshell_pattern, only: new_pattern, pattern_t
   use finshell_team, only: add_up, team_t
   implicit none
   private
   public :: sparsity_t, new_sparsity

   !> A pattern as solvers take it. The diagonal is always part of it. Each member of a team has the pattern of its own elements,
   !> and the matrix is the sum of all. `start` of the pattern is for the places of elements (finshell_scatter): only those that
   !> `new_sparsity` made have it.
   type, extends(pattern_t) :: sparsity_t
      integer(i4), allocatable :: column_pointer(:) !< (n + 1): column j is at column_pointer(j) .. column_pointer(j+1) - 1
      class(team_t), pointer :: team => null()
   contains
      procedure :: entries
      procedure :: find
      procedure :: diagonal_places
      procedure :: multiply
      procedure :: diagonal
      procedure :: hand_over
   end type sparsity_t

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

   !> (n) Where the diagonal stands among the values.
   pure function diagonal_places(self) result(places)
      class(sparsity_t), intent(in) :: self
      integer :: places(self%n)
      integer :: j
      if (self%symmetric) then
         places = self%column_pointer(:self%n) ! nothing is above it
      else
         places = [(self%find(j, j), j=1, self%n)]
      end if
   end function diagonal_places

   !> Give the pattern away, but for `start`, and keep nothing.
   subroutine hand_over(self, taker)
      class(sparsity_t), intent(inout) :: self
      type(sparsity_t), intent(out) :: taker
      taker%n = self%n
      taker%symmetric = self%symmetric
      taker%team => self%team
      call move_alloc(self%row, taker%row)
      call move_alloc(self%column_pointer, taker%column_pointer)
      if (allocated(self%start)) deallocate (self%start)
      self%n = 0
   end subroutine hand_over

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
      integer :: n

      if (present(team)) pattern%team => team
      call check_equations(triangles, eq, n, error)
      if (allocated(error)) return
      call new_pattern(pattern%pattern_t, n, triangles, eq, symmetric, cliques)
      if (pattern%start(n + 1) > huge(1_i4)) then
         call raise(error, status_invalid_argument, 'the matrix has more than 2147483647 entries')
         return
      end if
      pattern%column_pointer = int(pattern%start, i4)
   end subroutine new_sparsity

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
      d = values(self%diagonal_places())
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

end module finshell_sparsity
