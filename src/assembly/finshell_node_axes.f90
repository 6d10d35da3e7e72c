!> Element matrices in the axes of their nodes.
module finshell_node_axes
   use finshell_freedoms, only: n_corners, n_membrane, ux, uz
   use finshell_kinds, only: wp, i4
   implicit none
   private
   public :: to_node_axes

contains

   !> Turn an element matrix from global axes into those of its nodes.
   pure subroutine to_node_axes(frame, frames, k)
      integer(i4), intent(in) :: frame(n_corners) !< of each corner: index into frames, 0: global axes
      real(wp), intent(in) :: frames(:, :, :) !< (3, 3, :) orthonormal columns
      real(wp), intent(inout) :: k(:, :) !< of a shell or a membrane
      integer :: j, b, at
      do j = 1, n_corners
         if (frame(j) == 0) cycle
         associate (axes => frames(:, :, frame(j)))
            do b = 0, size(k, 1)/n_membrane - 1
               at = size(k, 1)/n_corners*(j - 1) + uz*b
               k(at + ux:at + uz, :) = matmul(transpose(axes), k(at + ux:at + uz, :))
               k(:, at + ux:at + uz) = matmul(k(:, at + ux:at + uz), axes)
            end do
         end associate
      end do
   end subroutine to_node_axes
end module finshell_node_axes
