!> A section: layers of material through the thickness, and the options of the element formulation.
!>
!> It is configured once and immutable afterwards, so any number of threads may share it. `integrate` turns membrane
!> strain and curvature at points of the midsurface into resultants and their tangent.
module finshell_section
   use finshell_kinds, only: wp, dp, i4, lanes
   use finshell_error, only: error_t, raise, text_of
   use finshell_evaluation, only: level_energy, level_force, level_tangent
   use finshell_material, only: material_t
   use finshell_status, only: status_invalid_argument
   use finshell_gauss, only: gauss_legendre, max_gauss_points
   use finshell_voigt, only: rotate_strain, rotate_stress, rotate_tangent
   implicit none
   private
   public :: section_t, layer_t, ply_t, resultants_t, switches_t, new_section, new_layered_section, integrate, &
      midsurface_thickness, reference_membrane_tangent, cauchy_stress, layer_direction
   public :: formulation_s, formulation_p, points_per_block, default_points

   !> Formulation of the core element: (S) stabilised, the default; (P) the paper's.
   integer, parameter :: formulation_s = 1, formulation_p = 2

   integer, parameter :: points_per_block = 3*lanes !< three in-plane points of each element of a block
   integer, parameter :: default_points = 3
   real(wp), parameter :: default_slack = 1.0e-6_wp

   !> A layer as the user gives it to `new_layered_section`.
   type :: ply_t
      class(material_t), allocatable :: law
      real(wp) :: thickness = 0 !< > 0
      real(wp) :: angle = 0 !< degrees, from the element's material direction to the layer's axis 1, about the normal
      integer :: points = default_points !< Gauss points through the layer, 1 to 12
      real(wp) :: density = 0 !< mass per reference volume, >= 0
   end type ply_t

   type :: layer_t
      class(material_t), allocatable :: law
      real(wp) :: thickness = 0
      real(wp) :: cosine = 1, sine = 0 !< of the angle from the element's material direction to the layer's axis 1
      integer :: points = 0
      real(wp) :: z(max_gauss_points) = 0 !< reference heights of the integration points
      real(wp) :: weight(max_gauss_points) = 0 !< integration weights (length)
   end type layer_t

   type :: section_t
      type(layer_t), allocatable :: layers(:) !< bottom to top
      integer :: midsurface_layer = 1 !< gives the thickness stretch
      real(wp) :: thickness = 0
      real(wp) :: offset = 0 !< height of the middle of the section above the surface of the nodes, along the normal
      real(wp) :: inertia(3) = 0 !< integrals of density times 1, z, z^2 through the thickness; z from the surface of the nodes
      integer :: formulation = formulation_s
      logical :: arc = .true. !< (S): curvature by the tangents of the arc, not of its chord
      real(wp) :: beta0 = 0 !< weight of the higher-order drilling strain; 0: by the element's own size (finshell_reference)
      logical :: isotropic = .true. !< no layer depends on a material direction
      logical :: switched = .false. !< a layer has switches (finshell_material)
      logical :: membrane = .false. !< no stiffness in bending, no rotations: three freedoms a node (finshell_membrane)
      logical :: wrinkling = .false. !< membranes: the sheet wrinkles instead of bearing compression (finshell_tension_field)
      real(wp) :: slack = default_slack !< part of the natural stiffness that is left to compression then (finshell_slack)
      !> A third of the trace of the small-strain membrane stiffness (force per length); stand-ins for laws that have none.
      real(wp) :: natural_stiffness = 0
   end type section_t

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

   !> A one-layer section, the nodes on its midsurface.
   subroutine new_section(section, law, thickness, error, formulation, beta0, thickness_points, density, offset, arc, &
                          wrinkling, slack, membrane)
      type(section_t), intent(out) :: section
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: thickness !< > 0
      type(error_t), allocatable, intent(out) :: error
      integer, intent(in), optional :: formulation !< formulation_s (default) or formulation_p
      real(wp), intent(in), optional :: beta0 !< > 0; default: by the size of each element (finshell_reference)
      integer, intent(in), optional :: thickness_points !< Gauss points through the thickness, 1 to 12; default 3
      real(wp), intent(in), optional :: density !< mass per reference volume, for the mass matrix only; default 0
      real(wp), intent(in), optional :: offset !< height of the midsurface above the surface of the nodes; default 0
      logical, intent(in), optional :: arc !< (S): curvature by the tangents of the arc instead of its chord; default .true.
      logical, intent(in), optional :: membrane !< no stiffness in bending, no rotations; default .false.
      logical, intent(in), optional :: wrinkling !< membranes: compression makes wrinkles; default .false.
      real(wp), intent(in), optional :: slack !< with wrinkling: part of the stiffness that is left to compression; default 1e-6
      type(ply_t) :: ply(1)

      allocate (ply(1)%law, source=law)
      ply(1)%thickness = thickness
      if (present(thickness_points)) ply(1)%points = thickness_points
      if (present(density)) ply(1)%density = density
      call new_layered_section(section, ply, error, formulation, beta0, offset, arc, wrinkling, slack, membrane)
   end subroutine new_section

   !> A section of several layers, bottom to top.
   !>
   !> Errors (status_invalid_argument): no layer or a layer without law, a thickness that is not positive, a number of points
   !> outside 1 to 12, an angle, density, offset or option that makes no sense. The thickness stretch is that of the layer at
   !> the surface of the nodes, or of the one nearest to it.
   subroutine new_layered_section(section, plies, error, formulation, beta0, offset, arc, wrinkling, slack, membrane)
      type(section_t), intent(out) :: section
      type(ply_t), intent(in) :: plies(:) !< bottom to top
      type(error_t), allocatable, intent(out) :: error
      integer, intent(in), optional :: formulation
      real(wp), intent(in), optional :: beta0, offset, slack
      logical, intent(in), optional :: arc, wrinkling, membrane
      real(wp), parameter :: degree = acos(-1.0_wp)/180
      real(wp) :: bottom, middle, natural(6)
      integer :: i

      if (present(formulation)) section%formulation = formulation
      if (present(beta0)) section%beta0 = beta0
      if (present(offset)) section%offset = offset
      if (present(arc)) section%arc = arc
      if (present(wrinkling)) section%wrinkling = wrinkling
      if (present(slack)) section%slack = slack
      if (present(membrane)) section%membrane = membrane
      if (size(plies) == 0) call raise(error, status_invalid_argument, 'a section needs at least one layer')
      do i = 1, size(plies)
         if (complaint(plies(i)) == '') cycle
         if (size(plies) == 1) then
            call raise(error, status_invalid_argument, trim(complaint(plies(i))))
         else
            call raise(error, status_invalid_argument, 'layer '//text_of(i)//': '//trim(complaint(plies(i))))
         end if
         exit
      end do
      if (allocated(error)) return
      if (present(beta0)) then
         if (.not. (beta0 > 0 .and. beta0 < huge(1.0_wp))) call raise(error, status_invalid_argument, &
            'beta0 is '//text_of(real(beta0, dp))//', expected a positive number')
      end if
      if (section%formulation /= formulation_s .and. section%formulation /= formulation_p) then
         call raise(error, status_invalid_argument, 'formulation is '//text_of(section%formulation)//', expected 1 (S) or 2 (P)')
      else if (.not. abs(section%offset) < huge(1.0_wp)) then
         call raise(error, status_invalid_argument, 'offset is '//text_of(real(section%offset, dp))//', expected a finite number')
      end if
      if (.not. (section%slack >= 0 .and. section%slack <= 1)) call raise(error, status_invalid_argument, &
         'slack is '//text_of(real(section%slack, dp))//', expected a number from 0 to 1')
      if (allocated(error)) return

      section%thickness = sum(plies%thickness)
      section%isotropic = .true.
      allocate (section%layers(size(plies)))
      bottom = -0.5_wp*section%thickness
      do i = 1, size(plies)
         middle = bottom + 0.5_wp*plies(i)%thickness
         ! exactly: a layer that fills the section is centred
         if (size(plies) == 1) middle = 0
         middle = middle + section%offset
         bottom = bottom + plies(i)%thickness
         associate (layer => section%layers(i), ply => plies(i))
            allocate (layer%law, source=ply%law)
            section%isotropic = section%isotropic .and. ply%law%isotropic
            section%switched = section%switched .or. ply%law%switched
            layer%thickness = ply%thickness
            layer%cosine = cos(degree*ply%angle)
            layer%sine = sin(degree*ply%angle)
            layer%points = ply%points
            call gauss_legendre(layer%z(:ply%points), layer%weight(:ply%points))
            layer%z(:ply%points) = middle + 0.5_wp*ply%thickness*layer%z(:ply%points)
            layer%weight(:ply%points) = 0.5_wp*ply%thickness*layer%weight(:ply%points)
            section%inertia = section%inertia + ply%density*ply%thickness*[1.0_wp, middle, middle**2 + ply%thickness**2/12]
         end associate
         if (i < size(plies) .and. bottom + section%offset <= 0) section%midsurface_layer = i + 1
      end do
      do i = 1, size(plies)
         natural = plies(i)%law%reference_tangent()
         section%natural_stiffness = section%natural_stiffness &
            + plies(i)%thickness*(natural(1) + natural(2) + 2*natural(3))/3
      end do
   end subroutine new_layered_section

   !> What is wrong with a layer, blank when nothing is.
   pure function complaint(ply) result(message)
      type(ply_t), intent(in) :: ply
      character(len=100) :: message
      message = ''
      if (.not. allocated(ply%law)) then
         message = 'a material law is missing'
      else if (.not. (ply%thickness > 0 .and. ply%thickness < huge(1.0_wp))) then
         message = 'thickness is '//text_of(real(ply%thickness, dp))//', expected a positive number'
      else if (ply%points < 1 .or. ply%points > max_gauss_points) then
         message = 'thickness_points is '//text_of(ply%points)//', expected 1 to '//text_of(max_gauss_points)
      else if (.not. abs(ply%angle) < huge(1.0_wp)) then
         message = 'angle is '//text_of(real(ply%angle, dp))//', expected a finite number of degrees'
      else if (.not. (ply%density >= 0 .and. ply%density < huge(1.0_wp))) then
         message = 'density is '//text_of(real(ply%density, dp))//', expected a number >= 0'
      end if
   end function complaint

   !> Resultants of a block of points: strain at reference height z is `membrane + z curvature`.
   !>
   !> Laws with switches (finshell_material) take `switches` into account, and without it switch at 0 exactly.
   pure subroutine integrate(section, level, membrane, curvature, axes, r, status, switches)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level !< level_energy, level_force or level_tangent
      real(wp), intent(in) :: membrane(points_per_block, 3), curvature(points_per_block, 3)
      real(wp), intent(in) :: axes(points_per_block, 2) !< cosine, sine of the element's material direction
      type(resultants_t), intent(inout) :: r
      integer(i4), intent(inout) :: status(points_per_block)
      type(switches_t), intent(in), optional :: switches
      real(wp) :: e(points_per_block, 3), k(points_per_block, 3), s(points_per_block, 3), d(points_per_block, 6)
      real(wp) :: x(points_per_block, 3), w(points_per_block), direction(points_per_block, 2)
      real(wp) :: weight, z
      integer :: i, l, p

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
            call layer%law%thickness_stretch(lanes, level, strain, l, dl, ddl, status)
         else
            call layer_direction(layer, axes, direction)
            call rotate_strain(lanes, direction, strain, e)
            call layer%law%thickness_stretch(lanes, level, e, l, dl, ddl, status)
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
   pure subroutine cauchy_stress(section, height, membrane, curvature, axes, sigma, status)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: height !< offset - thickness/2 (bottom) to offset + thickness/2 (top)
      real(wp), intent(in) :: membrane(lanes, 3), curvature(lanes, 3), axes(lanes, 2)
      real(wp), intent(out) :: sigma(lanes, 3)
      integer(i4), intent(inout) :: status(lanes)
      real(wp) :: e(lanes, 3), x(lanes, 3), s(lanes, 3), d(lanes, 6), w(lanes), l(lanes), dl(lanes, 3), ddl(lanes, 6)
      real(wp) :: direction(lanes, 2), u(lanes, 3), a(lanes, 3)
      real(wp), dimension(lanes) :: jacobian, inverse
      real(wp) :: top
      integer :: layer

      top = section%offset - 0.5_wp*section%thickness
      do layer = 1, size(section%layers) - 1
         top = top + section%layers(layer)%thickness
         if (height <= top) exit
      end do
      associate (law => section%layers(layer)%law)
         call layer_direction(section%layers(layer), axes, direction)
         e = membrane + height*curvature
         call rotate_strain(lanes, direction, e, x)
         call law%plane_stress(lanes, level_force, x, w, s, d, status)
         call law%thickness_stretch(lanes, level_energy, x, l, dl, ddl, status)
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

   !> Cosine and sine of axis 1 of the law of a layer, where those of the material direction are `axes`.
   pure subroutine layer_direction(layer, axes, direction)
      type(layer_t), intent(in) :: layer
      real(wp), intent(in) :: axes(:, :)
      real(wp), intent(out) :: direction(:, :)
      direction(:, 1) = layer%cosine*axes(:, 1) - layer%sine*axes(:, 2)
      direction(:, 2) = layer%sine*axes(:, 1) + layer%cosine*axes(:, 2)
   end subroutine layer_direction
end module finshell_section
