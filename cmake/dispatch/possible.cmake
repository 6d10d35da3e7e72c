# Sets `dispatch`: whether one library can hold the kernel for several processors, and the user has not chosen one by -march.
set(dispatch OFF)
if(FINSHELL_DISPATCH AND NOT FINSHELL_QUAD_ONLY)
  string(TOUPPER "${CMAKE_BUILD_TYPE}" type)
  set(flags "${CMAKE_Fortran_FLAGS} ${CMAKE_Fortran_FLAGS_${type}}")
  if(NOT CMAKE_SYSTEM_NAME STREQUAL Linux OR NOT CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$"
     OR NOT CMAKE_Fortran_COMPILER_ID STREQUAL GNU OR NOT CMAKE_OBJCOPY OR NOT CMAKE_NM OR NOT CMAKE_LINKER)
    message(STATUS "Kernel: for one processor (several need gfortran, Linux, x86-64 and binutils)")
  elseif(flags MATCHES "-march=")
    message(STATUS "Kernel: for one processor, as -march says")
  elseif(type STREQUAL DEBUG)
    message(STATUS "Kernel: for one processor (debugging)")
  else()
    include(CheckCSourceCompiles)
    check_c_source_compiles("int main(void) { __builtin_cpu_init(); return !__builtin_cpu_supports(\"x86-64-v4\"); }"
      FINSHELL_COMPILER_KNOWS_LEVELS)
    set(dispatch ${FINSHELL_COMPILER_KNOWS_LEVELS})
  endif()
endif()
