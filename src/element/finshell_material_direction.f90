!> The material direction of an element: given in space, looked for in its plane.
module finshell_material_direction
   use finshell_kinds, only: wp, i4, lanes
   use finshell_status, only: status_invalid_argument
   implicit none
   private
   public :: material_direction

contains

   !> Cosine and sine of the material direction projected on the element.
   !>
   !> Where the direction is normal to the element (within 0.1 degrees) the next coordinate axis but one takes its place,
   !> as is customary for the default direction x: z.
   pure subroutine material_direction(frame, direction, axes, status)
      real(wp), intent(in) :: frame(lanes, 3, 3) !< columns: two axes in the element, its normal
      real(wp), intent(in) :: direction(lanes, 3)
      real(wp), intent(out) :: axes(lanes, 2)
      integer(i4), intent(inout) :: status(lanes)
      real(wp), parameter :: sine_of_tenth_degree = 1.745e-3_wp
      real(wp), dimension(lanes) :: length, full
      real(wp) :: turned(lanes, 2)
      integer :: i
      full = sqrt(direction(:, 1)**2 + direction(:, 2)**2 + direction(:, 3)**2)
      where (.not. full > 0) status = status_invalid_argument
      do i = 1, 2
         axes(:, i) = direction(:, 1)*frame(:, 1, i) + direction(:, 2)*frame(:, 2, i) + direction(:, 3)*frame(:, 3, i)
         turned(:, i) = direction(:, 2)*frame(:, 1, i) + direction(:, 3)*frame(:, 2, i) + direction(:, 1)*frame(:, 3, i)
      end do
      length = sqrt(axes(:, 1)**2 + axes(:, 2)**2)
      do i = 1, 2
         where (length < sine_of_tenth_degree*full) axes(:, i) = turned(:, i)
      end do
      length = max(sqrt(axes(:, 1)**2 + axes(:, 2)**2), tiny(1.0_wp))
      axes(:, 1) = axes(:, 1)/length
      axes(:, 2) = axes(:, 2)/length
   end subroutine material_direction
end module finshell_material_direction
