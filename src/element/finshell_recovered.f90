!> What is known of a block of elements once they are recovered: the fields (finshell_element_fields) are made of it.
module finshell_recovered
   use finshell_kinds, only: wp, i4, lanes
   use finshell_own, only: own_t
   implicit none
   private
   public :: recovered_t

   !> Means over each element. Material direction: that projected on the element, and the in-plane normal to it.
   type :: recovered_t
      real(wp) :: stretch(lanes) !< thickness stretch of the surface of the nodes
      real(wp) :: force(lanes, 3) !< N11, N22, N12 per reference length, conjugate to Green-Lagrange strain; material direction
      real(wp) :: moment(lanes, 3) !< M11, M22, M12; material direction
      real(wp) :: energy(lanes) !< stored, per reference volume
      !> Strain at reference height z is membrane + z curvature; E11, E22, 2 E12 in the frame of the element.
      real(wp) :: membrane(lanes, 3), curvature(lanes, 3)
      real(wp) :: curvatures(lanes, 3, 3) !< curvature at the three points (element, component, point)
      !> Of elements that have grown; of membranes strains and resultants but for `force` are those from the stress-free state
      !> already, and nothing has grown any more.
      type(own_t) :: own
      real(wp) :: bend(lanes, 3) !< curvature of the reference, zero where it is flat; as `curvature`
      real(wp) :: axes(lanes, 2) !< cosine and sine of the material direction in the frame of the element
      real(wp) :: back(lanes, 2) !< of the frame of the element in the components that stresses have
      !> Material direction and the in-plane normal to it, carried along by the element's rotation (component, 1 or 2), global.
      real(wp) :: frame(lanes, 3, 2)
      !> Of membranes only: the state of sheets that may wrinkle (finshell_tension_field), and the unit vector along the ridges,
      !> global. Their strain and frame are those of the material, which is wider than its facet.
      integer(i4) :: state(lanes)
      real(wp) :: ridge(lanes, 3)
      real(wp) :: slack_energy(lanes) !< part of `energy`: of what is left to compression (finshell_slack)
   end type recovered_t
end module finshell_recovered
