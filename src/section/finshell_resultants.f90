!> Resultants of a block of elements: `integrate` turns membrane strain and curvature at points of the midsurface into forces,
!> moments and their tangent; thickness stretch and stiffness at rest.
module finshell_resultants
   use finshell_kinds, only: wp, i4, lanes, points_per_block
   use finshell_evaluation, only: level_energy, level_force, level_tangent
   use finshell_growth, only: from_stress_free, growth_t, layer_volume, new_growth, pull_back
   use finshell_law_block, only: thickness_stretch
   use finshell_metric_change, only: change_strain, pull_back_stress, pull_back_tangent
   use finshell_own, only: own_t, at_points
   use finshell_point_states, only: point_states_t, remembered_stress
   use finshell_section, only: layer_t, numbers_of, section_t
   use finshell_voigt, only: rotate_strain, rotate_stress, rotate_tangent
   implicit none
   private
   public :: resultants_t, switches_t, integrate, midsurface_thickness, reference_membrane_tangent
   public :: layer_direction, points_per_block

   !> Points of which the results mean something, in whole registers.
   integer, parameter :: used = min(points_per_block, 4*((3*lanes + 3)/4))

   !> What laws with switches have to know at the points of a block, beside the strain.
   type :: switches_t
      real(wp) :: floor(points_per_block) !< strain that rounding of the motion alone can make
      logical :: directed = .false. !< the tangent is the one-sided one in the direction of the rates, else that without fibres
      real(wp) :: membrane(points_per_block, 3), curvature(points_per_block, 3) !< rates
      real(wp) :: rate_floor(points_per_block)
   end type switches_t

   !> Resultants per reference length and their derivatives, at `points_per_block` points.
   type :: resultants_t
      real(wp) :: energy(points_per_block) !< per reference area
      real(wp) :: n(points_per_block, 3) !< membrane force, conjugate to the membrane strain
      real(wp) :: m(points_per_block, 3) !< moment, conjugate to the curvature
      real(wp) :: a(points_per_block, 6) !< dn/d(membrane strain), packed symmetric
      real(wp) :: b(points_per_block, 6) !< dn/d(curvature) = dm/d(membrane strain)
      real(wp) :: d(points_per_block, 6) !< dm/d(curvature)
   end type resultants_t

