!> Stiffness of a section at rest, as in the theory of laminates: membrane force and moment per membrane strain and curvature.
module finshell_laminate
   use finshell_evaluation, only: level_tangent
   use finshell_kinds, only: wp, i4, strip
   use finshell_section, only: section_t
   use finshell_voigt, only: pack, rotate_tangent
   implicit none
   private
   public :: stiffness_at_rest

contains

   !> The matrix (A, B; B, D) of the unstrained section, in the element's material axes: (N11, N22, N12, M11, M22, M12), about the
   !> surface of the nodes, from (E11, E22, 2 E12, K11, K22, 2 K12). Fibres that act in tension only are slack. Of a membrane
   !> B and D are zero, and if it wrinkles A is that of the taut one. Not 0 in `status`: a law has no tangent there.
   pure subroutine stiffness_at_rest(section, stiffness, status)
      type(section_t), intent(in) :: section
      real(wp), intent(out) :: stiffness(6, 6)
      integer(i4), intent(out) :: status
      real(wp), parameter :: nothing(strip, 3) = 0, floor(strip) = epsilon(1.0_wp)
      real(wp) :: energy(strip), stress(strip, 3), tangent(strip, 6), direction(strip, 2), d(3, 3), moments(0:2)
      integer(i4) :: found(strip)
      integer :: i, l
      stiffness = 0
      status = 0
      do l = 1, size(section%layers)
         associate (layer => section%layers(l))
            found = 0
            call layer%law%switched_plane_stress(strip, level_tangent, nothing, floor, energy, stress, tangent, found)
            status = found(1)
            if (status /= 0) return
            direction(:, 1) = layer%cosine
            direction(:, 2) = layer%sine
            if (.not. layer%law%isotropic) call rotate_tangent(strip, direction, tangent)
            do i = 1, 3
               d(:, i) = tangent(1, pack(:, i))
            end do
            moments(0) = layer%thickness
            moments(1:2) = 0
            if (.not. section%membrane) then
               do i = 0, 2 ! as evaluation integrates
                  moments(i) = sum(layer%weight(:layer%points)*layer%z(:layer%points)**i)
               end do
            end if
         end associate
         stiffness(:3, :3) = stiffness(:3, :3) + moments(0)*d
         stiffness(:3, 4:) = stiffness(:3, 4:) + moments(1)*d
         stiffness(4:, :3) = stiffness(4:, :3) + moments(1)*d
         stiffness(4:, 4:) = stiffness(4:, 4:) + moments(2)*d
      end do
   end subroutine stiffness_at_rest
end module finshell_laminate
