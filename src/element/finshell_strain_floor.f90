!> How much of a strain may be rounding of the motion that made it.
!>
!> Displacements and rotations come rounded: in a rigid motion the strains they make are not zero but of the size of `epsilon` times
!> displacement over height of the element, or position over height where displacements are differences of positions. The floor
!> vanishes with the motion: it does not hide its small strains.
module finshell_strain_floor
   use finshell_kinds, only: wp
   implicit none
   private
   public :: strain_floor, rounding, rounding_of_solution

   real(wp), parameter :: rounding = 32*epsilon(1.0_wp)
   real(wp), parameter :: small_motion = 1.0e-6_wp !< below, displacements are taken to be better than differences of positions
   !> Changes of strain come from the solution of equations, which loses more digits.
   real(wp), parameter :: rounding_of_solution = 2.0_wp**16*epsilon(1.0_wp)

contains

   !> The floor from the strains that motion and position would be if nothing of them were rigid.
   pure elemental function strain_floor(motion, position) result(floor)
      real(wp), intent(in) :: motion, position
      real(wp) :: floor
      floor = rounding*(motion + position*min(1.0_wp, motion/small_motion))
   end function strain_floor
end module finshell_strain_floor
