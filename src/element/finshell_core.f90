!> The core element: stored energy as a function of twelve numbers, with its exact gradient and Hessian.
!>
!> Core variables, in this order: midsurface strain (E11, E22, 2 E12); drilling angles tau_1..3; covariant slopes G_11, G_12,
!> G_21, G_22, G_31, G_32. Strain at reference height Z: membrane(point) - lambda_Z Z sym grad G(point), formulation (S) or
!> (P) of the theory. In (S) the membrane strain is constant over the element, so its terms are formed once for the three points
!> together.
module finshell_core
   use finshell_kinds, only: wp, i4, lanes
   use finshell_bending, only: bending_t, new_bending
   use finshell_core_derivatives, only: stress_t, core_gradient, strain_variation, predict, core_material_hessian, &
      stabilised_geometric, paper_geometric, von_karman_geometric, add_side_terms
   use finshell_core_strain, only: n_core, row, column, drilling_stiffness, add_drilling_force, stabilised_strain, paper_strain
   use finshell_drilling, only: drilling_t, new_drilling
   use finshell_filter, only: filter_t
   use finshell_material, only: level_force, level_tangent
   use finshell_reference, only: reference_t, higher_order_strain
   use finshell_section, only: section_t, resultants_t, switches_t, integrate, midsurface_thickness, formulation_s, points_per_block
   implicit none
   private
   public :: core_t, stress_t, heading_t, evaluate_core, n_core

   type :: core_t
      real(wp) :: energy(lanes)
      real(wp) :: gradient(lanes, n_core)
      real(wp) :: hessian(lanes, n_core, n_core)
      ! kept for recovery; point by point
      real(wp) :: membrane(points_per_block, 3), curvature(points_per_block, 3)
      real(wp) :: stretch(lanes) !< thickness stretch of the midsurface
      type(resultants_t) :: resultants
      !> Gradient for the geometric part of the tangent: `gradient`, unless that part has resultants of its own.
      real(wp) :: geometric_gradient(lanes, n_core)
   end type core_t

   !> For laws with switches (finshell_material): how much of the strains may be rounding, and where the element is about to move.
   type :: heading_t
      real(wp) :: floor(lanes) !< strain that rounding of the motion alone can make
      logical :: directed = .false. !< false: it does not move, the rest is not looked at
      real(wp) :: variation(lanes, n_core) !< of the core variables
      real(wp) :: rate_floor(lanes) !< what of the change of strain rounding alone can make
   end type heading_t

