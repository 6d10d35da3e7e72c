!> How large the forces and moments of a structure are: what its residual is compared with.
module finshell_levels
   use finshell_kinds, only: wp
   use finshell_freedoms, only: n_nodal, rx, rz, ux, uz
   use finshell_equations, only: equations_t
   implicit none
   private
   public :: force_levels

contains

   !> Norms of external forces and of reactions, for the convergence criterion.
   pure function force_levels(equations, external_force, out_of_balance, standing) result(levels)
      type(equations_t), intent(in) :: equations
      real(wp), intent(in) :: external_force(:, :), out_of_balance(:, :) !< (n_nodal, nodes), folded
      !> (n_nodal, nodes, 0 or 1) part of external_force that answers as supports do: under a rigid motion a foundation cancels the
      !> loads node by node.
      real(wp), intent(in) :: standing(:, :, :)
      real(wp) :: levels(2) !< of forces and of moments: Euclidean norm of the external ones or of the reactions, the larger
      real(wp) :: local(n_nodal), scale(2), reactions(2), loads(2)
      real(wp), allocatable :: acting(:, :)
      integer :: i, node

      acting = external_force
      if (size(standing, 3) > 0) acting = acting - standing(:, :, 1)
      scale = [maxval(abs(acting(ux:uz, :))), maxval(abs(acting(rx:rz, :)))]
      do i = 1, size(equations%supported)
         node = equations%supported(i)%node
         scale(1) = max(scale(1), maxval(abs(out_of_balance(ux:uz, node))))
         scale(2) = max(scale(2), maxval(abs(out_of_balance(rx:rz, node))))
      end do
      where (.not. scale > 0) scale = 1
      reactions = 0
      do i = 1, size(equations%supported)
         node = equations%supported(i)%node
         local(ux:uz) = out_of_balance(ux:uz, node)/scale(1)
         local(rx:rz) = out_of_balance(rx:rz, node)/scale(2)
         if (equations%frame(node) > 0) then
            associate (axes => equations%frames(:, :, equations%frame(node)))
               local(ux:uz) = matmul(local(ux:uz), axes)
               local(rx:rz) = matmul(local(rx:rz), axes)
            end associate
         end if
         where (equations%number(:, node) > 0) local = 0
         reactions = reactions + [sum(local(ux:uz)**2), sum(local(rx:rz)**2)]
      end do
      loads = [sum((acting(ux:uz, :)/scale(1))**2), sum((acting(rx:rz, :)/scale(2))**2)]
      levels = scale*sqrt(max(loads, reactions))
   end function force_levels
end module finshell_levels
