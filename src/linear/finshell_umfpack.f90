!> UMFPACK: L U of an unsymmetric matrix, the symbolic analysis reused.
module finshell_umfpack
   use, intrinsic :: iso_c_binding, only: c_int, c_double, c_ptr, c_null_ptr, c_associated
   use finshell_direct_solver, only: direct_solver_t, pivots_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: dp
   use finshell_sparsity, only: sparsity_t
   use finshell_status, only: status_invalid_argument, status_out_of_memory
   implicit none
   private
   public :: umfpack_t

   integer(c_int), parameter :: umfpack_ok = 0, umfpack_singular = 1, umfpack_no_memory = -1
   integer(c_int), parameter :: solve_a = 0
   integer, parameter :: control_size = 20, info_size = 90
   integer, parameter :: control_refinements = 8, info_rcond = 68, info_bytes_of_unit = 4, info_memory = 42, & ! from 1
                        info_estimate = 22

   !> One analysed matrix. A copy by assignment is empty: factors are not shared and must be made anew.
   type, extends(direct_solver_t) :: umfpack_t
      private
      integer(c_int) :: n = 0
      integer(c_int), allocatable :: column_pointer(:), row(:) ! from 0
      real(c_double) :: control(control_size) = 0, info(info_size) = 0
      type(c_ptr) :: symbolic = c_null_ptr, numeric = c_null_ptr
      integer(c_int), allocatable :: work_i(:)
      real(c_double), allocatable :: work_x(:), unused(:)
   contains
      procedure :: analyse
      procedure :: factorise
      procedure :: solve
      procedure :: memory
      procedure :: free
      procedure, private :: determinant_sign
      procedure, private :: copy
      generic :: assignment(=) => copy
      final :: finalise
   end type umfpack_t

   interface
      subroutine umfpack_di_defaults(control) bind(C)
         import :: c_double
         real(c_double), intent(out) :: control(*)
      end subroutine umfpack_di_defaults

      integer(c_int) function umfpack_di_symbolic(n_row, n_col, ap, ai, ax, symbolic, control, info) bind(C)
         import :: c_int, c_double, c_ptr
         integer(c_int), value :: n_row, n_col
         integer(c_int), intent(in) :: ap(*), ai(*)
         type(c_ptr), value :: ax
         type(c_ptr), intent(out) :: symbolic
         real(c_double), intent(in) :: control(*)
         real(c_double), intent(inout) :: info(*)
      end function umfpack_di_symbolic

      integer(c_int) function umfpack_di_numeric(ap, ai, ax, symbolic, numeric, control, info) bind(C)
         import :: c_int, c_double, c_ptr
         integer(c_int), intent(in) :: ap(*), ai(*)
         real(c_double), intent(in) :: ax(*)
         type(c_ptr), value :: symbolic
         type(c_ptr), intent(out) :: numeric
         real(c_double), intent(in) :: control(*)
         real(c_double), intent(inout) :: info(*)
      end function umfpack_di_numeric

      integer(c_int) function umfpack_di_wsolve(sys, ap, ai, ax, x, b, numeric, control, info, wi, w) bind(C)
         import :: c_int, c_double, c_ptr
         integer(c_int), value :: sys
         integer(c_int), intent(in) :: ap(*), ai(*)
         real(c_double), intent(in) :: ax(*), b(*), control(*)
         real(c_double), intent(inout) :: x(*), info(*), w(*)
         type(c_ptr), value :: numeric
         integer(c_int), intent(inout) :: wi(*)
      end function umfpack_di_wsolve

      integer(c_int) function umfpack_di_get_determinant(mx, ex, numeric, info) bind(C)
         import :: c_int, c_double, c_ptr
         real(c_double), intent(out) :: mx, ex
         type(c_ptr), value :: numeric
         real(c_double), intent(inout) :: info(*)
      end function umfpack_di_get_determinant

      subroutine umfpack_di_free_symbolic(symbolic) bind(C)
         import :: c_ptr
         type(c_ptr), intent(inout) :: symbolic
      end subroutine umfpack_di_free_symbolic

      subroutine umfpack_di_free_numeric(numeric) bind(C)
         import :: c_ptr
         type(c_ptr), intent(inout) :: numeric
      end subroutine umfpack_di_free_numeric
   end interface

