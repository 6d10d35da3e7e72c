# 1 "/work/main/src/base/finshell_kinds.F90"
# 1 "<built-in>"
# 1 "<command-line>"
# 1 "/work/main/test/api/test/sanitizers//"
# 1 "/work/main/src/base/finshell_kinds.F90"
!> The one place where the working precision is set.
module finshell_kinds
   use, intrinsic :: iso_fortran_env, only: int8, int32, int64, real64, real128
   implicit none
   private
   public :: wp, dp, i1, i4, i8, lanes

   integer, parameter :: dp = real64



   integer, parameter :: wp = real64

   integer, parameter :: i1 = int8, i4 = int32, i8 = int64

   !> Elements evaluated side by side: eight doubles fill one 512-bit register.
   integer, parameter :: lanes = 8
end module finshell_kinds
