!> The cap of an element with a curved reference: the volume between its facet and the curved surface over it.
!>
!> The heights of the surface over the middles of the sides, w_k = L_k . (G_i - G_j)/8 for side k from node i to node j (0 for a
!> side that is held), are those of the cubics with the slopes of the nodes; the volume is J A/3 (w_1 + w_2 + w_3), along the normal
!> of the facet. The cap of a facet is empty. What a pressure p does beyond that on the facets is p times its gradient: forces and
!> couples that make up for the work of the membrane force on the slopes (theory, S2c).
module finshell_cap
   use finshell_kinds, only: wp, lanes
   use finshell_core, only: core_t
   use finshell_curved, only: turned_t
   use finshell_filter, only: filter_t, jacobian_gradient, jacobian_hessian
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_reference, only: reference_t, side_to
   use finshell_voigt, only: row, column
   implicit none
   private
   public :: cap_volume

contains

   !> Volume as the energy of the core, with its derivatives.
   pure subroutine cap_volume(level, ref, turned, filter, core)
      integer, intent(in) :: level !< level_energy: the volume; level_force: its gradient, too; level_tangent: and its Hessian
      type(reference_t), intent(in) :: ref
      type(turned_t), intent(in) :: turned
      type(filter_t), intent(in) :: filter
      type(core_t), intent(inout) :: core
      real(wp) :: s(lanes, 2, 3) !< the sum of the heights is s_i . G_i
      real(wp) :: third(lanes), heights(lanes), dj(lanes, 3), ddj(lanes, 6)
      integer :: a, i, j, k, p

      third = merge(ref%area/3, 0.0_wp, any(abs(turned%slope) > 0, 2))
      do k = 1, 3
         do a = 1, 2
            s(:, a, side_to(k)) = ref%bow(:, side_to(k))*ref%side(:, a, side_to(k)) - ref%bow(:, k)*ref%side(:, a, k)
         end do
      end do
      heights = 0
      do k = 1, 3
         heights = heights + s(:, 1, k)*filter%slope(:, 1, k) + s(:, 2, k)*filter%slope(:, 2, k)
      end do
      core%energy = third*filter%jacobian*heights
      if (level < level_force) return

      call jacobian_gradient(filter, dj)
      core%gradient = 0
      do i = 1, 3
         core%gradient(:, i) = third*heights*dj(:, i)
      end do
      do k = 1, 3
         do a = 1, 2
            core%gradient(:, 1 + 2*k + a) = third*filter%jacobian*s(:, a, k)
         end do
      end do
      if (level < level_tangent) return

      core%geometric_gradient = core%gradient
      core%hessian = 0
      call jacobian_hessian(filter, ddj)
      do p = 1, 6
         core%hessian(:, row(p), column(p)) = third*heights*ddj(:, p)
         core%hessian(:, column(p), row(p)) = core%hessian(:, row(p), column(p))
      end do
      do k = 1, 3
         do a = 1, 2
            j = 1 + 2*k + a
            do i = 1, 3
               core%hessian(:, i, j) = third*dj(:, i)*s(:, a, k)
               core%hessian(:, j, i) = core%hessian(:, i, j)
            end do
         end do
      end do
   end subroutine cap_volume
end module finshell_cap
