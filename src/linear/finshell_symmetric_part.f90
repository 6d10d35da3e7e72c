!> The symmetric part of an unsymmetric matrix, factorised: it tells whether the matrix is positive definite, which the factors of
!> the matrix itself do not. A descent (finshell_descent) goes by it where pressure acts on a free edge.
module finshell_symmetric_part
   use finshell_error, only: error_t
   use finshell_kinds, only: dp
   use finshell_linear_solver, only: linear_solver_t
   use finshell_sparsity, only: sparsity_t
   implicit none
   private
   public :: symmetric_part_t

   type :: symmetric_part_t
      type(linear_solver_t) :: solver
      type(sparsity_t), private :: pattern !< lower triangle
      integer, allocatable, private :: entry(:), mirrored(:) !< among the values of the whole matrix
      logical, private :: analysed = .false.
   contains
      procedure :: take
      procedure :: exists
      procedure :: prepare
      procedure :: values_of
      procedure :: diagonal
   end type symmetric_part_t

contains

   !> The lower triangle of a full pattern; nothing for a symmetric one.
   subroutine take(self, pattern)
      class(symmetric_part_t), intent(inout) :: self
      type(sparsity_t), intent(in) :: pattern
      integer :: entries, i, j, p

      if (allocated(self%entry)) deallocate (self%entry, self%mirrored)
      self%analysed = .false.
      if (pattern%symmetric) return
      entries = (pattern%entries() + pattern%n)/2
      self%pattern = sparsity_t(n=pattern%n, symmetric=.true.)
      allocate (self%entry(entries), self%mirrored(entries), self%pattern%row(entries), self%pattern%column_pointer(pattern%n + 1))
      i = 0
      do j = 1, pattern%n
         self%pattern%column_pointer(j) = i + 1
         do p = pattern%column_pointer(j), pattern%column_pointer(j + 1) - 1
            if (pattern%row(p) < j) cycle
            i = i + 1
            self%entry(i) = p
            self%mirrored(i) = pattern%find(j, int(pattern%row(p)))
            self%pattern%row(i) = pattern%row(p)
         end do
      end do
      self%pattern%column_pointer(pattern%n + 1) = i + 1
   end subroutine take

   pure logical function exists(self)
      class(symmetric_part_t), intent(in) :: self
      exists = allocated(self%entry)
   end function exists

   !> Let the solver know the pattern, unless it does.
   subroutine prepare(self, error)
      class(symmetric_part_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      if (.not. self%analysed) call self%solver%analyse(self%pattern, error)
      if (.not. allocated(error)) self%analysed = .true.
   end subroutine prepare

   !> The values of the symmetric part of the matrix with these values.
   pure function values_of(self, values) result(half)
      class(symmetric_part_t), intent(in) :: self
      real(dp), intent(in) :: values(:) !< of the whole matrix
      real(dp), allocatable :: half(:)
      half = 0.5_dp*(values(self%entry) + values(self%mirrored))
   end function values_of

   !> Where the diagonal stands among them.
   pure function diagonal(self) result(at)
      class(symmetric_part_t), intent(in) :: self
      integer :: at(self%pattern%n)
      at = self%pattern%diagonal_places()
   end function diagonal
end module finshell_symmetric_part
