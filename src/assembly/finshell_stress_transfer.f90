!> Resultants of a mesh on its bisection: those of the element that an element was part of, in the axes of its facet.
!>
!> Between its old nodes a carried-over state (finshell_state_transfer) is as wrong as the interpolation: small in displacements,
!> but a thin shell's own membrane forces there may be many times the loads. A tangent with the forces of the mesh before has none
!> of that: from the hemisphere with a hole at 32 x 32 to 64 x 64 elements no pivot is negative (4 with the own ones).
module finshell_stress_transfer
   use finshell_assembly, only: assembly_t, predict_stress
   use finshell_batch, only: n_resultants
   use finshell_facet_axes, only: facet_axes
   use finshell_freedoms, only: n_nodal
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
   use finshell_voigt, only: rotate_stress
   implicit none
   private
   public :: resultants_of, inherit_resultants, in_order_of

contains

   !> Resultants of all elements at a state.
   function resultants_of(assembly, structure, state) result(stress)
      type(assembly_t), intent(in) :: assembly
      type(structure_t), intent(in) :: structure
      type(state_t), intent(in) :: state
      real(wp), allocatable :: stress(:, :) !< (n_resultants, elements)
      real(wp), allocatable :: slots(:, :), rest(:, :)
      allocate (slots(n_resultants, assembly%elements), stress(n_resultants, assembly%elements))
      allocate (rest(n_nodal, size(structure%mesh%coordinates, 2)), source=0.0_wp)
      call predict_stress(assembly, structure, state, rest, slots)
      stress(:, assembly%patches%element) = slots
   end function resultants_of

   !> In the order of an assembly, as `problem_t%evaluate` takes them.
   pure function in_order_of(assembly, stress) result(slots)
      type(assembly_t), intent(in) :: assembly
      real(wp), intent(in) :: stress(:, :) !< (n_resultants, elements)
      real(wp), allocatable :: slots(:, :)
      slots = stress(:, assembly%patches%element)
   end function in_order_of

   !> Those of the parents, averaged over the three points, in the axes of the parts.
   pure function inherit_resultants(stress, mesh, parent, fine) result(inherited)
      real(wp), intent(in) :: stress(:, :) !< (n_resultants, elements of mesh)
      type(mesh_t), intent(in) :: mesh, fine
      integer, intent(in) :: parent(:) !< (elements of fine) in mesh
      real(wp), allocatable :: inherited(:, :)
      real(wp) :: of_points(3, 2, 3) ! components; forces, moments; points
      real(wp) :: axes(3, 3), first(3, 3), direction(2, 2), mean(2, 3)
      integer :: e
      allocate (inherited(size(stress, 1), size(parent)))
      do e = 1, size(parent)
         axes = facet_axes(fine%coordinates(:, fine%triangles(:, e)))
         first = facet_axes(mesh%coordinates(:, mesh%triangles(:, parent(e))))
         direction = spread(matmul(first(:, 1), axes(:, :2)), 1, 2)
         mean = transpose(sum(reshape(stress(:, parent(e)), shape(of_points)), dim=3))/size(of_points, 3)
         call rotate_stress(2, direction, mean)
         of_points = spread(transpose(mean), 3, size(of_points, 3))
         inherited(:, e) = reshape(of_points, [size(stress, 1)])
      end do
   end function inherit_resultants
end module finshell_stress_transfer
