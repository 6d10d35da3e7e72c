!> Threads of the BLAS below the solvers. OpenBLAS has a pool of its own, as large as the machine from the beginning, whose members
!> burn CPU time waiting for each other; with the pool of OpenMP beside it there would be twice as many threads as were asked for.
!> So each pool exists only while it works: `to_blas` before a factorisation, `to_openmp` after it. What that takes is in OpenBLAS,
!> not in other BLAS libraries, and is looked up while running.
module finshell_blas_threads
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_f_procpointer, c_funptr, c_int, c_null_char, &
                                          c_null_ptr, c_ptr
   use finshell_fork, only: forked
   use finshell_kinds, only: dp
   use finshell_lapack, only: dpotrf
!$ use omp_lib, only: omp_get_max_threads, omp_in_parallel, omp_pause_resource_all, omp_pause_soft
   implicit none
   private
   public :: to_blas, to_openmp, wake_blas, threads_of_blas, set_blas_threads

   interface
      !> POSIX; a null handle means all that is loaded (RTLD_DEFAULT of Linux and the BSDs).
      function dlsym(handle, symbol) bind(c, name='dlsym') result(address)
         import :: c_ptr, c_funptr, c_char
         type(c_ptr), value :: handle
         character(kind=c_char), intent(in) :: symbol(*)
         type(c_funptr) :: address
      end function dlsym
   end interface

   abstract interface
      subroutine set_threads_interface(threads) bind(c)
         import :: c_int
         integer(c_int), value :: threads
      end subroutine set_threads_interface

      integer(c_int) function number_interface() bind(c)
         import :: c_int
      end function number_interface
   end interface

contains

   !> From now on the BLAS has the threads, and OpenMP none.
   subroutine to_blas(wanted)
      integer, intent(in) :: wanted !< 0: as many as OpenMP would have
      integer :: threads, status
      threads = max(wanted, 1)
      !$ if (wanted == 0) threads = omp_get_max_threads()
      if (threads > 1) then
         if (forked()) threads = 1
      end if
      if (threads > 1) then
         !$ if (.not. omp_in_parallel()) status = omp_pause_resource_all(omp_pause_soft)
      end if
      call set_blas_threads(threads)
   end subroutine to_blas

   !> From now on OpenMP may have the threads, and the BLAS works in the one that calls it.
   subroutine to_openmp()
      call set_blas_threads(1)
   end subroutine to_openmp

   !> How many threads OpenBLAS has; 0: it is another BLAS.
   integer function threads_of_blas() result(threads)
      procedure(number_interface), pointer :: get_threads
      type(c_funptr) :: getter
      threads = 0
      getter = dlsym(c_null_ptr, 'openblas_get_num_threads'//c_null_char)
      if (.not. c_associated(getter)) return
      call c_f_procpointer(getter, get_threads)
      threads = get_threads()
   end function threads_of_blas

   !> Leave OpenBLAS so many threads; nothing happens with another BLAS.
   subroutine set_blas_threads(threads)
      integer, intent(in) :: threads
      procedure(set_threads_interface), pointer :: set_threads
      procedure(number_interface), pointer :: get_threads, shut_down
      type(c_funptr) :: setter, getter, closer
      type(c_ptr) :: size_of_pool
      integer(c_int), pointer :: members
      integer(c_int) :: status

      setter = dlsym(c_null_ptr, 'openblas_set_num_threads'//c_null_char)
      getter = dlsym(c_null_ptr, 'openblas_get_num_threads'//c_null_char)
      if (.not. (c_associated(setter) .and. c_associated(getter))) return
      call c_f_procpointer(getter, get_threads)
      if (get_threads() == threads) return
      call c_f_procpointer(setter, set_threads)
      closer = dlsym(c_null_ptr, 'blas_thread_shutdown_'//c_null_char)
      size_of_pool = transfer(dlsym(c_null_ptr, 'blas_num_threads'//c_null_char), c_null_ptr)
      if (c_associated(closer) .and. c_associated(size_of_pool)) then
         ! The pool has the size that this variable has when it is made, which happens when it is first needed.
         call set_threads(1_c_int)
         call c_f_procpointer(closer, shut_down)
         status = shut_down()
         if (threads == 1) return
         call c_f_pointer(size_of_pool, members)
         members = int(threads, c_int)
      end if
      call set_threads(int(threads, c_int))
   end subroutine set_blas_threads

   !> A first call, for which OpenBLAS reserves its memory (128 MB of address space): later there may be too little of it, and
   !> OpenBLAS would ask for it again and again, for ever.
   subroutine wake_blas()
      real(dp) :: one(1, 1)
      integer :: info
      one = 1
      call dpotrf('L', 1, one, 1, info)
   end subroutine wake_blas
end module finshell_blas_threads
