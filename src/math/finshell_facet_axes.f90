!> Axes of a flat triangle: the first along its first side, the second in its plane, the third its normal.
module finshell_facet_axes
   use finshell_kinds, only: wp
   use finshell_rotation, only: cross_product
   implicit none
   private
   public :: facet_axes

contains

   !> As columns; NaN for a triangle without area.
   pure function facet_axes(x) result(axes)
      real(wp), intent(in) :: x(3, 3) !< corners, a column each
      real(wp) :: axes(3, 3)
      axes(:, 1) = x(:, 2) - x(:, 1)
      axes(:, 3) = cross_product(axes(:, 1), x(:, 3) - x(:, 1))
      axes(:, 1) = axes(:, 1)/norm2(axes(:, 1))
      axes(:, 3) = axes(:, 3)/norm2(axes(:, 3))
      axes(:, 2) = cross_product(axes(:, 3), axes(:, 1))
   end function facet_axes
end module finshell_facet_axes
