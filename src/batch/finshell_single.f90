!> An element alone in a call, as from hosts with user elements: eight side by side would be seven for nothing.
!>
!> CMake compiles the element once more for blocks of one element and makes this module use that (cmake/narrow). Otherwise, as under
!> fpm, there is no other element than that of the whole block.
module finshell_single
   use finshell_chunk, only: evaluate_single => evaluate_chunk
   use finshell_kinds, only: lanes
   use finshell_membrane_chunk, only: evaluate_single_membrane => evaluate_membrane_chunk
   implicit none
   private
   public :: evaluate_single, evaluate_single_membrane, narrow

   logical, parameter :: narrow = lanes == 1 !< whether single elements are evaluated otherwise than blocks
end module finshell_single
