!> Sparse linear systems: one type for symmetric (definite or not) and unsymmetric matrices.
!>
!> `analyse` once for a pattern, `factorise` for every new set of values, `solve` as often as wanted.
!> A symmetric matrix is first tried as positive definite when the last one was; what fails is done again as L D L^T, whose
!> negative pivots are counted. A pivot that is exactly zero need not mean a singular matrix (there is no pivoting): the
!> factorisation is then repeated with a slightly shifted diagonal, and refinement removes the shift from the solution.
!>
!> All judgements are free of units: equation i is measured by scale(i), such that entry (i, j) is compared with
!> scale(i) scale(j); for a definite matrix this is the root of the diagonal.
!> A matrix is called singular when a vector v has |A v| <= singular_tolerance |v| in that measure.
module finshell_linear_solver
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use finshell_cholmod, only: cholmod_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: dp
   use finshell_matrix_scale, only: equilibrate, initial_scale
   use finshell_sparsity, only: sparsity_t
   use finshell_status, only: status_invalid_argument, status_not_a_number, status_singular_matrix
   use finshell_umfpack, only: umfpack_t
   implicit none
   private
   public :: linear_solver_t

   !> A pivot smaller than this part of its diagonal asks for a closer look.
   real(dp), parameter :: suspicious_pivot = 1e-5_dp
   !> Relative diagonal shift after a zero pivot: growth 1/shift and error shift meet at half the digits.
   real(dp), parameter :: diagonal_shift = 1e-8_dp
   !> Relative residual beyond which a solution is refused.
   real(dp), parameter :: refused_residual = 1e-5_dp
   integer, parameter :: most_refinements = 30

   !> A copy by assignment has the pattern but no factors: it analyses and factorises for itself.
   type :: linear_solver_t
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
      integer :: analyses = 0, factorisations = 0 !< numeric factorisations tried, including failed ones
      type(sparsity_t), private :: pattern
      real(dp), allocatable, private :: values(:), scale(:)
      type(cholmod_t), private :: cholmod
      type(umfpack_t), private :: umfpack
      logical, private :: expect_definite = .true., ready = .false.
   contains
      procedure :: analyse
      procedure :: factorise
      generic :: solve => solve_one, solve_many
      procedure :: magnitude
      procedure :: free
      procedure, private :: solve_one, solve_many, prepare, factorise_symmetric, factorise_unsymmetric
      procedure, private :: backend, shifted_values, examine, refine
      procedure, private :: copy
      generic :: assignment(=) => copy
   end type linear_solver_t

