!> What every direct solver can do: order and analyse a pattern, factorise values, solve, say what it costs, give back.
!>
!> A new one is a file with a type that extends `direct_solver_t`, and its word in finshell_back_ends.
module finshell_direct_solver
   use finshell_error, only: error_t
   use finshell_kinds, only: dp
   use finshell_sparsity, only: sparsity_t
!$ use omp_lib, only: omp_get_max_threads
   implicit none
   private
   public :: direct_solver_t, pivots_t, solver_options_t, threads_of

   !> What a user may choose.
   type :: solver_options_t
      character(len=:), allocatable :: solver !< 'mumps', 'suitesparse', 'iterative', or 'auto' (also if not allocated)
      real(dp) :: low_rank = 0 !< blocks of the factor are compressed to this relative accuracy; 0: not at all
      logical :: out_of_core = .false. !< keep the factor on disk, in TMPDIR
      real(dp) :: memory = 0 !< bytes for the factor, beyond which it is kept on disk; 0: as many as the machine has left
      integer :: threads = 0 !< of the solver; 0: as OpenMP would
   end type solver_options_t

   !> What a factorisation says about the matrix.
   type :: pivots_t
      logical :: ok = .false. !< there are factors to solve with; else a pivot was zero, or negative where none was expected
      integer :: negative = -1 !< as many as negative eigenvalues; -1: unknown (unsymmetric)
      integer :: determinant_sign = 0 !< -1, 1, or 0 when unknown
      real(dp) :: smallest = 0 !< magnitude of the smallest, scaled; for an unsymmetric matrix a rough reciprocal condition number
   end type pivots_t

   type, abstract :: direct_solver_t
      type(solver_options_t) :: options !< to be set before `analyse`
      logical :: approximate = .false. !< the factors are: solutions need an iteration (finshell_refinement)
      logical :: on_disk = .false. !< after `analyse`: the factors will be
      logical :: tries_all = .false. !< it factorises many indefinite matrices as fast as others, and refuses the rest
      logical :: definite_only = .false. !< after `analyse`: others, where there are any, are faster for indefinite matrices
   contains
      procedure(analyse_interface), deferred :: analyse
      procedure(factorise_interface), deferred :: factorise
      procedure(solve_interface), deferred :: solve
      procedure(memory_interface), deferred :: memory
      procedure(free_interface), deferred :: free
   end type direct_solver_t

   abstract interface
      !> Order the equations and find the pattern of the factors.
      !> Errors: a pattern that this solver is not for, status_out_of_memory.
      subroutine analyse_interface(self, pattern, order, error)
         import :: direct_solver_t, sparsity_t, error_t
         class(direct_solver_t), intent(inout) :: self
         type(sparsity_t), intent(in) :: pattern !< at least one equation
         !> (n) equation that is eliminated as the k-th. Used where it is allocated, else allocated where the solver tells.
         integer, allocatable, intent(inout) :: order(:)
         type(error_t), allocatable, intent(out) :: error
      end subroutine analyse_interface

      !> Factorise the matrix with these values. A zero pivot is no error: see pivots_t. Errors: status_out_of_memory.
      subroutine factorise_interface(self, values, scale, definite, pivots, error)
         import :: direct_solver_t, dp, pivots_t, error_t
         class(direct_solver_t), intent(inout) :: self
         real(dp), intent(in), target, contiguous :: values(:) !< (entries of the pattern)
         real(dp), intent(in) :: scale(:) !< (n) entry (i, j) is to be compared with scale(i) scale(j)
         logical, intent(in) :: definite !< expected to be positive definite: a method may be used that fails otherwise
         type(pivots_t), intent(out) :: pivots
         type(error_t), allocatable, intent(out) :: error
      end subroutine factorise_interface

      !> Solve with the last factors. Errors: there are none.
      subroutine solve_interface(self, b, x, error)
         import :: direct_solver_t, dp, error_t
         class(direct_solver_t), intent(inout) :: self
         real(dp), intent(in), target, contiguous :: b(:, :) !< (n, right-hand sides)
         real(dp), intent(inout), target, contiguous :: x(:, :) !< (n, right-hand sides)
         type(error_t), allocatable, intent(out) :: error
      end subroutine solve_interface

      !> Bytes of the factors: as analysed, or as they are; 0 when unknown.
      real(dp) function memory_interface(self)
         import :: direct_solver_t, dp
         class(direct_solver_t), intent(in) :: self
      end function memory_interface

      !> Give everything back. Harmless when there is nothing.
      subroutine free_interface(self)
         import :: direct_solver_t
         class(direct_solver_t), intent(inout) :: self
      end subroutine free_interface
   end interface

contains

   !> As many as the solver may have.
   integer function threads_of(options) result(threads)
      type(solver_options_t), intent(in) :: options
      threads = max(options%threads, 1)
      !$ if (options%threads == 0) threads = omp_get_max_threads()
   end function threads_of
end module finshell_direct_solver
