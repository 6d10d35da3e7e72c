!> Caps of elements of a structure at a state: what pressure and volume on the curved surface add to those on the facets.
module finshell_cap_terms
   use finshell_kinds, only: wp, i4
   use finshell_batch, only: rotation_quaternion
   use finshell_caps, only: evaluate_caps
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: caps_at

contains

   !> Volume of each cap, gradient, Hessian; of an element that has failed, 0: the elements themselves report it.
   subroutine caps_at(structure, elements, state, volume, force, stiffness)
      type(structure_t), intent(in) :: structure !< with normals
      integer, intent(in) :: elements(:)
      type(state_t), intent(in) :: state
      real(wp), intent(out), optional :: volume(:) !< (elements)
      real(wp), intent(out), optional :: force(:, :) !< (18, elements)
      real(wp), intent(out), optional :: stiffness(:, :, :) !< (18, 18, elements)
      real(wp) :: x(3, 3, size(elements)), u(3, 3, size(elements)), q(4, 3, size(elements)), normal(3, 3, size(elements))
      integer(i4) :: status(size(elements))
      integer :: i
      do i = 1, size(elements)
         associate (nodes => structure%mesh%triangles(:, elements(i)))
            x(:, :, i) = structure%mesh%coordinates(:, nodes)
            u(:, :, i) = state%displacement(:, nodes)
            q(:, :, i) = state%rotation(:, nodes)
         end associate
         normal(:, :, i) = structure%normal(:, :, elements(i))
      end do
      call evaluate_caps(size(elements), x, u, q, rotation_quaternion, normal, status, volume, force, stiffness)
   end subroutine caps_at
end module finshell_cap_terms
