!> Gradient and Hessian of the core element from resultants and strain derivatives; resultants predicted for the next iteration.
module finshell_core_derivatives
   use finshell_kinds, only: wp, lanes
   use finshell_bending, only: bending_t
   use finshell_core_strain, only: n_core, row, column, pack, total_drilling_matrix, jacobian_gradient
   use finshell_drilling, only: drilling_t, add_drilling_hessian
   use finshell_filter, only: filter_t
   use finshell_reference, only: reference_t
   use finshell_section, only: resultants_t, points_per_block
   implicit none
   private
   public :: stress_t, core_gradient, strain_variation, predict, core_material_hessian, stabilised_geometric, paper_geometric, &
      von_karman_geometric, add_side_terms

   !> Resultants at the points, kept by mixed-integration-point Newton from one iteration to the next.
   type :: stress_t
      real(wp) :: n(points_per_block, 3), m(points_per_block, 3)
   end type stress_t

contains

   !> Work of the resultants on the first derivatives of the strains; the resultants are first weighted with the area.
   pure subroutine core_gradient(groups, weight, r, bend, dm, l, dl, gradient)
      integer, intent(in) :: groups
      real(wp), intent(in) :: weight(lanes)
      type(resultants_t), intent(in) :: r
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: dm(lanes, 3, n_core, 3), l(lanes), dl(lanes, 3)
      real(wp), intent(out) :: gradient(lanes, n_core)
      real(wp) :: n(lanes, 3), moment(lanes, 3), work(lanes)
      integer :: g, i, k, v

      gradient = 0
      do g = 1, groups
         call membrane_force(groups, g, weight, r, n)
         do i = 1, n_core
            gradient(:, i) = gradient(:, i) + n(:, 1)*dm(:, 1, i, g) + n(:, 2)*dm(:, 2, i, g) + n(:, 3)*dm(:, 3, i, g)
         end do
      end do
      do g = 1, 3
         k = lanes*(g - 1)
         do v = 1, 3
            moment(:, v) = -weight*r%m(k + 1:k + lanes, v)
         end do
         work = moment(:, 1)*bend%curvature(:, 1, g) + moment(:, 2)*bend%curvature(:, 2, g) &
            + moment(:, 3)*bend%curvature(:, 3, g)
         do i = 1, 3
            gradient(:, i) = gradient(:, i) + work*dl(:, i) + l*(moment(:, 1)*bend%curvature_e(:, 1, i, g) &
                                                                 + moment(:, 2)*bend%curvature_e(:, 2, i, g) &
                                                                 + moment(:, 3)*bend%curvature_e(:, 3, i, g))
         end do
         do i = 1, 6
            gradient(:, 6 + i) = gradient(:, 6 + i) + l*(moment(:, 1)*bend%curvature_g(:, 1, i, g) &
                                                         + moment(:, 2)*bend%curvature_g(:, 2, i, g) &
                                                         + moment(:, 3)*bend%curvature_g(:, 3, i, g))
         end do
      end do
   end subroutine core_gradient

   !> Changes of membrane strain and curvature at the points for a variation of the core variables.
   pure subroutine strain_variation(groups, bend, dm, l, dl, variation, membrane, curvature)
      integer, intent(in) :: groups
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: dm(lanes, 3, n_core, 3), l(lanes), dl(lanes, 3), variation(lanes, n_core)
      real(wp), intent(out) :: membrane(points_per_block, 3), curvature(points_per_block, 3)
      real(wp) :: de(lanes, 3), dk(lanes, 3), stretch(lanes)
      integer :: g, i, k, v
      stretch = dl(:, 1)*variation(:, 1) + dl(:, 2)*variation(:, 2) + dl(:, 3)*variation(:, 3)
      do g = 1, 3
         if (g <= groups) then
            de = 0
            do i = 1, n_core
               do v = 1, 3
                  de(:, v) = de(:, v) + dm(:, v, i, g)*variation(:, i)
               end do
            end do
         end if
         do v = 1, 3
            dk(:, v) = -stretch*bend%curvature(:, v, g)
            do i = 1, 3
               dk(:, v) = dk(:, v) - l*bend%curvature_e(:, v, i, g)*variation(:, i)
            end do
            do i = 1, 6
               dk(:, v) = dk(:, v) - l*bend%curvature_g(:, v, i, g)*variation(:, 6 + i)
            end do
         end do
         k = lanes*(g - 1)
         membrane(k + 1:k + lanes, :) = de
         curvature(k + 1:k + lanes, :) = dk
      end do
   end subroutine strain_variation

   !> Resultants, linearised: those of this state plus tangent times changes of the strains.
   pure subroutine predict(r, membrane, curvature, predicted)
      type(resultants_t), intent(in) :: r
      real(wp), intent(in) :: membrane(points_per_block, 3), curvature(points_per_block, 3)
      type(stress_t), intent(out) :: predicted
      integer :: i, v
      do v = 1, 3
         predicted%n(:, v) = r%n(:, v)
         predicted%m(:, v) = r%m(:, v)
         do i = 1, 3
            predicted%n(:, v) = predicted%n(:, v) + r%a(:, pack(v, i))*membrane(:, i) + r%b(:, pack(v, i))*curvature(:, i)
            predicted%m(:, v) = predicted%m(:, v) + r%b(:, pack(v, i))*membrane(:, i) + r%d(:, pack(v, i))*curvature(:, i)
         end do
      end do
   end subroutine predict

   !> Membrane force of group g, times the area it stands for.
   pure subroutine membrane_force(groups, g, weight, r, n)
      integer, intent(in) :: groups, g
      real(wp), intent(in) :: weight(lanes)
      type(resultants_t), intent(in) :: r
      real(wp), intent(out) :: n(lanes, 3)
      integer :: v
      do v = 1, 3
         if (groups == 1) then
            n(:, v) = weight*(r%n(1:lanes, v) + r%n(lanes + 1:2*lanes, v) + r%n(2*lanes + 1:3*lanes, v))
         else
            n(:, v) = weight*r%n(lanes*(g - 1) + 1:lanes*g, v)
         end if
      end do
   end subroutine membrane_force

   !> First derivatives times section tangent times first derivatives, and the second derivatives of the curvature.
   pure subroutine core_material_hessian(groups, weight, r, bend, dm, l, dl, ddl, h, side)
      integer, intent(in) :: groups
      real(wp), intent(in) :: weight(lanes)
      type(resultants_t), intent(in) :: r
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: dm(lanes, 3, n_core, 3), l(lanes), dl(lanes, 3), ddl(lanes, 6)
      real(wp), intent(out) :: h(lanes, n_core, n_core)
      real(wp), intent(out) :: side(lanes, 3) !< work conjugate to beta_k p_k of each side
      !> Core variable of each of the nine that bend.
      integer, parameter :: variable(9) = [1, 2, 3, 7, 8, 9, 10, 11, 12]
      real(wp) :: a(lanes, 6), b(lanes, 6), d(lanes, 6), dk(lanes, 3, 9), t(lanes, 3, n_core), y(lanes, 3, 9), s(lanes, 3)
      real(wp) :: moment(lanes, 3), sum_side(lanes, 3), sum_work(lanes)
      real(wp) :: sum_e(lanes, 3), sum_g(lanes, 6)
      integer :: g, i, j, k, m, v

      h = 0
      y = 0
      a = 0
      sum_side = 0
      sum_work = 0
      sum_e = 0
      sum_g = 0
      do g = 1, 3
         k = lanes*(g - 1)
         do v = 1, 6
            a(:, v) = a(:, v) + weight*r%a(k + 1:k + lanes, v)
            b(:, v) = weight*r%b(k + 1:k + lanes, v)
            d(:, v) = weight*r%d(k + 1:k + lanes, v)
         end do
         do i = 1, 3
            do v = 1, 3
               dk(:, v, i) = -dl(:, i)*bend%curvature(:, v, g) - l*bend%curvature_e(:, v, i, g)
            end do
         end do
         do i = 1, 6
            do v = 1, 3
               dk(:, v, 3 + i) = -l*bend%curvature_g(:, v, i, g)
            end do
         end do
         do j = 1, 9
            s(:, 1) = d(:, 1)*dk(:, 1, j) + d(:, 4)*dk(:, 2, j) + d(:, 5)*dk(:, 3, j)
            s(:, 2) = d(:, 4)*dk(:, 1, j) + d(:, 2)*dk(:, 2, j) + d(:, 6)*dk(:, 3, j)
            s(:, 3) = d(:, 5)*dk(:, 1, j) + d(:, 6)*dk(:, 2, j) + d(:, 3)*dk(:, 3, j)
            do i = 1, j
               h(:, variable(i), variable(j)) = h(:, variable(i), variable(j)) &
                  + dk(:, 1, i)*s(:, 1) + dk(:, 2, i)*s(:, 2) + dk(:, 3, i)*s(:, 3)
            end do
            y(:, 1, j) = y(:, 1, j) + b(:, 1)*dk(:, 1, j) + b(:, 4)*dk(:, 2, j) + b(:, 5)*dk(:, 3, j)
            y(:, 2, j) = y(:, 2, j) + b(:, 4)*dk(:, 1, j) + b(:, 2)*dk(:, 2, j) + b(:, 6)*dk(:, 3, j)
            y(:, 3, j) = y(:, 3, j) + b(:, 5)*dk(:, 1, j) + b(:, 6)*dk(:, 2, j) + b(:, 3)*dk(:, 3, j)
         end do

         ! sums of moment times curvature derivatives; minus sign: the strain is -lambda_Z Z sym grad G
         do v = 1, 3
            moment(:, v) = -weight*r%m(k + 1:k + lanes, v)
         end do
         sum_work = sum_work + moment(:, 1)*bend%curvature(:, 1, g) + moment(:, 2)*bend%curvature(:, 2, g) &
            + moment(:, 3)*bend%curvature(:, 3, g)
         do i = 1, 3
            sum_side(:, i) = sum_side(:, i) + moment(:, 1)*bend%curvature_side(:, 1, i, g) &
               + moment(:, 2)*bend%curvature_side(:, 2, i, g) + moment(:, 3)*bend%curvature_side(:, 3, i, g)
         end do
         do i = 1, 6
            sum_g(:, i) = sum_g(:, i) + moment(:, 1)*bend%curvature_g(:, 1, i, g) &
               + moment(:, 2)*bend%curvature_g(:, 2, i, g) + moment(:, 3)*bend%curvature_g(:, 3, i, g)
         end do

         if (g < 3 .and. groups == 1) cycle
         m = min(g, groups)
         do j = 1, n_core
            t(:, 1, j) = a(:, 1)*dm(:, 1, j, m) + a(:, 4)*dm(:, 2, j, m) + a(:, 5)*dm(:, 3, j, m)
            t(:, 2, j) = a(:, 4)*dm(:, 1, j, m) + a(:, 2)*dm(:, 2, j, m) + a(:, 6)*dm(:, 3, j, m)
            t(:, 3, j) = a(:, 5)*dm(:, 1, j, m) + a(:, 6)*dm(:, 2, j, m) + a(:, 3)*dm(:, 3, j, m)
         end do
         ! t gets the coupling with the curvature; its transposed half below
         do j = 1, 9
            t(:, :, variable(j)) = t(:, :, variable(j)) + y(:, :, j)
         end do
         do j = 1, n_core
            do i = 1, j
               h(:, i, j) = h(:, i, j) + dm(:, 1, i, m)*t(:, 1, j) + dm(:, 2, i, m)*t(:, 2, j) + dm(:, 3, i, m)*t(:, 3, j)
            end do
         end do
         do i = 1, 9
            do j = variable(i), n_core
               h(:, variable(i), j) = h(:, variable(i), j) &
                  + y(:, 1, i)*dm(:, 1, j, m) + y(:, 2, i)*dm(:, 2, j, m) + y(:, 3, i)*dm(:, 3, j, m)
            end do
         end do
         a = 0
         y = 0
      end do

      ! second derivatives of lambda_Z sym grad G, contracted with the moments
      do i = 1, 3
         sum_e(:, i) = sum_side(:, 1)*bend%p(:, 1)*bend%dbeta(:, i, 1) + sum_side(:, 2)*bend%p(:, 2)*bend%dbeta(:, i, 2) &
            + sum_side(:, 3)*bend%p(:, 3)*bend%dbeta(:, i, 3)
      end do
      do k = 1, 6
         i = row(k)
         j = column(k)
         h(:, i, j) = h(:, i, j) + ddl(:, k)*sum_work + dl(:, i)*sum_e(:, j) + dl(:, j)*sum_e(:, i)
      end do
      do v = 1, 3
         side(:, v) = l*sum_side(:, v)
      end do
      do j = 1, 6
         do i = 1, 3
            h(:, i, 6 + j) = h(:, i, 6 + j) + dl(:, i)*sum_g(:, j)
         end do
      end do
   end subroutine core_material_hessian

   !> Second derivatives of beta_k p_k, contracted with its work conjugate: p_k is linear in the slopes of the side's two nodes.
   pure subroutine add_side_terms(ref, bend, side, h)
      type(reference_t), intent(in) :: ref
      type(bending_t), intent(in) :: bend
      real(wp), intent(in) :: side(lanes, 3)
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
               h(:, i, 5 + 2*node) = h(:, i, 5 + 2*node) + side(:, k)*bend%dbeta(:, i, k)*ref%side(:, 1, k)
               h(:, i, 6 + 2*node) = h(:, i, 6 + 2*node) + side(:, k)*bend%dbeta(:, i, k)*ref%side(:, 2, k)
            end do
         end do
      end do
   end subroutine add_side_terms

   !> Second derivatives of the drilling strain of (S) at fixed membrane force.
   pure subroutine stabilised_geometric(ref, filter, drill, weight, r, h)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      type(drilling_t), intent(in) :: drill
      real(wp), intent(in) :: weight(lanes)
      type(resultants_t), intent(in) :: r
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: n(lanes, 3), ee(lanes, 6), ea(lanes, 3, 2), aa(lanes, 3)
      integer :: i, k
      call membrane_force(1, 1, weight, r, n)
      call add_drilling_hessian(ref, filter%c, filter%jacobian, drill, n, ee, ea, aa)
      do k = 1, 6
         h(:, row(k), column(k)) = h(:, row(k), column(k)) + ee(:, k)
      end do
      do i = 1, 3
         h(:, i, 4) = h(:, i, 4) + ea(:, i, 1)
         h(:, i, 5) = h(:, i, 5) + ea(:, i, 2)
         h(:, i, 6) = h(:, i, 6) - ea(:, i, 1) - ea(:, i, 2)
      end do
      h(:, 4, 4) = h(:, 4, 4) + aa(:, 1)
      h(:, 5, 5) = h(:, 5, 5) + aa(:, 2)
      h(:, 4, 5) = h(:, 4, 5) + aa(:, 3)
      h(:, 4, 6) = h(:, 4, 6) - aa(:, 1) - aa(:, 3)
      h(:, 5, 6) = h(:, 5, 6) - aa(:, 2) - aa(:, 3)
      h(:, 6, 6) = h(:, 6, 6) + aa(:, 1) + aa(:, 2) + 2*aa(:, 3)
   end subroutine stabilised_geometric

   !> Second derivatives of J B tau, formulation (P).
   pure subroutine paper_geometric(ref, filter, tau, higher, weight, r, h)
      type(reference_t), intent(in) :: ref
      type(filter_t), intent(in) :: filter
      real(wp), intent(in) :: tau(lanes, 3), higher(lanes, 3, 3, 3), weight(lanes)
      type(resultants_t), intent(in) :: r
      real(wp), intent(inout) :: h(lanes, n_core, n_core)
      real(wp) :: b(lanes, 3, 3), dj(lanes, 3), n(lanes, 3), w(lanes, 3), total(lanes)
      integer :: g, i, j, k
      call jacobian_gradient(filter, dj)
      w = 0
      do g = 1, 3
         call membrane_force(3, g, weight, r, n)
         call total_drilling_matrix(ref, higher(:, :, :, g), b)
         do i = 1, 3
            w(:, i) = w(:, i) + n(:, 1)*b(:, 1, i) + n(:, 2)*b(:, 2, i) + n(:, 3)*b(:, 3, i)
         end do
      end do
      do j = 1, 3
         do i = 1, 3
            h(:, i, 3 + j) = h(:, i, 3 + j) + dj(:, i)*w(:, j)
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

   !> Second derivatives of 1/2 G (x) G at fixed membrane force.
   pure subroutine von_karman_geometric(groups, weight, r, bend, h, side)
      integer, intent(in) :: groups
      real(wp), intent(in) :: weight(lanes)
      type(resultants_t), intent(in) :: r
      type(bending_t), intent(in) :: bend
      real(wp), intent(inout) :: h(lanes, n_core, n_core), side(lanes, 3)
      integer, parameter :: variable(9) = [1, 2, 3, 7, 8, 9, 10, 11, 12]
      real(wp) :: n(lanes, 3), ds(lanes, 2, 9), t(lanes, 2)
      integer :: g, i, j, k
      do g = 1, 3
         if (groups == 3 .or. g == 1) then
            call membrane_force(groups, g, weight, r, n)
            if (groups == 1) n = n/3
         end if
         ds(:, :, 1:3) = bend%slope_e(:, :, g, :)
         ds(:, :, 4:9) = bend%slope_g(:, :, g, :)
         do j = 1, 9
            t(:, 1) = n(:, 1)*ds(:, 1, j) + n(:, 3)*ds(:, 2, j)
            t(:, 2) = n(:, 3)*ds(:, 1, j) + n(:, 2)*ds(:, 2, j)
            do i = 1, j
               h(:, variable(i), variable(j)) = h(:, variable(i), variable(j)) + ds(:, 1, i)*t(:, 1) + ds(:, 2, i)*t(:, 2)
            end do
         end do
         t(:, 1) = n(:, 1)*bend%slope(:, 1, g) + n(:, 3)*bend%slope(:, 2, g)
         t(:, 2) = n(:, 3)*bend%slope(:, 1, g) + n(:, 2)*bend%slope(:, 2, g)
         do k = 1, 3
            side(:, k) = side(:, k) + t(:, 1)*bend%slope_side(:, 1, k, g) + t(:, 2)*bend%slope_side(:, 2, k, g)
         end do
      end do
   end subroutine von_karman_geometric
end module finshell_core_derivatives
