!> A section: layers of material through the thickness, and the options of the element formulation.
!>
!> It is configured once and immutable afterwards, so any number of threads may share it.
module finshell_section
   use finshell_kinds, only: wp, dp
   use finshell_error, only: error_t, raise, text_of
   use finshell_material, only: material_t
   use finshell_status, only: status_invalid_argument
   use finshell_gauss, only: gauss_legendre, max_gauss_points
   implicit none
   private
   public :: section_t, layer_t, ply_t, new_section, new_layered_section, formulation_s, formulation_p
   public :: points_by_law, usual_points, set_points, numbers_of, first_state, states_of

   !> Formulation of the core element: (S) stabilised, the default; (P) the paper's.
   integer, parameter :: formulation_s = 1, formulation_p = 2

   integer, parameter :: points_by_law = -huge(1) !< thickness points as `usual_points` has them
   real(wp), parameter :: default_slack = 1.0e-6_wp

   !> A layer as the user gives it to `new_layered_section`.
   type :: ply_t
      class(material_t), allocatable :: law
      real(wp) :: thickness = 0 !< > 0
      real(wp) :: angle = 0 !< degrees, from the element's material direction to the layer's axis 1, about the normal
      integer :: points = points_by_law !< Gauss points through the layer, 1 to 12
      real(wp) :: density = 0 !< mass per reference volume, >= 0
   end type ply_t

   type :: layer_t
      class(material_t), allocatable :: law
      real(wp) :: thickness = 0
      real(wp) :: cosine = 1, sine = 0 !< of the angle from the element's material direction to the layer's axis 1
      real(wp) :: middle = 0 !< reference height
      integer :: points = 0
      logical :: points_given = .false. !< otherwise they are those of the law
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
      integer, intent(in), optional :: thickness_points !< Gauss points through the thickness, 1 to 12; default: by the law
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
      do i = 1, size(plies)
         if (section%membrane .and. plies(i)%law%states > 0) call raise(error, status_invalid_argument, &
            'a membrane takes no law with states, as '''//trim(plies(i)%law%name)//''' is: take a shell')
      end do
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
            layer%middle = middle
            layer%points_given = ply%points /= points_by_law
            call set_points(layer, merge(ply%points, usual_points(ply%law), layer%points_given))
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

   !> Gauss points that a layer of this law needs where none are given (doc/switches.md): the error of the moment stays below 1e-4
   !> where bending turns the curvature of the reference over (a change of 2/R), for laws of rubber.
   pure integer function usual_points(law, curvature) result(points)
      class(material_t), intent(in) :: law
      real(wp), intent(in), optional :: curvature !< of the reference times the thickness of the layer, h/R; default 0
      real(wp), parameter :: bounds(4) = [0.075_wp, 0.15_wp, 0.22_wp, 0.3_wp] !< of h/R, a point more from each on
      points = 2
      if (law%linear) return
      points = merge(5, 3, law%switched) ! fibres: the stress has a kink that moves through the thickness
      if (present(curvature)) points = points + count(curvature > bounds)
   end function usual_points

   !> State variables of a layer of a shell element, in its three in-plane points.
   pure integer function numbers_of(layer)
      type(layer_t), intent(in) :: layer
      numbers_of = 3*layer%points*layer%law%states
   end function numbers_of

   !> Place, from 0, of the first state variable of a layer among those of an element of a section (finshell_law_states).
   pure integer function first_state(section, layer)
      type(section_t), intent(in) :: section
      integer, intent(in) :: layer
      integer :: l
      first_state = 0
      do l = 1, layer - 1
         first_state = first_state + numbers_of(section%layers(l))
      end do
   end function first_state

   !> State variables of an element of a section.
   pure integer function states_of(section)
      type(section_t), intent(in) :: section
      states_of = first_state(section, size(section%layers) + 1)
   end function states_of

   !> Integrate a layer by so many Gauss points.
   pure subroutine set_points(layer, points)
      type(layer_t), intent(inout) :: layer
      integer, intent(in) :: points !< 1 to 12
      layer%points = points
      call gauss_legendre(layer%z(:points), layer%weight(:points))
      layer%z(:points) = layer%middle + 0.5_wp*layer%thickness*layer%z(:points)
      layer%weight(:points) = 0.5_wp*layer%thickness*layer%weight(:points)
   end subroutine set_points

   !> What is wrong with a layer, blank when nothing is.
   pure function complaint(ply) result(message)
      type(ply_t), intent(in) :: ply
      character(len=100) :: message
      message = ''
      if (.not. allocated(ply%law)) then
         message = 'a material law is missing'
      else if (.not. (ply%thickness > 0 .and. ply%thickness < huge(1.0_wp))) then
         message = 'thickness is '//text_of(real(ply%thickness, dp))//', expected a positive number'
      else if (ply%points /= points_by_law .and. (ply%points < 1 .or. ply%points > max_gauss_points)) then
         message = 'thickness_points is '//text_of(ply%points)//', expected 1 to '//text_of(max_gauss_points)
      else if (.not. abs(ply%angle) < huge(1.0_wp)) then
         message = 'angle is '//text_of(real(ply%angle, dp))//', expected a finite number of degrees'
      else if (.not. (ply%density >= 0 .and. ply%density < huge(1.0_wp))) then
         message = 'density is '//text_of(real(ply%density, dp))//', expected a number >= 0'
      end if
   end function complaint
end module finshell_section
