!> Sparse linear systems: one type for symmetric (definite or not) and unsymmetric matrices.
!>
!> `analyse` once for a pattern, `factorise` for every new set of values, `solve` as often as wanted.
!> A symmetric matrix is first tried as positive definite when the last one was; what fails is done again as L D L^T, by another
!> solver where there is a better one, and its negative pivots are counted. The order of the equations is found once, at the first
!> factorisation, for all. A pivot that is exactly zero need not mean a singular matrix (without pivoting): the
!> factorisation is then repeated with a slightly shifted diagonal, and refinement removes the shift from the solution.
!>
!> All judgements are free of units: equation i is measured by scale(i), such that entry (i, j) is compared with
!> scale(i) scale(j); for a definite matrix this is the root of the diagonal.
!> A matrix is called singular when a vector v has |A v| <= singular_tolerance |v| in that measure.

module finshell_linear_solver
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use finshell_blas_threads, only: to_blas, to_openmp
   use finshell_back_ends, only: can_work_on_disk, choose_solvers, lack_of_solver
   use finshell_direct_solver, only: direct_solver_t, pivots_t, solver_options_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_gmres, only: factored_t
   use finshell_inspection, only: examine, finding_t, inspect
   use finshell_kinds, only: dp
   use finshell_matrix_scale, only: equilibrate, initial_scale, shifted
   use finshell_memory, only: memory_left
   use finshell_refinement, only: refine
   use finshell_sparsity, only: sparsity_t
   use finshell_status, only: status_invalid_argument, status_not_a_number, status_singular_matrix
   use finshell_team, only: agree, shared
   implicit none
   private
   public :: linear_solver_t

   !> A pivot smaller than this part of its diagonal asks for a closer look.
   real(dp), parameter :: suspicious_pivot = 1e-5_dp
   !> Relative diagonal shift after a zero pivot: growth 1/shift and error shift meet at half the digits.
   real(dp), parameter :: diagonal_shift = 1e-8_dp, approximate_shift = 1e-6_dp
   !> Relative residual beyond which a solution is refused.
   real(dp), parameter :: refused_residual = 1e-5_dp
   !> The same with approximate factors, which say nothing about how much is to be had; and what is then said.
   real(dp), parameter :: approximate_residual = 1e-10_dp
   character(len=*), parameter :: advice = ', the matrix is too close to singular for approximate factors: exact ones are ' &
                                  //"needed (solver = 'auto', low_rank = 0)"
   character(len=len(advice)), parameter :: close_to_singular = ': the matrix is close to singular'

   !> A copy by assignment has the pattern but no factors: it analyses and factorises for itself.
   type, extends(factored_t) :: linear_solver_t
      !> Below this the solution has no digit left. Singular matrices come to 1 epsilon, shells of thickness over size 1e-6 to 7.
      real(dp) :: singular_tolerance = 5*epsilon(1.0_dp)
      integer :: negative_pivots = -1 !< of the last factorisation, as many as negative eigenvalues; -1: unknown (unsymmetric)
      integer :: determinant_sign = 0 !< of the last factorisation: -1, 1, or 0 when singular
      logical :: definite = .false. !< the last factorisation was L L^T, or had positive pivots only
      integer :: singular_equation = 0 !< when factorise found the matrix singular: where its null vector is largest
      real(dp), allocatable :: null_vector(:) !< that vector, largest component (scaled) = 1
      real(dp) :: smallest_pivot = 0 !< relative to the diagonal, last symmetric factorisation
      integer :: refinements = 0 !< most taken for a right-hand side of the last solve
      real(dp) :: residual = 0 !< largest relative residual of the last solve
      integer :: analyses = 0 !< orderings: one for all that has this pattern
      integer :: factorisations = 0 !< numeric ones tried, including failed ones
      type(solver_options_t) :: options !< to be set before `analyse`
      type(sparsity_t) :: pattern !< is read by others; who gives one away puts it here, behind `analyse`
      real(dp), allocatable, private :: values(:), scale(:)
      integer, allocatable, private :: order(:)
      class(direct_solver_t), allocatable, private :: first, second !< the second, if there is one, for indefinite matrices
      logical, private :: by_second = .false., second_ready = .false. !< the last factors are its own; it knows the pattern
      logical :: expect_definite = .true., ready = .false. !< the next matrix is positive definite, as the last; there are factors
   contains
      procedure :: analyse
      procedure :: factorise
      generic :: solve => solve_one, solve_many
      procedure :: magnitude
      procedure :: free
      procedure :: prepare
      procedure :: memory
      procedure :: on_disk
      procedure, private :: solve_one, solve_many, factorise_by_one, try
      procedure :: multiply
      procedure :: backend
      procedure, private :: check_factors, approximate
      procedure, private :: copy
      generic :: assignment(=) => copy
   end type linear_solver_t

