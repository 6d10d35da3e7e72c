!> Stiffness against the curl of the slope field, in elements that are smaller than half of the thickness.
!>
!> A sheet of rubber that is stretched both ways (Mooney-Rivlin with c01 > 0) loses its stiffness against twist, curvatures of
!> opposite sign: W_2 falls along E_11 = -E_22. What holds it is that det grad G of a field of slopes is the same for all
!> deflections with the same edges. The slopes of DKT are continuous, but no gradient: det sym grad G = det grad G - 1/4 (curl G)^2,
!> and the curl has negative stiffness. The membrane force outweighs it as long as the elements are not small: flat disks stretched
!> to 1.8 to 2.5 become unstable from h/l = 16 on, l the side. So K_t = int 1/4 mu_0 h^2/12 c' c dV with c the curl in the
!> reference, C = I, is added there. It vanishes for constant curvature: what is added to a bent sheet goes with l^2.
module finshell_twist
   use finshell_kinds, only: wp, lanes
   use finshell_own, only: own_t
   use finshell_reference, only: reference_t, side_from, side_to
   use finshell_resultants, only: reference_membrane_tangent
   use finshell_section, only: section_t
   implicit none
   private
   public :: twist_t, new_twist, twist_energy, add_twist_force, add_twist_hessian

   type :: twist_t
      logical :: any = .false. !< an element of the block is that thick; else the rest is not set
      real(wp) :: stiffness(lanes, 6, 6) !< on the nodal slopes
      real(wp) :: slope(lanes, 6) !< nodal slopes, from those of a curved reference on
   end type twist_t

   !> Part of the shear modulus at rest. Mooney-Rivlin with c10 = 0 needs 0.21 at a stretch of 1.31, c10 = 4 c01 0.03; the membrane
   !> force, which helps, left out.
   real(wp), parameter :: part = 0.25_wp
   real(wp), parameter :: from_ratio = 2, to_ratio = 4 !< thickness over longest side: none up to the first, all from the second on

contains

   !> Constant stiffness of a block of elements.
   pure subroutine new_twist(section, own, ref, thickness, axes, slope, twist)
      type(section_t), intent(in) :: section
      type(own_t), intent(in) :: own
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: thickness(lanes)
      real(wp), intent(in) :: axes(lanes, 2) !< cosine, sine of the material direction in the element frame
      real(wp), intent(in) :: slope(lanes, 6)
      type(twist_t), intent(inout) :: twist
      real(wp) :: weight(lanes), c(lanes, 6), curl(lanes, 6, 3), side(lanes)
      integer :: a, i, j, k, point

      weight = thickness/sqrt(max(ref%side2(:, 1), ref%side2(:, 2), ref%side2(:, 3)))
      weight = min(max((weight - from_ratio)/(to_ratio - from_ratio), 0.0_wp), 1.0_wp)
      twist%any = any(weight > 0)
      if (.not. twist%any) return
      twist%slope = slope
      call reference_membrane_tangent(section, axes, c, own)
      weight = weight*(part*thickness**2/12)*c(:, 3)*(ref%area/3)
      do point = 1, 3
         do i = 1, 3
            curl(:, 2*i - 1, point) = ref%gradient(:, 2, i)
            curl(:, 2*i, point) = -ref%gradient(:, 1, i)
         end do
         do k = 1, 3
            side = (-0.75_wp)*(ref%side(:, 1, k)*ref%bubble(:, 2, k, point) - ref%side(:, 2, k)*ref%bubble(:, 1, k, point)) &
                   /ref%side2(:, k)
            do a = 1, 2
               i = 2*(side_from(k) - 1) + a
               j = 2*(side_to(k) - 1) + a
               curl(:, i, point) = curl(:, i, point) + side*ref%side(:, a, k)
               curl(:, j, point) = curl(:, j, point) + side*ref%side(:, a, k)
            end do
         end do
      end do
      do j = 1, 6
         do i = 1, 6
            twist%stiffness(:, i, j) = weight*(curl(:, i, 1)*curl(:, j, 1) + curl(:, i, 2)*curl(:, j, 2) &
                                               + curl(:, i, 3)*curl(:, j, 3))
         end do
      end do
   end subroutine new_twist

   pure subroutine twist_energy(twist, energy)
      type(twist_t), intent(in) :: twist
      real(wp), intent(inout) :: energy(lanes)
      integer :: i, j
      do j = 1, 6
         do i = 1, 6
            energy = energy + 0.5_wp*twist%slope(:, i)*twist%stiffness(:, i, j)*twist%slope(:, j)
         end do
      end do
   end subroutine twist_energy

   !> To the gradient with respect to the nodal slopes.
   pure subroutine add_twist_force(twist, gradient)
      type(twist_t), intent(in) :: twist
      real(wp), intent(inout) :: gradient(lanes, 6)
      integer :: i, j
      do j = 1, 6
         do i = 1, 6
            gradient(:, i) = gradient(:, i) + twist%stiffness(:, i, j)*twist%slope(:, j)
         end do
      end do
   end subroutine add_twist_force

   !> To the Hessian with respect to the nodal slopes, which begin behind row `before`; its upper triangle alone is there.
   pure subroutine add_twist_hessian(twist, before, hessian)
      type(twist_t), intent(in) :: twist
      integer, intent(in) :: before
      real(wp), intent(inout) :: hessian(:, :, :) !< (lanes, n, n)
      integer :: i, j
      do j = 1, 6
         do i = 1, j
            hessian(:, before + i, before + j) = hessian(:, before + i, before + j) + twist%stiffness(:, i, j)
         end do
      end do
   end subroutine add_twist_hessian
end module finshell_twist