contains

   !> See finshell_direct_solver. It orders the columns its own way.
   subroutine analyse(self, pattern, order, error)
      class(umfpack_t), intent(inout) :: self
      type(sparsity_t), intent(in) :: pattern
      integer, allocatable, intent(inout) :: order(:)
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: status

      call self%free()
      if (pattern%symmetric) then
         call raise(error, status_invalid_argument, 'UMFPACK is for unsymmetric matrices')
         return
      end if
      self%n = pattern%n
      self%column_pointer = int(pattern%column_pointer - 1, c_int)
      self%row = int(pattern%row - 1, c_int)
      allocate (self%work_i(self%n), source=0_c_int)
      allocate (self%work_x(self%n), self%unused(1), source=0.0_c_double)
      call umfpack_di_defaults(self%control)
      self%control(control_refinements) = 0 ! the caller refines
      status = umfpack_di_symbolic(self%n, self%n, self%column_pointer, self%row, c_null_ptr, self%symbolic, self%control, &
                                   self%info)
      if (status /= umfpack_ok) then
         call report(status, int(self%n), error)
         call self%free()
      end if
   end subroutine analyse

   !> See finshell_direct_solver.
   subroutine factorise(self, values, scale, definite, pivots, error)
      class(umfpack_t), intent(inout) :: self
      real(dp), intent(in), target, contiguous :: values(:)
      real(dp), intent(in) :: scale(:)
      logical, intent(in) :: definite
      type(pivots_t), intent(out) :: pivots
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: status

      if (c_associated(self%numeric)) call umfpack_di_free_numeric(self%numeric)
      status = umfpack_di_numeric(self%column_pointer, self%row, values, self%symbolic, self%numeric, self%control, self%info)
      select case (status)
      case (umfpack_ok)
         pivots%ok = .true.
         pivots%smallest = self%info(info_rcond)
         pivots%determinant_sign = self%determinant_sign()
      case (umfpack_singular)
         call umfpack_di_free_numeric(self%numeric)
      case default
         self%numeric = c_null_ptr
         call report(status, int(self%n), error)
      end select
   end subroutine factorise

   !> Sign of the determinant of the last factorisation: -1, 0, 1.
   integer function determinant_sign(self)
      class(umfpack_t), intent(inout) :: self
      real(c_double) :: mantissa, exponent
      determinant_sign = 0
      if (.not. c_associated(self%numeric)) return
      if (umfpack_di_get_determinant(mantissa, exponent, self%numeric, self%info) < umfpack_ok) return
      if (mantissa > 0) determinant_sign = 1
      if (mantissa < 0) determinant_sign = -1
   end function determinant_sign

   !> See finshell_direct_solver.
   subroutine solve(self, b, x, error)
      class(umfpack_t), intent(inout) :: self
      real(dp), intent(in), target, contiguous :: b(:, :)
      real(dp), intent(inout), target, contiguous :: x(:, :)
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: status
      integer :: j

      if (.not. c_associated(self%numeric)) then
         call raise(error, status_invalid_argument, 'solution asked for before a successful factorisation')
         return
      end if
      do j = 1, size(b, 2)
         ! Without refinement UMFPACK does not look at the values of the matrix.
         status = umfpack_di_wsolve(solve_a, self%column_pointer, self%row, self%unused, x(:, j), b(:, j), self%numeric, &
                                    self%control, self%info, self%work_i, self%work_x)
         if (status < umfpack_ok) then
            call report(status, int(self%n), error)
            return
         end if
      end do
   end subroutine solve

   !> See finshell_direct_solver.
   real(dp) function memory(self)
      class(umfpack_t), intent(in) :: self
      memory = self%info(info_bytes_of_unit)*self%info(merge(info_memory, info_estimate, c_associated(self%numeric)))
   end function memory

   !> Give everything back. Harmless when there is nothing.
   subroutine free(self)
      class(umfpack_t), intent(inout) :: self
      if (c_associated(self%numeric)) call umfpack_di_free_numeric(self%numeric)
      if (c_associated(self%symbolic)) call umfpack_di_free_symbolic(self%symbolic)
      self%numeric = c_null_ptr
      self%symbolic = c_null_ptr
      if (allocated(self%row)) deallocate (self%row, self%column_pointer, self%work_i, self%work_x, self%unused)
      self%n = 0
   end subroutine free

   subroutine copy(self, other)
      class(umfpack_t), intent(inout) :: self
      class(umfpack_t), intent(in) :: other
      ! Only the copy is emptied; a self-assignment must keep its factors.
      if (c_associated(self%symbolic, other%symbolic)) return
      call self%free()
      self%options = other%options
   end subroutine copy

   subroutine finalise(self)
      type(umfpack_t), intent(inout) :: self
      call self%free()
   end subroutine finalise

   subroutine report(status, n, error)
      integer(c_int), intent(in) :: status
      integer, intent(in) :: n
      type(error_t), allocatable, intent(inout) :: error
      if (status == umfpack_no_memory) then
         call raise(error, status_out_of_memory, 'not enough memory to factorise '//text_of(n)//' equations')
      else
         call raise(error, status_invalid_argument, 'UMFPACK failed with status '//text_of(int(status)))
      end if
   end subroutine report
end module finshell_umfpack
