!> Caps of elements of a structure at a state: what pressure and volume on the curved surface add to those on the facets.
module finshell_cap_terms
   use finshell_kinds, only: wp, i4
   use finshell_batch, only: rotation_quaternion
   use finshell_caps, only: evaluate_caps
   use finshell_discretisation, only: gather_elements, gathered_t
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   implicit none
   private
   public :: caps_at

contains

   !> Volume of each cap, gradient, Hessian; of an element that has failed, 0: the elements themselves report it.
   subroutine caps_at(structure, elements, state, volume, force, stiffness, held)
      type(structure_t), intent(in) :: structure !< with normals
      integer, intent(in) :: elements(:)
      type(state_t), intent(in) :: state
      real(wp), intent(out), optional, contiguous :: volume(:) !< (elements)
      real(wp), intent(out), optional, contiguous :: force(:, :) !< (n_shell, elements)
      real(wp), intent(out), optional, contiguous :: stiffness(:, :, :) !< (n_shell, n_shell, elements)
      integer, intent(in), optional :: held(:, :) !< (3, elements of the structure) see finshell_held_side
      type(gathered_t) :: g
      integer(i4) :: status(size(elements))
      call gather_elements(structure, state, elements, g, held)
      call evaluate_caps(size(elements), g%x, g%u, g%q, rotation_quaternion, g%normal, status, volume, force, stiffness, &
                         held=g%held)
   end subroutine caps_at
end module finshell_cap_terms
