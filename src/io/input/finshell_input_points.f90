!> Thickness points of the layers whose group &section does not give them: by law, thickness over radius, and preset.
module finshell_input_points
   use finshell_error, only: text_of
   use finshell_gauss, only: max_gauss_points
   use finshell_input_preset, only: preset_t
   use finshell_kinds, only: wp
   use finshell_section, only: set_points, usual_points
   use finshell_structure, only: structure_t, thickness_of
   implicit none
   private
   public :: choose_points

contains

   !> The normals of a structure say how curved its reference is; facets count as flat. Membranes do not bend.
   subroutine choose_points(structure, preset)
      type(structure_t), intent(inout) :: structure
      type(preset_t), intent(inout) :: preset
      real(wp) :: curvature(size(structure%sections))
      integer :: l, s

      curvature = largest_curvatures(structure)
      do s = 1, size(structure%sections)
         if (structure%sections(s)%membrane) cycle
         do l = 1, size(structure%sections(s)%layers)
            associate (layer => structure%sections(s)%layers(l))
               if (layer%points_given) cycle
               call set_points(layer, min(max_gauss_points, usual_points(layer%law, layer%thickness*curvature(s)) &
                                          + merge(0, preset%more_points, layer%law%linear)))
               call preset%note('thickness_points', text_of(layer%points))
            end associate
         end do
      end do
   end subroutine choose_points

   !> (sections) Largest 1/radius of their elements, how much normals turn along a side over its length, where they have the
   !> thickness of the section; thicker ones count as more curved.
   pure function largest_curvatures(structure) result(curvature)
      type(structure_t), intent(in) :: structure
      real(wp) :: curvature(size(structure%sections))
      real(wp) :: ratio, side(3), turn(3)
      integer :: e, i, j

      curvature = 0
      if (.not. allocated(structure%normal)) return
      do e = 1, size(structure%normal, 3)
         associate (nodes => structure%mesh%triangles(:, e), largest => curvature(structure%element_section(e)))
            ratio = thickness_of(structure, e)/structure%sections(structure%element_section(e))%thickness
            do i = 1, 3
               j = 1 + mod(i, 3)
               side = structure%mesh%coordinates(:, nodes(j)) - structure%mesh%coordinates(:, nodes(i))
               turn = structure%normal(:, j, e) - structure%normal(:, i, e)
               largest = max(largest, ratio*norm2(turn)/norm2(side))
            end do
         end associate
      end do
   end function largest_curvatures
end module finshell_input_points
