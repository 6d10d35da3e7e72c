!> Layers that have grown: their law looks at the strain from the stress-free state.
!>
!> With E_g the strain of the stress-free state in the plane, from the reference, and U = (1 + 2 E_g)^(1/2), a point of the layer
!> has the elastic strain U^-1 (E - E_g) U^-1 and, per reference volume, the energy J W, J = det U times the growth of the
!> thickness (the multiplicative split F = F_e F_g with F_g symmetric, Rodriguez, Hoger & McCulloch 1994, in plane stress). Where
!> the reference is curved, K_0 its curvature as that of the strains, fibres at a height z are longer or shorter from the start,
!> and so is what has grown of them: E_g - z (E_g K_0 + K_0 E_g).
module finshell_growth
   use finshell_kinds, only: wp, lanes, points_per_block
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_metric_change, only: change_strain, new_metric_change, pull_back_stress, pull_back_tangent
   use finshell_own, only: own_t, n_growth, at_points
   use finshell_voigt, only: rotate_strain
   implicit none
   private
   public :: growth_t, new_growth, from_stress_free, pull_back, stress_free_stretch, free_over_reference, layer_volume

   !> Of a layer at the first so many points of a block, in the axes in which its law is evaluated.
   type :: growth_t
      real(wp) :: strain(points_per_block, 3), curvature(points_per_block, 3) !< E_g at height z is strain + z curvature
      real(wp) :: map(points_per_block, 3, 3) !< E -> U^-1 E U^-1
      real(wp) :: volume(points_per_block) !< J
      real(wp) :: thickness(points_per_block) !< growth of it
   end type growth_t

contains

   !> Growth of a layer at the points of a block, or at one point of each element.
   pure subroutine new_growth(own, layer, n, turned, growth, bend)
      type(own_t), intent(in) :: own !< with growth
      integer, intent(in) :: layer !< its number
      integer, intent(in) :: n !< points: points_per_block or lanes
      real(wp), intent(in) :: turned(n, 2) !< cosine, sine of the axes of evaluation, from the material direction
      type(growth_t), intent(out) :: growth
      real(wp), intent(in), optional :: bend(n, 3) !< K_0 in the axes of evaluation, 11, 22, 2 12; absent: the reference is flat
      real(wp) :: given(n, 3), values(points_per_block)
      integer :: i
      do i = 1, n_growth - 1
         values = at_points(own%growth(:, i, layer))
         given(:, i) = values(:n)
      end do
      growth%thickness = 1 + at_points(own%growth(:, n_growth, layer))
      call rotate_strain(n, turned, given, growth%strain(:n, :))
      given(:, 1:2) = 2*growth%strain(:n, 1:2)
      given(:, 3) = growth%strain(:n, 3)
      call new_metric_change(n, given, growth%map(:n, :, :), growth%volume(:n))
      growth%volume(:n) = growth%volume(:n)*growth%thickness(:n)
      growth%curvature(:n, :) = 0
      if (.not. present(bend)) return
      associate (e => growth%strain(:n, :), k => growth%curvature(:n, :))
         k(:, 1) = -2*e(:, 1)*bend(:, 1) - 0.5_wp*e(:, 3)*bend(:, 3)
         k(:, 2) = -2*e(:, 2)*bend(:, 2) - 0.5_wp*e(:, 3)*bend(:, 3)
         k(:, 3) = -(e(:, 1) + e(:, 2))*bend(:, 3) - e(:, 3)*(bend(:, 1) + bend(:, 2))
         if (.not. own%sized) return
         ! heights are those of the section
         values = at_points(own%shift)
         do i = 1, 3
            e(:, i) = e(:, i) + values(:n)*k(:, i)
         end do
         values = at_points(own%ratio)
         do i = 1, 3
            k(:, i) = values(:n)*k(:, i)
         end do
      end associate
   end subroutine new_growth

   !> Strains from the reference become those from the stress-free state; at height z they are strain + z curvature.
   pure subroutine from_stress_free(n, growth, strain, curvature)
      integer, intent(in) :: n
      type(growth_t), intent(in) :: growth
      real(wp), intent(inout) :: strain(n, 3)
      real(wp), intent(inout), optional :: curvature(n, 3)
      strain = strain - growth%strain(:n, :)
      call change_strain(n, growth%map(:n, :, :), strain)
      if (.not. present(curvature)) return
      curvature = curvature - growth%curvature(:n, :)
      call change_strain(n, growth%map(:n, :, :), curvature)
   end subroutine from_stress_free

   !> Energy, stress and tangent of the stress-free state become those of the reference.
   pure subroutine pull_back(n, level, growth, energy, stress, tangent)
      integer, intent(in) :: n, level
      type(growth_t), intent(in) :: growth
      real(wp), intent(inout) :: energy(n), stress(n, 3), tangent(n, 6)
      energy = growth%volume(:n)*energy
      if (level >= level_force) call pull_back_stress(n, growth%map(:n, :, :), growth%volume(:n), stress)
      if (level >= level_tangent) call pull_back_tangent(n, growth%map(:n, :, :), growth%volume(:n), tangent)
   end subroutine pull_back

   !> U - 1 along the material direction, of elements that have grown the same in all layers.
   pure subroutine stress_free_stretch(own, stretch)
      type(own_t), intent(in) :: own
      real(wp), intent(out) :: stretch(lanes, 3) !< 11, 22, 12
      real(wp) :: c(3), u(3), j, t, determinant
      integer :: l
      do l = 1, lanes
         ! 2 E_g (U + 1)^-1, with digits where little has grown
         c = [2*own%growth(l, 1, 1), 2*own%growth(l, 2, 1), own%growth(l, 3, 1)]
         j = sqrt((1 + c(1))*(1 + c(2)) - c(3)**2)
         t = sqrt(2 + c(1) + c(2) + 2*j)
         u = [(1 + c(1) + j)/t + 1, (1 + c(2) + j)/t + 1, c(3)/t]
         determinant = u(1)*u(2) - u(3)**2
         stretch(l, 1) = (c(1)*u(2) - c(3)*u(3))/determinant
         stretch(l, 2) = (c(2)*u(1) - c(3)*u(3))/determinant
         stretch(l, 3) = (c(3)*u(1) - c(1)*u(3))/determinant
      end do
   end subroutine stress_free_stretch

   !> Volume of a stress-free layer over that of the reference.
   pure function layer_volume(own, layer) result(volume)
      type(own_t), intent(in) :: own
      integer, intent(in) :: layer
      real(wp) :: volume(lanes)
      volume = free_over_reference(own, layer)*(1 + own%growth(:, n_growth, layer))
   end function layer_volume

   !> Area of a stress-free layer over that of the reference.
   pure function free_over_reference(own, layer) result(area)
      type(own_t), intent(in) :: own
      integer, intent(in) :: layer
      real(wp) :: area(lanes)
      area = sqrt((1 + 2*own%growth(:, 1, layer))*(1 + 2*own%growth(:, 2, layer)) - own%growth(:, 3, layer)**2)
   end function free_over_reference
end module finshell_growth