contains

   !> Energy, gradient and Hessian of a block of elements.
   !>
   !> Mixed-integration-point Newton (Magisano, Leonetti & Garcea 2017): with `stress`, the geometric part of the Hessian uses
   !> these resultants instead of its own. With `variation` of the core variables, the resultants linearised at this state are
   !> returned as `predicted`, and no Hessian; both need level_tangent, as does a directed `heading`.
   pure subroutine evaluate_core(section, level, ref, filter, axes, heading, core, status, stress, variation, predicted)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: axes(lanes, 2) !< cosine, sine of the material direction in the element frame
      type(heading_t), intent(in) :: heading !< looked at by sections with switches
      type(core_t), intent(inout) :: core
      integer(i4), intent(inout) :: status(lanes)
      type(stress_t), intent(in), optional :: stress
      real(wp), intent(in), optional :: variation(lanes, n_core)
      type(stress_t), intent(out), optional :: predicted
      type(switches_t) :: switches
      type(bending_t) :: bend
      type(drilling_t) :: drill
      real(wp) :: higher(lanes, 3, 3, 3), kh(lanes, 6), tau(lanes, 3), slope(lanes, 6)
      real(wp) :: membrane(lanes, 3, 3), dm(lanes, 3, n_core, 3)
      real(wp) :: l(lanes), dl(lanes, 3), ddl(lanes, 6), weight(lanes), side(lanes, 3)
      real(wp) :: point_axes(points_per_block, 2)
      real(wp) :: membrane_change(points_per_block, 3), curvature_change(points_per_block, 3)
      integer(i4) :: point_status(points_per_block)
      integer :: g, groups, i, j, k, v

      do k = 1, 3
         tau(:, k) = filter%theta(:, 3, k)
         slope(:, 2*k - 1) = filter%slope(:, 1, k)
         slope(:, 2*k) = filter%slope(:, 2, k)
      end do
      call new_bending(level, ref, filter%c, slope, bend)
      call higher_order_strain(ref, section%beta0, higher)
      if (section%formulation == formulation_s) then
         groups = 1
         call new_drilling(level, ref, filter%c, filter%jacobian, tau, drill)
         call stabilised_strain(level, filter%strain, bend, drill, membrane, dm)
         call drilling_stiffness(section, ref, higher, axes, kh)
      else
         groups = 3
         call paper_strain(level, ref, filter, tau, bend, higher, membrane, dm)
      end if

      ! resultants at the three points; a material limit is news only where the geometry is sound
      point_status = 0
      call midsurface_thickness(section, level, filter%strain, axes, l, dl, ddl, point_status(1:lanes))
      do g = 1, 3
         k = lanes*(g - 1)
         point_axes(k + 1:k + lanes, :) = axes
         do v = 1, 3
            core%membrane(k + 1:k + lanes, v) = membrane(:, v, min(g, groups))
            core%curvature(k + 1:k + lanes, v) = -l*bend%curvature(:, v, g)
         end do
      end do
      if (section%switched) then
         switches%directed = heading%directed
         if (heading%directed) call strain_variation(groups, bend, dm, l, dl, heading%variation, switches%membrane, &
                                                     switches%curvature)
         do k = 0, 2*lanes, lanes
            switches%floor(k + 1:k + lanes) = heading%floor
            if (heading%directed) switches%rate_floor(k + 1:k + lanes) = heading%rate_floor
         end do
         call integrate(section, level, core%membrane, core%curvature, point_axes, core%resultants, point_status, switches)
      else
         call integrate(section, level, core%membrane, core%curvature, point_axes, core%resultants, point_status)
      end if
      where (status == 0) status = max(point_status(1:lanes), point_status(lanes + 1:2*lanes), &
                                       point_status(2*lanes + 1:3*lanes))
      core%stretch = l
      weight = ref%area/3
      associate (w => core%resultants%energy)
         core%energy = weight*(w(1:lanes) + w(lanes + 1:2*lanes) + w(2*lanes + 1:3*lanes))
      end associate
      if (groups == 1) then
         core%energy = core%energy + 0.5_wp*(kh(:, 1)*tau(:, 1)**2 + kh(:, 2)*tau(:, 2)**2 + kh(:, 3)*tau(:, 3)**2) &
            + kh(:, 4)*tau(:, 1)*tau(:, 2) + kh(:, 5)*tau(:, 1)*tau(:, 3) + kh(:, 6)*tau(:, 2)*tau(:, 3)
      end if
      if (level < level_force) return

      call core_gradient(groups, weight, core%resultants, bend, dm, l, dl, core%gradient)
      if (groups == 1) call add_drilling_force(kh, tau, core%gradient)
      if (level < level_tangent) return
      if (present(variation) .and. present(predicted)) then
         call strain_variation(groups, bend, dm, l, dl, variation, membrane_change, curvature_change)
         call predict(core%resultants, membrane_change, curvature_change, predicted)
         return
      end if

      if (present(stress)) then
         core%resultants%n = stress%n
         core%resultants%m = stress%m
         call core_gradient(groups, weight, core%resultants, bend, dm, l, dl, core%geometric_gradient)
         if (groups == 1) call add_drilling_force(kh, tau, core%geometric_gradient)
      else
         core%geometric_gradient = core%gradient
      end if
      call core_material_hessian(groups, weight, core%resultants, bend, dm, l, dl, ddl, core%hessian, side)
      if (groups == 1) then
         do k = 1, 6
            i = 3 + row(k)
            j = 3 + column(k)
            core%hessian(:, i, j) = core%hessian(:, i, j) + kh(:, k)
         end do
         call stabilised_geometric(ref, filter, drill, weight, core%resultants, core%hessian)
      else
         call paper_geometric(ref, filter, tau, higher, weight, core%resultants, core%hessian)
      end if
      call von_karman_geometric(groups, weight, core%resultants, bend, core%hessian, side)
      call add_side_terms(ref, bend, side, core%hessian)
      do j = 1, n_core
         do i = 1, j - 1
            core%hessian(:, j, i) = core%hessian(:, i, j)
         end do
      end do
   end subroutine evaluate_core

end module finshell_core
