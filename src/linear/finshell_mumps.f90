!> MUMPS: L D L^T of a symmetric matrix with pivots of one and two rows, or L U of an unsymmetric one. Its pivoting makes the
!> count of negative pivots exact where the matrix is indefinite, and its supernodes make it fast.
module finshell_mumps
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int, c_int64_t, c_loc, c_null_ptr, c_ptr
   use finshell_direct_solver, only: direct_solver_t, pivots_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: dp
   use finshell_sparsity, only: sparsity_t
   use finshell_status, only: status_invalid_argument, status_out_of_memory
   use finshell_team, only: from_first, shared, team_t
   implicit none
   private
   public :: mumps_t

   integer(c_int), parameter :: world = -987654 ! the communicator of everybody, and the only one without MPI
   integer(c_int), parameter :: job_analyse = 1, job_factorise = 2, job_solve = 3
   integer(c_int), parameter :: singular = -10
   !> Errors that more workspace cures.
   integer(c_int), parameter :: too_small(7) = [-8, -9, -11, -12, -14, -15, -17]
   integer, parameter :: most_enlargements = 6
   !> Pivots are as good as this part of the largest entry of their row.
   real(dp), parameter :: pivot_threshold = 0.01_dp

   !> One analysed matrix. A copy by assignment is empty: factors are not shared and must be made anew.
   type, extends(direct_solver_t) :: mumps_t
      private
      integer :: n = 0
      logical :: symmetric = .true.
      class(team_t), pointer :: team => null()
      logical :: factorised = .false.
      type(c_ptr) :: handle = c_null_ptr
      integer(c_int), pointer, contiguous :: row(:) => null(), column(:) => null(), position(:) => null()
      real(c_double), pointer, contiguous :: scaling(:) => null()
      real(dp) :: bytes = 0
      integer(c_int), pointer :: icntl(:) => null(), infog(:) => null()
      real(c_double), pointer :: cntl(:) => null(), rinfog(:) => null()
   contains
      procedure :: analyse
      procedure :: factorise
      procedure :: solve
      procedure :: memory
      procedure :: free
      procedure, private :: open
      procedure, private :: copy
      generic :: assignment(=) => copy
      final :: finalise
   end type mumps_t

   interface
      type(c_ptr) function finshell_mumps_open(symmetry, communicator) bind(C)
         import :: c_ptr, c_int
         integer(c_int), value :: symmetry, communicator
      end function finshell_mumps_open

      subroutine finshell_mumps_call(handle, job) bind(C)
         import :: c_ptr, c_int
         type(c_ptr), value :: handle
         integer(c_int), value :: job
      end subroutine finshell_mumps_call

      subroutine finshell_mumps_close(handle) bind(C)
         import :: c_ptr
         type(c_ptr), value :: handle
      end subroutine finshell_mumps_close

      type(c_ptr) function finshell_mumps_icntl(handle) bind(C)
         import :: c_ptr
         type(c_ptr), value :: handle
      end function finshell_mumps_icntl

      type(c_ptr) function finshell_mumps_cntl(handle) bind(C)
         import :: c_ptr
         type(c_ptr), value :: handle
      end function finshell_mumps_cntl

      type(c_ptr) function finshell_mumps_infog(handle) bind(C)
         import :: c_ptr
         type(c_ptr), value :: handle
      end function finshell_mumps_infog

      type(c_ptr) function finshell_mumps_rinfog(handle) bind(C)
         import :: c_ptr
         type(c_ptr), value :: handle
      end function finshell_mumps_rinfog

      type(c_ptr) function finshell_mumps_sym_perm(handle) bind(C)
         import :: c_ptr
         type(c_ptr), value :: handle
      end function finshell_mumps_sym_perm

      subroutine finshell_mumps_matrix(handle, n, entries, rows, columns, values) bind(C)
         import :: c_ptr, c_int, c_int64_t
         type(c_ptr), value :: handle, rows, columns, values
         integer(c_int), value :: n
         integer(c_int64_t), value :: entries
      end subroutine finshell_mumps_matrix

      subroutine finshell_mumps_local_matrix(handle, n, entries, rows, columns, values) bind(C)
         import :: c_ptr, c_int, c_int64_t
         type(c_ptr), value :: handle, rows, columns, values
         integer(c_int), value :: n
         integer(c_int64_t), value :: entries
      end subroutine finshell_mumps_local_matrix

      subroutine finshell_mumps_order(handle, position) bind(C)
         import :: c_ptr
         type(c_ptr), value :: handle, position
      end subroutine finshell_mumps_order

      subroutine finshell_mumps_scaling(handle, rows, columns) bind(C)
         import :: c_ptr
         type(c_ptr), value :: handle, rows, columns
      end subroutine finshell_mumps_scaling

      subroutine finshell_mumps_rhs(handle, rhs, n, count) bind(C)
         import :: c_ptr, c_int
         type(c_ptr), value :: handle, rhs
         integer(c_int), value :: n, count
      end subroutine finshell_mumps_rhs
   end interface

