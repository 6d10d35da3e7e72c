!> Few elements in a call, as from hosts with user elements: eight side by side would be most of them for nothing.
!>
!> CMake compiles the element once more for blocks of one element and makes this module use that (cmake/narrow). Otherwise, as under
!> fpm, there is no other element than that of the whole block.
module finshell_single
   use finshell_chunk, only: evaluate_single => evaluate_chunk
   use finshell_kinds, only: lanes
   use finshell_membrane_chunk, only: evaluate_single_membrane => evaluate_membrane_chunk
   implicit none
   private
   public :: evaluate_single, evaluate_single_membrane, most_alone, most_membranes_alone

   !> Elements of a call that are evaluated one after the other: three shells take less time than a block, four as much, and two
   !> membranes more.
   integer, parameter :: most_alone = merge(3, 0, lanes == 1), most_membranes_alone = min(1, most_alone)
end module finshell_single