contains

   !> Take over a pattern and analyse it.
   subroutine analyse(self, pattern, error)
      class(linear_solver_t), intent(inout) :: self
      type(sparsity_t), intent(in) :: pattern
      type(error_t), allocatable, intent(out) :: error
      call self%free()
      self%pattern = pattern
      self%expect_definite = .true.
      call self%prepare(error)
   end subroutine analyse

   !> Analyse unless done.
   subroutine prepare(self, error)
      class(linear_solver_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      if (self%pattern%n == 0) return
      if (self%pattern%symmetric) then
         if (self%cholmod%analysed()) return
         call self%cholmod%analyse(self%pattern%n, self%pattern%column_pointer, self%pattern%row, error)
      else
         if (self%umfpack%analysed()) return
         call self%umfpack%analyse(self%pattern%n, self%pattern%column_pointer, self%pattern%row, error)
      end if
      self%analyses = self%analyses + 1
   end subroutine prepare

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
         return
      end if
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
      else if (self%pattern%symmetric) then
         call self%factorise_symmetric(error)
      else
         call self%factorise_unsymmetric(error)
      end if
      self%ready = .not. allocated(error)
   end subroutine factorise

   subroutine factorise_symmetric(self, error)
      class(linear_solver_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: d(:)
      logical :: ok, supernodal

      ok = .false.
      supernodal = self%cholmod%supernodal()
      if (self%expect_definite .and. supernodal) then
         self%factorisations = self%factorisations + 1
         call self%cholmod%factorise(self%values, .true., ok, error)
         if (allocated(error)) return
      end if
      if (.not. ok) then
         call equilibrate(self%pattern, self%values, self%scale)
         self%factorisations = self%factorisations + 1
         call self%cholmod%factorise(self%values, .false., ok, error)
         if (allocated(error)) return
      end if
      allocate (d(self%pattern%n))
      if (ok) then
         call self%cholmod%pivots(d)
         ok = all(ieee_is_finite(d))
         if (ok) ok = all(abs(d) > 0)
      end if
      if (.not. ok) then
         self%factorisations = self%factorisations + 1
         call self%cholmod%factorise(self%shifted_values(), .false., ok, error)
         if (allocated(error)) return
         if (.not. ok) then
            call raise(error, status_singular_matrix, 'a pivot is zero even after a shift of the diagonal')
            self%singular_equation = minloc(self%scale, 1)
            return
         end if
         call self%cholmod%pivots(d)
      end if
      self%smallest_pivot = minval(abs(d)/self%scale**2)
      self%negative_pivots = count(d < 0)
      self%determinant_sign = 1 - 2*mod(self%negative_pivots, 2)
      self%definite = self%negative_pivots == 0
      self%expect_definite = self%definite
      if (self%smallest_pivot < suspicious_pivot) call self%examine(error)
   end subroutine factorise_symmetric

   subroutine factorise_unsymmetric(self, error)
      class(linear_solver_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      logical :: ok
      real(dp) :: rcond

      call equilibrate(self%pattern, self%values, self%scale)
      self%factorisations = self%factorisations + 1
      call self%umfpack%factorise(self%values, ok, rcond, error)
      if (allocated(error)) return
      if (.not. ok) then
         ! UMFPACK pivots, so this is the end; the shift only serves to find the null vector.
         self%factorisations = self%factorisations + 1
         call self%umfpack%factorise(self%shifted_values(), ok, rcond, error)
         if (allocated(error)) return
         if (.not. ok) then
            call raise(error, status_singular_matrix, 'a pivot is zero even after a shift of the diagonal')
            self%singular_equation = minloc(self%scale, 1)
            return
         end if
         rcond = 0
      end if
      self%determinant_sign = self%umfpack%determinant_sign()
      if (rcond < suspicious_pivot) call self%examine(error)
   end subroutine factorise_unsymmetric

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
      integer :: j

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
         call self%refine(rhs(:, j), x(:, j), error)
      end do
   end subroutine solve_many

   !> |A| |x|, with the matrix factorised last: times epsilon, what rounding x to working precision does to A x.
   subroutine magnitude(self, x, y)
      class(linear_solver_t), intent(in) :: self
      real(dp), intent(in) :: x(:) !< (n)
      real(dp), intent(out) :: y(:) !< (n); zero before the first factorisation
      real(dp), allocatable :: unused(:)
      y = 0
      allocate (unused(size(y)))
      if (allocated(self%values)) call self%pattern%multiply(self%values, x, unused, y)
   end subroutine magnitude

   !> Add corrections from the residual while they halve it.
   subroutine refine(self, b, x, error)
      class(linear_solver_t), intent(inout) :: self
      real(dp), intent(in) :: b(:)
      real(dp), intent(inout) :: x(:)
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: r(:), better(:), size_of(:), dx(:, :)
      real(dp) :: before, after
      integer :: k

      allocate (r(size(b)), size_of(size(b)), dx(size(b), 1))
      call measure(x, before)
      do k = 1, most_refinements
         if (before <= epsilon(before)) exit
         call self%backend(reshape(r, [size(b), 1]), dx, error)
         if (allocated(error)) return
         better = x + dx(:, 1)
         call measure(better, after)
         if (.not. after < before) exit
         x = better
         self%refinements = max(self%refinements, k)
         if (after > 0.5_dp*before) then
            before = after
            exit
         end if
         before = after
      end do
      self%residual = max(self%residual, before)
      if (.not. before <= refused_residual) then
         call raise(error, status_singular_matrix, 'the linear system was solved only to a relative residual of '// &
                    text_of(before)//': the matrix is close to singular')
      end if

   contains

      subroutine measure(solution, relative)
         real(dp), intent(in) :: solution(:)
         real(dp), intent(out) :: relative
         real(dp) :: largest
         call self%pattern%multiply(self%values, solution, r, size_of)
         r = b - r
         largest = maxval((size_of + abs(b))/self%scale)
         relative = 0
         if (largest > 0) relative = maxval(abs(r)/self%scale)/largest
         ! maxval passes over NaN.
         if (.not. all(ieee_is_finite(r))) relative = huge(relative)
      end subroutine measure
   end subroutine refine

   !> Look for a vector that the matrix takes to nothing, by inverse iteration (once is enough, unless there is a shift).
   subroutine examine(self, error)
      class(linear_solver_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      real(dp), allocatable :: b(:, :), v(:, :)
      real(dp) :: reduction, previous
      integer :: i, k, seed

      allocate (b(self%pattern%n, 1), v(self%pattern%n, 1))
      ! Numbers without pattern: a null vector orthogonal to them is as good as impossible.
      seed = 12345
      do i = 1, self%pattern%n
         seed = mod(1103*seed + 12721, 65536)
         b(i, 1) = (real(seed, dp)/32768 - 1)*self%scale(i)
      end do
      previous = 1
      do k = 1, most_refinements
         call self%backend(b, v, error)
         if (allocated(error)) return
         if (.not. all(ieee_is_finite(v))) then
            self%singular_equation = minloc(self%scale, 1)
            exit
         end if
         i = maxloc(abs(v(:, 1))*self%scale, 1)
         v = v/v(i, 1)
         call self%pattern%multiply(self%values, v(:, 1), b(:, 1))
         reduction = norm2(b(:, 1)/self%scale)/norm2(v(:, 1)*self%scale)
         if (reduction <= self%singular_tolerance) then
            self%singular_equation = i
            self%null_vector = v(:, 1)
            exit
         end if
         if (reduction > 0.1_dp*previous) return
         previous = reduction
         b(:, 1) = v(:, 1)*self%scale**2
      end do
      if (self%singular_equation == 0) return
      self%determinant_sign = 0
      call raise(error, status_singular_matrix, 'the matrix is singular; its null vector is largest in equation '// &
                 text_of(self%singular_equation))
   end subroutine examine

   subroutine backend(self, b, x, error)
      class(linear_solver_t), intent(inout) :: self
      real(dp), intent(in), contiguous :: b(:, :)
      real(dp), intent(inout), contiguous :: x(:, :)
      type(error_t), allocatable, intent(out) :: error
      if (self%pattern%symmetric) then
         call self%cholmod%solve(b, x, error)
      else
         call self%umfpack%solve(b, x, error)
      end if
   end subroutine backend

   !> The matrix plus a little of its scale on the diagonal.
   function shifted_values(self) result(shifted)
      class(linear_solver_t), intent(in) :: self
      real(dp), allocatable :: shifted(:)
      integer :: j, p
      shifted = self%values
      do j = 1, self%pattern%n
         do p = self%pattern%column_pointer(j), self%pattern%column_pointer(j + 1) - 1
            if (self%pattern%row(p) == j) shifted(p) = shifted(p) + diagonal_shift*self%scale(j)**2
         end do
      end do
   end function shifted_values

   !> Give everything back; the counters start again.
   subroutine free(self)
      class(linear_solver_t), intent(inout) :: self
      call self%cholmod%free()
      call self%umfpack%free()
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
      self%expect_definite = .true.
   end subroutine copy
end module finshell_linear_solver
