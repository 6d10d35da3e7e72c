!> How many threads.
module finshell_thread_choice
   use finshell_assembly, only: paying_threads
   use finshell_blas_threads, only: to_openmp, wake_blas
   use finshell_fork, only: forked
!$ use omp_lib, only: omp_get_num_procs, omp_set_num_threads
   implicit none
   private
   public :: choose_threads

contains

   !> As many threads as the input asks for, else as OpenMP would but no more than pay, and than there are idle processors: threads
   !> that wait for others that have no processor make a busy machine slower than one thread is.
   subroutine choose_threads(wanted, elements)
      integer, intent(in) :: wanted, elements
      integer, parameter :: always_allowed = 8
      integer :: threads
      threads = wanted
      if (wanted == 0) threads = paying_threads(elements)
!$    if (wanted == 0) threads = max(1, min(threads, omp_get_num_procs() - other_work()))
      ! more than there are processors never pay, and very many cannot be created
!$    threads = min(threads, max(omp_get_num_procs(), always_allowed))
      if (threads > 1) then
         if (forked()) threads = 1
      end if
!$    call omp_set_num_threads(threads)
      call to_openmp()
      call wake_blas()
   end subroutine choose_threads

   !> Threads of others that want a processor: the mean over the last minute, as Linux tells it; elsewhere 0.
   integer function other_work() result(busy)
      real :: load
      integer :: unit, status
      busy = 0
      open (newunit=unit, file='/proc/loadavg', status='old', action='read', iostat=status)
      if (status /= 0) return
      read (unit, *, iostat=status) load
      close (unit)
      if (status == 0) busy = nint(load)
   end function other_work
end module finshell_thread_choice
