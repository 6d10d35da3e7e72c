!> Processes that are children of one which had several threads.
module finshell_fork
   use, intrinsic :: iso_c_binding, only: c_int
   implicit none
   private
   public :: forked

   interface
      function getpid() result(process) bind(c)
         import :: c_int
         integer(c_int) :: process
      end function getpid
   end interface

contains

   !> Whether this process is the child of one that asked before. To be asked where several threads are about to begin.
   !>
   !> The threads of OpenMP do not follow into a child, but OpenMP does not know and would wait for them for ever.
   function forked() result(answer)
      logical :: answer
      integer(c_int), save :: owner = 0 ! process whose threads were used first
      integer(c_int) :: known, here
      here = getpid()
!$omp atomic read
      known = owner
      answer = known /= 0 .and. known /= here
      if (known /= 0) return
!$omp atomic write
      owner = here
   end function forked
end module finshell_fork