contains

   !> Resultants of a block of points: strain at reference height z is `membrane + z curvature`.
   !>
   !> Laws with switches (finshell_material) take `switches` into account, and without it switch at 0 exactly. Laws with states are
   !> asked with `states`, and without it as if nothing had been before.
   pure subroutine integrate(section, level, membrane, curvature, axes, r, status, switches, own, bend, states)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level !< level_energy, level_force or level_tangent
      real(wp), intent(in) :: membrane(points_per_block, 3), curvature(points_per_block, 3)
      real(wp), intent(in) :: axes(points_per_block, 2) !< cosine, sine of the element's material direction
      type(resultants_t), intent(inout) :: r
      integer(i4), intent(inout) :: status(points_per_block)
      type(switches_t), intent(in), optional :: switches
      type(own_t), intent(in), optional :: own !< absent: thickness and offset of the section, and nothing has grown
      real(wp), intent(in), optional :: bend(points_per_block, 3) !< with growth: curvature of the reference (finshell_growth)
      type(point_states_t), intent(inout), optional :: states
      logical :: sized
      sized = .false.
      if (present(own)) sized = own%sized
      if (sized) then
         call integrate_sized(section, level, membrane, curvature, axes, r, status, own, switches, bend, states)
      else
         call integrate_layers(section, level, membrane, curvature, axes, r, status, switches, own, bend, states)
      end if
   end subroutine integrate

   !> Elements whose thickness or offset is not that of the section: what is at z in the section is at ratio z + shift.
   pure subroutine integrate_sized(section, level, membrane, curvature, axes, r, status, own, switches, bend, states)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level
      real(wp), intent(in) :: membrane(points_per_block, 3), curvature(points_per_block, 3), axes(points_per_block, 2)
      type(resultants_t), intent(inout) :: r
      integer(i4), intent(inout) :: status(points_per_block)
      type(own_t), intent(in) :: own
      type(switches_t), intent(in), optional :: switches
      real(wp), intent(in), optional :: bend(points_per_block, 3)
      type(point_states_t), intent(inout), optional :: states
      type(switches_t) :: scaled
      real(wp) :: ratio(points_per_block), shift(points_per_block), e(points_per_block, 3), k(points_per_block, 3)
      integer :: i
      ratio = at_points(own%ratio)
      shift = at_points(own%shift)
      do i = 1, 3
         e(:, i) = membrane(:, i) + shift*curvature(:, i)
         k(:, i) = ratio*curvature(:, i)
      end do
      if (present(switches) .and. section%switched) then
         scaled%floor = switches%floor
         scaled%directed = switches%directed
         if (switches%directed) then
            scaled%rate_floor = switches%rate_floor
            do i = 1, 3
               scaled%membrane(:, i) = switches%membrane(:, i) + shift*switches%curvature(:, i)
               scaled%curvature(:, i) = ratio*switches%curvature(:, i)
            end do
         end if
         call integrate_layers(section, level, e, k, axes, r, status, scaled, own, bend, states)
      else
         call integrate_layers(section, level, e, k, axes, r, status, own=own, bend=bend, states=states)
      end if
      r%energy = ratio*r%energy
      if (level < level_force) return
      do i = 1, 3
         r%m(:, i) = ratio*(ratio*r%m(:, i) + shift*r%n(:, i))
         r%n(:, i) = ratio*r%n(:, i)
      end do
      if (level < level_tangent) return
      do i = 1, 6
         r%d(:, i) = ratio*(ratio*(ratio*r%d(:, i) + 2*shift*r%b(:, i)) + shift**2*r%a(:, i))
         r%b(:, i) = ratio*(ratio*r%b(:, i) + shift*r%a(:, i))
         r%a(:, i) = ratio*r%a(:, i)
      end do
   end subroutine integrate_sized

   !> The sum over layers and their points, heights being those of the section.
   pure subroutine integrate_layers(section, level, membrane, curvature, axes, r, status, switches, own, bend, states)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level
      real(wp), intent(in) :: membrane(points_per_block, 3), curvature(points_per_block, 3), axes(points_per_block, 2)
      type(resultants_t), intent(inout) :: r
      integer(i4), intent(inout) :: status(points_per_block)
      type(switches_t), intent(in), optional :: switches
      type(own_t), intent(in), optional :: own
      real(wp), intent(in), optional :: bend(points_per_block, 3)
      type(point_states_t), intent(inout), optional :: states
      type(growth_t) :: growth
      real(wp) :: e(points_per_block, 3), k(points_per_block, 3), s(points_per_block, 3), d(points_per_block, 6)
      real(wp) :: x(points_per_block, 3), w(points_per_block), direction(points_per_block, 2)
      real(wp) :: bent(points_per_block, 3), turned(points_per_block, 2)
      real(wp) :: weight, z
      logical :: grown, remembers
      integer :: i, l, p, place

      remembers = .false.
      if (present(states)) remembers = associated(states%all%begin)
      place = 0
      grown = .false.
      if (present(own)) grown = own%grown
      r%energy = 0
      if (level >= level_force) then
         r%n = 0
         r%m = 0
      end if
      if (level >= level_tangent) then
         r%a = 0
         r%b = 0
         r%d = 0
      end if
      do l = 1, size(section%layers)
         associate (layer => section%layers(l))
            if (layer%law%isotropic) then
               e = membrane
               k = curvature
            else
               call layer_direction(layer, axes, direction)
               call rotate_strain(points_per_block, direction, membrane, e)
               call rotate_strain(points_per_block, direction, curvature, k)
            end if
            if (grown) then
               turned = axes_of_evaluation(layer, points_per_block, axes)
               if (present(bend)) then
                  bent = bend
                  if (.not. layer%law%isotropic) call rotate_strain(points_per_block, direction, bend, bent)
                  call new_growth(own, l, points_per_block, turned, growth, bent)
               else
                  call new_growth(own, l, points_per_block, turned, growth)
               end if
               call from_stress_free(points_per_block, growth, e, k)
            end if
            do p = 1, layer%points
               z = layer%z(p)
               weight = layer%weight(p)
               x = e + z*k
               if (layer%law%switched .and. present(switches)) then
                  call switched(layer, z, level, x, direction, switches, w, s, d, status, grown, growth)
               else if (layer%law%states > 0 .and. remembers) then
                  call remembered_stress(layer%law, states, place + (p - 1)*layer%law%states, layer%points*layer%law%states, 3, &
                                         points_per_block, level, x, w, s, d, status)
               else
                  call layer%law%plane_stress(points_per_block, level, x, w, s, d, status)
               end if
               if (grown) call pull_back(points_per_block, level, growth, w, s, d)
               if (.not. layer%law%isotropic .and. level >= level_force) then
                  call rotate_stress(points_per_block, direction, s)
                  if (level >= level_tangent) call rotate_tangent(points_per_block, direction, d)
               end if
               r%energy(:used) = r%energy(:used) + weight*w(:used)
               if (level < level_force) cycle
               do i = 1, 3
                  r%n(:used, i) = r%n(:used, i) + weight*s(:used, i)
                  r%m(:used, i) = r%m(:used, i) + (weight*z)*s(:used, i)
               end do
               if (level < level_tangent) cycle
               do i = 1, 6
                  r%a(:used, i) = r%a(:used, i) + weight*d(:used, i)
                  r%b(:used, i) = r%b(:used, i) + (weight*z)*d(:used, i)
                  r%d(:used, i) = r%d(:used, i) + (weight*z**2)*d(:used, i)
               end do
            end do
            place = place + numbers_of(layer)
         end associate
      end do
   end subroutine integrate_layers

   !> The law of a layer at height z, with switches.
   pure subroutine switched(layer, z, level, x, direction, switches, w, s, d, status, grown, growth)
      type(layer_t), intent(in) :: layer
      real(wp), intent(in) :: z, x(points_per_block, 3), direction(points_per_block, 2)
      integer, intent(in) :: level
      type(switches_t), intent(in) :: switches
      real(wp), intent(inout) :: w(points_per_block), s(points_per_block, 3), d(points_per_block, 6)
      integer(i4), intent(inout) :: status(points_per_block)
      logical, intent(in) :: grown
      type(growth_t), intent(in) :: growth !< looked at where it has grown
      real(wp) :: rate(points_per_block, 3), turned(points_per_block, 3)
      if (.not. switches%directed) then
         call layer%law%switched_plane_stress(points_per_block, level, x, switches%floor, w, s, d, status)
         return
      end if
      rate = switches%membrane + z*switches%curvature
      call rotate_strain(points_per_block, direction, rate, turned)
      if (grown) call change_strain(points_per_block, growth%map, turned)
      call layer%law%switched_plane_stress(points_per_block, level, x, switches%floor, w, s, d, status, turned, switches%rate_floor)
   end subroutine switched

   !> Thickness stretch of the midsurface with its derivatives with respect to the membrane strain (paper eq. 25).
   pure subroutine midsurface_thickness(section, level, strain, axes, l, dl, ddl, status, own)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level
      real(wp), intent(in) :: strain(lanes, 3), axes(lanes, 2)
      real(wp), intent(inout) :: l(lanes), dl(lanes, 3), ddl(lanes, 6)
      integer(i4), intent(inout) :: status(lanes)
      type(own_t), intent(in), optional :: own !< as in `integrate`
      real(wp) :: l2(lanes), dl2(lanes, 3), ddl2(lanes, 6)
      integer(i4) :: found(lanes)
      integer :: layer(lanes), i, number
      layer = section%midsurface_layer
      if (present(own) .and. size(section%layers) > 1) then
         if (own%sized) layer = layers_on_surface(section, own)
      end if
      call layer_thickness(section%layers(layer(1)), layer(1), level, strain, axes, l, dl, ddl, status, own)
      do number = 1, size(section%layers)
         if (number == layer(1) .or. .not. any(layer == number)) cycle
         ! elements of which another layer lies on the surface of the nodes
         found = 0
         call layer_thickness(section%layers(number), number, level, strain, axes, l2, dl2, ddl2, found, own)
         do i = 1, lanes
            if (layer(i) /= number) cycle
            l(i) = l2(i)
            status(i) = found(i)
            if (level >= level_force) dl(i, :) = dl2(i, :)
            if (level >= level_tangent) ddl(i, :) = ddl2(i, :)
         end do
      end do
   end subroutine midsurface_thickness

   !> The layer at the surface of the nodes, or the nearest to it, of each element (new_layered_section says so of the section).
   pure function layers_on_surface(section, own) result(layer)
      type(section_t), intent(in) :: section
      type(own_t), intent(in) :: own
      integer :: layer(lanes)
      real(wp) :: bottom
      integer :: i
      layer = 1
      bottom = section%offset - 0.5_wp*section%thickness
      do i = 1, size(section%layers) - 1
         bottom = bottom + section%layers(i)%thickness
         where (own%ratio*bottom + own%shift <= 0) layer = i + 1
      end do
   end function layers_on_surface

   !> Thickness stretch of a layer at the surface of the nodes.
   pure subroutine layer_thickness(layer, number, level, strain, axes, l, dl, ddl, status, own)
      type(layer_t), intent(in) :: layer
      integer, intent(in) :: number, level
      real(wp), intent(in) :: strain(lanes, 3), axes(lanes, 2)
      real(wp), intent(inout) :: l(lanes), dl(lanes, 3), ddl(lanes, 6)
      integer(i4), intent(inout) :: status(lanes)
      type(own_t), intent(in), optional :: own
      type(growth_t) :: growth
      real(wp) :: e(lanes, 3), direction(lanes, 2), factor(lanes)
      logical :: grown
      grown = .false.
      if (present(own)) grown = own%grown
      e = strain
      if (.not. layer%law%isotropic) then
         call layer_direction(layer, axes, direction)
         call rotate_strain(lanes, direction, strain, e)
      end if
      if (grown) then
         call new_growth(own, number, lanes, axes_of_evaluation(layer, lanes, axes), growth)
         call from_stress_free(lanes, growth, e)
      end if
      call thickness_stretch(layer%law, level, e, l, dl, ddl, status)
      if (grown) then
         factor = growth%thickness(:lanes)
         l = factor*l
         if (level >= level_force) call pull_back_stress(lanes, growth%map(:lanes, :, :), factor, dl)
         if (level >= level_tangent) call pull_back_tangent(lanes, growth%map(:lanes, :, :), factor, ddl)
      end if
      if (layer%law%isotropic) return
      if (level >= level_force) call rotate_stress(lanes, direction, dl)
      if (level >= level_tangent) call rotate_tangent(lanes, direction, ddl)
   end subroutine layer_thickness

   !> Small-strain membrane stiffness (per reference length) in the element frame: the scale of the drilling stiffness.
   pure subroutine reference_membrane_tangent(section, axes, a, own)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: axes(lanes, 2)
      real(wp), intent(out) :: a(lanes, 6)
      type(own_t), intent(in), optional :: own !< of which thickness and volume count
      real(wp) :: c(6), d(lanes, 6), direction(lanes, 2), factor(lanes)
      logical :: grown
      integer :: i, l
      grown = .false.
      if (present(own)) grown = own%grown
      a = 0
      do l = 1, size(section%layers)
         associate (layer => section%layers(l))
            c = layer%law%reference_tangent()
            do i = 1, 6
               d(:, i) = layer%thickness*c(i)
            end do
            if (.not. layer%law%isotropic) then
               call layer_direction(layer, axes, direction)
               call rotate_tangent(lanes, direction, d)
            end if
            if (grown) then
               factor = layer_volume(own, l)
               do i = 1, 6
                  d(:, i) = factor*d(:, i)
               end do
            end if
            a = a + d
         end associate
      end do
      if (.not. present(own)) return
      if (.not. own%sized) return
      do i = 1, 6
         a(:, i) = own%ratio*a(:, i)
      end do
   end subroutine reference_membrane_tangent

   !> Cosine and sine of the axes in which a layer is evaluated, from the material direction of the element: those of the element
   !> for isotropic laws, else those of the law.
   pure function axes_of_evaluation(layer, n, axes) result(turned)
      type(layer_t), intent(in) :: layer
      integer, intent(in) :: n
      real(wp), intent(in) :: axes(n, 2) !< of the material direction in the element frame
      real(wp) :: turned(n, 2)
      if (layer%law%isotropic) then
         turned(:, 1) = axes(:, 1)
         turned(:, 2) = -axes(:, 2)
      else
         turned(:, 1) = layer%cosine
         turned(:, 2) = layer%sine
      end if
   end function axes_of_evaluation

   !> Cosine and sine of axis 1 of the law of a layer, where those of the material direction are `axes`.
   pure subroutine layer_direction(layer, axes, direction)
      type(layer_t), intent(in) :: layer
      real(wp), intent(in) :: axes(:, :)
      real(wp), intent(out) :: direction(:, :)
      direction(:, 1) = layer%cosine*axes(:, 1) - layer%sine*axes(:, 2)
      direction(:, 2) = layer%sine*axes(:, 1) + layer%cosine*axes(:, 2)
   end subroutine layer_direction
end module finshell_resultants
