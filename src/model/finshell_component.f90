!> The motion of a node along a global axis as a sum over the unknowns. The one place that knows what a component depends on.
module finshell_component
   use finshell_equations, only: equations_t
   use finshell_freedoms, only: rx, uz
   use finshell_kinds, only: wp
   implicit none
   private
   public :: expand_component, most_unknowns

   integer, parameter :: most_unknowns = 96 !< that a component depends on; input refuses more

contains

   !> motion(component) = sum of coefficient(:n)*x(equation(:n)); n = 0: it is held.
   !>
   !> What a component depends on stays the same; the coefficients of dependent ones go with the state (finshell_links).
   pure subroutine expand_component(self, node, component, equation, coefficient, n)
      type(equations_t), intent(in) :: self
      integer, intent(in) :: node, component !< finshell_freedoms, along a global axis
      integer, intent(out) :: equation(:) !< (most_unknowns)
      real(wp), intent(out) :: coefficient(:) !< (most_unknowns)
      integer, intent(out) :: n
      n = 0
      call add_component(self, node, component, 1.0_wp, equation, coefficient, n)
   end subroutine expand_component

   !> Add a component times a factor to a sum.
   pure recursive subroutine add_component(self, node, component, factor, equation, coefficient, n)
      type(equations_t), intent(in) :: self
      integer, intent(in) :: node, component
      real(wp), intent(in) :: factor
      integer, intent(inout) :: equation(:)
      real(wp), intent(inout) :: coefficient(:)
      integer, intent(inout) :: n
      integer :: e, first, k, r
      if (self%links%depends(component, node)) then
         associate (links => self%links)
            r = links%row(component, node)
            do e = links%first(r), links%first(r + 1) - 1
               call add_component(self, links%master(e), links%along(e), factor*links%coefficient(e), equation, coefficient, n)
            end do
         end associate
      else if (self%frame(node) == 0) then
         if (self%number(component, node) > 0) &
            call add_unknown(self%number(component, node), factor, equation, coefficient, n)
      else
         first = merge(rx, 1, component > uz)
         associate (axes => self%frames(:, :, self%frame(node)))
            do k = 1, 3
               if (self%number(first + k - 1, node) == 0) cycle
               call add_unknown(self%number(first + k - 1, node), factor*axes(component - first + 1, k), equation, coefficient, n)
            end do
         end associate
      end if
   end subroutine add_component

   !> Those beyond the room are counted only.
   pure subroutine add_unknown(number, factor, equation, coefficient, n)
      integer, intent(in) :: number
      real(wp), intent(in) :: factor
      integer, intent(inout) :: equation(:)
      real(wp), intent(inout) :: coefficient(:)
      integer, intent(inout) :: n
      integer :: i
      i = findloc(equation(:min(n, size(equation))), number, dim=1)
      if (i == 0) then
         n = n + 1
         if (n > size(equation)) return
         i = n
         equation(i) = number
         coefficient(i) = 0
      end if
      coefficient(i) = coefficient(i) + factor
   end subroutine add_unknown
end module finshell_component
