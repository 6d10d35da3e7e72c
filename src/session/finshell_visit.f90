!> What a host has before a call and gets back behind it: its floating-point environment, the numbers of threads of OpenMP and BLAS.
module finshell_visit
   use, intrinsic :: iso_c_binding, only: c_int, c_int64_t
   use finshell_blas_threads, only: set_blas_threads, threads_of_blas
   use finshell_environment, only: environment_t, hold
   use finshell_fork, only: forked
!$ use omp_lib, only: omp_get_max_threads, omp_set_num_threads
   implicit none
   private
   public :: visit_t

   type :: visit_t
      integer(c_int64_t), private :: whole(32) = 0 ! fenv_t of C, which is smaller everywhere
      integer, private :: threads = 0, blas = 0
   contains
      procedure :: begin
      procedure :: work_with
      procedure :: leave
   end type visit_t

   interface
      function fegetenv(store) result(failed) bind(c)
         import :: c_int, c_int64_t
         integer(c_int64_t), intent(inout) :: store(*)
         integer(c_int) :: failed
      end function fegetenv

      function fesetenv(store) result(failed) bind(c)
         import :: c_int, c_int64_t
         integer(c_int64_t), intent(in) :: store(*)
         integer(c_int) :: failed
      end function fesetenv
   end interface

contains

   !> All of the environment is kept: what reads and writes numbers may use other units than the kernel does (x87).
   subroutine begin(self)
      class(visit_t), intent(inout) :: self
      type(environment_t) :: lowered
      integer(c_int) :: failed
      failed = fegetenv(self%whole)
      call hold(lowered)
      !$ self%threads = omp_get_max_threads()
      self%blas = threads_of_blas()
   end subroutine begin

   !> So many threads, and the BLAS in the one that calls it. In the child of a process that had several: one.
   subroutine work_with(self, threads)
      class(visit_t), intent(in) :: self
      integer, intent(in) :: threads
      integer :: team
      team = threads
      if (team > 1) then
         if (forked()) team = 1
      end if
      !$ if (self%threads > 0) call omp_set_num_threads(team)
      if (self%blas > 1) call set_blas_threads(1)
   end subroutine work_with

   subroutine leave(self)
      class(visit_t), intent(in) :: self
      integer(c_int) :: failed
      !$ call omp_set_num_threads(self%threads)
      if (self%blas > 1) call set_blas_threads(self%blas)
      failed = fesetenv(self%whole)
   end subroutine leave
end module finshell_visit
