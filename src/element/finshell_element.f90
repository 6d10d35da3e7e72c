!> The element on one screen: reference geometry, polar filter, core, lift.
!>
!> A block of `lanes` elements is evaluated at once; state in, state out, no history. Element numbers, threads and error
!> lists belong to finshell_batch.
module finshell_element
   use finshell_kinds, only: wp, i4, lanes
   use finshell_core, only: core_t, evaluate_core
   use finshell_filter, only: filter_t, new_filter
   use finshell_lift, only: lift
   use finshell_material, only: level_force, level_tangent
   use finshell_reference, only: reference_t, new_reference
   use finshell_quaternion, only: rotation_vector_to_quaternion
   use finshell_rotation, only: tangent_operator, tangent_transpose_derivative
   use finshell_section, only: section_t
   use finshell_status, only: status_invalid_argument
   implicit none
   private
   public :: evaluate_block, material_direction, rotation_vector, rotation_quaternion

   !> How nodal rotations are given, and what force and tangent refer to.
   !> rotation_vector: total rotation vectors (3 numbers), exact Hessian. rotation_quaternion: unit quaternions (4 numbers, scalar
   !> first), spins.
   integer, parameter :: rotation_vector = 1, rotation_quaternion = 2

contains

   !> Energy, force and tangent of a block of elements.
   pure subroutine evaluate_block(section, level, nodes, displacement, rotation, convention, direction, energy, force, tangent, &
                                  status)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level !< level_energy, level_force or level_tangent
      real(wp), intent(in) :: nodes(lanes, 3, 3), displacement(lanes, 3, 3) !< (element, component, node)
      real(wp), intent(in) :: rotation(lanes, 4, 3) !< quaternion, or rotation vector in the first three components
      integer, intent(in) :: convention !< rotation_vector or rotation_quaternion
      real(wp), intent(in) :: direction(lanes, 3) !< material direction 1, global; used when the section is not isotropic
      real(wp), intent(inout) :: energy(lanes), force(lanes, 18)
      real(wp), intent(inout) :: tangent(lanes, 18, 18) !< upper triangle
      integer(i4), intent(out) :: status(lanes)
      type(reference_t) :: ref
      type(filter_t) :: filter
      type(core_t) :: core
      real(wp) :: quaternion(lanes, 4, 3), node_frame(lanes, 3, 3, 3), moment(lanes, 3, 3), axes(lanes, 2)
      integer :: i, l

      status = 0
      call new_reference(nodes, ref, status)
      if (convention == rotation_vector) then
         do i = 1, 3
            do l = 1, lanes
               quaternion(l, :, i) = rotation_vector_to_quaternion(rotation(l, 1:3, i))
            end do
         end do
      else
         quaternion = rotation
      end if
      call new_filter(ref, displacement, quaternion, filter, status)
      call material_direction(section, ref, direction, axes, status)
      call evaluate_core(section, level, ref, filter, axes, core, status)
      energy = core%energy
      if (level < level_force) return

      if (convention == rotation_vector) then
         do i = 1, 3
            do l = 1, lanes
               node_frame(l, :, :, i) = matmul(transpose(tangent_operator(rotation(l, 1:3, i))), filter%rotation(l, :, :))
            end do
         end do
      else
         do i = 1, 3
            node_frame(:, :, :, i) = filter%rotation
         end do
      end if
      call lift(level, ref, filter, core, node_frame, force, moment, tangent)
      if (level == level_tangent .and. convention == rotation_vector) call add_vector_curvature(rotation, moment, tangent)
   end subroutine evaluate_block

   !> Second derivative of the spin with respect to total rotation vectors: symmetric part of d(T' m)/dtheta.
   pure subroutine add_vector_curvature(rotation, moment, tangent)
      real(wp), intent(in) :: rotation(lanes, 4, 3), moment(lanes, 3, 3)
      real(wp), intent(inout) :: tangent(lanes, 18, 18)
      real(wp) :: d(3, 3)
      integer :: c, i, l, o, r
      do i = 1, 3
         o = 6*i - 3
         do l = 1, lanes
            d = tangent_transpose_derivative(rotation(l, 1:3, i), moment(l, :, i))
            do c = 1, 3
               do r = 1, c
                  tangent(l, o + r, o + c) = tangent(l, o + r, o + c) + 0.5_wp*(d(r, c) + d(c, r))
               end do
            end do
         end do
      end do
   end subroutine add_vector_curvature

   !> Cosine and sine of the material direction projected on the element; (1, 0) when no layer depends on it.
   pure subroutine material_direction(section, ref, direction, axes, status)
      type(section_t), intent(in) :: section
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: direction(lanes, 3)
      real(wp), intent(out) :: axes(lanes, 2)
      integer(i4), intent(inout) :: status(lanes)
      real(wp), dimension(lanes) :: length, full
      integer :: i
      axes(:, 1) = 1
      axes(:, 2) = 0
      if (section%isotropic) return
      do i = 1, 2
         axes(:, i) = direction(:, 1)*ref%frame(:, 1, i) + direction(:, 2)*ref%frame(:, 2, i) + direction(:, 3)*ref%frame(:, 3, i)
      end do
      length = sqrt(axes(:, 1)**2 + axes(:, 2)**2)
      full = sqrt(direction(:, 1)**2 + direction(:, 2)**2 + direction(:, 3)**2)
      where (.not. length > sqrt(epsilon(1.0_wp))*full) status = status_invalid_argument
      axes(:, 1) = axes(:, 1)/length
      axes(:, 2) = axes(:, 2)/length
   end subroutine material_direction
end module finshell_element
