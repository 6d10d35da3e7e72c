!> What is left of a sheet's stiffness against compression: k/2 times the sum of the squares of the negative principal strains.
!>
!> Added in every state of a sheet that wrinkles, so that nothing jumps where it becomes slack, wrinkled or taut; strains are not
!> below -1/2, so it never exceeds k/8 per principal direction. Its second derivative is that of a spectral function:
!> k n (x) n (x) n (x) n and a shear term with (S1 - S2)/(E1 - E2), where the difference is that of strains of opposite sign.
module finshell_slack
   use finshell_kinds, only: wp, lanes
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_membrane_section, only: membrane_force_t
   implicit none
   private
   public :: add_slack

contains

   !> Add the residual to the resultants.
   pure subroutine add_slack(k, level, strain, r, energy)
      real(wp), intent(in) :: k !< stiffness, force per length
      integer, intent(in) :: level
      real(wp), intent(in) :: strain(lanes, 3) !< in the axes of the resultants
      type(membrane_force_t), intent(inout) :: r
      real(wp), intent(out) :: energy(lanes) !< the residual alone, per reference area
      real(wp) :: e1, e2, mean, half, radius, inverse, p(3), q(3), c
      integer :: l
      do l = 1, lanes
         mean = 0.5_wp*(strain(l, 1) + strain(l, 2))
         half = 0.5_wp*(strain(l, 1) - strain(l, 2))
         radius = hypot(half, 0.5_wp*strain(l, 3))
         e1 = mean + radius
         e2 = mean - radius
         energy(l) = 0
         if (.not. e2 < 0) cycle
         if (e1 <= 0) then
            energy(l) = 0.5_wp*k*(strain(l, 1)**2 + strain(l, 2)**2 + 0.5_wp*strain(l, 3)**2)
            r%energy(l) = r%energy(l) + energy(l)
            if (level < level_force) cycle
            r%n(l, :) = r%n(l, :) + k*[strain(l, 1), strain(l, 2), 0.5_wp*strain(l, 3)]
            if (level < level_tangent) cycle
            r%a(l, 1:3) = r%a(l, 1:3) + k*[1.0_wp, 1.0_wp, 0.5_wp]
            cycle
         end if
         energy(l) = 0.5_wp*k*e2**2
         r%energy(l) = r%energy(l) + energy(l)
         if (level < level_force) cycle
         inverse = 1/radius
         ! n (x) n and n (x) t + t (x) n of the compressed direction n
         p = 0.5_wp*[1 - half*inverse, 1 + half*inverse, -0.5_wp*strain(l, 3)*inverse]
         r%n(l, :) = r%n(l, :) + k*e2*p
         if (level < level_tangent) cycle
         q = [0.5_wp*strain(l, 3), -0.5_wp*strain(l, 3), -half]*inverse
         c = -k*e2*0.25_wp*inverse
         r%a(l, 1:3) = r%a(l, 1:3) + k*p*p + c*q*q
         r%a(l, 4) = r%a(l, 4) + k*p(1)*p(2) + c*q(1)*q(2)
         r%a(l, 5) = r%a(l, 5) + k*p(1)*p(3) + c*q(1)*q(3)
         r%a(l, 6) = r%a(l, 6) + k*p(2)*p(3) + c*q(2)*q(3)
      end do
   end subroutine add_slack
end module finshell_slack
