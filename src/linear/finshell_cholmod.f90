!> CHOLMOD: supernodal L L^T of a positive definite matrix, simplicial L D L^T of any other, one symbolic analysis for both.
module finshell_cholmod
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_loc, c_null_ptr, c_ptr, c_size_t
   use finshell_cholmod_c, only: always_supernodal, cholmod_analyze, cholmod_analyze_p, cholmod_bisect, &
                                 cholmod_change_factor, cholmod_copy_factor, &
                                 cholmod_factorize, cholmod_finish, cholmod_free_dense, cholmod_free_factor, cholmod_ok, &
                                 cholmod_out_of_memory, cholmod_pattern, cholmod_real, cholmod_solve2, cholmod_start, &
                                 cholmod_too_large, common_t, dense_t, factor_t, layout_is_known, ordering_given, &
                                 ordering_natural, &
                                 simplicial_or_supernodal, solve_a, solve_l, solve_lt, sparse_t
   use finshell_cholmod_factor, only: corner_of, diagonal_of
   use finshell_direct_solver, only: direct_solver_t, pivots_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: dp
   use finshell_sparsity, only: sparsity_t
   use finshell_status, only: status_invalid_argument, status_out_of_memory
!$ use omp_lib, only: omp_in_parallel
   implicit none
   private
   public :: cholmod_t, bisect

   !> One analysed matrix. A copy by assignment is empty: factors are not shared and must be made anew.
   type, extends(direct_solver_t) :: cholmod_t
      logical :: as_it_stands = .false. !< the order of the equations is to be kept, and supernodes made; set before `analyse`
      integer, private :: n = 0
      real(dp), private :: factor_bytes = 0
      type(common_t), pointer, private :: common => null()
      integer(c_int), pointer, private :: column_pointer(:) => null(), row(:) => null() ! from 0
      type(c_ptr), private :: definite = c_null_ptr, indefinite = c_null_ptr ! supernodal L L^T, simplicial L D L^T
      type(c_ptr), private :: current = c_null_ptr ! whichever was made last
      type(c_ptr), private :: x = c_null_ptr, y = c_null_ptr, e = c_null_ptr ! kept between solutions
   contains
      procedure :: analyse
      procedure :: factorise
      procedure :: solve
      procedure :: solve_lower
      procedure :: solve_upper
      procedure :: corner
      procedure :: release
      procedure :: pivots_of
      procedure :: memory
      procedure :: free
      procedure, private :: supernodal
      procedure, private :: solve_system
      procedure, private :: start
      procedure, private :: copy
      generic :: assignment(=) => copy
      final :: finalise
   end type cholmod_t

