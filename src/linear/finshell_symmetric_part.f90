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
      procedure :: factorise
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

   !> Factorise the symmetric part of the matrix with these values; analysed at the first time. Errors: as of the solver.
   subroutine factorise(self, values, error)
      class(symmetric_part_t), intent(inout) :: self
      real(dp), intent(in) :: values(:) !< of the whole matrix
      type(error_t), allocatable, intent(out) :: error
      if (.not. self%analysed) call self%solver%analyse(self%pattern, error)
      if (allocated(error)) return
      self%analysed = .true.
      call self%solver%factorise(0.5_dp*(values(self%entry) + values(self%mirrored)), error)
   end subroutine factorise
end module finshell_symmetric_part
