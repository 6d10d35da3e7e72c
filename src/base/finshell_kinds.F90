!> The one place where the working precision is set.
module finshell_kinds
   use, intrinsic :: iso_fortran_env, only: int8, int32, int64, real64, real128
   implicit none
   private
   public :: wp, dp, i1, i4, i8, strip, lanes, points_per_block, rows_3

   integer, parameter :: dp = real64
#ifdef FINSHELL_QUAD
   integer, parameter :: wp = real128 !< quadruple precision: derivative checks only
#else
   integer, parameter :: wp = real64
#endif
   integer, parameter :: i1 = int8, i4 = int32, i8 = int64

   !> Points that a material law takes side by side: eight doubles fill one 512-bit register.
   integer, parameter :: strip = 8
   !> Elements evaluated side by side. The narrow copy of the element (cmake/narrow) takes them one by one.
#ifdef FINSHELL_NARROW
   integer, parameter :: lanes = 1
#else
   integer, parameter :: lanes = strip
#endif
   !> Three in-plane points of each element of a block, those of the first element l, l + lanes, l + 2 lanes; and what laws need
   !> beyond (finshell_material): a point anywhere in the block, whose results mean nothing.
   integer, parameter :: points_per_block = strip*((3*lanes + strip - 1)/strip)
   !> Rows of matrices that have three: those of a single element fill whole registers of four. What is in the fourth is of no
   !> meaning, and overwritten where something else begins.
   integer, parameter :: rows_3 = merge(4, 3, lanes == 1)
end module finshell_kinds
