!> Linear systems with a few unknowns more than the sparse matrix K has, all of which depend on many of its own:
!>
!>     [ K    -G ] [x]   [b]                        S = -C - G^T K^-1 G
!>     [-G^T  -C ] [z] = [a]    is solved with      S z = a + G^T K^-1 b,    x = K^-1 b + K^-1 G z
!>
!> where C is diagonal, zero or positive. K may be singular where the whole is not: an entry s is then added to its diagonal where
!> its null vector is largest, and taken away again by one more column, e, with -1/s for C.
!>
!> Negative eigenvalues are counted of K + G C^-1 G^T (where C is zero: of K on what G^T takes to zero). By Haynsworth's inertia
!> formula, once for each of both diagonal blocks, they are those of K and of S less those of -C, of which zeros count as negative.
module finshell_bordered
   use finshell_error, only: error_t, raise
   use finshell_kinds, only: dp
   use finshell_lapack, only: dgetrf, dgetrs, dsyev
   use finshell_linear_solver, only: linear_solver_t
   use finshell_status, only: status_singular_matrix
   use finshell_team, only: largest_of, leads, team_t
   implicit none
   private
   public :: border_t

   type :: border_t
      integer :: negative_pivots = -1 !< of K + G C^-1 G^T; -1: not known
      integer :: determinant_sign = 0 !< 0: not known
      integer :: columns = 0 !< of G
      real(dp), allocatable, private :: gradient(:, :) ! (n, columns and helpers)
      real(dp), allocatable, private :: answer(:, :) ! K^-1 times it
      real(dp), allocatable, private :: corner(:) ! -C, and 1/s
      real(dp), allocatable, private :: scale(:) ! of the rows of S
      real(dp), allocatable, private :: lu(:, :) ! of S, scaled
      integer, allocatable, private :: pivots(:)
   contains
      procedure :: factorise
      procedure :: solve
   end type border_t

   integer, parameter :: most_helpers = 3, most_refinements = 3
   !> A solution that is so much smaller than its two parts is refined.
   real(dp), parameter :: cancellation = 1.0e3_dp
   !> Of S, beside the parts that it is the difference of.
   real(dp), parameter :: rounding = 10*epsilon(1.0_dp)

