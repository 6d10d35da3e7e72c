!> Resultants of a mesh on its bisection: those of the element that an element was part of, in the axes of its facet.
!>
!> Between its old nodes a carried-over state (finshell_state_transfer) is as wrong as the interpolation: small in displacements,
!> but a thin shell's own membrane forces there may be many times the loads. A tangent with the forces of the mesh before has none
!> of that: from the hemisphere with a hole at 32 x 32 to 64 x 64 elements no pivot is negative (4 with the own ones).
module finshell_stress_transfer
   use finshell_assembly, only: assembly_t, predict_stress
   use finshell_batch, only: n_resultants
   use finshell_freedoms, only: n_nodal
   use finshell_kinds, only: wp
   use finshell_mesh, only: mesh_t, twice_area_vector
   use finshell_rotation, only: cross_product
   use finshell_state, only: state_t
   use finshell_structure, only: structure_t
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
      real(wp) :: of_points(3, 2, 3), turn(2, 2), axes(3, 2) ! components; forces, moments; points
      real(wp) :: mean(3, 2)
      integer :: e, k
      allocate (inherited(size(stress, 1), size(parent)))
      do e = 1, size(parent)
         axes = axes_of(fine, e)
         turn = matmul(transpose(axes), axes_of(mesh, parent(e)))
         mean = sum(reshape(stress(:, parent(e)), shape(of_points)), dim=3)/size(of_points, 3)
         do k = 1, size(mean, 2)
            of_points(:, k, :) = spread(turned_tensor(mean(:, k), turn), 2, size(of_points, 3))
         end do
         inherited(:, e) = reshape(of_points, [size(stress, 1)])
      end do
   end function inherit_resultants

   !> Axes in the plane of an element, the first along its first side (finshell_triangle).
   pure function axes_of(mesh, e) result(axes)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: e
      real(wp) :: axes(3, 2)
      real(wp) :: normal(3)
      associate (nodes => mesh%triangles(:, e))
         axes(:, 1) = mesh%coordinates(:, nodes(2)) - mesh%coordinates(:, nodes(1))
      end associate
      axes(:, 1) = axes(:, 1)/norm2(axes(:, 1))
      normal = twice_area_vector(mesh, e)
      axes(:, 2) = cross_product(normal/norm2(normal), axes(:, 1))
   end function axes_of

   !> Components 11, 22, 12 of a symmetric tensor in other axes.
   pure function turned_tensor(t, turn) result(turned)
      real(wp), intent(in) :: t(3)
      real(wp), intent(in) :: turn(2, 2) !< new axis i along old axis j
      real(wp) :: turned(3)
      real(wp) :: full(2, 2)
      full = matmul(turn, matmul(reshape([t(1), t(3), t(3), t(2)], [2, 2]), transpose(turn)))
      turned = [full(1, 1), full(2, 2), full(1, 2)]
   end function turned_tensor
end module finshell_stress_transfer
