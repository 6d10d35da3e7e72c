!> Curved references: unit normals at the nodes make a shallow curved element of the flat facet (theory, S2c).
!>
!> All of it are constants of the reference. The rotation E0_i that takes the normal of the facet to that of the node turns the
!> nodal rotation on the right, R_i E0_i, so that the reference itself has slopes G0_i. Slope strain and curvature are counted from
!> theirs, V0 and K0, and the strain is referred to the metric I + V0 of the curved surface: E <- A E A, A = (I + V0)^(-1/2).
module finshell_curved
   use finshell_kinds, only: wp, i4, lanes, points_per_block
   use finshell_metric_change, only: change_strain, new_metric_change, pull_back_stress, pull_back_tangent
   use finshell_bending, only: bending_t, new_bending
   use finshell_evaluation, only: level_energy, level_force, level_tangent
   use finshell_quaternion, only: turn_quaternions
   use finshell_reference, only: reference_t, side_to
   use finshell_resultants, only: resultants_t
   use finshell_section, only: section_t
   use finshell_status, only: status_invalid_argument
   implicit none
   private
   public :: curved_t, turned_t, new_turned, new_curved, turn_nodes, refer_to, refer_change_to, reference_curvature, &
      from_curved

   !> The normals of the nodes against that of the facet.
   type :: turned_t
      logical :: any !< a normal of the block differs from that of its facet; else the rest is not set
      real(wp) :: turn(lanes, 4, 3) !< E0_i, quaternion, global components
      real(wp) :: slope(lanes, 6) !< G0_i
   end type turned_t

   type, extends(turned_t) :: curved_t
      real(wp) :: v(lanes, 3) !< V0: 11, 22, 12
      real(wp) :: curvature(lanes, 3, 3) !< K0, Voigt, at the points
      real(wp) :: strain(lanes, 3, 3) !< E <- A E A for Voigt strains
      real(wp) :: area(lanes) !< of the curved element over that of the facet
   end type curved_t

   !> A normal nearer than this to that of the facet is the facet's: flat stays flat to the last bit.
   real(wp), parameter :: same_direction = 64*epsilon(1.0_wp)

