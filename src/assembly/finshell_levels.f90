!> How large the forces and moments of a structure are: what its residual is compared with.
module finshell_levels
   use finshell_kinds, only: wp
   use finshell_equations, only: equations_t
   implicit none
   private
   public :: force_levels

contains

   !> Norms of external forces and of reactions, for the convergence criterion.
   pure function force_levels(equations, external_force, out_of_balance, standing) result(levels)
      type(equations_t), intent(in) :: equations
      real(wp), intent(in) :: external_force(:, :), out_of_balance(:, :) !< (6, nodes)
      !> (6, nodes, 0 or 1) part of external_force that answers as supports do: under a rigid motion a foundation cancels the loads
      !> node by node.
      real(wp), intent(in) :: standing(:, :, :)
      real(wp) :: levels(2) !< of forces and of moments: Euclidean norm of the external ones or of the reactions, the larger
      real(wp) :: local(6), scale(2), reactions(2), loads(2)
      real(wp), allocatable :: acting(:, :)
      integer :: i, node

      acting = external_force
      if (size(standing, 3) > 0) acting = acting - standing(:, :, 1)
      scale = [maxval(abs(acting(1:3, :))), maxval(abs(acting(4:6, :)))]
      do i = 1, size(equations%supported)
         node = equations%supported(i)%node
         scale(1) = max(scale(1), maxval(abs(out_of_balance(1:3, node))))
         scale(2) = max(scale(2), maxval(abs(out_of_balance(4:6, node))))
      end do
      where (.not. scale > 0) scale = 1
      reactions = 0
      do i = 1, size(equations%supported)
         node = equations%supported(i)%node
         local(1:3) = out_of_balance(1:3, node)/scale(1)
         local(4:6) = out_of_balance(4:6, node)/scale(2)
         if (equations%frame(node) > 0) then
            associate (axes => equations%frames(:, :, equations%frame(node)))
               local(1:3) = matmul(local(1:3), axes)
               local(4:6) = matmul(local(4:6), axes)
            end associate
         end if
         where (equations%number(:, node) > 0) local = 0
         reactions = reactions + [sum(local(1:3)**2), sum(local(4:6)**2)]
      end do
      loads = [sum((acting(1:3, :)/scale(1))**2), sum((acting(4:6, :)/scale(2))**2)]
      levels = scale*sqrt(max(loads, reactions))
   end function force_levels
end module finshell_levels
