!> Membrane strain of the core element in both formulations, with its first derivatives, and the drilling stiffness of (S).
module finshell_core_strain
   use finshell_kinds, only: wp, lanes
   use finshell_bending, only: bending_t
   use finshell_drilling, only: drilling_t
   use finshell_filter, only: filter_t
   use finshell_material, only: level_force
   use finshell_reference, only: reference_t
   use finshell_section, only: section_t, reference_membrane_tangent
   implicit none
   private
   public :: n_core, row, column, pack
   public :: drilling_stiffness, add_drilling_force, stabilised_strain, paper_strain, total_drilling_matrix, jacobian_gradient

   !> Number of core variables (finshell_core).
   integer, parameter :: n_core = 12
   !> Packed symmetric 3x3: entry k is (row(k), column(k)).
   integer, parameter :: row(6) = [1, 2, 3, 1, 1, 2], column(6) = [1, 2, 3, 2, 3, 3]
   integer, parameter :: pack(3, 3) = reshape([1, 4, 5, 4, 2, 6, 5, 6, 3], [3, 3])

contains

   !> Constant drilling stiffness K_h = int B_h' C_0 B_h dV of formulation (S).
   pure subroutine drilling_stiffness(section, ref, higher, axes, kh)
      type(section_t), intent(in) :: section
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: higher(lanes, 3, 3, 3), axes(lanes, 2)
      real(wp), intent(out) :: kh(lanes, 6)
      real(wp) :: c(lanes, 6), t(lanes, 3)
      integer :: g, i, j, k, v
      call reference_membrane_tangent(section, axes, c)
      do v = 1, 6
         c(:, v) = c(:, v)*ref%area/3
      end do
      kh = 0
      do g = 1, 3
         do j = 1, 3
            do v = 1, 3
               t(:, v) = c(:, pack(v, 1))*higher(:, 1, j, g) + c(:, pack(v, 2))*higher(:, 2, j, g) &
                  + c(:, pack(v, 3))*higher(:, 3, j, g)
            end do
            do i = 1, j
               k = pack(i, j)
               kh(:, k) = kh(:, k) + higher(:, 1, i, g)*t(:, 1) + higher(:, 2, i, g)*t(:, 2) + higher(:, 3, i, g)*t(:, 3)
            end do
         end do
      end do
   end subroutine drilling_stiffness

   !> Drilling moments K_h tau.
   pure subroutine add_drilling_force(kh, tau, gradient)
      real(wp), intent(in) :: kh(lanes, 6), tau(lanes, 3)
      real(wp), intent(inout) :: gradient(lanes, n_core)
      integer :: i
      do i = 1, 3
         gradient(:, 3 + i) = gradient(:, 3 + i) + kh(:, pack(i, 1))*tau(:, 1) + kh(:, pack(i, 2))*tau(:, 2) &
            + kh(:, pack(i, 3))*tau(:, 3)
      end do
   end subroutine add_drilling_force

   !> Membrane strain of (S), one for the whole element.
   pure subroutine stabilised_strain(level, strain, bend, drill, membrane, dm)
      integer, intent(in) :: level
      real(wp), intent(in) :: strain(lanes, 3)
      type(bending_t), intent(in) :: bend
      type(drilling_t), intent(in) :: drill
      real(wp), intent(inout) :: membrane(lanes, 3, 3), dm(lanes, 3, n_core, 3)
      integer :: i

      associate (s => bend%slope)
         membrane(:, 1, 1) = (s(:, 1, 1)**2 + s(:, 1, 2)**2 + s(:, 1, 3)**2)/6
         membrane(:, 2, 1) = (s(:, 2, 1)**2 + s(:, 2, 2)**2 + s(:, 2, 3)**2)/6
         membrane(:, 3, 1) = (s(:, 1, 1)*s(:, 2, 1) + s(:, 1, 2)*s(:, 2, 2) + s(:, 1, 3)*s(:, 2, 3))/3
      end associate
      membrane(:, :, 1) = strain + drill%strain + membrane(:, :, 1)
      if (level < level_force) return
      do i = 1, 3
         call mean_von_karman(bend%slope, bend%slope_e(:, :, :, i), dm(:, :, i, 1))
         dm(:, i, i, 1) = dm(:, i, i, 1) + 1
         dm(:, :, i, 1) = dm(:, :, i, 1) + drill%strain_e(:, :, i)
      end do
      dm(:, :, 4, 1) = drill%strain_a(:, :, 1)
      dm(:, :, 5, 1) = drill%strain_a(:, :, 2)
      dm(:, :, 6, 1) = -drill%strain_a(:, :, 1) - drill%strain_a(:, :, 2)
      do i = 1, 6
         call mean_von_karman(bend%slope, bend%slope_g(:, :, :, i), dm(:, :, 6 + i, 1))
      end do
   end subroutine stabilised_strain

   !> Derivative of 1/2 <G (x) G> for a change dG of the slopes at the points.
   pure subroutine mean_von_karman(s, ds, d)
      real(wp), intent(in) :: s(lanes, 2, 3), ds(lanes, 2, 3)
      real(wp), intent(out) :: d(lanes, 3)
      real(wp), parameter :: third = 1.0_wp/3
      d(:, 1) = third*(s(:, 1, 1)*ds(:, 1, 1) + s(:, 1, 2)*ds(:, 1, 2) + s(:, 1, 3)*ds(:, 1, 3))
      d(:, 2) = third*(s(:, 2, 1)*ds(:, 2, 1) + s(:, 2, 2)*ds(:, 2, 2) + s(:, 2, 3)*ds(:, 2, 3))
      d(:, 3) = third*(s(:, 1, 1)*ds(:, 2, 1) + s(:, 2, 1)*ds(:, 1, 1) + s(:, 1, 2)*ds(:, 2, 2) + s(:, 2, 2)*ds(:, 1, 2) &
                       + s(:, 1, 3)*ds(:, 2, 3) + s(:, 2, 3)*ds(:, 1, 3))
   end subroutine mean_von_karman

   !> Membrane strain of (P) at the three points: (C - I)/2 + J B tau + 1/2 G (x) G.
   pure subroutine paper_strain(level, ref, filter, tau, bend, higher, membrane, dm)
      integer, intent(in) :: level
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: tau(lanes, 3)
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: higher(lanes, 3, 3, 3)
      real(wp), intent(inout) :: membrane(lanes, 3, 3), dm(lanes, 3, n_core, 3)
      real(wp) :: b(lanes, 3, 3), dj(lanes, 3)
      integer :: g, i, v
      call jacobian_gradient(filter, dj)
      do g = 1, 3
         call total_drilling_matrix(ref, higher(:, :, :, g), b)
         associate (s => bend%slope(:, :, g))
            membrane(:, 1, g) = filter%strain(:, 1) + 0.5_wp*s(:, 1)**2
            membrane(:, 2, g) = filter%strain(:, 2) + 0.5_wp*s(:, 2)**2
            membrane(:, 3, g) = filter%strain(:, 3) + s(:, 1)*s(:, 2)
         end associate
         do v = 1, 3
            membrane(:, v, g) = membrane(:, v, g) &
               + filter%jacobian*(b(:, v, 1)*tau(:, 1) + b(:, v, 2)*tau(:, 2) + b(:, v, 3)*tau(:, 3))
         end do
         if (level < level_force) cycle
         do i = 1, 3
            call von_karman(bend%slope(:, :, g), bend%slope_e(:, :, g, i), dm(:, :, i, g))
            dm(:, i, i, g) = dm(:, i, i, g) + 1
            do v = 1, 3
               dm(:, v, i, g) = dm(:, v, i, g) &
                  + dj(:, i)*(b(:, v, 1)*tau(:, 1) + b(:, v, 2)*tau(:, 2) + b(:, v, 3)*tau(:, 3))
               dm(:, v, 3 + i, g) = filter%jacobian*b(:, v, i)
            end do
         end do
         do i = 1, 6
            call von_karman(bend%slope(:, :, g), bend%slope_g(:, :, g, i), dm(:, :, 6 + i, g))
         end do
      end do
   end subroutine paper_strain

   pure subroutine von_karman(s, ds, d)
      real(wp), intent(in) :: s(lanes, 2), ds(lanes, 2)
      real(wp), intent(out) :: d(lanes, 3)
      d(:, 1) = s(:, 1)*ds(:, 1)
      d(:, 2) = s(:, 2)*ds(:, 2)
      d(:, 3) = s(:, 1)*ds(:, 2) + s(:, 2)*ds(:, 1)
   end subroutine von_karman

   !> Basic plus higher-order drilling strain at a point.
   pure subroutine total_drilling_matrix(ref, higher, b)
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: higher(lanes, 3, 3)
      real(wp), intent(out) :: b(lanes, 3, 3)
      b(:, :, 1) = higher(:, :, 1) + ref%basic(:, :, 1)
      b(:, :, 2) = higher(:, :, 2) + ref%basic(:, :, 2)
      b(:, :, 3) = higher(:, :, 3) - ref%basic(:, :, 1) - ref%basic(:, :, 2)
   end subroutine total_drilling_matrix

   pure subroutine jacobian_gradient(filter, dj)
      type(filter_t), intent(in) :: filter
      real(wp), intent(out) :: dj(lanes, 3)
      dj(:, 1) = filter%c(:, 2)/filter%jacobian
      dj(:, 2) = filter%c(:, 1)/filter%jacobian
      dj(:, 3) = -filter%c(:, 3)/filter%jacobian
   end subroutine jacobian_gradient
end module finshell_core_strain
