!> The core element: stored energy as a function of twelve numbers, with its exact gradient and Hessian.
!>
!> Core variables, in this order: midsurface strain (E11, E22, 2 E12); drilling angles tau_1..3; covariant slopes G_11, G_12,
!> G_21, G_22, G_31, G_32. Strain at reference height Z: membrane(point) - lambda_Z Z sym grad G(point), formulation (S) or (P) of the
!> theory. In (S) the membrane strain is constant over the element, so its terms are formed once for the three points together.
module finshell_core
   use finshell_kinds, only: wp, i4, lanes
   use finshell_bending, only: bending_t, new_bending
   use finshell_drilling, only: drilling_t, new_drilling, add_drilling_hessian
   use finshell_filter, only: filter_t
   use finshell_material, only: level_force, level_tangent
   use finshell_reference, only: reference_t, higher_order_strain
   use finshell_section, only: section_t, resultants_t, integrate, midsurface_thickness, reference_membrane_tangent, &
      formulation_s, points_per_block
   implicit none
   private
   public :: core_t, stress_t, evaluate_core, n_core

   integer, parameter :: n_core = 12
   !> Packed symmetric 3x3: entry k is (row(k), column(k)).
   integer, parameter :: row(6) = [1, 2, 3, 1, 1, 2], column(6) = [1, 2, 3, 2, 3, 3]
   integer, parameter :: pack(3, 3) = reshape([1, 4, 5, 4, 2, 6, 5, 6, 3], [3, 3])

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

   !> Resultants at the points, kept by mixed-integration-point Newton from one iteration to the next.
   type :: stress_t
      real(wp) :: n(points_per_block, 3), m(points_per_block, 3)
   end type stress_t

