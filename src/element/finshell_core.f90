!> The core element: stored energy as a function of twelve numbers, with its exact gradient and Hessian.
!>
!> Core variables, in this order: midsurface strain (E11, E22, 2 E12); covariant slopes G_11, G_12, G_21, G_22, G_31, G_32;
!> drilling angles tau_1..3. Strain at reference height Z: membrane(point) - lambda_Z Z sym grad G(point), formulation (S) or
!> (P) of the theory. In (S) the membrane strain is constant over the element, so its terms are formed once for the three points
!> together.
module finshell_core
   use finshell_kinds, only: wp, i4, lanes
   use finshell_bending, only: bending_t, new_bending
   use finshell_core_force, only: work_t, new_work, add_slope_force, add_stabilised_force, add_paper_force
   use finshell_core_derivatives, only: stress_t, strain_derivatives_t, strain_derivatives, strain_variation, predict
   use finshell_core_geometric, only: add_side_terms, stabilised_geometric, paper_geometric
   use finshell_core_hessian, only: bending_hessian, curvature_hessian, membrane_hessian, bow_hessian
   use finshell_core_strain, only: n_core, rows_9, drilling_stiffness, stabilised_strain, paper_strain
   use finshell_curved, only: curved_t, refer_to, refer_change_to, reference_curvature, from_curved
   use finshell_drilling, only: drilling_t, new_drilling
   use finshell_filter, only: filter_t
   use finshell_growth, only: free_over_reference
   use finshell_kink, only: kink_t, new_kink
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_point_states, only: point_states_t
   use finshell_own, only: own_t
   use finshell_reference, only: reference_t, drilling_weight, higher_order_strain
   use finshell_resultants, only: resultants_t, switches_t, integrate, midsurface_thickness, points_per_block
   use finshell_section, only: section_t, formulation_s
   use finshell_twist, only: twist_t, new_twist, twist_energy, add_twist_force, add_twist_hessian
   use finshell_voigt, only: row, column
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
      real(wp) :: force(points_per_block, 3), moment(points_per_block, 3) !< resultants on a curved reference
      type(resultants_t) :: resultants !< of the facet
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
   pure subroutine evaluate_core(section, own, level, ref, curved, filter, axes, heading, core, status, stress, variation, &
                                 predicted, recovers, states)
      type(section_t), intent(in) :: section
      type(own_t), intent(in) :: own
      integer, intent(in) :: level
      type(reference_t), intent(in) :: ref
      type(curved_t), intent(in) :: curved !< has no effect in (P)
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: axes(lanes, 2) !< cosine, sine of the material direction in the element frame
      type(heading_t), intent(in) :: heading !< looked at by sections with switches
      type(core_t), intent(inout) :: core
      integer(i4), intent(inout) :: status(lanes)
      type(stress_t), intent(in), optional :: stress
      real(wp), intent(in), optional :: variation(lanes, n_core)
      type(stress_t), intent(out), optional :: predicted
      logical, intent(in), optional :: recovers !< strains and resultants are all that is wanted
      type(point_states_t), intent(inout), optional :: states !< of laws with states
      type(switches_t) :: switches
      type(bending_t) :: bend
      type(drilling_t) :: drill
      real(wp) :: higher(lanes, 3, 3, 3), kh(lanes, 6), tau(lanes, 3), slope(lanes, 6)
      type(work_t) :: work
      type(strain_derivatives_t) :: derivatives
      real(wp) :: membrane(lanes, 3, 3), arc(lanes, rows_9, 3)
      real(wp) :: l(lanes), dl(lanes, 3), ddl(lanes, 6), weight(lanes), beta0(lanes), thickness(lanes), area(lanes)
      real(wp) :: point_axes(points_per_block, 2), bend_there(points_per_block, 3)
      real(wp) :: membrane_change(points_per_block, 3), curvature_change(points_per_block, 3)
      integer(i4) :: point_status(points_per_block)
      type(kink_t) :: kink
      type(twist_t) :: twist
      logical :: stabilised
      integer :: g, groups, i, j, k, v

      stabilised = section%formulation == formulation_s
      kink%any = stabilised .and. curved%any
      do k = 1, 3
         tau(:, k) = filter%theta(:, 3, k)
         slope(:, 2*k - 1) = filter%slope(:, 1, k)
         slope(:, 2*k) = filter%slope(:, 2, k)
      end do
      call new_bending(section, level, ref, filter%c, filter%jacobian, slope, bend)
      beta0 = section%beta0
      thickness = section%thickness
      if (own%sized) thickness = own%ratio*section%thickness
      if (.not. section%beta0 > 0) call drilling_weight(ref, thickness, beta0)
      call higher_order_strain(ref, higher)
      if (stabilised) then
         groups = 1
         if (kink%any) call new_kink(level, ref, filter, bend, curved%slope, kink)
         area = 1
         if (own%grown) area = free_over_reference(own, section%midsurface_layer)
         call new_drilling(level, ref, filter%c, filter%jacobian, tau, kink, area, drill)
         call stabilised_strain(filter%strain, bend, drill, membrane)
         call drilling_stiffness(section, own, ref, beta0, higher, axes, kh)
         if (kink%any) slope = slope - curved%slope
         call new_twist(section, own, ref, thickness, axes, slope, twist)
      else
         groups = 3
         do i = 1, 3
            do g = 1, 3
               do v = 1, 3
                  higher(:, v, i, g) = sqrt(beta0)*higher(:, v, i, g)
               end do
            end do
         end do
         call paper_strain(ref, filter, tau, bend, higher, membrane)
      end if

      ! resultants at the three points; a material limit is news only where the geometry is sound
      point_status = 0
      call midsurface_thickness(section, level, filter%strain, axes, l, dl, ddl, point_status(1:lanes), own)
      do g = 1, 3
         k = lanes*(g - 1)
         point_axes(k + 1:k + lanes, :) = axes
         do v = 1, 3
            core%membrane(k + 1:k + lanes, v) = membrane(:, v, min(g, groups))
            core%curvature(k + 1:k + lanes, v) = -l*bend%curvature(:, v, g)
         end do
      end do
      if (kink%any) call refer_to(curved, core%membrane, core%curvature)
      do k = 3*lanes + 1, points_per_block
         core%membrane(k, :) = core%membrane(1, :)
         core%curvature(k, :) = core%curvature(1, :)
         point_axes(k, :) = point_axes(1, :)
      end do
      if (level >= level_tangent) &
         call strain_derivatives(stabilised, ref, filter, tau, bend, drill, higher, l, dl, derivatives, kink)
      if (section%switched) then
         switches%directed = heading%directed
         if (heading%directed) then
            call strain_variation(derivatives, heading%variation, switches%membrane, switches%curvature)
            if (kink%any) call refer_change_to(curved, switches%membrane, switches%curvature)
         end if
         switches%floor = heading%floor(1)
         if (heading%directed) switches%rate_floor = heading%rate_floor(1)
         do k = 0, 2*lanes, lanes
            switches%floor(k + 1:k + lanes) = heading%floor
            if (heading%directed) switches%rate_floor(k + 1:k + lanes) = heading%rate_floor
         end do
      end if
      if (kink%any .and. own%grown) then
         call reference_curvature(curved, bend_there)
         call integrate(section, level, core%membrane, core%curvature, point_axes, core%resultants, point_status, switches, own, &
                        bend_there, states)
      else
         call integrate(section, level, core%membrane, core%curvature, point_axes, core%resultants, point_status, switches, own, &
                        states=states)
      end if
      if (kink%any) then
         core%force = core%resultants%n
         core%moment = core%resultants%m
         call from_curved(level, curved, core%resultants)
      end if
      where (status == 0) status = max(point_status(1:lanes), point_status(lanes + 1:2*lanes), &
                                       point_status(2*lanes + 1:3*lanes))
      core%stretch = l
      weight = ref%area/3
      associate (w => core%resultants%energy)
         core%energy = weight*(w(1:lanes) + w(lanes + 1:2*lanes) + w(2*lanes + 1:3*lanes))
      end associate
      if (stabilised) then
         core%energy = core%energy + 0.5_wp*(kh(:, 1)*tau(:, 1)**2 + kh(:, 2)*tau(:, 2)**2 + kh(:, 3)*tau(:, 3)**2) &
            + kh(:, 4)*tau(:, 1)*tau(:, 2) + kh(:, 5)*tau(:, 1)*tau(:, 3) + kh(:, 6)*tau(:, 2)*tau(:, 3)
         if (twist%any) call twist_energy(twist, core%energy)
      end if
      if (level < level_force) return
      if (present(recovers)) return

      if (present(variation) .and. present(predicted)) then
         call strain_variation(derivatives, variation, membrane_change, curvature_change)
         call predict(core%resultants, membrane_change, curvature_change, predicted)
         return
      end if

      call gradient_of(core%resultants, work, core%gradient)
      if (level < level_tangent) return

      core%geometric_gradient = core%gradient
      if (present(stress)) then
         core%resultants%n = stress%n
         core%resultants%m = stress%m
         call gradient_of(core%resultants, work, core%geometric_gradient)
      end if
      call bending_hessian(weight, core%resultants, work, derivatives, core%hessian)
      call curvature_hessian(ref, bend, work, l, dl, ddl, derivatives, arc, core%hessian)
      call membrane_hessian(weight, core%resultants, derivatives, arc, kink%any, core%hessian)
      call add_side_terms(ref, bend, work%beta, core%hessian)
      if (stabilised) then
         call bow_hessian(ref, work, core%hessian)
         do k = 1, 6
            i = 9 + row(k)
            j = 9 + column(k)
            core%hessian(:, i, j) = core%hessian(:, i, j) + kh(:, k)
         end do
         if (twist%any) call add_twist_hessian(twist, 3, core%hessian)
         call stabilised_geometric(ref, filter, bend, drill, work, core%hessian, kink)
      else
         call paper_geometric(ref, filter, tau, higher, work, core%hessian)
      end if
      call mirror(core%hessian)

   contains

      pure subroutine gradient_of(resultants, work, gradient)
         type(resultants_t), intent(in) :: resultants
         type(work_t), intent(inout) :: work !< also what the second derivatives need
         real(wp), intent(out) :: gradient(lanes, n_core)
         call new_work(stabilised, ref, weight, resultants, bend, l, work)
         gradient = 0
         call add_slope_force(stabilised, ref, bend, l, dl, work, gradient)
         if (stabilised) then
            call add_stabilised_force(drill, kh, tau, work, gradient, kink)
            if (twist%any) call add_twist_force(twist, gradient(:, 4:9))
         else
            call add_paper_force(ref, filter, tau, higher, work, gradient)
         end if
      end subroutine gradient_of
   end subroutine evaluate_core

   !> The lower triangle from the upper, by tiles of three rows and columns: the compiler unrolls them.
   pure subroutine mirror(hessian)
      real(wp), intent(inout) :: hessian(lanes, n_core, n_core)
      integer :: c, d, i, j
      do j = 0, n_core - 3, 3
         do i = 0, j - 3, 3
            do d = 1, 3
               do c = 1, 3
                  hessian(:, j + c, i + d) = hessian(:, i + d, j + c)
               end do
            end do
         end do
         do d = 1, 3
            do c = d + 1, 3
               hessian(:, j + c, j + d) = hessian(:, j + d, j + c)
            end do
         end do
      end do
   end subroutine mirror
end module finshell_core
