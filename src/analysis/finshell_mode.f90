!> Size of modes.
module finshell_mode
   use finshell_kinds, only: wp
   use finshell_freedoms, only: rx, ux, uz
   implicit none
   private
   public :: normalise_mode

contains

   !> Largest displacement of a node 1 (where none moves, the largest rotation), its largest component positive.
   pure subroutine normalise_mode(motion, scale)
      real(wp), intent(inout) :: motion(:, :) !< (n_nodal, nodes)
      real(wp), intent(out) :: scale !< what it was multiplied by
      integer :: k, node, first
      first = ux
      if (.not. any(abs(motion(ux:uz, :)) > 0)) first = rx
      node = maxloc(sum(motion(first:first + 2, :)**2, dim=1), 1)
      k = maxloc(abs(motion(first:first + 2, node)), 1)
      scale = sign(1/norm2(motion(first:first + 2, node)), motion(first + k - 1, node))
      motion = scale*motion
   end subroutine normalise_mode
end module finshell_mode