contains

   !> See finshell_direct_solver.
   subroutine analyse(self, pattern, order, error)
      class(mumps_t), intent(inout) :: self
      type(sparsity_t), intent(in) :: pattern
      integer, allocatable, intent(inout) :: order(:)
      type(error_t), allocatable, intent(out) :: error
      integer(c_int), pointer :: found(:)
      integer :: i, j

      call self%free()
      self%n = pattern%n
      self%symmetric = pattern%symmetric
      self%team => pattern%team
      call self%open(error)
      if (allocated(error)) return
      allocate (self%row, source=int(pattern%row, c_int))
      allocate (self%column(size(self%row)))
      do j = 1, pattern%n
         self%column(pattern%column_pointer(j):pattern%column_pointer(j + 1) - 1) = j
      end do
      if (allocated(order) .and. .not. shared(self%team)) then
         allocate (self%position(self%n))
         self%position(order) = [(i, i=1, self%n)]
         self%icntl(7) = 1
         call finshell_mumps_order(self%handle, c_loc(self%position))
      end if
      call give_matrix(self, c_null_ptr)
      call finshell_mumps_call(self%handle, job_analyse)
      if (self%infog(1) < 0) then
         call report(self%infog, self%n, error)
         call self%free()
         return
      end if
      self%bytes = 1e6_dp*self%infog(17)
      if (.not. allocated(order)) then
         call c_f_pointer(finshell_mumps_sym_perm(self%handle), found, [self%n])
         allocate (order(self%n))
         order(found) = [(i, i=1, self%n)]
      end if
   end subroutine analyse

   !> Tell MUMPS where the matrix is: on this process, or the part of it that is.
   subroutine give_matrix(self, values)
      class(mumps_t), intent(in) :: self
      type(c_ptr), intent(in) :: values
      associate (n => self%n, entries => size(self%row, kind=c_int64_t), row => c_loc(self%row), column => c_loc(self%column))
         if (shared(self%team)) then
            call finshell_mumps_local_matrix(self%handle, n, entries, row, column, values)
         else
            call finshell_mumps_matrix(self%handle, n, entries, row, column, values)
         end if
      end associate
   end subroutine give_matrix

   !> An instance, with everything switched off that needs values when it is analysed or that the caller does itself.
   subroutine open(self, error)
      class(mumps_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      integer(c_int) :: communicator
      communicator = world
      if (shared(self%team)) communicator = self%team%communicator
      self%handle = finshell_mumps_open(merge(2, 0, self%symmetric), communicator)
      if (.not. c_associated(self%handle)) then
         call raise(error, status_out_of_memory, 'MUMPS does not start')
         return
      end if
      call c_f_pointer(finshell_mumps_icntl(self%handle), self%icntl, [60])
      call c_f_pointer(finshell_mumps_infog(self%handle), self%infog, [80])
      call c_f_pointer(finshell_mumps_cntl(self%handle), self%cntl, [15])
      call c_f_pointer(finshell_mumps_rinfog(self%handle), self%rinfog, [40])
      self%icntl(1:3) = -1 ! prints nothing
      self%icntl(4) = 0
      self%icntl(6) = 0 ! no matching of rows and columns
      self%icntl(8) = merge(7, -1, shared(self%team)) ! the scaling is ours, but of a matrix in parts MUMPS takes its own only
      self%icntl(10) = 0 ! the caller refines
      self%icntl(12) = 1 ! no ordering by pairs of rows
      self%icntl(13) = 1 ! the last front as all others: its negative pivots are counted
      self%icntl(14) = 30 ! % of memory for pivots that are put off
      self%icntl(18) = merge(3, 0, shared(self%team)) ! parts of the matrix
      self%icntl(22) = merge(1, 0, self%options%out_of_core)
      self%icntl(33) = merge(0, 1, self%symmetric)
      if (self%options%low_rank > 0) then
         self%icntl(35) = 2
         self%cntl(7) = self%options%low_rank
      end if
   end subroutine open

   !> See finshell_direct_solver. Definite or not, the method is the same; without pivoting where it is expected to be definite.
   subroutine factorise(self, values, scale, definite, pivots, error)
      class(mumps_t), intent(inout) :: self
      real(dp), intent(in), target, contiguous :: values(:)
      real(dp), intent(in) :: scale(:)
      logical, intent(in) :: definite
      type(pivots_t), intent(out) :: pivots
      type(error_t), allocatable, intent(out) :: error
      integer :: k

      self%factorised = .false.
      if (.not. associated(self%scaling)) allocate (self%scaling(self%n))
      self%scaling = 1/scale
      if (.not. shared(self%team)) call finshell_mumps_scaling(self%handle, c_loc(self%scaling), c_loc(self%scaling))
      call give_matrix(self, c_loc(values))
      self%cntl(1) = merge(0.0_dp, pivot_threshold, definite .and. self%symmetric)
      do k = 1, most_enlargements
         call finshell_mumps_call(self%handle, job_factorise)
         if (.not. any(self%infog(1) == too_small)) exit
         self%icntl(14) = 2*self%icntl(14)
      end do
      if (self%infog(1) == singular) return
      if (self%infog(1) < 0) then
         call report(self%infog, self%n, error)
         return
      end if
      self%bytes = 1e6_dp*self%infog(22)
      pivots%ok = .true.
      pivots%smallest = self%rinfog(19)
      if (self%symmetric) then
         pivots%negative = self%infog(12)
         pivots%determinant_sign = 1 - 2*mod(pivots%negative, 2)
         ! Without pivoting, an indefinite matrix may have lost its digits.
         if (definite .and. pivots%negative > 0) pivots%ok = .false.
      else
         pivots%determinant_sign = int(sign(1.0_dp, self%rinfog(12)))
      end if
      self%factorised = pivots%ok
   end subroutine factorise

   !> See finshell_direct_solver.
   subroutine solve(self, b, x, error)
      class(mumps_t), intent(inout) :: self
      real(dp), intent(in), target, contiguous :: b(:, :)
      real(dp), intent(inout), target, contiguous :: x(:, :)
      type(error_t), allocatable, intent(out) :: error
      integer :: j
      if (.not. self%factorised) then
         call raise(error, status_invalid_argument, 'solution asked for before a successful factorisation')
         return
      end if
      x = b
      call finshell_mumps_rhs(self%handle, c_loc(x), self%n, size(b, 2))
      call finshell_mumps_call(self%handle, job_solve)
      if (self%infog(1) < 0) call report(self%infog, self%n, error)
      do j = 1, size(x, 2)
         call from_first(self%team, x(:, j))
      end do
   end subroutine solve

   !> See finshell_direct_solver.
   real(dp) function memory(self)
      class(mumps_t), intent(in) :: self
      memory = self%bytes
   end function memory

   !> Give everything back. Harmless when there is nothing.
   subroutine free(self)
      class(mumps_t), intent(inout) :: self
      if (c_associated(self%handle)) call finshell_mumps_close(self%handle)
      self%handle = c_null_ptr
      if (associated(self%row)) deallocate (self%row)
      if (associated(self%column)) deallocate (self%column)
      if (associated(self%position)) deallocate (self%position)
      if (associated(self%scaling)) deallocate (self%scaling)
      nullify (self%icntl, self%infog, self%cntl, self%rinfog)
      self%factorised = .false.
      self%bytes = 0
      self%n = 0
   end subroutine free

   subroutine copy(self, other)
      class(mumps_t), intent(inout) :: self
      class(mumps_t), intent(in) :: other
      ! Only the copy is emptied; a self-assignment must keep its factors.
      if (c_associated(self%handle, other%handle)) return
      call self%free()
      self%options = other%options
   end subroutine copy

   subroutine finalise(self)
      type(mumps_t), intent(inout) :: self
      call self%free()
   end subroutine finalise

   subroutine report(infog, n, error)
      integer(c_int), intent(in) :: infog(:)
      integer, intent(in) :: n
      type(error_t), allocatable, intent(inout) :: error
      integer(c_int), parameter :: no_memory(5) = [-5, -7, -13, -19, -20]
      if (any(infog(1) == no_memory) .or. any(infog(1) == too_small)) then
         call raise(error, status_out_of_memory, 'not enough memory to factorise '//text_of(n)//' equations')
      else if (infog(1) == -90) then
         call raise(error, status_out_of_memory, 'the factor of '//text_of(n)// &
                    ' equations cannot be kept on disk; TMPDIR names the folder')
      else
         call raise(error, status_invalid_argument, 'MUMPS failed with status '//text_of(int(infog(1)))//', '// &
                    text_of(int(infog(2))))
      end if
   end subroutine report
end module finshell_mumps