contains

   !> Take over a pattern. It is analysed when it is first factorised, or by `prepare`.
   !> Errors: status_invalid_argument for a solver that this build does not have.
   subroutine analyse(self, pattern, error, order_of)
      class(linear_solver_t), intent(inout) :: self
      type(sparsity_t), intent(in) :: pattern
      type(error_t), allocatable, intent(out) :: error
      !> its order of the equations serves, if it has one for the same number
      type(linear_solver_t), intent(in), optional :: order_of
      character(len=:), allocatable :: reason
      call self%free()
      self%pattern = pattern
      if (present(order_of)) then
         if (allocated(order_of%order) .and. order_of%pattern%n == pattern%n) self%order = order_of%order
      end if
      self%expect_definite = .true.
      reason = lack_of_solver(self%options, shared(self%pattern%team))
      if (reason /= '') call raise(error, status_invalid_argument, reason)
   end subroutine analyse

   !> Order the equations and find the pattern of the factors, unless done. Errors: status_out_of_memory, status_invalid_argument.
   subroutine prepare(self, error)
      class(linear_solver_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      type(solver_options_t) :: with_disk
      class(direct_solver_t), allocatable :: other
      if (self%pattern%n == 0 .or. allocated(self%first)) return
      call choose_solvers(self%options, self%pattern, self%first, self%second)
      if (.not. allocated(self%first)) then
         call raise(error, status_invalid_argument, 'this finshell was built without a solver for this matrix')
         return
      end if
      if (.not. allocated(self%order)) self%analyses = self%analyses + 1
      call self%first%analyse(self%pattern, self%order, error)
      if (allocated(error)) then
         deallocate (self%first)
         return
      end if
      if (.not. self%first%definite_only .and. allocated(self%second)) deallocate (self%second)
      ! What may not fit in memory goes to a solver that works on disk if it does not, in the order that was found.
      if (shared(self%pattern%team) .or. self%first%on_disk .or. self%first%memory() < memory_left(self%options%memory)) return
      with_disk = self%options
      if (allocated(with_disk%solver)) then
         if (with_disk%solver == 'suitesparse') return
      end if
      if (.not. can_work_on_disk()) return
      with_disk%solver = 'mumps'
      call choose_solvers(with_disk, self%pattern, other, self%second)
      call self%first%free()
      call move_alloc(other, self%first)
      call self%first%analyse(self%pattern, self%order, error)
      if (allocated(error)) deallocate (self%first)
   end subroutine prepare

   !> Bytes of the factors; 0 before `prepare`.
   real(dp) function memory(self)
      class(linear_solver_t), intent(in) :: self
      memory = 0
      if (allocated(self%first)) memory = self%first%memory()
      if (self%by_second) memory = self%second%memory()
   end function memory

   !> Whether the factors are, or will be.
   pure logical function on_disk(self)
      class(linear_solver_t), intent(in) :: self
      on_disk = .false.
      if (allocated(self%first)) on_disk = self%first%on_disk
      if (self%by_second) on_disk = self%second%on_disk
   end function on_disk

   !> Factorise the matrix with these values.
   !>
   !> Errors: status_singular_matrix (singular_equation and null_vector say where), status_not_a_number,
   !> status_invalid_argument, status_out_of_memory.
   subroutine factorise(self, values, error)
      class(linear_solver_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: values(:) !< (entries of the pattern)
      type(error_t), allocatable, intent(out) :: error
      integer :: i, j

      self%ready = .false.
      self%negative_pivots = -1
      self%determinant_sign = 0
      self%definite = .false.
      self%singular_equation = 0
      if (allocated(self%null_vector)) deallocate (self%null_vector)
      if (size(values) /= self%pattern%entries()) then
         call raise(error, status_invalid_argument, 'the matrix has '//text_of(self%pattern%entries())//' entries, but '// &
                    text_of(size(values))//' were given')
         return
      end if
      if (.not. all(ieee_is_finite(values))) then
         i = findloc(ieee_is_finite(values), .false., 1)
         j = findloc(self%pattern%column_pointer > i, .true., 1) - 1
         call raise(error, status_not_a_number, 'the matrix is not finite in row '//text_of(int(self%pattern%row(i)))// &
                    ', column '//text_of(j))
      end if
      call agree(self%pattern%team, error)
      if (allocated(error)) return
      call self%prepare(error)
      if (allocated(error)) return
      self%values = values
      call initial_scale(self%pattern, values, self%scale, self%singular_equation)
      if (self%singular_equation > 0) then
         allocate (self%null_vector(self%pattern%n), source=0.0_dp)
         self%null_vector(self%singular_equation) = 1
         call raise(error, status_singular_matrix, 'equation '//text_of(self%singular_equation)//' has no stiffness at all')
         return
      end if
      if (self%pattern%n == 0) then
         self%negative_pivots = merge(0, -1, self%pattern%symmetric)
         self%determinant_sign = 1
         self%definite = .true.
      else
         call self%factorise_by_one(error)
      end if
      self%ready = .not. allocated(error)
   end subroutine factorise

   subroutine factorise_by_one(self, error)
      class(linear_solver_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      type(pivots_t) :: pivots
      real(dp) :: shift
      logical :: as_definite

      as_definite = self%pattern%symmetric .and. self%first%definite_only .and. (self%expect_definite .or. self%first%tries_all)
      if (as_definite) then
         call self%try(self%values, .true., pivots, error)
         if (allocated(error)) return
         self%first%tries_all = self%first%tries_all .and. pivots%ok
      end if
      if (.not. pivots%ok) then
         call equilibrate(self%pattern, self%values, self%scale)
         call self%try(self%values, .false., pivots, error)
         if (allocated(error)) return
      end if
      if (.not. pivots%ok) then
         ! With pivoting this is the end; the shift then only serves to find the null vector.
         shift = merge(approximate_shift, diagonal_shift, self%approximate())
         call self%try(shifted(self%pattern, self%values, self%scale, shift), .false., pivots, error)
         if (allocated(error)) return
         if (.not. pivots%ok) then
            call raise(error, status_singular_matrix, 'a pivot is zero even after a shift of the diagonal')
            self%singular_equation = minloc(self%scale, 1)
            return
         end if
         pivots%smallest = 0
      end if
      self%smallest_pivot = pivots%smallest
      self%negative_pivots = pivots%negative
      self%determinant_sign = pivots%determinant_sign
      if (self%approximate() .or. pivots%smallest < suspicious_pivot) call self%check_factors(error)
      self%definite = self%negative_pivots == 0
      self%expect_definite = self%definite
   end subroutine factorise_by_one

   !> Let the solver for such matrices factorise.
   subroutine try(self, values, definite, pivots, error)
      class(linear_solver_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: values(:)
      logical, intent(in) :: definite
      type(pivots_t), intent(out) :: pivots
      type(error_t), allocatable, intent(out) :: error
      self%factorisations = self%factorisations + 1
      self%by_second = .not. definite .and. allocated(self%second)
      if (self%by_second .and. .not. self%second_ready) then
         call self%second%analyse(self%pattern, self%order, error)
         if (allocated(error)) return
         self%second_ready = .true.
      end if
      call to_blas(self%options%threads)
      if (self%by_second) then
         call self%second%factorise(values, self%scale, definite, pivots, error)
      else
         call self%first%factorise(values, self%scale, definite, pivots, error)
      end if
      call to_openmp()
   end subroutine try

   !> Solve for one right-hand side.
   subroutine solve_one(self, rhs, x, error)
      class(linear_solver_t), intent(inout) :: self
      real(dp), intent(in), contiguous, target :: rhs(:) !< (n)
      real(dp), intent(inout), contiguous, target :: x(:) !< (n) the solution
      type(error_t), allocatable, intent(out) :: error
      real(dp), pointer, contiguous :: b(:, :), y(:, :)
      b(1:size(rhs), 1:1) => rhs
      y(1:size(x), 1:1) => x
      call self%solve_many(b, y, error)
   end subroutine solve_one

   !> Solve for several right-hand sides, each refined until its residual stops falling.
   !>
   !> Errors: status_invalid_argument; status_singular_matrix when the residual stays too large; status_not_a_number.
   subroutine solve_many(self, rhs, x, error)
      class(linear_solver_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: rhs(:, :) !< (n, right-hand sides)
      real(dp), intent(inout), contiguous :: x(:, :) !< (n, right-hand sides) the solutions
      type(error_t), allocatable, intent(out) :: error
      integer :: j, steps
      real(dp) :: left

      self%refinements = 0
      self%residual = 0
      if (.not. self%ready) then
         call raise(error, status_invalid_argument, 'solution asked for before a successful factorisation')
      else if (size(rhs, 1) /= self%pattern%n .or. any(shape(rhs) /= shape(x))) then
         call raise(error, status_invalid_argument, 'right-hand side and solution must both have '//text_of(self%pattern%n)// &
                    ' rows and the same number of columns')
      else if (.not. all(ieee_is_finite(rhs))) then
         call raise(error, status_not_a_number, 'the right-hand side is not finite')
      end if
      if (allocated(error) .or. size(rhs) == 0) return
      call self%backend(rhs, x, error)
      do j = 1, size(rhs, 2)
         if (allocated(error)) return
         call refine(self, self%scale, self%approximate(), rhs(:, j), x(:, j), steps, left, error)
         if (allocated(error)) return
         self%refinements = max(self%refinements, steps)
         self%residual = max(self%residual, left)
         if (left <= merge(approximate_residual, refused_residual, self%approximate())) cycle
         call raise(error, status_singular_matrix, 'the linear system was solved only to a relative residual of '//text_of(left) &
                    //trim(merge(advice, close_to_singular, self%approximate())))
      end do
   end subroutine solve_many

   !> |A| |x|, with the matrix factorised last: times epsilon, what rounding x to working precision does to A x.
   subroutine magnitude(self, x, y, values)
      class(linear_solver_t), intent(in) :: self
      real(dp), intent(in) :: x(:) !< (n)
      real(dp), intent(out) :: y(:) !< (n); zero before the first factorisation
      real(dp), intent(in), optional :: values(:) !< of another matrix of this pattern
      real(dp), allocatable :: unused(:)
      y = 0
      allocate (unused(size(y)))
      if (present(values)) call self%pattern%multiply(values, x, unused, y)
      if (.not. present(values) .and. allocated(self%values)) call self%pattern%multiply(self%values, x, unused, y)
   end subroutine magnitude

   !> See finshell_gmres.
   subroutine multiply(self, x, y, y_abs)
      class(linear_solver_t), intent(in) :: self
      real(dp), intent(in) :: x(:)
      real(dp), intent(out), contiguous :: y(:), y_abs(:)
      call self%pattern%multiply(self%values, x, y, y_abs)
   end subroutine multiply

   !> Whether the factors are.
   pure logical function approximate(self)
      class(linear_solver_t), intent(in) :: self
      approximate = .false.
      if (allocated(self%first)) approximate = self%first%approximate
      if (self%by_second) approximate = self%second%approximate
   end function approximate

   !> Is the matrix singular? What approximate factors say about its eigenvalues is corrected.
   subroutine check_factors(self, error)
      class(linear_solver_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      type(finding_t) :: finding
      if (self%approximate()) then
         call inspect(self, self%scale, self%singular_tolerance, finding, error)
      else
         call examine(self, self%scale, self%singular_tolerance, finding, error)
      end if
      if (allocated(error)) return
      if (finding%singular_equation > 0) then
         self%singular_equation = finding%singular_equation
         if (allocated(finding%null_vector)) call move_alloc(finding%null_vector, self%null_vector)
         self%determinant_sign = 0
         call raise(error, status_singular_matrix, 'the matrix is singular; its null vector is largest in equation '// &
                    text_of(self%singular_equation))
      else if (.not. finding%known) then
         call raise(error, status_singular_matrix, 'an iteration with the factors does not converge'//advice)
      end if
      self%determinant_sign = self%determinant_sign*(1 - 2*mod(finding%passed, 2))
      if (self%pattern%symmetric) self%negative_pivots = self%negative_pivots + finding%more_negative
   end subroutine check_factors

   !> See finshell_gmres.
   subroutine backend(self, b, x, error)
      class(linear_solver_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: b(:, :)
      real(dp), intent(inout), contiguous :: x(:, :)
      type(error_t), allocatable, intent(out) :: error
      if (self%by_second) call self%second%solve(b, x, error)
      if (.not. self%by_second) call self%first%solve(b, x, error)
   end subroutine backend

   !> Give everything back; the counters start again.
   subroutine free(self)
      class(linear_solver_t), intent(inout) :: self
      if (allocated(self%first)) deallocate (self%first)
      if (allocated(self%second)) deallocate (self%second)
      if (allocated(self%order)) deallocate (self%order)
      self%by_second = .false.
      self%second_ready = .false.
      self%ready = .false.
      self%analyses = 0
      self%factorisations = 0
      self%pattern = sparsity_t()
      if (allocated(self%values)) deallocate (self%values)
      if (allocated(self%scale)) deallocate (self%scale)
   end subroutine free

   subroutine copy(self, other)
      class(linear_solver_t), intent(inout) :: self
      class(linear_solver_t), intent(in) :: other
      type(sparsity_t) :: pattern
      pattern = other%pattern ! also when self is other
      call self%free()
      self%pattern = pattern
      self%singular_tolerance = other%singular_tolerance
      self%options = other%options
      self%expect_definite = .true.
   end subroutine copy
end module finshell_linear_solver
