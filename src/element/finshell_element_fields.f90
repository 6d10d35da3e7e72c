!> The table of element fields: names, components, places, units, and one short procedure each.
!>
!> A new field is one line of `element_fields` and one procedure here. Input, result files, monitors, the C interface and Python
!> go by this table, and doc/namelist.md is compared with it.
!>
!> Components 11, 22, 12 are those of a tensor in the material direction projected on the element and the in-plane normal to it,
!> carried along by the element's rotation; directions are unit vectors in the deformed configuration, global components.
!>
!> A field may be made in two stages: `recover` finds a tensor, `finish` makes of it what is reported, as principal values. Linear
!> changes of a state are taken of the tensor.
module finshell_element_fields
   use finshell_element_field, only: element_field_t, field, at_element, at_surfaces, at_layers, change_none, change_quadratic
   use finshell_kinds, only: wp, i4, lanes
   use finshell_recovered, only: recovered_t
   use finshell_resultants, only: layer_direction
   use finshell_section, only: section_t
   use finshell_section_strain, only: cauchy_stress, elastic_strain, layer_at
   use finshell_status, only: status_no_value
   use finshell_voigt, only: rotate_strain, rotate_stress
   implicit none
   private
   public :: element_fields, find_element_field, surface_stress, n_element_fields

   integer, parameter :: n_element_fields = 20

