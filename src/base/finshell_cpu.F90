!> The processor this copy of the kernel was compiled for (CMakeLists.txt compiles several, cmake/dispatch chooses).
module finshell_cpu
   implicit none
   private
   public :: cpu_level

#ifndef FINSHELL_CPU_LEVEL
#define FINSHELL_CPU_LEVEL 0
#endif

contains

   !> 1, 3, 4: x86-64, x86-64-v3 (AVX2 and FMA), x86-64-v4 (AVX-512); 0: there is one copy only.
   pure integer function cpu_level()
      cpu_level = FINSHELL_CPU_LEVEL
   end function cpu_level
end module finshell_cpu
