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
      real(wp) :: mean(3), turned(3), turn(2, 2), axes(3, 2)
      integer :: e, g, part
      allocate (inherited(size(stress, 1), size(parent)))
      do e = 1, size(parent)
         axes = axes_of(fine, e)
         turn = matmul(transpose(axes), axes_of(mesh, parent(e)))
         do part = 0, 3, 3 ! forces, moments
            mean = (stress(part + 1:part + 3, parent(e)) + stress(part + 7:part + 9, parent(e)) &
                    + stress(part + 13:part + 15, parent(e)))/3
            turned = turned_tensor(mean, turn)
            do g = 0, 12, 6
               inherited(g + part + 1:g + part + 3, e) = turned
            end do
         end do
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
