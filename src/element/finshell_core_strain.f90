!> Membrane strain of the core element in both formulations, and the drilling stiffness of (S).
module finshell_core_strain
   use finshell_kinds, only: wp, lanes
   use finshell_bending, only: bending_t
   use finshell_drilling, only: drilling_t
   use finshell_filter, only: filter_t
   use finshell_own, only: own_t
   use finshell_reference, only: reference_t
   use finshell_resultants, only: reference_membrane_tangent
   use finshell_section, only: section_t
   use finshell_voigt, only: pack
   implicit none
   private
   public :: n_core, rows_9
   public :: drilling_stiffness, stabilised_strain, paper_strain, total_drilling_matrix

   !> Number of core variables (finshell_core). The first nine of them bend: midsurface strain and slopes.
   integer, parameter :: n_core = 12
   !> As rows_3 (finshell_kinds) for these nine; what is beyond is zero.
   integer, parameter :: rows_9 = merge(12, 9, lanes == 1)

contains

   !> Constant drilling stiffness K_h = int B_h' C_0 B_h dV of formulation (S).
   pure subroutine drilling_stiffness(section, own, ref, beta0, higher, axes, kh)
      type(section_t), intent(in) :: section
      type(own_t), intent(in) :: own
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: beta0(lanes), higher(lanes, 3, 3, 3), axes(lanes, 2)
      real(wp), intent(out) :: kh(lanes, 6)
      real(wp) :: c(lanes, 6), t(lanes, 3)
      integer :: g, i, j, k, v
      call reference_membrane_tangent(section, axes, c, own)
      do v = 1, 6
         c(:, v) = c(:, v)*(ref%area/3)*beta0
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

   !> Membrane strain of (S), one for the whole element.
   pure subroutine stabilised_strain(strain, bend, drill, membrane)
      real(wp), intent(in) :: strain(lanes, 3)
      type(bending_t), intent(in) :: bend
      type(drilling_t), intent(in) :: drill
      real(wp), intent(inout) :: membrane(lanes, 3, 3)
      membrane(:, 1, 1) = strain(:, 1) + drill%strain(:, 1) + 0.5_wp*bend%v(:, 1)
      membrane(:, 2, 1) = strain(:, 2) + drill%strain(:, 2) + 0.5_wp*bend%v(:, 2)
      membrane(:, 3, 1) = strain(:, 3) + drill%strain(:, 3) + bend%v(:, 3)
   end subroutine stabilised_strain

   !> Membrane strain of (P) at the three points: (C - I)/2 + J B tau + 1/2 G (x) G.
   pure subroutine paper_strain(ref, filter, tau, bend, higher, membrane)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: tau(lanes, 3)
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: higher(lanes, 3, 3, 3)
      real(wp), intent(inout) :: membrane(lanes, 3, 3)
      real(wp) :: b(lanes, 3, 3)
      integer :: g, v
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
      end do
   end subroutine paper_strain

   !> Basic plus higher-order drilling strain at a point.
   pure subroutine total_drilling_matrix(ref, higher, b)
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: higher(lanes, 3, 3)
      real(wp), intent(out) :: b(lanes, 3, 3)
      b(:, :, 1) = higher(:, :, 1) + ref%basic(:, :, 1)
      b(:, :, 2) = higher(:, :, 2) + ref%basic(:, :, 2)
      b(:, :, 3) = higher(:, :, 3) - ref%basic(:, :, 1) - ref%basic(:, :, 2)
   end subroutine total_drilling_matrix
end module finshell_core_strain
