!> Says why an element cannot be evaluated: for a rotation that is too large, of which node, and whether it is a drilling rotation.
module finshell_element_failure
   use finshell_kinds, only: wp
   use finshell_error, only: text_of
   use finshell_facet_axes, only: facet_axes
   use finshell_mesh, only: mesh_t
   use finshell_quaternion, only: quaternion_to_matrix
   use finshell_rotation, only: log_rotation
   use finshell_state, only: state_t
   use finshell_status, only: status_large_rotation, status_text
   implicit none
   private
   public :: rotation_failure

contains

   !> One sentence for the status of an element at a state.
   pure function rotation_failure(mesh, state, element, status) result(text)
      type(mesh_t), intent(in) :: mesh
      type(state_t), intent(in) :: state
      integer, intent(in) :: element, status
      character(len=:), allocatable :: text
      real(wp) :: before(3, 3), now(3, 3), turn(3, 3)
      integer :: i, worst

      text = 'element '//text_of(element)//': '//status_text(status)
      if (status /= status_large_rotation) return
      associate (nodes => mesh%triangles(:, element))
         before = facet_axes(mesh%coordinates(:, nodes))
         now = facet_axes(mesh%coordinates(:, nodes) + state%displacement(:, nodes))
         do i = 1, 3
            turn(:, i) = log_rotation(matmul(transpose(now), matmul(quaternion_to_matrix(state%rotation(:, nodes(i))), before)))
         end do
         worst = maxloc(norm2(turn, 1), 1)
         if (abs(turn(3, worst)) > 0.7_wp*norm2(turn(:, worst))) then
            text = text//'; it is the drilling rotation (about the normal of the shell) of node '//text_of(nodes(worst)) &
               //': if it is free, hold it by a support'
         else
            text = text//'; it is that of node '//text_of(nodes(worst))
         end if
      end associate
   end function rotation_failure
end module finshell_element_failure
