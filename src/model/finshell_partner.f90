!> Which node goes with which: nearest nodes of two sets, nodes of sets that are alike but for a shift, nearest points of triangles.
module finshell_partner
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t
   use finshell_rotation, only: cross_product
   implicit none
   private
   public :: nearest_node, shifted_partner, project, nearest_in_triangle

contains

   !> The node of a list that is nearest to a point; 0: the list is empty.
   pure subroutine nearest_node(mesh, list, point, node, distance)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: list(:)
      real(wp), intent(in) :: point(3)
      integer, intent(out) :: node
      real(wp), intent(out) :: distance
      real(wp) :: square, least
      integer :: i
      node = 0
      least = huge(least)
      do i = 1, size(list)
         square = sum((mesh%coordinates(:, list(i)) - point)**2)
         if (square >= least) cycle
         least = square
         node = list(i)
      end do
      distance = sqrt(least)
   end subroutine nearest_node

   !> For each node of a list that of another list which lies alike in it: nearest when both have their centres at one place.
   pure subroutine shifted_partner(mesh, list, other, partner, distance)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: list(:), other(:)
      integer, intent(out) :: partner(:) !< (size(list))
      real(wp), intent(out) :: distance(:) !< (size(list)) between the two, less the shift
      real(wp) :: shift(3)
      integer :: i
      shift = sum(mesh%coordinates(:, other), dim=2)/size(other) - sum(mesh%coordinates(:, list), dim=2)/size(list)
      do i = 1, size(list)
         call nearest_node(mesh, other, mesh%coordinates(:, list(i)) + shift, partner(i), distance(i))
      end do
   end subroutine shifted_partner

   !> The point of some elements that is nearest to a node, which none of them may have as a corner.
   pure subroutine project(mesh, elements, node, element, weight, distance)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: elements(:), node
      integer, intent(out) :: element !< 0: there is none
      real(wp), intent(out) :: weight(3) !< of its corners
      real(wp), intent(out) :: distance
      real(wp) :: x(3, 3), n(3), square, least
      integer :: i
      element = 0
      weight = 0
      least = huge(least)
      do i = 1, size(elements)
         if (any(mesh%triangles(:, elements(i)) == node)) cycle
         x = mesh%coordinates(:, mesh%triangles(:, elements(i)))
         n = nearest_in_triangle(x, mesh%coordinates(:, node))
         square = sum((matmul(x, n) - mesh%coordinates(:, node))**2)
         if (square >= least) cycle
         least = square
         element = elements(i)
         weight = n
      end do
      distance = sqrt(least)
   end subroutine project

   !> Barycentric coordinates of the point of a triangle that is nearest to a point: on its face, or else on the nearest side.
   pure function nearest_in_triangle(x, point) result(weight)
      real(wp), intent(in) :: x(3, 3), point(3) !< (component, corner)
      real(wp) :: weight(3)
      real(wp) :: normal(3), twice, along, square, least, side(3), found(3)
      integer :: a, b, c
      normal = cross_product(x(:, 2) - x(:, 1), x(:, 3) - x(:, 1))
      twice = sum(normal**2)
      do a = 1, 3
         b = 1 + mod(a, 3)
         c = 1 + mod(b, 3)
         weight(a) = dot_product(cross_product(x(:, c) - x(:, b), point - x(:, b)), normal)/twice
      end do
      if (all(weight >= 0)) return
      least = huge(least)
      do a = 1, 3
         b = 1 + mod(a, 3)
         side = x(:, b) - x(:, a)
         along = min(max(dot_product(point - x(:, a), side)/sum(side**2), 0.0_wp), 1.0_wp)
         square = sum((x(:, a) + along*side - point)**2)
         if (square >= least) cycle
         least = square
         found = 0
         found(a) = 1 - along
         found(b) = along
      end do
      weight = found
   end function nearest_in_triangle
end module finshell_partner
