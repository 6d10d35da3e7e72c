!> Strains that are referred to another metric: E <- A E A with A = (I + V)^(-1/2), and stresses and tangents that are pulled back.
!>
!> V, strains and tangents in Voigt form (finshell_voigt). V is small where metrics differ little: it is given, not I + V. Loops
!> over points keep what they need in registers: with arrays for it they would not become vector instructions. What is changed in
!> place has assumed shape: slices of larger arrays are taken where they stand.
module finshell_metric_change
   use finshell_kinds, only: wp
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
      real(wp), intent(inout) :: strain(:, :) !< (n, 3)
      real(wp) :: e1, e2, e3
      integer :: l
      !GCC$ ivdep
      do l = 1, n
         e1 = strain(l, 1)
         e2 = strain(l, 2)
         e3 = strain(l, 3)
         strain(l, 1) = map(l, 1, 1)*e1 + map(l, 1, 2)*e2 + map(l, 1, 3)*e3
         strain(l, 2) = map(l, 2, 1)*e1 + map(l, 2, 2)*e2 + map(l, 2, 3)*e3
         strain(l, 3) = map(l, 3, 1)*e1 + map(l, 3, 2)*e2 + map(l, 3, 3)*e3
      end do
   end subroutine change_strain

   !> Stresses, or gradients with respect to strain: transposed, times a factor, in place.
   pure subroutine pull_back_stress(n, map, factor, stress)
      integer, intent(in) :: n
      real(wp), intent(in) :: map(n, 3, 3), factor(n)
      real(wp), intent(inout) :: stress(:, :) !< (n, 3)
      real(wp) :: s1, s2, s3
      integer :: l
      !GCC$ ivdep
      do l = 1, n
         s1 = factor(l)*stress(l, 1)
         s2 = factor(l)*stress(l, 2)
         s3 = factor(l)*stress(l, 3)
         stress(l, 1) = map(l, 1, 1)*s1 + map(l, 2, 1)*s2 + map(l, 3, 1)*s3
         stress(l, 2) = map(l, 1, 2)*s1 + map(l, 2, 2)*s2 + map(l, 3, 2)*s3
         stress(l, 3) = map(l, 1, 3)*s1 + map(l, 2, 3)*s2 + map(l, 3, 3)*s3
      end do
   end subroutine pull_back_stress

   !> Tangents, or Hessians with respect to strain, packed.
   pure subroutine pull_back_tangent(n, map, factor, tangent)
      integer, intent(in) :: n
      real(wp), intent(in) :: map(n, 3, 3), factor(n)
      real(wp), intent(inout) :: tangent(:, :) !< (n, 6)
      real(wp) :: d11, d22, d33, d12, d13, d23, t1, t2, t3
      integer :: l
      !GCC$ ivdep
      do l = 1, n
         d11 = factor(l)*tangent(l, 1)
         d22 = factor(l)*tangent(l, 2)
         d33 = factor(l)*tangent(l, 3)
         d12 = factor(l)*tangent(l, 4)
         d13 = factor(l)*tangent(l, 5)
         d23 = factor(l)*tangent(l, 6)
         t1 = d11*map(l, 1, 1) + d12*map(l, 2, 1) + d13*map(l, 3, 1)
         t2 = d12*map(l, 1, 1) + d22*map(l, 2, 1) + d23*map(l, 3, 1)
         t3 = d13*map(l, 1, 1) + d23*map(l, 2, 1) + d33*map(l, 3, 1)
         tangent(l, 1) = map(l, 1, 1)*t1 + map(l, 2, 1)*t2 + map(l, 3, 1)*t3
         tangent(l, 4) = map(l, 1, 2)*t1 + map(l, 2, 2)*t2 + map(l, 3, 2)*t3
         tangent(l, 5) = map(l, 1, 3)*t1 + map(l, 2, 3)*t2 + map(l, 3, 3)*t3
         t1 = d11*map(l, 1, 2) + d12*map(l, 2, 2) + d13*map(l, 3, 2)
         t2 = d12*map(l, 1, 2) + d22*map(l, 2, 2) + d23*map(l, 3, 2)
         t3 = d13*map(l, 1, 2) + d23*map(l, 2, 2) + d33*map(l, 3, 2)
         tangent(l, 2) = map(l, 1, 2)*t1 + map(l, 2, 2)*t2 + map(l, 3, 2)*t3
         tangent(l, 6) = map(l, 1, 3)*t1 + map(l, 2, 3)*t2 + map(l, 3, 3)*t3
         t1 = d11*map(l, 1, 3) + d12*map(l, 2, 3) + d13*map(l, 3, 3)
         t2 = d12*map(l, 1, 3) + d22*map(l, 2, 3) + d23*map(l, 3, 3)
         t3 = d13*map(l, 1, 3) + d23*map(l, 2, 3) + d33*map(l, 3, 3)
         tangent(l, 3) = map(l, 1, 3)*t1 + map(l, 2, 3)*t2 + map(l, 3, 3)*t3
      end do
   end subroutine pull_back_tangent
end module finshell_metric_change
