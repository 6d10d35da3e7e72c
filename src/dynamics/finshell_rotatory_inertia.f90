!> Rotatory inertia that does not limit the stable increment.
!>
!> The natural one of a thin sheet, thickness^2/12 per mass, makes its rotations, the drilling ones before all, by far the fastest
!> motion. With an inertia of about the area of an element per mass they are as slow as its displacements (Key & Beisinger 1971;
!> Hughes, Cohen & Haroun 1978).
module finshell_rotatory_inertia
   use finshell_freedoms, only: n_corners, rx, rz
   use finshell_kinds, only: wp
   use finshell_point_masses, only: point_masses
   use finshell_rotation, only: cross_product
   use finshell_structure, only: structure_t, inertia_of, is_membrane
   implicit none
   private
   public :: scale_rotatory_inertia

contains

   !> Replace the rotatory inertia of the nodes: that of each element is at least `scaling` times its mass times its area;
   !> that of points stays.
   pure subroutine scale_rotatory_inertia(structure, scaling, mass)
      type(structure_t), intent(in) :: structure
      real(wp), intent(in) :: scaling
      real(wp), intent(inout) :: mass(:, :) !< (n_nodal, nodes) lumped
      real(wp), allocatable :: points(:, :)
      real(wp) :: area, inertia(3)
      integer :: e, j
      points = point_masses(structure)
      mass(rx:rz, :) = points(rx:rz, :)
      do e = 1, size(structure%mesh%triangles, 2)
         if (is_membrane(structure, e)) cycle
         inertia = inertia_of(structure, e)
         associate (nodes => structure%mesh%triangles(:, e), x => structure%mesh%coordinates)
            area = 0.5_wp*norm2(cross_product(x(:, nodes(2)) - x(:, nodes(1)), x(:, nodes(3)) - x(:, nodes(1))))
            do j = 1, n_corners
               mass(rx:rz, nodes(j)) = mass(rx:rz, nodes(j)) + area/n_corners*max(inertia(3), scaling*area*inertia(1))
            end do
         end associate
      end do
   end subroutine scale_rotatory_inertia
end module finshell_rotatory_inertia
