!> In-plane rotation of plane strain, stress and their tangent in Voigt form.
!>
!> `direction(:, 1:2)` holds cosine and sine of the angle from the first axis of the outer frame to the first axis of the
!> inner one. Strain (E11, E22, 2 E12), stress (S11, S22, S12), tangent packed (11, 22, 33, 12, 13, 23).
module finshell_voigt
   use finshell_kinds, only: wp
   implicit none
   private
   public :: rotate_strain, rotate_stress, rotate_tangent, row, column, pack

   !> Packed symmetric 3x3: entry k is (row(k), column(k)).
   integer, parameter :: row(6) = [1, 2, 3, 1, 1, 2], column(6) = [1, 2, 3, 2, 3, 3]
   integer, parameter :: pack(3, 3) = reshape([1, 4, 5, 4, 2, 6, 5, 6, 3], [3, 3])

contains

   !> Strain components of the inner frame from those of the outer.
   pure subroutine rotate_strain(n, direction, outer, inner)
      integer, intent(in) :: n
      real(wp), intent(in) :: direction(n, 2), outer(n, 3)
      real(wp), intent(out) :: inner(n, 3)
      real(wp) :: c, s
      integer :: i
      do i = 1, n
         c = direction(i, 1)
         s = direction(i, 2)
         inner(i, 1) = c*c*outer(i, 1) + s*s*outer(i, 2) + c*s*outer(i, 3)
         inner(i, 2) = s*s*outer(i, 1) + c*c*outer(i, 2) - c*s*outer(i, 3)
         inner(i, 3) = 2*c*s*(outer(i, 2) - outer(i, 1)) + (c*c - s*s)*outer(i, 3)
      end do
   end subroutine rotate_strain

   !> Stress components (or any gradient with respect to strain) from the inner frame to the outer, in place.
   pure subroutine rotate_stress(n, direction, stress)
      integer, intent(in) :: n
      real(wp), intent(in) :: direction(n, 2)
      real(wp), intent(inout) :: stress(n, 3)
      real(wp) :: c, s, a, b, t
      integer :: i
      do i = 1, n
         c = direction(i, 1)
         s = direction(i, 2)
         a = stress(i, 1)
         b = stress(i, 2)
         t = stress(i, 3)
         stress(i, 1) = c*c*a + s*s*b - 2*c*s*t
         stress(i, 2) = s*s*a + c*c*b + 2*c*s*t
         stress(i, 3) = c*s*(a - b) + (c*c - s*s)*t
      end do
   end subroutine rotate_stress

   !> Tangent (or any Hessian with respect to strain) from the inner frame to the outer, in place: T' D T.
   pure subroutine rotate_tangent(n, direction, tangent)
      integer, intent(in) :: n
      real(wp), intent(in) :: direction(n, 2)
      real(wp), intent(inout) :: tangent(n, 6)
      real(wp) :: c, s, t(3, 3), d(3, 3), p(3, 3)
      integer :: i
      do i = 1, n
         c = direction(i, 1)
         s = direction(i, 2)
         t(:, 1) = [c*c, s*s, -2*c*s]
         t(:, 2) = [s*s, c*c, 2*c*s]
         t(:, 3) = [c*s, -c*s, c*c - s*s]
         d(:, 1) = [tangent(i, 1), tangent(i, 4), tangent(i, 5)]
         d(:, 2) = [tangent(i, 4), tangent(i, 2), tangent(i, 6)]
         d(:, 3) = [tangent(i, 5), tangent(i, 6), tangent(i, 3)]
         p = matmul(transpose(t), matmul(d, t))
         tangent(i, :) = [p(1, 1), p(2, 2), p(3, 3), p(1, 2), p(1, 3), p(2, 3)]
      end do
   end subroutine rotate_tangent
end module finshell_voigt