contains

   !> All element fields, in the order of the result files.
   pure function element_fields() result(table)
      type(element_field_t) :: table(n_element_fields)
      table = [ &
         field('thickness_stretch', '', at_element, '-', thickness_stretch, &
               'current over reference thickness at the surface of the nodes'), &
         field('membrane_force', '11, 22, 12', at_element, 'force/length', membrane_force, &
               'per reference length, conjugate to the Green-Lagrange strain of the surface of the nodes'), &
         field('moment', '11, 22, 12', at_element, 'force', moment, &
               'per reference length, about the surface of the nodes, conjugate to the curvature'), &
         field('stress', '11, 22, 12', at_surfaces, 'stress', surface_stress, &
               'Cauchy stress'), &
         field('strain', '11, 22, 12', at_surfaces, '-', strain, &
               'Green-Lagrange strain, from the stress-free state'), &
         field('curvature', '11, 22, 12', at_element, '1/length', curvature, &
               'change of the Green-Lagrange strain per reference height'), &
         field('principal_stretch', '1, 2', at_surfaces, '-', stretch, &
               'in the plane of the element, from the stress-free state, the larger first', principal_values, raw=3), &
         field('principal_direction_1', 'x, y, z', at_surfaces, '-', stretch, &
               'direction of the larger principal stretch', larger_direction), &
         field('principal_direction_2', 'x, y, z', at_surfaces, '-', stretch, &
               'direction of the smaller principal stretch', smaller_direction), &
         field('principal_stress', '1, 2', at_surfaces, 'stress', surface_stress, &
               'principal Cauchy stress in the plane of the element, the larger first', principal_values, raw=3), &
         field('von_mises', '', at_surfaces, 'stress', surface_stress, &
               'equivalent stress of von Mises', von_mises, raw=3), &
         field('fibre_stretch', '1, 2', at_layers, '-', fibre_stretch, &
               'along the families of fibres of the law, from the stress-free state; one family counts twice'), &
         field('fibre_direction_1', 'x, y, z', at_layers, '-', fibre_direction_1, &
               'direction of the first family of fibres', along, raw=2, change=change_none), &
         field('fibre_direction_2', 'x, y, z', at_layers, '-', fibre_direction_2, &
               'direction of the second family of fibres', along, raw=2, change=change_none), &
         field('energy_density', '', at_element, 'energy/volume', energy_density, &
               'stored energy per reference volume, mean over the element', change=change_quadratic), &
         field('material_stress', '11, 22, 12', at_layers, 'stress', material_stress, &
               'Cauchy stress, 1 being axis 1 of the law of the layer'), &
         field('wrinkle_state', '', at_element, '-', wrinkle_state, &
               'of membranes: 0 slack, 1 wrinkled, 2 taut', change=change_none), &
         field('wrinkle_ridge', 'x, y, z', at_element, '-', wrinkle_ridge, &
               'of membranes: along the ridges of wrinkles; zero where there are none', change=change_none), &
         field('slack_energy_density', '', at_element, 'energy/volume', slack_energy_density, &
               'of membranes: part of energy_density, of what is left to compression', change=change_quadratic), &
         field('thickness', '', at_element, 'length', thickness, &
               'of the whole section, in the reference state', change=change_none)]
   end function element_fields

   pure subroutine thickness_stretch(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      values(:, 1) = r%stretch
   end subroutine thickness_stretch

   pure subroutine membrane_force(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      values = r%force
   end subroutine membrane_force

   pure subroutine moment(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      values = r%moment
   end subroutine moment

   pure subroutine energy_density(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      values(:, 1) = r%energy
   end subroutine energy_density

   pure subroutine curvature(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      values = tensor(r%axes, r%curvature)
   end subroutine curvature

   pure subroutine strain(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      values = strain_at(section, r, layer_at(section, surface(section, place)), surface(section, place))
   end subroutine strain

   pure subroutine stretch(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      values = stretch_at(section, r, layer_at(section, surface(section, place)), surface(section, place))
   end subroutine stretch

   pure subroutine surface_stress(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      call cauchy_stress(section, surface(section, place), r%membrane, r%curvature, r%axes, values, status, r%own, r%bend, &
                         r%states)
      call rotate_stress(lanes, r%back, values)
   end subroutine surface_stress

   pure subroutine material_stress(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      real(wp) :: axes(lanes, 2)
      call cauchy_stress(section, middle(section, place), r%membrane, r%curvature, r%axes, values, status, r%own, r%bend, &
                         r%states)
      call layer_direction(section%layers(place), r%axes, axes)
      call rotate_stress(lanes, reverse(axes), values)
   end subroutine material_stress

   pure subroutine fibre_stretch(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      real(wp) :: e(lanes, 3), fibre(3, 2)
      integer :: i, families
      call section%layers(place)%law%fibres(families, fibre)
      if (families == 0) status = max(status, status_no_value)
      call elastic_strain(section, place, middle(section, place), r%membrane, r%curvature, r%axes, r%own, e, r%bend)
      do i = 1, 2
         associate (f => fibre(:, max(1, min(i, families))))
            values(:, i) = sqrt(1 + 2*(f(1)*e(:, 1) + f(2)*e(:, 2) + f(3)*e(:, 3)))
         end associate
      end do
   end subroutine fibre_stretch

   pure subroutine fibre_direction_1(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      call fibre_direction(section, r, place, 1, values, status)
   end subroutine fibre_direction_1

   pure subroutine fibre_direction_2(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      call fibre_direction(section, r, place, 2, values, status)
   end subroutine fibre_direction_2

   !> U a0 for the fibres a0 of a family.
   pure subroutine fibre_direction(section, r, place, family, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place, family
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      real(wp) :: u(lanes, 3), fibre(3, 2), c, s, a(2)
      integer :: families
      call section%layers(place)%law%fibres(families, fibre)
      if (families == 0) status = max(status, status_no_value)
      ! cosine and sine of the angle to the material direction of the element
      associate (f => fibre(:, max(1, min(family, families))), layer => section%layers(place))
         c = sqrt(f(1))
         s = sign(sqrt(f(2)), f(3))
         a = [layer%cosine*c - layer%sine*s, layer%sine*c + layer%cosine*s]
      end associate
      u = stretch_at(section, r, place, middle(section, place))
      values(:, 1) = u(:, 1)*a(1) + u(:, 3)*a(2)
      values(:, 2) = u(:, 3)*a(1) + u(:, 2)*a(2)
   end subroutine fibre_direction

   !> Green-Lagrange strain at a height of the section, from the stress-free state, along the material direction.
   pure function strain_at(section, r, layer, height) result(e)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: layer
      real(wp), intent(in) :: height
      real(wp) :: e(lanes, 3)
      real(wp) :: local(lanes, 3), back(lanes, 2)
      call elastic_strain(section, layer, height, r%membrane, r%curvature, r%axes, r%own, local, r%bend)
      back(:, 1) = section%layers(layer)%cosine
      back(:, 2) = -section%layers(layer)%sine
      e = tensor(back, local)
   end function strain_at

   !> U = C^(1/2) in the plane, by its closed form (C + J I)/t.
   pure function stretch_at(section, r, layer, height) result(u)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: layer
      real(wp), intent(in) :: height
      real(wp) :: u(lanes, 3)
      real(wp) :: jacobian(lanes), t(lanes)
      u = 2*strain_at(section, r, layer, height)
      jacobian = sqrt((1 + u(:, 1))*(1 + u(:, 2)) - u(:, 3)**2)
      t = sqrt(2 + u(:, 1) + u(:, 2) + 2*jacobian)
      u(:, 1) = (1 + u(:, 1) + jacobian)/t
      u(:, 2) = (1 + u(:, 2) + jacobian)/t
      u(:, 3) = u(:, 3)/t
   end function stretch_at

   !> Components 11, 22, 12 along the material direction of a strain E11, E22, 2 E12 in the frame of the element.
   pure function tensor(axes, strain) result(e)
      real(wp), intent(in) :: axes(lanes, 2), strain(lanes, 3)
      real(wp) :: e(lanes, 3)
      call rotate_strain(lanes, axes, strain, e)
      e(:, 3) = 0.5_wp*e(:, 3)
   end function tensor

   pure subroutine wrinkle_state(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      if (section%membrane) then
         values(:, 1) = r%state
      else
         status = max(status, status_no_value)
      end if
   end subroutine wrinkle_state

   pure subroutine wrinkle_ridge(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      if (section%membrane) then
         values = r%ridge
      else
         status = max(status, status_no_value)
      end if
   end subroutine wrinkle_ridge

   pure subroutine slack_energy_density(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      if (section%membrane) then
         values(:, 1) = r%slack_energy
      else
         status = max(status, status_no_value)
      end if
   end subroutine slack_energy_density

   pure subroutine thickness(section, r, place, values, status)
      type(section_t), intent(in) :: section
      type(recovered_t), intent(in) :: r
      integer, intent(in) :: place
      real(wp), intent(inout), contiguous :: values(:, :)
      integer(i4), intent(inout) :: status(lanes)
      values(:, 1) = section%thickness
      if (r%own%sized) values(:, 1) = r%own%ratio*section%thickness
   end subroutine thickness

   pure subroutine principal_values(raw, frame, values)
      real(wp), intent(in) :: raw(:), frame(3, 2)
      real(wp), intent(out) :: values(:)
      real(wp) :: radius
      radius = hypot(0.5_wp*(raw(1) - raw(2)), raw(3))
      values = 0.5_wp*(raw(1) + raw(2)) + [radius, -radius]
   end subroutine principal_values

   pure subroutine von_mises(raw, frame, values)
      real(wp), intent(in) :: raw(:), frame(3, 2)
      real(wp), intent(out) :: values(:)
      values = sqrt(raw(1)**2 - raw(1)*raw(2) + raw(2)**2 + 3*raw(3)**2)
   end subroutine von_mises

   !> Of the two signs that with a positive component along the material direction; where all directions are principal, this one.
   pure subroutine larger_direction(raw, frame, values)
      real(wp), intent(in) :: raw(:), frame(3, 2)
      real(wp), intent(out) :: values(:)
      real(wp) :: angle
      angle = 0.5_wp*atan2(2*raw(3), raw(1) - raw(2))
      call along([cos(angle), sin(angle)], frame, values)
   end subroutine larger_direction

   !> The larger one turned by 90 degrees about the normal.
   pure subroutine smaller_direction(raw, frame, values)
      real(wp), intent(in) :: raw(:), frame(3, 2)
      real(wp), intent(out) :: values(:)
      real(wp) :: angle
      angle = 0.5_wp*atan2(2*raw(3), raw(1) - raw(2))
      call along([-sin(angle), cos(angle)], frame, values)
   end subroutine smaller_direction

   !> Unit vector of given components along the frame; zero for a slack membrane that has collapsed.
   pure subroutine along(raw, frame, values)
      real(wp), intent(in) :: raw(:), frame(3, 2)
      real(wp), intent(out) :: values(:)
      values = matmul(frame, raw(1:2))
      values = values/max(norm2(values), tiny(1.0_wp))
   end subroutine along

   !> Reference height of bottom, middle, top.
   pure real(wp) function surface(section, place)
      type(section_t), intent(in) :: section
      integer, intent(in) :: place
      surface = section%offset + 0.5_wp*(place - 2)*section%thickness
   end function surface

   !> Reference height of the middle of a layer.
   pure real(wp) function middle(section, layer)
      type(section_t), intent(in) :: section
      integer, intent(in) :: layer
      middle = section%offset
      if (size(section%layers) > 1) middle = surface(section, 1) + sum(section%layers(:layer - 1)%thickness) &
         + 0.5_wp*section%layers(layer)%thickness
   end function middle

   !> From the frame of the element into axes that stand in it.
   pure function reverse(axes) result(back)
      real(wp), intent(in) :: axes(lanes, 2)
      real(wp) :: back(lanes, 2)
      back(:, 1) = axes(:, 1)
      back(:, 2) = -axes(:, 2)
   end function reverse

   !> The number of an element field in the table, 0: there is none of this name.
   pure integer function find_element_field(name)
      character(len=*), intent(in) :: name
      type(element_field_t) :: table(n_element_fields)
      table = element_fields()
      do find_element_field = n_element_fields, 1, -1
         if (table(find_element_field)%name == name) exit
      end do
   end function find_element_field
end module finshell_element_fields
