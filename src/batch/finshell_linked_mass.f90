!> The part of the mass matrix that comes from the deflection between the nodes.
!>
!> Between nodes a bent shell moves along its normal by more than linear interpolation says: the edge from node i to j bulges by
!> L_i L_j b with b = (s_i - s_j)/2, s_i = theta_i . (e x n) the slope at its ends times its length (linked interpolation, Xu 1992;
!> Zienkiewicz et al. 1993). Without it the kinetic energy of a wave of length 2 pi/k on edges of length h is too small by
!> (k h)^2/6. It depends on the normals of the state, so it is for small motions about it, not for a mass matrix that stays.
module finshell_linked_mass
   use finshell_kinds, only: wp
   use finshell_freedoms, only: n_corners, n_shell, rx, rz, shell_at, ux, uz
   use finshell_rotation, only: cross_product
   implicit none
   private
   public :: linked_mass

   !> Integrals over a triangle of area 1 of L_a L_i L_j for a on the edge (i, j), and off it; of the products of the L_i L_j of two
   !> edges, one with itself and with another.
   real(wp), parameter :: on = 1/30.0_wp, off = 1/60.0_wp, itself = 1/90.0_wp, other = 1/180.0_wp

contains

   !> To be added to the mass matrix of a shell element with linear interpolation.
   pure function linked_mass(mass, normal, x) result(added)
      real(wp), intent(in) :: mass !< of the element
      real(wp), intent(in) :: normal(3) !< of unit length
      real(wp), intent(in) :: x(3, n_corners) !< present coordinates
      real(wp) :: added(n_shell, n_shell)
      real(wp) :: deflection(n_shell, n_corners), bulge(n_shell, n_corners), turn(3), share
      integer :: a, e, i, j

      deflection = 0
      bulge = 0
      do i = 1, n_corners
         j = mod(i, n_corners) + 1
         deflection(shell_at(i) + ux:shell_at(i) + uz, i) = normal
         turn = 0.5_wp*cross_product(x(:, j) - x(:, i), normal)
         bulge(shell_at(i) + rx:shell_at(i) + rz, i) = turn
         bulge(shell_at(j) + rx:shell_at(j) + rz, i) = -turn
      end do
      added = 0
      do e = 1, n_corners
         do a = 1, n_corners
            share = merge(off, on, a == mod(e + 1, n_corners) + 1)
            call add_product(added, deflection(:, a), bulge(:, e), share)
            call add_product(added, bulge(:, e), deflection(:, a), share)
            call add_product(added, bulge(:, a), bulge(:, e), merge(itself, other, a == e))
         end do
      end do
      added = mass*added
   end function linked_mass

   pure subroutine add_product(matrix, u, v, factor)
      real(wp), intent(inout) :: matrix(:, :)
      real(wp), intent(in) :: u(:), v(:), factor
      integer :: k
      do k = 1, size(v)
         matrix(:, k) = matrix(:, k) + factor*v(k)*u
      end do
   end subroutine add_product
end module finshell_linked_mass
