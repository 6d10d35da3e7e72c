!> Elements that come one or two at a time, as from hosts with user elements: eight side by side would be seven for nothing.
!>
!> CMake compiles the element once more for blocks of one element and makes this module use that (cmake/narrow). Otherwise, as under
!> fpm, there is no other element than that of the whole block, and no call is called few.
module finshell_few
   use finshell_chunk, only: evaluate_few => evaluate_chunk
   use finshell_kinds, only: lanes
   use finshell_membrane_chunk, only: evaluate_few_membranes => evaluate_membrane_chunk
   implicit none
   private
   public :: evaluate_few, evaluate_few_membranes, few

   !> Calls of so many elements are evaluated one by one: three cost as much as a block of eight.
   integer, parameter :: few = merge(2, 0, lanes == 1)
end module finshell_few
