!> Hessian of the core element: second derivatives of sides, drilling strain and membrane strain at fixed resultants.
module finshell_core_geometric
   use finshell_kinds, only: wp, lanes
   use finshell_bending, only: bending_t
   use finshell_core_force, only: work_t
   use finshell_core_strain, only: n_core, total_drilling_matrix
   use finshell_drilling, only: drilling_t, add_drilling_hessian
   use finshell_filter, only: filter_t, jacobian_gradient
   use finshell_kink, only: kink_t, add_kink_hessian
   use finshell_reference, only: reference_t
   use finshell_voigt, only: row, column
   implicit none
   private
   public :: add_side_terms, stabilised_geometric, paper_geometric

contains

   !> Second derivatives of beta_k p_k, at fixed work conjugate: p_k is linear in the slopes of the side's two nodes.
   pure subroutine add_side_terms(ref, bend, side, h)
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: side(lanes, 3) !< conjugate to beta_k p_k
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: p(lanes, 3)
      integer :: i, k, m, node
      p = side*bend%p
      do k = 1, 6
         h(:, row(k), column(k)) = h(:, row(k), column(k)) + p(:, 1)*bend%ddbeta(:, k, 1) + p(:, 2)*bend%ddbeta(:, k, 2) &
            + p(:, 3)*bend%ddbeta(:, k, 3)
      end do
      do k = 1, 3
         do m = 0, 1
            node = 1 + mod(k - 1 + m, 3)
            do i = 1, 3
               h(:, i, 2 + 2*node) = h(:, i, 2 + 2*node) + side(:, k)*bend%dbeta(:, i, k)*ref%side(:, 1, k)
               h(:, i, 3 + 2*node) = h(:, i, 3 + 2*node) + side(:, k)*bend%dbeta(:, i, k)*ref%side(:, 2, k)
            end do
         end do
      end do
   end subroutine add_side_terms

   !> Second derivatives of the drilling strain of (S) at fixed membrane force.
   pure subroutine stabilised_geometric(ref, filter, bend, drill, w, h, kink)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      type(bending_t), intent(in) :: bend
      type(drilling_t), intent(in) :: drill
      type(work_t), intent(in) :: w
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      type(kink_t), intent(in) :: kink
      real(wp) :: n(lanes, 3), ee(lanes, 6), ea(lanes, 3, 3), aa(lanes, 6)
      integer :: i, k
      n = 3*w%n(:, :, 1)
      call add_drilling_hessian(ref, filter%c, filter%jacobian, drill, n, ee, ea, aa)
      do k = 1, 6
         h(:, row(k), column(k)) = h(:, row(k), column(k)) + ee(:, k)
      end do
      do i = 1, 3
         h(:, i, 10) = h(:, i, 10) + ea(:, i, 1)
         h(:, i, 11) = h(:, i, 11) + ea(:, i, 2)
         h(:, i, 12) = h(:, i, 12) - ea(:, i, 1) - ea(:, i, 2)
      end do
      h(:, 10, 10) = h(:, 10, 10) + aa(:, 1)
      h(:, 11, 11) = h(:, 11, 11) + aa(:, 2)
      h(:, 10, 11) = h(:, 10, 11) + aa(:, 3)
      h(:, 10, 12) = h(:, 10, 12) - aa(:, 1) - aa(:, 3)
      h(:, 11, 12) = h(:, 11, 12) - aa(:, 2) - aa(:, 3)
      h(:, 12, 12) = h(:, 12, 12) + aa(:, 1) + aa(:, 2) + 2*aa(:, 3)
      if (kink%any) call kinked(ref, filter, bend, kink, ea, aa, w%drilling, h)
   end subroutine stabilised_geometric

   !> What a kink adds to that: the differences depend on midsurface strain and slopes too.
   pure subroutine kinked(ref, filter, bend, kink, ea, aa, conjugate, h)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      type(bending_t), intent(in) :: bend
      type(kink_t), intent(in) :: kink
      real(wp), intent(in) :: ea(lanes, 3, 3), aa(lanes, 6), conjugate(lanes, 3)
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      integer, parameter :: pair(3, 3) = reshape([1, 3, 4, 3, 2, 5, 4, 5, 6], [3, 3])
      real(wp) :: second(lanes, 3, 9), t(lanes, 3)
      integer :: a, b, i, j
      second = 0
      call add_kink_hessian(ref, filter, bend, kink, conjugate, second)
      associate (da => kink%derivative)
         do j = 1, 9
            t = 0
            do a = 1, 3
               do b = 1, 3
                  t(:, a) = t(:, a) + aa(:, pair(a, b))*da(:, b, j)
               end do
            end do
            do i = 1, j
               h(:, i, j) = h(:, i, j) + da(:, 1, i)*t(:, 1) + da(:, 2, i)*t(:, 2) + da(:, 3, i)*t(:, 3)
            end do
            do i = 1, 3
               second(:, i, j) = second(:, i, j) + ea(:, i, 1)*da(:, 1, j) + ea(:, i, 2)*da(:, 2, j) + ea(:, i, 3)*da(:, 3, j)
               if (j <= i) h(:, j, i) = h(:, j, i) + ea(:, i, 1)*da(:, 1, j) + ea(:, i, 2)*da(:, 2, j) + ea(:, i, 3)*da(:, 3, j)
               if (i <= j) h(:, i, j) = h(:, i, j) + second(:, i, j)
            end do
            ! with the drilling angles
            t(:, 3) = -t(:, 1) - t(:, 2)
            do i = 1, 3
               h(:, j, 9 + i) = h(:, j, 9 + i) + t(:, i)
            end do
         end do
      end associate
   end subroutine kinked

   !> Second derivatives of J B tau, formulation (P).
   pure subroutine paper_geometric(ref, filter, tau, higher, work, h)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: tau(lanes, 3), higher(lanes, 3, 3, 3)
      type(work_t), intent(in) :: work
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: b(lanes, 3, 3), dj(lanes, 3), w(lanes, 3), total(lanes)
      integer :: g, i, j, k
      call jacobian_gradient(filter, dj)
      w = 0
      do g = 1, 3
         call total_drilling_matrix(ref, higher(:, :, :, g), b)
         do i = 1, 3
            w(:, i) = w(:, i) + work%n(:, 1, g)*b(:, 1, i) + work%n(:, 2, g)*b(:, 2, i) + work%n(:, 3, g)*b(:, 3, i)
         end do
      end do
      do j = 1, 3
         do i = 1, 3
            h(:, i, 9 + j) = h(:, i, 9 + j) + dj(:, i)*w(:, j)
         end do
      end do
      ! J J,ab = (J^2),ab/2 - J,a J,b with (J^2),12 = 4 and (J^2),33 = -2
      total = (w(:, 1)*tau(:, 1) + w(:, 2)*tau(:, 2) + w(:, 3)*tau(:, 3))/filter%jacobian
      do k = 1, 6
         i = row(k)
         j = column(k)
         h(:, i, j) = h(:, i, j) - total*dj(:, i)*dj(:, j)
      end do
      h(:, 1, 2) = h(:, 1, 2) + 2*total
      h(:, 3, 3) = h(:, 3, 3) - total
   end subroutine paper_geometric
end module finshell_core_geometric
