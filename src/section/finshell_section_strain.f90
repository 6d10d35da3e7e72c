!> Strain and stress at a height of a section: what is recovered of it.
module finshell_section_strain
   use finshell_kinds, only: wp, i4, lanes, strip
   use finshell_evaluation, only: level_energy, level_force
   use finshell_growth, only: from_stress_free, growth_t, new_growth, pull_back
   use finshell_law_block, only: plane_stress, thickness_stretch
   use finshell_own, only: own_t, actual_height
   use finshell_point_states, only: point_states_t, remembered_at
   use finshell_resultants, only: layer_direction
   use finshell_section, only: first_state, section_t
   use finshell_voigt, only: rotate_strain, rotate_stress
   implicit none
   private
   public :: cauchy_stress, elastic_strain, layer_at

contains

   !> Cauchy stress (element frame, rotated back) at a reference height: sigma = U S U/(det U lambda_3), U from the local strain.
   pure subroutine cauchy_stress(section, height, membrane, curvature, axes, sigma, status, own, bend, states)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: height !< of the section: offset - thickness/2 (bottom) to offset + thickness/2 (top)
      real(wp), intent(in) :: membrane(lanes, 3), curvature(lanes, 3), axes(lanes, 2)
      real(wp), intent(out) :: sigma(lanes, 3)
      integer(i4), intent(inout) :: status(lanes)
      type(own_t), intent(in) :: own
      real(wp), intent(in), optional :: bend(lanes, 3) !< with growth: curvature of the reference, mean over the element
      type(point_states_t), intent(in), optional :: states !< of laws with states
      real(wp) :: e(lanes, 3), x(lanes, 3), s(lanes, 3), d(lanes, 6), w(lanes), l(lanes), dl(lanes, 3), ddl(lanes, 6)
      real(wp) :: direction(lanes, 2), u(lanes, 3), a(lanes, 3)
      real(wp), dimension(lanes) :: jacobian, inverse
      type(growth_t) :: growth
      integer :: layer
      logical :: remembers

      layer = layer_at(section, height)
      call strain_at_height(section, layer, height, membrane, curvature, axes, own, e, x, direction, growth, bend)
      associate (law => section%layers(layer)%law)
         remembers = .false.
         if (law%states > 0 .and. present(states)) remembers = associated(states%all%begin)
         if (remembers) then
            call remembered(section, layer, height, x, states, w, s, d, status)
         else
            call plane_stress(law, level_force, x, w, s, d, status)
         end if
         call thickness_stretch(law, level_energy, x, l, dl, ddl, status)
         if (own%grown) then
            call pull_back(lanes, level_force, growth, w, s, d)
            l = growth%thickness(:lanes)*l
         end if
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
   pure subroutine remembered(section, layer, height, x, states, energy, stress, tangent, status)
      type(section_t), intent(in) :: section
      integer, intent(in) :: layer
      real(wp), intent(in) :: height, x(lanes, 3)
      type(point_states_t), intent(in) :: states
      real(wp), intent(inout) :: energy(lanes), stress(lanes, 3), tangent(lanes, 6)
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
      associate (given => section%layers(layer))
         call remembered_at(given%law, states, first_state(section, layer), given%points, given%z(:given%points), height, n, &
                            level_force, e, w, s, d, found)
      end associate
      energy = w(:lanes)
      stress = s(:lanes, :)
      tangent = 0 ! not asked for
      where (found(:lanes) /= 0) status = found(:lanes)
   end subroutine remembered

   !> The strain that the law of a layer looks at, in its axes: from the stress-free state.
   pure subroutine elastic_strain(section, layer, height, membrane, curvature, axes, own, elastic, bend)
      type(section_t), intent(in) :: section
      integer, intent(in) :: layer
      real(wp), intent(in) :: height !< of the section
      real(wp), intent(in) :: membrane(lanes, 3), curvature(lanes, 3), axes(lanes, 2)
      type(own_t), intent(in) :: own
      real(wp), intent(out) :: elastic(lanes, 3)
      real(wp), intent(in), optional :: bend(lanes, 3) !< as in `cauchy_stress`
      type(growth_t) :: growth
      real(wp) :: e(lanes, 3), direction(lanes, 2)
      call strain_at_height(section, layer, height, membrane, curvature, axes, own, e, elastic, direction, growth, bend)
   end subroutine elastic_strain

   !> Strain at a height from the reference in the element frame, and from the stress-free state in the axes of the law.
   pure subroutine strain_at_height(section, layer, height, membrane, curvature, axes, own, total, elastic, direction, growth, bend)
      type(section_t), intent(in) :: section
      integer, intent(in) :: layer
      real(wp), intent(in) :: height, membrane(lanes, 3), curvature(lanes, 3), axes(lanes, 2)
      type(own_t), intent(in) :: own
      real(wp), intent(out) :: total(lanes, 3), elastic(lanes, 3), direction(lanes, 2)
      type(growth_t), intent(inout) :: growth !< of the layer, where it has grown
      real(wp), intent(in), optional :: bend(lanes, 3)
      real(wp) :: z(lanes), bent(lanes, 3), turned(lanes, 2)
      integer :: i
      z = actual_height(own, height)
      do i = 1, 3
         total(:, i) = membrane(:, i) + z*curvature(:, i)
      end do
      call layer_direction(section%layers(layer), axes, direction)
      call rotate_strain(lanes, direction, total, elastic)
      if (.not. own%grown) return
      turned(:, 1) = section%layers(layer)%cosine
      turned(:, 2) = section%layers(layer)%sine
      if (present(bend)) then
         call rotate_strain(lanes, direction, bend, bent)
         call new_growth(own, layer, lanes, turned, growth, bent)
      else
         call new_growth(own, layer, lanes, turned, growth)
      end if
      ! what is curved has other lengths at this height from the start: that is no strain
      elastic = elastic - height*growth%curvature(:lanes, :)
      direction(:, 2) = -direction(:, 2)
      call rotate_strain(lanes, direction, elastic, total)
      direction(:, 2) = -direction(:, 2)
      call from_stress_free(lanes, growth, elastic)
   end subroutine strain_at_height

   !> Number of the layer at a height of the section.
   pure integer function layer_at(section, height) result(layer)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: height
      real(wp) :: top
      top = section%offset - 0.5_wp*section%thickness
      do layer = 1, size(section%layers) - 1
         top = top + section%layers(layer)%thickness
         if (height <= top) exit
      end do
   end function layer_at
end module finshell_section_strain
