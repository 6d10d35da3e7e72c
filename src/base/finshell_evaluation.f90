!> How far an evaluation goes: the energy, its first derivatives, its second derivatives; each level includes the one before.
module finshell_evaluation
   implicit none
   private
   public :: level_energy, level_force, level_tangent
   integer, parameter :: level_energy = 0, level_force = 1, level_tangent = 2
end module finshell_evaluation
