!> Inertia for a descent (finshell_descent): how much each unknown weighs against the others.
module finshell_lumped_weight
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t
   use finshell_equations, only: equations_t
   implicit none
   private
   public :: lumped_weight

contains

   !> A mass of one per area, a third of an element at each node, with the radius of gyration of an element.
   function lumped_weight(mesh, equations, detail) result(weight)
      type(mesh_t), intent(in) :: mesh
      type(equations_t), intent(in) :: equations
      real(wp), intent(in) :: detail
      real(wp), allocatable :: weight(:)
      real(wp) :: area, a(3), b(3)
      integer :: e, i, k
      allocate (weight(equations%n), source=0.0_wp)
      do e = 1, size(mesh%triangles, 2)
         associate (nodes => mesh%triangles(:, e))
            a = mesh%coordinates(:, nodes(2)) - mesh%coordinates(:, nodes(1))
            b = mesh%coordinates(:, nodes(3)) - mesh%coordinates(:, nodes(1))
            area = 0.5_wp*norm2([a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)])
            do i = 1, 3
               do k = 1, 6
                  associate (at => equations%number(k, nodes(i)))
                     if (at > 0) weight(at) = weight(at) + area/3*merge(1.0_wp, detail**2, k <= 3)
                  end associate
               end do
            end do
         end associate
      end do
   end function lumped_weight
end module finshell_lumped_weight
