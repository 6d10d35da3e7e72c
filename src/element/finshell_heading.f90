!> Where a block of elements is about to move, and how much of its strains may be rounding: for laws with switches only.
!>
!> What counts as rounding of strains: finshell_strain_floor. Below it a fibre counts as unstretched.
module finshell_heading
   use finshell_kinds, only: wp, lanes
   use finshell_freedoms, only: n_nodal, n_shell, uz
   use finshell_core, only: heading_t
   use finshell_curved, only: curved_t
   use finshell_filter, only: filter_t
   use finshell_lift, only: core_variation
   use finshell_own, only: own_t
   use finshell_reference, only: reference_t
   use finshell_section, only: section_t
   use finshell_strain_floor, only: rounding, rounding_of_solution, strain_floor
   implicit none
   private
   public :: new_heading, set_direction

contains

   !> A heading that knows the floor, and no direction.
   pure subroutine new_heading(section, own, ref, curved, nodes, displacement, quaternion, heading)
      type(section_t), intent(in) :: section
      type(own_t), intent(in) :: own
      type(reference_t), intent(in) :: ref
      type(curved_t), intent(in) :: curved
      real(wp), intent(in) :: nodes(lanes, 3, 3), displacement(lanes, 3, 3), quaternion(lanes, 4, 3)
      type(heading_t), intent(out) :: heading
      real(wp), dimension(lanes) :: largest, turn, position, motion
      integer :: i, k
      position = 0
      largest = 0
      turn = 0
      do k = 1, 3
         do i = 1, 3
            position = max(position, abs(nodes(:, i, k)))
            largest = max(largest, abs(displacement(:, i, k)))
            turn = max(turn, abs(quaternion(:, i + 1, k)))
         end do
         turn = max(turn, abs(quaternion(:, 1, k) - 1))
      end do
      motion = level(section, own, ref, largest, turn)
      heading%floor = strain_floor(motion, level(section, own, ref, position, 0*turn))
      ! strains from a curved reference are differences of strains from the facet
      if (curved%any) heading%floor = heading%floor + rounding*level(section, own, ref, 0*turn, maxval(abs(curved%slope), 2))
   end subroutine new_heading

   !> Let it head for a motion.
   pure subroutine set_direction(section, own, ref, filter, motion, heading)
      type(section_t), intent(in) :: section
      type(own_t), intent(in) :: own
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: motion(lanes, n_shell) !< displacements and spins, u1 t1 u2 t2 u3 t3
      type(heading_t), intent(inout) :: heading
      real(wp), dimension(lanes) :: largest, turn
      integer :: i, k
      largest = 0
      turn = 0
      do k = 0, n_shell - n_nodal, n_nodal
         do i = 1, uz
            largest = max(largest, abs(motion(:, k + i)))
            turn = max(turn, abs(motion(:, k + uz + i)))
         end do
      end do
      heading%directed = .true.
      heading%rate_floor = rounding_of_solution*level(section, own, ref, largest, turn)
      call core_variation(ref, filter, motion, heading%variation)
   end subroutine set_direction

   !> Size of the strains that a motion would make if nothing of it were rigid.
   pure function level(section, own, ref, displacement, turn) result(strain)
      type(section_t), intent(in) :: section
      type(own_t), intent(in) :: own
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: displacement(lanes), turn(lanes)
      real(wp) :: strain(lanes)
      real(wp) :: inverse(lanes) ! of the least height
      real(wp) :: half(lanes), off(lanes)
      integer :: k
      inverse = 0
      do k = 1, 3
         inverse = max(inverse, abs(ref%gradient(:, 1, k)) + abs(ref%gradient(:, 2, k)))
      end do
      half = 0.5_wp*section%thickness
      off = section%offset
      if (own%sized) then
         half = own%ratio*half
         off = own%ratio*off + own%shift
      end if
      strain = (displacement*inverse + turn)*(1 + (half + abs(off))*inverse)
   end function level
end module finshell_heading
