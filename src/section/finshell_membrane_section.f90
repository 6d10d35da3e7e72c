!> The section of a membrane: strain is the same through the thickness, so that each layer is evaluated once and nothing bends.
module finshell_membrane_section
   use finshell_kinds, only: wp, i4, lanes
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_law_block, only: plane_stress, switched_plane_stress
   use finshell_resultants, only: layer_direction
   use finshell_section, only: section_t
   use finshell_voigt, only: rotate_strain, rotate_stress, rotate_tangent
   implicit none
   private
   public :: membrane_force_t, membrane_switches_t, integrate_membrane

   !> Resultants per reference length of a block of elements.
   type :: membrane_force_t
      real(wp) :: energy(lanes) !< per reference area
      real(wp) :: n(lanes, 3) !< membrane force, conjugate to Green-Lagrange strain
      real(wp) :: a(lanes, 6) !< its tangent, packed symmetric
   end type membrane_force_t

   !> What laws with switches have to know (finshell_material).
   type :: membrane_switches_t
      real(wp) :: floor(lanes) !< strain that rounding of the motion alone can make
      logical :: directed = .false. !< the tangent is the one-sided one in the direction of the rates
      real(wp) :: rate(lanes, 3), rate_floor(lanes)
   end type membrane_switches_t

contains

   !> Resultants of a block at a membrane strain.
   pure subroutine integrate_membrane(section, level, strain, axes, r, status, switches)
      type(section_t), intent(in) :: section
      integer, intent(in) :: level !< level_energy, level_force or level_tangent
      real(wp), intent(in) :: strain(lanes, 3) !< in any in-plane axes
      real(wp), intent(in) :: axes(lanes, 2) !< cosine, sine of the element's material direction in these axes
      type(membrane_force_t), intent(inout) :: r
      integer(i4), intent(inout) :: status(lanes) !< status_material_limit, see finshell_material
      type(membrane_switches_t), intent(in), optional :: switches
      real(wp) :: e(lanes, 3), rate(lanes, 3), w(lanes), s(lanes, 3), d(lanes, 6), direction(lanes, 2)
      real(wp) :: h
      integer :: i, l

      r%energy = 0
      if (level >= level_force) r%n = 0
      if (level >= level_tangent) r%a = 0
      do l = 1, size(section%layers)
         associate (layer => section%layers(l))
            h = layer%thickness
            if (layer%law%isotropic) then
               call plane_stress(layer%law, level, strain, w, s, d, status)
            else
               call layer_direction(layer, axes, direction)
               call rotate_strain(lanes, direction, strain, e)
               if (.not. (layer%law%switched .and. present(switches))) then
                  call plane_stress(layer%law, level, e, w, s, d, status)
               else if (switches%directed) then
                  call rotate_strain(lanes, direction, switches%rate, rate)
                  call switched_plane_stress(layer%law, level, e, switches%floor, w, s, d, status, rate, switches%rate_floor)
               else
                  call switched_plane_stress(layer%law, level, e, switches%floor, w, s, d, status)
               end if
               if (level >= level_force) call rotate_stress(lanes, direction, s)
               if (level >= level_tangent) call rotate_tangent(lanes, direction, d)
            end if
         end associate
         r%energy = r%energy + h*w
         if (level < level_force) cycle
         do i = 1, 3
            r%n(:, i) = r%n(:, i) + h*s(:, i)
         end do
         if (level < level_tangent) cycle
         do i = 1, 6
            r%a(:, i) = r%a(:, i) + h*d(:, i)
         end do
      end do
   end subroutine integrate_membrane
end module finshell_membrane_section