contains

   !> See finshell_direct_solver. Small matrices take L D L^T always, others if they are not expected to be definite.
   subroutine analyse(self, pattern, order, error)
      class(cholmod_t), intent(inout) :: self
      type(sparsity_t), intent(in) :: pattern
      integer, allocatable, intent(inout) :: order(:)
      type(error_t), allocatable, intent(out) :: error
      type(sparse_t) :: a
      type(factor_t), pointer :: factor
      integer(c_int), allocatable, target :: given(:)
      integer(c_int), pointer :: found(:)

      call self%start(pattern, error)
      if (allocated(error)) return
      a = sparse_matrix(self, c_null_ptr)
      if (allocated(order) .and. .not. self%as_it_stands) then
         self%common%nmethods = 1
         self%common%method(1)%ordering = ordering_given
         given = int(order - 1, c_int)
         self%definite = cholmod_analyze_p(a, c_loc(given), c_null_ptr, 0_c_size_t, self%common)
      else
         self%definite = cholmod_analyze(a, self%common)
      end if
      if (.not. c_associated(self%definite)) then
         call report(self%common%status, self%n, error)
         return
      end if
      call c_f_pointer(self%definite, factor)
      if (.not. allocated(order)) then
         call c_f_pointer(factor%perm, found, [self%n])
         order = int(found) + 1
      end if
      self%factor_bytes = 8*self%common%lnz
      self%definite_only = self%supernodal()
      if (.not. self%definite_only) then
         self%indefinite = self%definite
         self%definite = c_null_ptr
      end if
   end subroutine analyse

   !> Take over a pattern.
   subroutine start(self, pattern, error)
      class(cholmod_t), intent(inout) :: self
      type(sparsity_t), intent(in) :: pattern
      type(error_t), allocatable, intent(out) :: error
      call self%free()
      if (.not. pattern%symmetric) then
         call raise(error, status_invalid_argument, 'CHOLMOD is for symmetric matrices')
         return
      end if
      self%n = pattern%n
      allocate (self%common)
      allocate (self%column_pointer, source=int(pattern%column_pointer - 1, c_int))
      allocate (self%row, source=int(pattern%row - 1, c_int))
      if (cholmod_start(self%common) == 0 .or. .not. layout_is_known(self%common)) then
         call raise(error, status_invalid_argument, 'this release of CHOLMOD is not known; SuiteSparse 5.12 is')
         deallocate (self%common)
         return
      end if
      self%common%print = 0
      self%common%try_catch = 1
      self%common%quick_return_if_not_posdef = 1
      self%common%final_ll = 0
      self%common%supernodal = merge(always_supernodal, simplicial_or_supernodal, self%as_it_stands)
      if (.not. self%as_it_stands) return
      ! In its own order CHOLMOD takes a lower triangle as it is, without transposing it twice.
      self%common%postorder = 0
      self%common%nmethods = 1
      self%common%method(1)%ordering = ordering_natural
   end subroutine start

   !> Cut a graph in two by METIS: 0 and 1 for its halves, 2 for the vertices that separate them.
   subroutine bisect(pattern, side, error)
      type(sparsity_t), intent(in) :: pattern
      integer, allocatable, intent(out) :: side(:) !< (n)
      type(error_t), allocatable, intent(out) :: error
      type(cholmod_t) :: graph
      integer(c_int), allocatable :: found(:)
      call graph%start(pattern, error)
      if (allocated(error)) return
      allocate (found(graph%n))
      if (cholmod_bisect(sparse_matrix(graph, c_null_ptr), c_null_ptr, 0_c_size_t, 1, found, graph%common) < 0) then
         call report(graph%common%status, graph%n, error)
      else
         side = int(found)
      end if
   end subroutine bisect

   !> True when the matrix is large enough for the supernodal method; small ones always take L D L^T.
   logical function supernodal(self)
      class(cholmod_t), intent(in) :: self
      type(factor_t), pointer :: factor
      supernodal = .false.
      if (.not. c_associated(self%definite)) return
      call c_f_pointer(self%definite, factor)
      supernodal = factor%is_super /= 0
   end function supernodal

   !> See finshell_direct_solver.
   subroutine factorise(self, values, scale, definite, pivots, error)
      class(cholmod_t), intent(inout) :: self
      real(dp), intent(in), target, contiguous :: values(:)
      real(dp), intent(in) :: scale(:)
      logical, intent(in) :: definite
      type(pivots_t), intent(out) :: pivots
      type(error_t), allocatable, intent(out) :: error
      type(sparse_t) :: a
      type(factor_t), pointer :: factor
      integer(c_int) :: done
      logical :: lower
      real(dp), allocatable :: d(:)

      self%current = c_null_ptr
      lower = definite .and. c_associated(self%definite)
      if (.not. lower .and. .not. c_associated(self%indefinite)) then
         ! The same ordering without supernodes: convert a copy back to a plain symbolic factor.
         self%indefinite = cholmod_copy_factor(self%definite, self%common)
         done = 0
         if (c_associated(self%indefinite)) done = cholmod_change_factor(cholmod_pattern, 0, 0, 1, 1, self%indefinite, self%common)
         if (done == 0) then
            call report(self%common%status, self%n, error)
            return
         end if
      end if
      self%current = merge_pointer(self%definite, self%indefinite, lower)
      a = sparse_matrix(self, c_loc(values))
      ! CHOLMOD is compiled for four threads, whatever OpenMP was told; those of the BLAS do the work.
      if (in_parallel()) then
         done = cholmod_factorize(a, self%current, self%common)
      else
         !$omp teams num_teams(1) thread_limit(1) default(shared)
         done = cholmod_factorize(a, self%current, self%common)
         !$omp end teams
      end if
      if (done == 0 .or. self%common%status < cholmod_ok) then
         call report(self%common%status, self%n, error)
         self%current = c_null_ptr
         return
      end if
      call c_f_pointer(self%current, factor)
      pivots%ok = factor%minor == factor%n
      if (pivots%ok) then
         allocate (d(self%n))
         call self%pivots_of(d)
         pivots%ok = all(ieee_is_finite(d))
         if (pivots%ok) pivots%ok = all(abs(d) > 0)
      end if
      if (.not. pivots%ok) then
         call self%release()
         return
      end if
      pivots%smallest = minval(abs(d)/scale**2)
      pivots%negative = count(d < 0)
      pivots%determinant_sign = 1 - 2*mod(pivots%negative, 2)
   end subroutine factorise

   !> Does this thread work beside others? Then those that CHOLMOD would start have no place.
   logical function in_parallel()
      in_parallel = .false.
      !$ in_parallel = omp_in_parallel()
   end function in_parallel

   !> Another solver takes over, perhaps: its factor shall find room.
   subroutine release(self)
      class(cholmod_t), intent(inout) :: self
      integer(c_int) :: done
      if (c_associated(self%definite) .and. c_associated(self%current, self%definite)) &
         done = cholmod_change_factor(cholmod_pattern, 1, 1, 1, 1, self%definite, self%common)
      self%current = c_null_ptr
   end subroutine release

   !> See finshell_direct_solver.
   subroutine solve(self, b, x, error)
      class(cholmod_t), intent(inout) :: self
      real(dp), intent(in), target, contiguous :: b(:, :)
      real(dp), intent(inout), target, contiguous :: x(:, :)
      type(error_t), allocatable, intent(out) :: error
      call self%solve_system(solve_a, b, x, error)
   end subroutine solve

   !> L x = b of a matrix as it stands, positive definite. Errors: there are none.
   subroutine solve_lower(self, b, x, error)
      class(cholmod_t), intent(inout) :: self
      real(dp), intent(in), target, contiguous :: b(:, :)
      real(dp), intent(inout), target, contiguous :: x(:, :)
      type(error_t), allocatable, intent(out) :: error
      call self%solve_system(solve_l, b, x, error)
   end subroutine solve_lower

   !> L^T x = b.
   subroutine solve_upper(self, b, x, error)
      class(cholmod_t), intent(inout) :: self
      real(dp), intent(in), target, contiguous :: b(:, :)
      real(dp), intent(inout), target, contiguous :: x(:, :)
      type(error_t), allocatable, intent(out) :: error
      call self%solve_system(solve_lt, b, x, error)
   end subroutine solve_upper

   subroutine solve_system(self, system, b, x, error)
      class(cholmod_t), intent(inout) :: self
      integer(c_int), intent(in) :: system
      real(dp), intent(in), target, contiguous :: b(:, :)
      real(dp), intent(inout), target, contiguous :: x(:, :)
      type(error_t), allocatable, intent(out) :: error
      type(dense_t) :: rhs
      type(dense_t), pointer :: solution
      real(c_double), pointer :: values(:, :)
      integer(c_int) :: done

      if (.not. c_associated(self%current)) then
         call raise(error, status_invalid_argument, 'solution asked for before a successful factorisation')
         return
      end if
      rhs%nrow = self%n
      rhs%ncol = size(b, 2)
      rhs%nzmax = size(b)
      rhs%d = self%n
      rhs%x = c_loc(b)
      rhs%z = c_null_ptr
      rhs%xtype = cholmod_real
      rhs%dtype = 0
      done = cholmod_solve2(system, self%current, rhs, c_null_ptr, self%x, c_null_ptr, self%y, self%e, self%common)
      if (done == 0) then
         call report(self%common%status, self%n, error)
         return
      end if
      call c_f_pointer(self%x, solution)
      call c_f_pointer(solution%x, values, [self%n, size(b, 2)])
      x(:self%n, :) = values
   end subroutine solve_system

   !> The last rows and columns of L of a matrix as it stands, positive definite.
   subroutine corner(self, l)
      class(cholmod_t), intent(in) :: self
      real(dp), intent(out) :: l(:, :) !< (m, m) lower triangle, zeros above
      call corner_of(self%current, self%n, l)
   end subroutine corner

   !> The pivots of the last factorisation, by equation: squares of the diagonal of L, or D.
   subroutine pivots_of(self, d)
      class(cholmod_t), intent(in) :: self
      real(dp), intent(out) :: d(:) !< (n)
      call diagonal_of(self%current, self%n, d)
   end subroutine pivots_of

   !> See finshell_direct_solver.
   real(dp) function memory(self)
      class(cholmod_t), intent(in) :: self
      memory = self%factor_bytes
   end function memory

   !> Give everything back. Harmless when there is nothing.
   subroutine free(self)
      class(cholmod_t), intent(inout) :: self
      integer(c_int) :: done
      if (associated(self%common)) then
         if (c_associated(self%definite)) done = cholmod_free_factor(self%definite, self%common)
         if (c_associated(self%indefinite)) done = cholmod_free_factor(self%indefinite, self%common)
         if (c_associated(self%x)) done = cholmod_free_dense(self%x, self%common)
         if (c_associated(self%y)) done = cholmod_free_dense(self%y, self%common)
         if (c_associated(self%e)) done = cholmod_free_dense(self%e, self%common)
         done = cholmod_finish(self%common)
         deallocate (self%common)
      end if
      if (associated(self%column_pointer)) deallocate (self%column_pointer)
      if (associated(self%row)) deallocate (self%row)
      self%current = c_null_ptr
      self%factor_bytes = 0
      self%n = 0
   end subroutine free

   subroutine copy(self, other)
      class(cholmod_t), intent(inout) :: self
      class(cholmod_t), intent(in) :: other
      ! Only the copy is emptied; a self-assignment must keep its factors.
      if (associated(self%common, other%common)) return
      call self%free()
      self%options = other%options
   end subroutine copy

   subroutine finalise(self)
      type(cholmod_t), intent(inout) :: self
      call self%free()
   end subroutine finalise

   pure function merge_pointer(a, b, condition) result(p)
      type(c_ptr), intent(in) :: a, b
      logical, intent(in) :: condition
      type(c_ptr) :: p
      if (condition) then
         p = a
      else
         p = b
      end if
   end function merge_pointer

   !> The matrix as CHOLMOD sees it: no copy.
   function sparse_matrix(self, values) result(a)
      class(cholmod_t), intent(in) :: self
      type(c_ptr), intent(in) :: values !< null for the pattern alone
      type(sparse_t) :: a
      a%nrow = self%n
      a%ncol = self%n
      a%nzmax = size(self%row)
      a%p = c_loc(self%column_pointer)
      a%i = c_loc(self%row)
      a%nz = c_null_ptr
      a%x = values
      a%z = c_null_ptr
      a%stype = -1
      a%itype = 0
      a%xtype = merge(cholmod_real, cholmod_pattern, c_associated(values))
      a%dtype = 0
      a%sorted = 1
      a%packed = 1
   end function sparse_matrix

   subroutine report(status, n, error)
      integer(c_int), intent(in) :: status
      integer, intent(in) :: n
      type(error_t), allocatable, intent(inout) :: error
      select case (status)
      case (cholmod_out_of_memory)
         call raise(error, status_out_of_memory, 'not enough memory to factorise '//text_of(n)//' equations')
      case (cholmod_too_large)
         call raise(error, status_out_of_memory, 'the factor of '//text_of(n)//' equations is too large for 32-bit indices')
      case default
         call raise(error, status_invalid_argument, 'CHOLMOD failed with status '//text_of(int(status)))
      end select
   end subroutine report
end module finshell_cholmod
