!> Strains that are referred to another metric: E <- A E A with A = (I + V)^(-1/2), and stresses and tangents that are pulled back.
!>
!> V, strains and tangents in Voigt form (finshell_voigt). V is small where metrics differ little: it is given, not I + V.
module finshell_metric_change
   use finshell_kinds, only: wp
   use finshell_voigt, only: column, pack, row
   implicit none
   private
   public :: new_metric_change, change_strain, pull_back_stress, pull_back_tangent

contains

   !> The change by its closed form, A = (C + J I)^-1 t, with C = I + V, J = sqrt(det C), t = tr sqrt(C).
   pure subroutine new_metric_change(n, v, map, area)
      integer, intent(in) :: n
      real(wp), intent(in) :: v(n, 3) !< V_11, V_22, V_12
      real(wp), intent(out) :: map(n, 3, 3) !< of Voigt strains
      real(wp), intent(out) :: area(n) !< J: new over old area
      real(wp) :: a, b, d, j, inverse
      integer :: i
      do i = 1, n
         j = sqrt((1 + v(i, 1))*(1 + v(i, 2)) - v(i, 3)**2)
         inverse = 1/(sqrt(2 + v(i, 1) + v(i, 2) + 2*j)*j)
         a = (1 + v(i, 2) + j)*inverse
         d = (1 + v(i, 1) + j)*inverse
         b = -v(i, 3)*inverse
         area(i) = j
         map(i, 1, 1) = a*a
         map(i, 1, 2) = b*b
         map(i, 1, 3) = a*b
         map(i, 2, 1) = b*b
         map(i, 2, 2) = d*d
         map(i, 2, 3) = b*d
         map(i, 3, 1) = 2*a*b
         map(i, 3, 2) = 2*b*d
         map(i, 3, 3) = a*d + b*b
      end do
   end subroutine new_metric_change

   !> Strains referred to the other metric, in place.
   pure subroutine change_strain(n, map, strain)
      integer, intent(in) :: n
      real(wp), intent(in) :: map(n, 3, 3)
      real(wp), intent(inout) :: strain(n, 3)
      real(wp) :: e(n, 3)
      integer :: v
      e = strain
      do v = 1, 3
         strain(:, v) = map(:, v, 1)*e(:, 1) + map(:, v, 2)*e(:, 2) + map(:, v, 3)*e(:, 3)
      end do
   end subroutine change_strain

   !> Stresses, or gradients with respect to strain: transposed, times a factor, in place.
   pure subroutine pull_back_stress(n, map, factor, stress)
      integer, intent(in) :: n
      real(wp), intent(in) :: map(n, 3, 3), factor(n)
      real(wp), intent(inout) :: stress(n, 3)
      real(wp) :: s(n, 3)
      integer :: v
      s = stress
      do v = 1, 3
         stress(:, v) = factor*(map(:, 1, v)*s(:, 1) + map(:, 2, v)*s(:, 2) + map(:, 3, v)*s(:, 3))
      end do
   end subroutine pull_back_stress

   !> Tangents, or Hessians with respect to strain, packed.
   pure subroutine pull_back_tangent(n, map, factor, tangent)
      integer, intent(in) :: n
      real(wp), intent(in) :: map(n, 3, 3), factor(n)
      real(wp), intent(inout) :: tangent(n, 6)
      real(wp) :: t(n, 3, 3)
      integer :: i, j, p
      do j = 1, 3
         do i = 1, 3
            t(:, i, j) = tangent(:, pack(i, 1))*map(:, 1, j) + tangent(:, pack(i, 2))*map(:, 2, j) &
               + tangent(:, pack(i, 3))*map(:, 3, j)
         end do
      end do
      do p = 1, 6
         i = row(p)
         j = column(p)
         tangent(:, p) = factor*(map(:, 1, i)*t(:, 1, j) + map(:, 2, i)*t(:, 2, j) + map(:, 3, i)*t(:, 3, j))
      end do
   end subroutine pull_back_tangent
end module finshell_metric_change
