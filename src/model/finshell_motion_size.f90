!> How far nodes have moved from where strains are measured.
module finshell_motion_size
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_kinds, only: wp
   use finshell_normals, only: add_turns
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: size_of_motion

contains

   !> Displacements and, up to half a turn, rotations (radian); of curved elements the angles of their normals where these are
   !> larger.
   pure function size_of_motion(structure, state) result(nodal)
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp) :: nodal(n_nodal, size(state%rotation, 2))
      nodal(ux:uz, :) = state%displacement
      nodal(rx:rz, :) = 2*state%rotation(2:4, :)
      if (allocated(structure%normal)) call add_turns(structure%mesh, structure%normal, nodal(rx:rz, :))
   end function size_of_motion
end module finshell_motion_size