contains

   !> Constants of a block of elements; see `new_turned` for the normals.
   pure subroutine new_curved(section, ref, normal, curved, status)
      type(section_t), intent(in) :: section
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: normal(lanes, 3, 3) !< (element, component, node)
      type(curved_t), intent(inout) :: curved
      integer(i4), intent(inout) :: status(lanes)
      type(bending_t) :: bend
      real(wp) :: flat(lanes, 3), one(lanes)

      call new_turned(ref, normal, curved%turned_t, status)
      if (.not. curved%any) return
      flat(:, 1:2) = 1
      flat(:, 3) = 0
      one = 1
      call new_bending(section, level_energy, ref, flat, one, curved%slope, bend)
      curved%v = bend%v
      curved%curvature = bend%curvature
      call new_metric_change(lanes, curved%v, curved%strain, curved%area)
      curved%area = curved%area + strips(ref, curved%slope)
   end subroutine new_curved

   !> A normal may have any length; one that is zero, or 90 degrees or more from that of the facet, is status_invalid_argument.
   pure subroutine new_turned(ref, normal, turned, status)
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: normal(lanes, 3, 3) !< (element, component, node)
      type(turned_t), intent(inout) :: turned
      integer(i4), intent(inout) :: status(lanes)
      real(wp), dimension(lanes) :: sine, cosine, length, half, angle, factor !< half: cosine of half the angle
      real(wp) :: axis(lanes, 3, 3)
      logical :: kept(lanes)
      integer :: c, k

      turned%any = .false.
      do k = 1, 3
         axis(:, 1, k) = ref%frame(:, 2, 3)*normal(:, 3, k) - ref%frame(:, 3, 3)*normal(:, 2, k)
         axis(:, 2, k) = ref%frame(:, 3, 3)*normal(:, 1, k) - ref%frame(:, 1, 3)*normal(:, 3, k)
         axis(:, 3, k) = ref%frame(:, 1, 3)*normal(:, 2, k) - ref%frame(:, 2, 3)*normal(:, 1, k)
         cosine = ref%frame(:, 1, 3)*normal(:, 1, k) + ref%frame(:, 2, 3)*normal(:, 2, k) + ref%frame(:, 3, 3)*normal(:, 3, k)
         sine = sqrt(axis(:, 1, k)**2 + axis(:, 2, k)**2 + axis(:, 3, k)**2)
         where (status == 0 .and. .not. cosine > 0) status = status_invalid_argument
         kept = sine > same_direction*cosine .and. cosine > 0
         turned%any = turned%any .or. any(kept)
         length = max(sqrt(sine**2 + cosine**2), tiny(1.0_wp))
         half = sqrt(0.5_wp + 0.5_wp*max(cosine, 0.0_wp)/length)
         factor = merge(0.5_wp/(length*half), 0.0_wp, kept)
         turned%turn(:, 1, k) = merge(half, 1.0_wp, kept)
         do c = 1, 3
            turned%turn(:, 1 + c, k) = factor*axis(:, c, k)
         end do
         angle = atan2(sine, max(cosine, tiny(1.0_wp)))
         factor = merge(angle/max(sine, tiny(1.0_wp)), 0.0_wp, kept)
         turned%slope(:, 2*k - 1) = -factor*(axis(:, 1, k)*ref%frame(:, 1, 2) + axis(:, 2, k)*ref%frame(:, 2, 2) &
                                             + axis(:, 3, k)*ref%frame(:, 3, 2))
         turned%slope(:, 2*k) = factor*(axis(:, 1, k)*ref%frame(:, 1, 1) + axis(:, 2, k)*ref%frame(:, 2, 1) &
                                        + axis(:, 3, k)*ref%frame(:, 3, 1))
      end do
   end subroutine new_turned

   !> Area over that of the facet of the strips beside the graph over the facet: over each side, from the plane normal to the facet
   !> to that of the normals at the nodes, up to the arc.
   pure function strips(ref, slope) result(area)
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: slope(lanes, 6)
      real(wp) :: area(lanes)
      real(wp), dimension(lanes) :: height, tilt
      integer :: i, j, k
      area = 0
      do k = 1, 3
         i = 2*k
         j = 2*side_to(k)
         height = ref%bow(:, k)*(ref%side(:, 1, k)*(slope(:, i - 1) - slope(:, j - 1)) &
                                 + ref%side(:, 2, k)*(slope(:, i) - slope(:, j)))
         tilt = 0.5_wp*(ref%side(:, 1, k)*(slope(:, i) + slope(:, j)) - ref%side(:, 2, k)*(slope(:, i - 1) + slope(:, j - 1)))
         area = area + (2.0_wp/3)*height*tilt/ref%area
      end do
   end function strips

   !> Nodal rotations R_i become R_i E0_i.
   pure subroutine turn_nodes(turned, quaternion)
      class(turned_t), intent(in) :: turned
      real(wp), intent(inout) :: quaternion(lanes, 4, 3)
      integer :: k
      do k = 1, 3
         call turn_quaternions(lanes, quaternion(:, :, k), turned%turn(:, :, k))
      end do
   end subroutine turn_nodes

   !> Strains at the points counted from the curved reference and referred to its metric.
   pure subroutine refer_to(curved, membrane, curvature)
      type(curved_t), intent(in) :: curved
      real(wp), intent(inout) :: membrane(points_per_block, 3), curvature(points_per_block, 3)
      integer :: g, k
      do g = 1, 3
         k = lanes*(g - 1)
         membrane(k + 1:k + lanes, 1) = membrane(k + 1:k + lanes, 1) - 0.5_wp*curved%v(:, 1)
         membrane(k + 1:k + lanes, 2) = membrane(k + 1:k + lanes, 2) - 0.5_wp*curved%v(:, 2)
         membrane(k + 1:k + lanes, 3) = membrane(k + 1:k + lanes, 3) - curved%v(:, 3)
         curvature(k + 1:k + lanes, :) = curvature(k + 1:k + lanes, :) + curved%curvature(:, :, g)
      end do
      call refer_change_to(curved, membrane, curvature)
   end subroutine refer_to

   !> The same for changes of the strains.
   pure subroutine refer_change_to(curved, membrane, curvature)
      type(curved_t), intent(in) :: curved
      real(wp), intent(inout) :: membrane(points_per_block, 3), curvature(points_per_block, 3)
      integer :: k
      do k = 0, 2*lanes, lanes
         call change_strain(lanes, curved%strain, membrane(k + 1:k + lanes, :))
         call change_strain(lanes, curved%strain, curvature(k + 1:k + lanes, :))
      end do
   end subroutine refer_change_to

   !> K0 at the points, referred to the metric of the curved surface.
   pure subroutine reference_curvature(curved, curvature)
      type(curved_t), intent(in) :: curved
      real(wp), intent(out) :: curvature(points_per_block, 3)
      integer :: g, k
      do g = 1, 3
         k = lanes*(g - 1)
         curvature(k + 1:k + lanes, :) = curved%curvature(:, :, g)
         call change_strain(lanes, curved%strain, curvature(k + 1:k + lanes, :))
      end do
      do k = 3*lanes + 1, points_per_block
         curvature(k, :) = curvature(1, :)
      end do
   end subroutine reference_curvature

   !> Resultants and tangents on the curved surface, pulled back to the facet.
   pure subroutine from_curved(level, curved, r)
      integer, intent(in) :: level
      type(curved_t), intent(in) :: curved
      type(resultants_t), intent(inout) :: r
      integer :: g, k
      do g = 1, 3
         k = lanes*(g - 1)
         r%energy(k + 1:k + lanes) = curved%area*r%energy(k + 1:k + lanes)
         if (level < level_force) cycle
         call pull_back_stress(lanes, curved%strain, curved%area, r%n(k + 1:k + lanes, :))
         call pull_back_stress(lanes, curved%strain, curved%area, r%m(k + 1:k + lanes, :))
         if (level < level_tangent) cycle
         call pull_back_tangent(lanes, curved%strain, curved%area, r%a(k + 1:k + lanes, :))
         call pull_back_tangent(lanes, curved%strain, curved%area, r%b(k + 1:k + lanes, :))
         call pull_back_tangent(lanes, curved%strain, curved%area, r%d(k + 1:k + lanes, :))
      end do
   end subroutine from_curved
end module finshell_curved
