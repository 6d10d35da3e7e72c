!> The motion of a node along a global axis as a sum over the unknowns. The one place that knows what a component depends on.
module finshell_component
   use finshell_equations, only: equations_t
   use finshell_freedoms, only: rx, uz
   use finshell_kinds, only: wp
   implicit none
   private
   public :: expand_component, most_unknowns

   integer, parameter :: most_unknowns = 3 !< that a component depends on

contains

   !> motion(component) = sum of coefficient(:n)*x(equation(:n)); n = 0: it is held.
   pure subroutine expand_component(self, node, component, equation, coefficient, n)
      type(equations_t), intent(in) :: self
      integer, intent(in) :: node, component !< finshell_freedoms, along a global axis
      integer, intent(out) :: equation(:) !< (most_unknowns)
      real(wp), intent(out) :: coefficient(:) !< (most_unknowns)
      integer, intent(out) :: n
      integer :: first, k
      equation = 0
      coefficient = 0
      n = 0
      if (self%frame(node) == 0) then
         if (self%number(component, node) == 0) return
         n = 1
         equation(1) = self%number(component, node)
         coefficient(1) = 1
         return
      end if
      first = merge(rx, 1, component > uz)
      associate (axes => self%frames(:, :, self%frame(node)))
         do k = 1, 3
            if (self%number(first + k - 1, node) == 0) cycle
            n = n + 1
            equation(n) = self%number(first + k - 1, node)
            coefficient(n) = axes(component - first + 1, k)
         end do
      end associate
   end subroutine expand_component
end module finshell_component