contains

   !> Factorise. Errors: as of the solver; the whole is singular.
   subroutine factorise(self, solver, values, diagonal, team, gradient, compliance, error)
      class(border_t), intent(inout) :: self
      type(linear_solver_t), intent(inout) :: solver
      real(dp), intent(in) :: values(:) !< of K
      integer, intent(in) :: diagonal(:) !< (n) where it stands among the values
      class(team_t), pointer, intent(in) :: team !< of processes that share K
      real(dp), intent(in) :: gradient(:, :), compliance(:) !< G, C
      type(error_t), allocatable, intent(out) :: error
      type(error_t), allocatable :: alone
      real(dp), allocatable :: helped(:), free(:)
      real(dp) :: stand_in(1)
      integer :: at, i, k, n

      self%negative_pivots = -1
      self%determinant_sign = 0
      self%columns = size(compliance)
      n = size(gradient, 1)
      self%gradient = gradient
      self%corner = -compliance
      call solver%factorise(values, error)
      if (allocated(error)) then
         alone = error
         helped = values
         if (allocated(solver%null_vector)) free = solver%null_vector
      end if
      do i = 1, most_helpers
         if (.not. allocated(error)) exit
         if (error%code /= status_singular_matrix .or. solver%singular_equation == 0) return
         at = solver%singular_equation
         stand_in = maxval([0.0_dp, abs(helped)])
         call largest_of(team, stand_in)
         if (leads(team)) helped(diagonal(at)) = helped(diagonal(at)) + stand_in(1)
         self%gradient = reshape([self%gradient, spread(0.0_dp, 1, n)], [n, size(self%corner) + 1])
         self%gradient(at, size(self%corner) + 1) = 1
         self%corner = [self%corner, 1/stand_in]
         deallocate (error)
         call solver%factorise(helped, error)
      end do
      if (allocated(error)) return
      if (allocated(self%answer)) deallocate (self%answer)
      allocate (self%answer(n, size(self%corner)))
      do k = 1, size(self%corner)
         call solver%solve(self%gradient(:, k), self%answer(:, k), error)
         if (allocated(error)) return
      end do
      call finish(self, solver, error)
      if (.not. (allocated(error) .and. allocated(alone))) return
      error = alone ! what K says: the border does not hold its free motion
      if (allocated(free)) solver%null_vector = free
   end subroutine factorise

   !> Factorise S, and count.
   subroutine finish(self, solver, error)
      class(border_t), intent(inout) :: self
      type(linear_solver_t), intent(in) :: solver
      type(error_t), allocatable, intent(inout) :: error
      real(dp), allocatable :: s(:, :), w(:), work(:), parts(:)
      integer :: i, info, k, negative, sign_of_s

      k = size(self%corner)
      s = -matmul(transpose(self%gradient), self%answer)
      parts = [(abs(s(i, i)), i=1, k)]
      parts = parts + abs(self%corner)
      do i = 1, k
         s(i, i) = s(i, i) + self%corner(i)
      end do
      where (.not. parts > 0) parts = 1
      self%scale = 1/sqrt(parts)
      do i = 1, k
         s(:, i) = self%scale*s(:, i)*self%scale(i)
      end do
      self%lu = s
      if (allocated(self%pivots)) deallocate (self%pivots)
      allocate (self%pivots(k), w(k), work(max(1, 3*k)))
      call dgetrf(k, k, self%lu, k, self%pivots, info)
      if (info /= 0 .or. minval([(abs(self%lu(i, i)), i=1, k)]) < rounding) then
         call raise(error, status_singular_matrix, 'the matrix with the pressures of the chambers is singular')
         return
      end if
      sign_of_s = 1
      do i = 1, k
         if (self%lu(i, i) < 0) sign_of_s = -sign_of_s
         if (self%pivots(i) /= i) sign_of_s = -sign_of_s
      end do
      self%determinant_sign = solver%determinant_sign*sign_of_s*(1 - 2*mod(self%columns, 2))
      if (solver%negative_pivots < 0) return
      call dsyev('N', 'U', k, s, k, w, work, size(work), info)
      negative = count(w < 0)
      self%negative_pivots = max(0, solver%negative_pivots + negative - self%columns)
   end subroutine finish

   !> Solve for one right-hand side, a behind b.
   subroutine solve(self, solver, rhs, x, error)
      class(border_t), intent(in) :: self
      type(linear_solver_t), intent(inout) :: solver
      real(dp), intent(in), contiguous :: rhs(:) !< (n + columns)
      real(dp), intent(out), contiguous :: x(:) !< (n + columns)
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: left(:), more(:), product(:), magnitudes(:), z(:)
      real(dp) :: before, size_of_first
      integer :: i, n

      n = size(self%gradient, 1)
      allocate (left(n + size(self%corner)), more(n + size(self%corner)), product(n), magnitudes(n), z(size(self%corner)))
      left = 0
      left(:size(rhs)) = rhs
      call once(self, solver, left, more, size_of_first, error)
      if (allocated(error)) return
      before = huge(before)
      x = more(:size(x))
      z = more(n + 1:)
      if (size_of_first <= cancellation*norm2(more(:n)) .and. size(z) == self%columns) return
      do i = 1, most_refinements
         call solver%multiply(x(:n), product, magnitudes)
         left(:n) = rhs(:n) - product + matmul(self%gradient, z)
         left(n + 1:) = matmul(transpose(self%gradient), x(:n)) - self%corner*z
         left(n + 1:n + self%columns) = left(n + 1:n + self%columns) + rhs(n + 1:)
         if (norm2(left(:n)) >= 0.5_dp*before) exit
         before = norm2(left(:n))
         call once(self, solver, left, more, size_of_first, error)
         if (allocated(error)) return
         x = x + more(:size(x))
         z = z + more(n + 1:)
      end do
   end subroutine solve

   !> The block elimination.
   subroutine once(self, solver, rhs, x, size_of_first, error)
      class(border_t), intent(in) :: self
      type(linear_solver_t), intent(inout) :: solver
      real(dp), intent(in) :: rhs(:)
      real(dp), intent(inout) :: x(:)
      real(dp), intent(out) :: size_of_first !< of K^-1 b
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: z(:, :)
      integer :: info, k, n
      n = size(self%gradient, 1)
      k = size(self%corner)
      call solver%solve(rhs(:n), x(:n), error)
      if (allocated(error)) return
      size_of_first = norm2(x(:n))
      allocate (z(k, 1))
      z(:, 1) = self%scale*(rhs(n + 1:) + matmul(transpose(self%gradient), x(:n)))
      call dgetrs('N', k, 1, self%lu, k, self%pivots, z, k, info)
      z(:, 1) = self%scale*z(:, 1)
      x(:n) = x(:n) + matmul(self%answer, z(:, 1))
      x(n + 1:) = z(:, 1)
   end subroutine once
end module finshell_bordered