contains

   !> Energy, gradient and Hessian of a block of elements.
   !>
   !> Mixed-integration-point Newton (Magisano, Leonetti & Garcea 2017): with `stress`, the geometric part of the Hessian uses
   !> these resultants instead of its own. With `variation` of the core variables, the resultants linearised at this state are
   !> returned as `predicted`, and no Hessian; both need level_tangent.
   pure subroutine evaluate_core(section, level, ref, filter, axes, core, status, stress, variation, predicted)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: axes(lanes, 2) !< cosine, sine of the material direction in the element frame
      type(core_t), intent(inout) :: core
      integer(i4), intent(inout) :: status(lanes)
      type(stress_t), intent(in), optional :: stress
      real(wp), intent(in), optional :: variation(lanes, n_core)
      type(stress_t), intent(out), optional :: predicted
      type(bending_t) :: bend
      type(drilling_t) :: drill
      real(wp) :: higher(lanes, 3, 3, 3), kh(lanes, 6), tau(lanes, 3), slope(lanes, 6)
      real(wp) :: membrane(lanes, 3, 3), dm(lanes, 3, n_core, 3)
      real(wp) :: l(lanes), dl(lanes, 3), ddl(lanes, 6), weight(lanes), side(lanes, 3)
      real(wp) :: point_axes(points_per_block, 2)
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
      call integrate(section, level, core%membrane, core%curvature, point_axes, core%resultants, point_status)
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
         call predict(groups, core%resultants, bend, dm, l, dl, variation, predicted)
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

   !> Drilling moments K_h tau.
   pure subroutine add_drilling_force(kh, tau, gradient)
      real(wp), intent(in) :: kh(lanes, 6), tau(lanes, 3)
      real(wp), intent(inout) :: gradient(lanes, n_core)
      integer :: i
      do i = 1, 3
         gradient(:, 3 + i) = gradient(:, 3 + i) + kh(:, pack(i, 1))*tau(:, 1) + kh(:, pack(i, 2))*tau(:, 2) &
            + kh(:, pack(i, 3))*tau(:, 3)
      end do
   end subroutine add_drilling_force

   !> Resultants, linearised: those of this state plus tangent times the strains of a variation of the core variables.
   pure subroutine predict(groups, r, bend, dm, l, dl, variation, predicted)
      integer, intent(in) :: groups
      type(resultants_t), intent(in) :: r
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: dm(lanes, 3, n_core, 3), l(lanes), dl(lanes, 3), variation(lanes, n_core)
      type(stress_t), intent(out) :: predicted
      real(wp) :: de(lanes, 3), dk(lanes, 3), stretch(lanes)
      integer :: g, i, k, v
      stretch = dl(:, 1)*variation(:, 1) + dl(:, 2)*variation(:, 2) + dl(:, 3)*variation(:, 3)
      do g = 1, 3
         if (g <= groups) then
            de = 0
            do i = 1, n_core
               do v = 1, 3
                  de(:, v) = de(:, v) + dm(:, v, i, g)*variation(:, i)
               end do
            end do
         end if
         do v = 1, 3
            dk(:, v) = -stretch*bend%curvature(:, v, g)
            do i = 1, 3
               dk(:, v) = dk(:, v) - l*bend%curvature_e(:, v, i, g)*variation(:, i)
            end do
            do i = 1, 6
               dk(:, v) = dk(:, v) - l*bend%curvature_g(:, v, i, g)*variation(:, 6 + i)
            end do
         end do
         k = lanes*(g - 1)
         do v = 1, 3
            predicted%n(k + 1:k + lanes, v) = r%n(k + 1:k + lanes, v)
            predicted%m(k + 1:k + lanes, v) = r%m(k + 1:k + lanes, v)
            do i = 1, 3
               predicted%n(k + 1:k + lanes, v) = predicted%n(k + 1:k + lanes, v) &
                  + r%a(k + 1:k + lanes, pack(v, i))*de(:, i) + r%b(k + 1:k + lanes, pack(v, i))*dk(:, i)
               predicted%m(k + 1:k + lanes, v) = predicted%m(k + 1:k + lanes, v) &
                  + r%b(k + 1:k + lanes, pack(v, i))*de(:, i) + r%d(k + 1:k + lanes, pack(v, i))*dk(:, i)
            end do
         end do
      end do
   end subroutine predict

   !> Constant drilling stiffness K_h = int B_h' C_0 B_h dV of formulation (S).
   pure subroutine drilling_stiffness(section, ref, higher, axes, kh)
      type(section_t), intent(in) :: section
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: higher(lanes, 3, 3, 3), axes(lanes, 2)
      real(wp), intent(out) :: kh(lanes, 6)
      real(wp) :: c(lanes, 6), t(lanes, 3)
      integer :: g, i, j, k, v
      call reference_membrane_tangent(section, axes, c)
      do v = 1, 6
         c(:, v) = c(:, v)*ref%area/3
      end do
      kh = 0
      do g = 1, 3
         do j = 1, 3
            do v = 1, 3
               t(:, v) = c(:, pack(v, 1))*higher(:, 1, j, g) + c(:, pack(v, 2))*higher(:, 2, j, g) &
                  + c(:, pack(v, 3))*higher(:, 3, j, g)
            end do
            do i = 1, j
               k = pack(i, j)
               kh(:, k) = kh(:, k) + higher(:, 1, i, g)*t(:, 1) + higher(:, 2, i, g)*t(:, 2) + higher(:, 3, i, g)*t(:, 3)
            end do
         end do
      end do
   end subroutine drilling_stiffness

   !> Membrane strain of (S), one for the whole element.
   pure subroutine stabilised_strain(level, strain, bend, drill, membrane, dm)
      integer, intent(in) :: level
      real(wp), intent(in) :: strain(lanes, 3)
      type(bending_t), intent(in) :: bend
      type(drilling_t), intent(in) :: drill
      real(wp), intent(inout) :: membrane(lanes, 3, 3), dm(lanes, 3, n_core, 3)
      integer :: i

      associate (s => bend%slope)
         membrane(:, 1, 1) = (s(:, 1, 1)**2 + s(:, 1, 2)**2 + s(:, 1, 3)**2)/6
         membrane(:, 2, 1) = (s(:, 2, 1)**2 + s(:, 2, 2)**2 + s(:, 2, 3)**2)/6
         membrane(:, 3, 1) = (s(:, 1, 1)*s(:, 2, 1) + s(:, 1, 2)*s(:, 2, 2) + s(:, 1, 3)*s(:, 2, 3))/3
      end associate
      membrane(:, :, 1) = strain + drill%strain + membrane(:, :, 1)
      if (level < level_force) return
      do i = 1, 3
         call mean_von_karman(bend%slope, bend%slope_e(:, :, :, i), dm(:, :, i, 1))
         dm(:, i, i, 1) = dm(:, i, i, 1) + 1
         dm(:, :, i, 1) = dm(:, :, i, 1) + drill%strain_e(:, :, i)
      end do
      dm(:, :, 4, 1) = drill%strain_a(:, :, 1)
      dm(:, :, 5, 1) = drill%strain_a(:, :, 2)
      dm(:, :, 6, 1) = -drill%strain_a(:, :, 1) - drill%strain_a(:, :, 2)
      do i = 1, 6
         call mean_von_karman(bend%slope, bend%slope_g(:, :, :, i), dm(:, :, 6 + i, 1))
      end do
   end subroutine stabilised_strain

   !> Derivative of 1/2 <G (x) G> for a change dG of the slopes at the points.
   pure subroutine mean_von_karman(s, ds, d)
      real(wp), intent(in) :: s(lanes, 2, 3), ds(lanes, 2, 3)
      real(wp), intent(out) :: d(lanes, 3)
      real(wp), parameter :: third = 1.0_wp/3
      d(:, 1) = third*(s(:, 1, 1)*ds(:, 1, 1) + s(:, 1, 2)*ds(:, 1, 2) + s(:, 1, 3)*ds(:, 1, 3))
      d(:, 2) = third*(s(:, 2, 1)*ds(:, 2, 1) + s(:, 2, 2)*ds(:, 2, 2) + s(:, 2, 3)*ds(:, 2, 3))
      d(:, 3) = third*(s(:, 1, 1)*ds(:, 2, 1) + s(:, 2, 1)*ds(:, 1, 1) + s(:, 1, 2)*ds(:, 2, 2) + s(:, 2, 2)*ds(:, 1, 2) &
                       + s(:, 1, 3)*ds(:, 2, 3) + s(:, 2, 3)*ds(:, 1, 3))
   end subroutine mean_von_karman

   !> Membrane strain of (P) at the three points: (C - I)/2 + J B tau + 1/2 G (x) G.
   pure subroutine paper_strain(level, ref, filter, tau, bend, higher, membrane, dm)
      integer, intent(in) :: level
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: tau(lanes, 3)
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: higher(lanes, 3, 3, 3)
      real(wp), intent(inout) :: membrane(lanes, 3, 3), dm(lanes, 3, n_core, 3)
      real(wp) :: b(lanes, 3, 3), dj(lanes, 3)
      integer :: g, i, v
      call jacobian_gradient(filter, dj)
      do g = 1, 3
         call total_drilling_matrix(ref, higher(:, :, :, g), b)
         associate (s => bend%slope(:, :, g))
            membrane(:, 1, g) = filter%strain(:, 1) + 0.5_wp*s(:, 1)**2
            membrane(:, 2, g) = filter%strain(:, 2) + 0.5_wp*s(:, 2)**2
            membrane(:, 3, g) = filter%strain(:, 3) + s(:, 1)*s(:, 2)
         end associate
         do v = 1, 3
            membrane(:, v, g) = membrane(:, v, g) &
               + filter%jacobian*(b(:, v, 1)*tau(:, 1) + b(:, v, 2)*tau(:, 2) + b(:, v, 3)*tau(:, 3))
         end do
         if (level < level_force) cycle
         do i = 1, 3
            call von_karman(bend%slope(:, :, g), bend%slope_e(:, :, g, i), dm(:, :, i, g))
            dm(:, i, i, g) = dm(:, i, i, g) + 1
            do v = 1, 3
               dm(:, v, i, g) = dm(:, v, i, g) &
                  + dj(:, i)*(b(:, v, 1)*tau(:, 1) + b(:, v, 2)*tau(:, 2) + b(:, v, 3)*tau(:, 3))
               dm(:, v, 3 + i, g) = filter%jacobian*b(:, v, i)
            end do
         end do
         do i = 1, 6
            call von_karman(bend%slope(:, :, g), bend%slope_g(:, :, g, i), dm(:, :, 6 + i, g))
         end do
      end do
   end subroutine paper_strain

   pure subroutine von_karman(s, ds, d)
      real(wp), intent(in) :: s(lanes, 2), ds(lanes, 2)
      real(wp), intent(out) :: d(lanes, 3)
      d(:, 1) = s(:, 1)*ds(:, 1)
      d(:, 2) = s(:, 2)*ds(:, 2)
      d(:, 3) = s(:, 1)*ds(:, 2) + s(:, 2)*ds(:, 1)
   end subroutine von_karman

   !> Basic plus higher-order drilling strain at a point.
   pure subroutine total_drilling_matrix(ref, higher, b)
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: higher(lanes, 3, 3)
      real(wp), intent(out) :: b(lanes, 3, 3)
      b(:, :, 1) = higher(:, :, 1) + ref%basic(:, :, 1)
      b(:, :, 2) = higher(:, :, 2) + ref%basic(:, :, 2)
      b(:, :, 3) = higher(:, :, 3) - ref%basic(:, :, 1) - ref%basic(:, :, 2)
   end subroutine total_drilling_matrix

   pure subroutine jacobian_gradient(filter, dj)
      type(filter_t), intent(in) :: filter
      real(wp), intent(out) :: dj(lanes, 3)
      dj(:, 1) = filter%c(:, 2)/filter%jacobian
      dj(:, 2) = filter%c(:, 1)/filter%jacobian
      dj(:, 3) = -filter%c(:, 3)/filter%jacobian
   end subroutine jacobian_gradient

   !> Work of the resultants on the first derivatives of the strains; the resultants are first weighted with the area.
   pure subroutine core_gradient(groups, weight, r, bend, dm, l, dl, gradient)
      integer, intent(in) :: groups
      real(wp), intent(in) :: weight(lanes)
      type(resultants_t), intent(in) :: r
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: dm(lanes, 3, n_core, 3), l(lanes), dl(lanes, 3)
      real(wp), intent(out) :: gradient(lanes, n_core)
      real(wp) :: n(lanes, 3), moment(lanes, 3), work(lanes)
      integer :: g, i, k, v

      gradient = 0
      do g = 1, groups
         call membrane_force(groups, g, weight, r, n)
         do i = 1, n_core
            gradient(:, i) = gradient(:, i) + n(:, 1)*dm(:, 1, i, g) + n(:, 2)*dm(:, 2, i, g) + n(:, 3)*dm(:, 3, i, g)
         end do
      end do
      do g = 1, 3
         k = lanes*(g - 1)
         do v = 1, 3
            moment(:, v) = -weight*r%m(k + 1:k + lanes, v)
         end do
         work = moment(:, 1)*bend%curvature(:, 1, g) + moment(:, 2)*bend%curvature(:, 2, g) &
            + moment(:, 3)*bend%curvature(:, 3, g)
         do i = 1, 3
            gradient(:, i) = gradient(:, i) + work*dl(:, i) + l*(moment(:, 1)*bend%curvature_e(:, 1, i, g) &
                                                                 + moment(:, 2)*bend%curvature_e(:, 2, i, g) &
                                                                 + moment(:, 3)*bend%curvature_e(:, 3, i, g))
         end do
         do i = 1, 6
            gradient(:, 6 + i) = gradient(:, 6 + i) + l*(moment(:, 1)*bend%curvature_g(:, 1, i, g) &
                                                         + moment(:, 2)*bend%curvature_g(:, 2, i, g) &
                                                         + moment(:, 3)*bend%curvature_g(:, 3, i, g))
         end do
      end do
   end subroutine core_gradient

   !> Membrane force of group g, times the area it stands for.
   pure subroutine membrane_force(groups, g, weight, r, n)
      integer, intent(in) :: groups, g
      real(wp), intent(in) :: weight(lanes)
      type(resultants_t), intent(in) :: r
      real(wp), intent(out) :: n(lanes, 3)
      integer :: v
      do v = 1, 3
         if (groups == 1) then
            n(:, v) = weight*(r%n(1:lanes, v) + r%n(lanes + 1:2*lanes, v) + r%n(2*lanes + 1:3*lanes, v))
         else
            n(:, v) = weight*r%n(lanes*(g - 1) + 1:lanes*g, v)
         end if
      end do
   end subroutine membrane_force

   !> First derivatives times section tangent times first derivatives, and the second derivatives of the curvature.
   pure subroutine core_material_hessian(groups, weight, r, bend, dm, l, dl, ddl, h, side)
      integer, intent(in) :: groups
      real(wp), intent(in) :: weight(lanes)
      type(resultants_t), intent(in) :: r
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: dm(lanes, 3, n_core, 3), l(lanes), dl(lanes, 3), ddl(lanes, 6)
      real(wp), intent(out) :: h(lanes, n_core, n_core)
      real(wp), intent(out) :: side(lanes, 3) !< work conjugate to beta_k p_k of each side
      !> Core variable of each of the nine that bend.
      integer, parameter :: variable(9) = [1, 2, 3, 7, 8, 9, 10, 11, 12]
      real(wp) :: a(lanes, 6), b(lanes, 6), d(lanes, 6), dk(lanes, 3, 9), t(lanes, 3, n_core), y(lanes, 3, 9), s(lanes, 3)
      real(wp) :: moment(lanes, 3), sum_side(lanes, 3), sum_work(lanes)
      real(wp) :: sum_e(lanes, 3), sum_g(lanes, 6)
      integer :: g, i, j, k, m, v

      h = 0
      y = 0
      a = 0
      sum_side = 0
      sum_work = 0
      sum_e = 0
      sum_g = 0
      do g = 1, 3
         k = lanes*(g - 1)
         do v = 1, 6
            a(:, v) = a(:, v) + weight*r%a(k + 1:k + lanes, v)
            b(:, v) = weight*r%b(k + 1:k + lanes, v)
            d(:, v) = weight*r%d(k + 1:k + lanes, v)
         end do
         do i = 1, 3
            do v = 1, 3
               dk(:, v, i) = -dl(:, i)*bend%curvature(:, v, g) - l*bend%curvature_e(:, v, i, g)
            end do
         end do
         do i = 1, 6
            do v = 1, 3
               dk(:, v, 3 + i) = -l*bend%curvature_g(:, v, i, g)
            end do
         end do
         do j = 1, 9
            s(:, 1) = d(:, 1)*dk(:, 1, j) + d(:, 4)*dk(:, 2, j) + d(:, 5)*dk(:, 3, j)
            s(:, 2) = d(:, 4)*dk(:, 1, j) + d(:, 2)*dk(:, 2, j) + d(:, 6)*dk(:, 3, j)
            s(:, 3) = d(:, 5)*dk(:, 1, j) + d(:, 6)*dk(:, 2, j) + d(:, 3)*dk(:, 3, j)
            do i = 1, j
               h(:, variable(i), variable(j)) = h(:, variable(i), variable(j)) &
                  + dk(:, 1, i)*s(:, 1) + dk(:, 2, i)*s(:, 2) + dk(:, 3, i)*s(:, 3)
            end do
            y(:, 1, j) = y(:, 1, j) + b(:, 1)*dk(:, 1, j) + b(:, 4)*dk(:, 2, j) + b(:, 5)*dk(:, 3, j)
            y(:, 2, j) = y(:, 2, j) + b(:, 4)*dk(:, 1, j) + b(:, 2)*dk(:, 2, j) + b(:, 6)*dk(:, 3, j)
            y(:, 3, j) = y(:, 3, j) + b(:, 5)*dk(:, 1, j) + b(:, 6)*dk(:, 2, j) + b(:, 3)*dk(:, 3, j)
         end do

         ! sums of moment times curvature derivatives; minus sign: the strain is -lambda_Z Z sym grad G
         do v = 1, 3
            moment(:, v) = -weight*r%m(k + 1:k + lanes, v)
         end do
         sum_work = sum_work + moment(:, 1)*bend%curvature(:, 1, g) + moment(:, 2)*bend%curvature(:, 2, g) &
            + moment(:, 3)*bend%curvature(:, 3, g)
         do i = 1, 3
            sum_side(:, i) = sum_side(:, i) + moment(:, 1)*bend%curvature_side(:, 1, i, g) &
               + moment(:, 2)*bend%curvature_side(:, 2, i, g) + moment(:, 3)*bend%curvature_side(:, 3, i, g)
         end do
         do i = 1, 6
            sum_g(:, i) = sum_g(:, i) + moment(:, 1)*bend%curvature_g(:, 1, i, g) &
               + moment(:, 2)*bend%curvature_g(:, 2, i, g) + moment(:, 3)*bend%curvature_g(:, 3, i, g)
         end do

         if (g < 3 .and. groups == 1) cycle
         m = min(g, groups)
         do j = 1, n_core
            t(:, 1, j) = a(:, 1)*dm(:, 1, j, m) + a(:, 4)*dm(:, 2, j, m) + a(:, 5)*dm(:, 3, j, m)
            t(:, 2, j) = a(:, 4)*dm(:, 1, j, m) + a(:, 2)*dm(:, 2, j, m) + a(:, 6)*dm(:, 3, j, m)
            t(:, 3, j) = a(:, 5)*dm(:, 1, j, m) + a(:, 6)*dm(:, 2, j, m) + a(:, 3)*dm(:, 3, j, m)
         end do
         ! t gets the coupling with the curvature; its transposed half below
         do j = 1, 9
            t(:, :, variable(j)) = t(:, :, variable(j)) + y(:, :, j)
         end do
         do j = 1, n_core
            do i = 1, j
               h(:, i, j) = h(:, i, j) + dm(:, 1, i, m)*t(:, 1, j) + dm(:, 2, i, m)*t(:, 2, j) + dm(:, 3, i, m)*t(:, 3, j)
            end do
         end do
         do i = 1, 9
            do j = variable(i), n_core
               h(:, variable(i), j) = h(:, variable(i), j) &
                  + y(:, 1, i)*dm(:, 1, j, m) + y(:, 2, i)*dm(:, 2, j, m) + y(:, 3, i)*dm(:, 3, j, m)
            end do
         end do
         a = 0
         y = 0
      end do

      ! second derivatives of lambda_Z sym grad G, contracted with the moments
      do i = 1, 3
         sum_e(:, i) = sum_side(:, 1)*bend%p(:, 1)*bend%dbeta(:, i, 1) + sum_side(:, 2)*bend%p(:, 2)*bend%dbeta(:, i, 2) &
            + sum_side(:, 3)*bend%p(:, 3)*bend%dbeta(:, i, 3)
      end do
      do k = 1, 6
         i = row(k)
         j = column(k)
         h(:, i, j) = h(:, i, j) + ddl(:, k)*sum_work + dl(:, i)*sum_e(:, j) + dl(:, j)*sum_e(:, i)
      end do
      do v = 1, 3
         side(:, v) = l*sum_side(:, v)
      end do
      do j = 1, 6
         do i = 1, 3
            h(:, i, 6 + j) = h(:, i, 6 + j) + dl(:, i)*sum_g(:, j)
         end do
      end do
   end subroutine core_material_hessian

   !> Second derivatives of beta_k p_k, contracted with its work conjugate: p_k is linear in the slopes of the side's two nodes.
   pure subroutine add_side_terms(ref, bend, side, h)
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: side(lanes, 3)
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: p(lanes, 3)
      integer :: i, k, m, node
      p = side*bend%p
      do k = 1, 6
         h(:, row(k), column(k)) = h(:, row(k), column(k)) + p(:, 1)*bend%ddbeta(:, k, 1) + p(:, 2)*bend%ddbeta(:, k, 2) &
            + p(:, 3)*bend%ddbeta(:, k, 3)
      end do
      do k = 1, 3
         do m = 0, 1
            node = 1 + mod(k - 1 + m, 3)
            do i = 1, 3
               h(:, i, 5 + 2*node) = h(:, i, 5 + 2*node) + side(:, k)*bend%dbeta(:, i, k)*ref%side(:, 1, k)
               h(:, i, 6 + 2*node) = h(:, i, 6 + 2*node) + side(:, k)*bend%dbeta(:, i, k)*ref%side(:, 2, k)
            end do
         end do
      end do
   end subroutine add_side_terms

   !> Second derivatives of the drilling strain of (S) at fixed membrane force.
   pure subroutine stabilised_geometric(ref, filter, drill, weight, r, h)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      type(drilling_t), intent(in) :: drill
      real(wp), intent(in) :: weight(lanes)
      type(resultants_t), intent(in) :: r
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: n(lanes, 3), ee(lanes, 6), ea(lanes, 3, 2), aa(lanes, 3)
      integer :: i, k
      call membrane_force(1, 1, weight, r, n)
      call add_drilling_hessian(ref, filter%c, filter%jacobian, drill, n, ee, ea, aa)
      do k = 1, 6
         h(:, row(k), column(k)) = h(:, row(k), column(k)) + ee(:, k)
      end do
      do i = 1, 3
         h(:, i, 4) = h(:, i, 4) + ea(:, i, 1)
         h(:, i, 5) = h(:, i, 5) + ea(:, i, 2)
         h(:, i, 6) = h(:, i, 6) - ea(:, i, 1) - ea(:, i, 2)
      end do
      h(:, 4, 4) = h(:, 4, 4) + aa(:, 1)
      h(:, 5, 5) = h(:, 5, 5) + aa(:, 2)
      h(:, 4, 5) = h(:, 4, 5) + aa(:, 3)
      h(:, 4, 6) = h(:, 4, 6) - aa(:, 1) - aa(:, 3)
      h(:, 5, 6) = h(:, 5, 6) - aa(:, 2) - aa(:, 3)
      h(:, 6, 6) = h(:, 6, 6) + aa(:, 1) + aa(:, 2) + 2*aa(:, 3)
   end subroutine stabilised_geometric

   !> Second derivatives of J B tau, formulation (P).
   pure subroutine paper_geometric(ref, filter, tau, higher, weight, r, h)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: tau(lanes, 3), higher(lanes, 3, 3, 3), weight(lanes)
      type(resultants_t), intent(in) :: r
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: b(lanes, 3, 3), dj(lanes, 3), n(lanes, 3), w(lanes, 3), total(lanes)
      integer :: g, i, j, k
      call jacobian_gradient(filter, dj)
      w = 0
      do g = 1, 3
         call membrane_force(3, g, weight, r, n)
         call total_drilling_matrix(ref, higher(:, :, :, g), b)
         do i = 1, 3
            w(:, i) = w(:, i) + n(:, 1)*b(:, 1, i) + n(:, 2)*b(:, 2, i) + n(:, 3)*b(:, 3, i)
         end do
      end do
      do j = 1, 3
         do i = 1, 3
            h(:, i, 3 + j) = h(:, i, 3 + j) + dj(:, i)*w(:, j)
         end do
      end do
      ! J J,ab = (J^2),ab/2 - J,a J,b with (J^2),12 = 4 and (J^2),33 = -2
      total = (w(:, 1)*tau(:, 1) + w(:, 2)*tau(:, 2) + w(:, 3)*tau(:, 3))/filter%jacobian
      do k = 1, 6
         i = row(k)
         j = column(k)
         h(:, i, j) = h(:, i, j) - total*dj(:, i)*dj(:, j)
      end do
      h(:, 1, 2) = h(:, 1, 2) + 2*total
      h(:, 3, 3) = h(:, 3, 3) - total
   end subroutine paper_geometric

   !> Second derivatives of 1/2 G (x) G at fixed membrane force.
   pure subroutine von_karman_geometric(groups, weight, r, bend, h, side)
      integer, intent(in) :: groups
      real(wp), intent(in) :: weight(lanes)
      type(resultants_t), intent(in) :: r
      type(bending_t), intent(in) :: bend
      real(wp), intent(inout) :: h(lanes, n_core, n_core), side(lanes, 3)
      integer, parameter :: variable(9) = [1, 2, 3, 7, 8, 9, 10, 11, 12]
      real(wp) :: n(lanes, 3), ds(lanes, 2, 9), t(lanes, 2)
      integer :: g, i, j, k
      do g = 1, 3
         if (groups == 3 .or. g == 1) then
            call membrane_force(groups, g, weight, r, n)
            if (groups == 1) n = n/3
         end if
         ds(:, :, 1:3) = bend%slope_e(:, :, g, :)
         ds(:, :, 4:9) = bend%slope_g(:, :, g, :)
         do j = 1, 9
            t(:, 1) = n(:, 1)*ds(:, 1, j) + n(:, 3)*ds(:, 2, j)
            t(:, 2) = n(:, 3)*ds(:, 1, j) + n(:, 2)*ds(:, 2, j)
            do i = 1, j
               h(:, variable(i), variable(j)) = h(:, variable(i), variable(j)) + ds(:, 1, i)*t(:, 1) + ds(:, 2, i)*t(:, 2)
            end do
         end do
         t(:, 1) = n(:, 1)*bend%slope(:, 1, g) + n(:, 3)*bend%slope(:, 2, g)
         t(:, 2) = n(:, 3)*bend%slope(:, 1, g) + n(:, 2)*bend%slope(:, 2, g)
         do k = 1, 3
            side(:, k) = side(:, k) + t(:, 1)*bend%slope_side(:, 1, k, g) + t(:, 2)*bend%slope_side(:, 2, k, g)
         end do
      end do
   end subroutine von_karman_geometric
end module finshell_core
