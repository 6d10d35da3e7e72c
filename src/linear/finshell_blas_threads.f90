!> Threads of the BLAS below CHOLMOD. A threaded OpenBLAS makes small factorisations slower and burns CPU time waiting, and
!> its count can be set by a call that other BLAS libraries do not have: it is looked up while running.
module finshell_blas_threads
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_procpointer, c_funptr, c_int, c_null_char, c_ptr, c_null_ptr
   use finshell_kinds, only: dp
   implicit none
   private
   public :: set_blas_threads, wake_blas

   interface
      !> POSIX; a null handle means all that is loaded (RTLD_DEFAULT of Linux and the BSDs).
      function dlsym(handle, symbol) bind(c, name='dlsym') result(address)
         import :: c_ptr, c_funptr, c_char
         type(c_ptr), value :: handle
         character(kind=c_char), intent(in) :: symbol(*)
         type(c_funptr) :: address
      end function dlsym
   end interface

   interface
      subroutine dpotrf(uplo, n, a, lda, info)
         import :: dp
         character, intent(in) :: uplo
         integer, intent(in) :: n, lda
         real(dp), intent(inout) :: a(lda, *)
         integer, intent(out) :: info
      end subroutine dpotrf
   end interface

   abstract interface
      subroutine set_threads_interface(threads) bind(c)
         import :: c_int
         integer(c_int), value :: threads
      end subroutine set_threads_interface
   end interface

contains

   !> Ask OpenBLAS for a number of threads; nothing happens with another BLAS.
   subroutine set_blas_threads(threads)
      integer, intent(in) :: threads
      procedure(set_threads_interface), pointer :: set_threads
      type(c_funptr) :: address
      address = dlsym(c_null_ptr, 'openblas_set_num_threads'//c_null_char)
      if (.not. c_associated(address)) return
      call c_f_procpointer(address, set_threads)
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
