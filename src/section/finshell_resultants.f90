!> Resultants of a block of elements: `integrate` turns membrane strain and curvature at points of the midsurface into forces,
!> moments and their tangent; and what else is to be known of a section at a strain.
module finshell_resultants
   use finshell_kinds, only: wp, i4, lanes, strip
   use finshell_evaluation, only: level_energy, level_force, level_tangent
   use finshell_law_block, only: plane_stress, thickness_stretch
   use finshell_point_states, only: point_states_t, remembered_at, remembered_stress
   use finshell_section, only: layer_t, numbers_of, section_t
   use finshell_voigt, only: rotate_strain, rotate_stress, rotate_tangent
   implicit none
   private
   public :: resultants_t, switches_t, integrate, midsurface_thickness, reference_membrane_tangent, cauchy_stress
   public :: layer_direction, points_per_block

   !> Three in-plane points of each element of a block, those of the first element l, l + lanes, l + 2 lanes; and what laws need
   !> beyond (finshell_material): a point anywhere in the block, whose results mean nothing.
   integer, parameter :: points_per_block = strip*((3*lanes + strip - 1)/strip)

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
   pure subroutine integrate(section, level, membrane, curvature, axes, r, status, switches, states)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level !< level_energy, level_force or level_tangent
      real(wp), intent(in) :: membrane(points_per_block, 3), curvature(points_per_block, 3)
      real(wp), intent(in) :: axes(points_per_block, 2) !< cosine, sine of the element's material direction
      type(resultants_t), intent(inout) :: r
      integer(i4), intent(inout) :: status(points_per_block)
      type(switches_t), intent(in), optional :: switches
      type(point_states_t), intent(inout), optional :: states
      real(wp) :: e(points_per_block, 3), k(points_per_block, 3), s(points_per_block, 3), d(points_per_block, 6)
      real(wp) :: x(points_per_block, 3), w(points_per_block), direction(points_per_block, 2)
      real(wp) :: weight, z
      integer :: i, l, p, place
      logical :: remembers

      remembers = .false.
      if (present(states)) remembers = associated(states%all%begin)
      place = 0
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
            do p = 1, layer%points
               z = layer%z(p)
               weight = layer%weight(p)
               x = e + z*k
               if (layer%law%switched .and. present(switches)) then
                  call switched(layer, z, level, x, direction, switches, w, s, d, status)
               else if (layer%law%states > 0 .and. remembers) then
                  call remembered_stress(layer%law, states, place + (p - 1)*layer%law%states, layer%points*layer%law%states, 3, &
                                         points_per_block, level, x, w, s, d, status)
               else
                  call layer%law%plane_stress(points_per_block, level, x, w, s, d, status)
               end if
               if (.not. layer%law%isotropic .and. level >= level_force) then
                  call rotate_stress(points_per_block, direction, s)
                  if (level >= level_tangent) call rotate_tangent(points_per_block, direction, d)
               end if
               r%energy = r%energy + weight*w
               if (level < level_force) cycle
               do i = 1, 3
                  r%n(:, i) = r%n(:, i) + weight*s(:, i)
                  r%m(:, i) = r%m(:, i) + (weight*z)*s(:, i)
               end do
               if (level < level_tangent) cycle
               do i = 1, 6
                  r%a(:, i) = r%a(:, i) + weight*d(:, i)
                  r%b(:, i) = r%b(:, i) + (weight*z)*d(:, i)
                  r%d(:, i) = r%d(:, i) + (weight*z**2)*d(:, i)
               end do
            end do
            place = place + numbers_of(layer)
         end associate
      end do
   end subroutine integrate

   !> The law of a layer at height z, with switches.
   pure subroutine switched(layer, z, level, x, direction, switches, w, s, d, status)
      type(layer_t), intent(in) :: layer
      real(wp), intent(in) :: z, x(points_per_block, 3), direction(points_per_block, 2)
      integer, intent(in) :: level
      type(switches_t), intent(in) :: switches
      real(wp), intent(inout) :: w(points_per_block), s(points_per_block, 3), d(points_per_block, 6)
      integer(i4), intent(inout) :: status(points_per_block)
      real(wp) :: rate(points_per_block, 3), turned(points_per_block, 3)
      if (.not. switches%directed) then
         call layer%law%switched_plane_stress(points_per_block, level, x, switches%floor, w, s, d, status)
         return
      end if
      rate = switches%membrane + z*switches%curvature
      call rotate_strain(points_per_block, direction, rate, turned)
      call layer%law%switched_plane_stress(points_per_block, level, x, switches%floor, w, s, d, status, turned, switches%rate_floor)
   end subroutine switched

   !> Thickness stretch of the midsurface with its derivatives with respect to the membrane strain (paper eq. 25).
   pure subroutine midsurface_thickness(section, level, strain, axes, l, dl, ddl, status)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level
      real(wp), intent(in) :: strain(lanes, 3), axes(lanes, 2)
      real(wp), intent(inout) :: l(lanes), dl(lanes, 3), ddl(lanes, 6)
      integer(i4), intent(inout) :: status(lanes)
      real(wp) :: e(lanes, 3), direction(lanes, 2)
      associate (layer => section%layers(section%midsurface_layer))
         if (layer%law%isotropic) then
            call thickness_stretch(layer%law, level, strain, l, dl, ddl, status)
         else
            call layer_direction(layer, axes, direction)
            call rotate_strain(lanes, direction, strain, e)
            call thickness_stretch(layer%law, level, e, l, dl, ddl, status)
            if (level >= level_force) call rotate_stress(lanes, direction, dl)
            if (level >= level_tangent) call rotate_tangent(lanes, direction, ddl)
         end if
      end associate
   end subroutine midsurface_thickness

   !> Small-strain membrane stiffness (per reference length) in the element frame: the scale of the drilling stiffness.
   pure subroutine reference_membrane_tangent(section, axes, a)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: axes(lanes, 2)
      real(wp), intent(out) :: a(lanes, 6)
      real(wp) :: c(6), d(lanes, 6), direction(lanes, 2)
      integer :: i, l
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
            a = a + d
         end associate
      end do
   end subroutine reference_membrane_tangent

   !> Cauchy stress (element frame, rotated back) at a reference height: sigma = U S U/(det U lambda_3), U from the local strain.
   pure subroutine cauchy_stress(section, height, membrane, curvature, axes, sigma, status, states)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: height !< offset - thickness/2 (bottom) to offset + thickness/2 (top)
      real(wp), intent(in) :: membrane(lanes, 3), curvature(lanes, 3), axes(lanes, 2)
      real(wp), intent(out) :: sigma(lanes, 3)
      integer(i4), intent(inout) :: status(lanes)
      type(point_states_t), intent(in) :: states !< null: virgin material
      real(wp) :: e(lanes, 3), x(lanes, 3), s(lanes, 3), d(lanes, 6), w(lanes), l(lanes), dl(lanes, 3), ddl(lanes, 6)
      real(wp) :: direction(lanes, 2), u(lanes, 3), a(lanes, 3)
      real(wp), dimension(lanes) :: jacobian, inverse
      real(wp) :: top
      integer :: layer, place

      place = 0
      top = section%offset - 0.5_wp*section%thickness
      do layer = 1, size(section%layers) - 1
         top = top + section%layers(layer)%thickness
         if (height <= top) exit
         place = place + numbers_of(section%layers(layer))
      end do
      associate (law => section%layers(layer)%law)
         call layer_direction(section%layers(layer), axes, direction)
         e = membrane + height*curvature
         call rotate_strain(lanes, direction, e, x)
         if (law%states > 0 .and. associated(states%all%begin)) then
            call remembered(section%layers(layer), place, height, x, states, s, status)
         else
            call plane_stress(law, level_force, x, w, s, d, status)
         end if
         call thickness_stretch(law, level_energy, x, l, dl, ddl, status)
         call rotate_stress(lanes, direction, s)
      end associate
      ! where the law has ended there may be no stretch either
      do layer = 1, 3
         where (status /= 0) e(:, layer) = 0
      end do
      where (status /= 0) l = 1
      jacobian = sqrt((1 + 2*e(:, 1))*(1 + 2*e(:, 2)) - e(:, 3)**2)
      inverse = 1/sqrt(2 + 2*e(:, 1) + 2*e(:, 2) + 2*jacobian)
      u(:, 1) = (1 + 2*e(:, 1) + jacobian)*inverse
      u(:, 2) = (1 + 2*e(:, 2) + jacobian)*inverse
      u(:, 3) = e(:, 3)*inverse
      inverse = 1/(jacobian*l)
      ! U S U, symmetric
      a(:, 1) = u(:, 1)*s(:, 1) + u(:, 3)*s(:, 3)
      a(:, 2) = u(:, 3)*s(:, 3) + u(:, 2)*s(:, 2)
      a(:, 3) = u(:, 1)*s(:, 3) + u(:, 3)*s(:, 2)
      sigma(:, 1) = (a(:, 1)*u(:, 1) + a(:, 3)*u(:, 3))*inverse
      sigma(:, 3) = (a(:, 1)*u(:, 3) + a(:, 3)*u(:, 2))*inverse
      sigma(:, 2) = ((u(:, 3)*s(:, 1) + u(:, 2)*s(:, 3))*u(:, 3) + a(:, 2)*u(:, 2))*inverse
   end subroutine cauchy_stress

   !> Stress of a law with states at any height of its layer. Laws take `strip` points, and a block may have fewer.
   pure subroutine remembered(layer, place, height, x, states, stress, status)
      type(layer_t), intent(in) :: layer
      integer, intent(in) :: place !< of the numbers of the layer
      real(wp), intent(in) :: height, x(lanes, 3)
      type(point_states_t), intent(in) :: states
      real(wp), intent(inout) :: stress(lanes, 3)
      integer(i4), intent(inout) :: status(lanes)
      integer, parameter :: n = strip*((lanes + strip - 1)/strip)
      real(wp) :: e(n, 3), w(n), s(n, 3), d(n, 6)
      integer(i4) :: found(n)
      integer :: i
      do i = 1, 3
         e(:, i) = x(1, i)
         e(:lanes, i) = x(:, i)
      end do
      found = 0
      call remembered_at(layer%law, states, place, layer%points, layer%z(:layer%points), height, n, level_force, e, w, s, d, found)
      stress = s(:lanes, :)
      where (found(:lanes) /= 0) status = found(:lanes)
   end subroutine remembered

   !> Cosine and sine of axis 1 of the law of a layer, where those of the material direction are `axes`.
   pure subroutine layer_direction(layer, axes, direction)
      type(layer_t), intent(in) :: layer
      real(wp), intent(in) :: axes(:, :)
      real(wp), intent(out) :: direction(:, :)
      direction(:, 1) = layer%cosine*axes(:, 1) - layer%sine*axes(:, 2)
      direction(:, 2) = layer%sine*axes(:, 1) + layer%cosine*axes(:, 2)
   end subroutine layer_direction
end module finshell_resultants
