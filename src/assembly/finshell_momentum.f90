!> Momentum, angular momentum and kinetic energy of a structure in motion.
module finshell_momentum
   use finshell_freedoms, only: rx, rz, ux, uz
   use finshell_kinds, only: wp
   use finshell_rotation, only: cross_product
   use finshell_state, only: state_t
   implicit none
   private
   public :: kinetic_energy, momentum, angular_momentum

contains

   pure real(wp) function kinetic_energy(state, nodal)
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: nodal(:, :) !< (n_nodal, nodes) momenta: masses times velocities and spins
      kinetic_energy = 0.5_wp*sum(state%velocity*nodal)
   end function kinetic_energy

   pure function momentum(nodal)
      real(wp), intent(in) :: nodal(:, :) !< as for `kinetic_energy`
      real(wp) :: momentum(3)
      momentum = sum(nodal(ux:uz, :), dim=2)
   end function momentum

   !> About the origin.
   pure function angular_momentum(coordinates, state, nodal)
      real(wp), intent(in) :: coordinates(:, :) !< (3, nodes) of the reference
      type(state_t), intent(in) :: state
      real(wp), intent(in) :: nodal(:, :) !< as for `kinetic_energy`
      real(wp) :: angular_momentum(3)
      integer :: i
      angular_momentum = sum(nodal(rx:rz, :), dim=2)
      do i = 1, size(nodal, 2)
         angular_momentum = angular_momentum + cross_product(coordinates(:, i) + state%displacement(:, i), nodal(ux:uz, i))
      end do
   end function angular_momentum
end module finshell_momentum
