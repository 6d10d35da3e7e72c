!> The relaxed energy of a sheet that has no stiffness in bending: the least energy of E + Q over all Q >= 0 (Pipkin 1986,
!> Steigmann 1990; C + P with P = 2 Q). Compression does not occur, it is escaped by wrinkles finer than the mesh.
!>
!> Slack: no principal strain is positive; Q = -E, no stress. Taut: the stress of E itself has no negative principal value; Q = 0.
!> Wrinkled: Q = a n (x) n (finshell_wrinkle), the stress is a tension along the ridges. All natural states of the laws are C = I.
!> By the envelope theorem the stress is that at E + Q; in axes t, n the tangent is the law's, condensed by S n = 0 first for a,
!> then for the direction: with D' = D - D_n D_n/D_nn and h = S_tt + 2 a D'_gg
!>
!>     tt: D'_tt - 2 a D'_tg^2/h,   tg: D'_tg S_tt/h,   gg: D'_gg S_tt/h,   the others 0
!>
!> which divides by no difference of stretches.
module finshell_tension_field
   use finshell_kinds, only: wp, i4, lanes
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_membrane_section, only: integrate_membrane, membrane_force_t, membrane_switches_t
   use finshell_section, only: section_t
   use finshell_slack, only: add_slack
   use finshell_status, only: status_material_limit, status_not_converged, status_ok
   use finshell_voigt, only: rotate_strain
   use finshell_wrinkle, only: find_wrinkles, wrinkle_t
   implicit none
   private
   public :: tension_field_t, relax, state_slack, state_wrinkled, state_taut

   integer, parameter :: state_slack = 0, state_wrinkled = 1, state_taut = 2

   !> Extension below this part of the contraction, and compression below this part of the tension, are rounding.
   real(wp), parameter :: rounding = 16*epsilon(1.0_wp)

   !> Axes are turned into those of the ridges where the sheet is wrinkled.
   type :: tension_field_t
      integer :: state(lanes)
      real(wp) :: axes(lanes, 2) !< cosine, sine of the angle to axis 1 of what follows; 1, 0 unless wrinkled
      type(membrane_force_t) :: force !< with what slack sheets bear
      real(wp) :: tension(lanes, 3) !< membrane force without that: no compression
      real(wp) :: slack_energy(lanes) !< of that, per reference area; part of the energy
      real(wp) :: strain(lanes, 3) !< of the ironed material
   end type tension_field_t

contains

   !> Relaxed resultants of a block of elements.
   pure subroutine relax(section, level, strain, axes, switches, field, status)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level !< level_energy, level_force or level_tangent
      real(wp), intent(in) :: strain(lanes, 3)
      real(wp), intent(in) :: axes(lanes, 2) !< material direction in the axes of the strain
      !> Strains below its floor are none, and the sheet is taut then: at rest it has the stiffness of the material.
      type(membrane_switches_t), intent(in) :: switches
      type(tension_field_t), intent(out) :: field
      !> status_material_limit where the law ends, status_not_converged where wrinkles have not been found for another reason.
      integer(i4), intent(inout) :: status(lanes)
      type(wrinkle_t) :: wrinkle
      real(wp) :: e(lanes, 3), mean, radius
      integer(i4) :: refused(lanes)
      logical, dimension(lanes) :: wrinkled, evaluated, at_rest
      integer :: l

      e = strain
      do l = 1, lanes
         field%state(l) = state_taut
         at_rest(l) = max(abs(e(l, 1)), abs(e(l, 2)), abs(e(l, 3))) <= switches%floor(l)
         if (at_rest(l)) cycle
         mean = 0.5_wp*(e(l, 1) + e(l, 2))
         radius = hypot(0.5_wp*(e(l, 1) - e(l, 2)), 0.5_wp*e(l, 3))
         if (mean + radius <= rounding*max(radius, -mean)) then
            field%state(l) = state_slack
            e(l, :) = 0
         end if
      end do
      refused = status_ok
      call integrate_membrane(section, merge(max(level, level_force), level_tangent, section%isotropic), e, axes, field%force, &
                              refused, switches)
      evaluated = refused == status_ok
      do l = 1, lanes
         if (field%state(l) == state_slack) then
            field%force%energy(l) = 0
            field%force%n(l, :) = 0
            field%force%a(l, :) = 0
            cycle
         end if
         if (at_rest(l)) cycle
         mean = 0.5_wp*(field%force%n(l, 1) + field%force%n(l, 2))
         radius = hypot(0.5_wp*(field%force%n(l, 1) - field%force%n(l, 2)), field%force%n(l, 3))
         if (.not. (evaluated(l) .and. mean - radius >= -rounding*(mean + radius))) field%state(l) = state_wrinkled
      end do
      field%axes(:, 1) = 1
      field%axes(:, 2) = 0
      field%strain = e
      wrinkled = field%state == state_wrinkled .and. status == status_ok
      if (any(wrinkled)) then
         call find_wrinkles(section, e, axes, wrinkled, field%force, evaluated, wrinkle)
         do l = 1, lanes
            if (.not. wrinkled(l)) cycle
            if (.not. wrinkle%found(l)) then
               status(l) = merge(status_not_converged, status_material_limit, evaluated(l) .and. .not. wrinkle%refused(l))
               cycle
            end if
            field%axes(l, :) = wrinkle%ridge(l, :)
            field%strain(l, :) = wrinkle%strain(l, :)
            field%force%energy(l) = wrinkle%force%energy(l)
            field%force%n(l, :) = [max(wrinkle%force%n(l, 1), 0.0_wp), 0.0_wp, 0.0_wp]
            if (level >= level_tangent) field%force%a(l, :) = condensed(wrinkle%force%a(l, :), field%force%n(l, 1), &
                                                                        wrinkle%amplitude(l))
         end do
      end if
      field%tension = field%force%n
      call rotate_strain(lanes, field%axes, strain, e)
      do l = 1, lanes
         if (at_rest(l)) e(l, :) = 0
      end do
      call add_slack(section%slack*section%natural_stiffness, level, e, field%force, field%slack_energy)
   end subroutine relax

   !> Tangent of a wrinkled sheet from that of its material, in the axes of the ridges.
   pure function condensed(d, tension, amplitude) result(c)
      real(wp), intent(in) :: d(6), tension, amplitude
      real(wp) :: c(6)
      real(wp) :: tt, tg, gg, h
      tt = d(1) - d(4)*(d(4)/d(2))
      tg = d(5) - d(4)*(d(6)/d(2))
      gg = d(3) - d(6)*(d(6)/d(2))
      h = max(tension + 2*amplitude*gg, tiny(1.0_wp))
      c = 0
      c(1) = tt - 2*amplitude*tg*(tg/h)
      c(5) = tg*(tension/h)
      c(3) = gg*(tension/h)
   end function condensed
end module finshell_tension_field
