!> Membrane strain of the drilling rotations: linear part, and the quadratic part that keeps large stretch stable.
!>
!> Formulation (S) of the theory: D + (1 - eta) Qbar + eta <Q>, with D = J d, d = B_b tau, Qbar = 1/2 D C^-1 D = 1/2 d adj(C) d,
!> <Q> the mean quadratic Green strain of the side bubbles, eta a step of the harmonic mean of the
!> squared stretches, 1 at C = I (new_drilling). Both quadratic strains are linear in C and
!> quadratic in the differences a = (tau_1 - tau_3, tau_2 - tau_3), and are kept as such: Q_v = 1/2 sum z(v, ab, m) a_a a_b C_m with
!> ab in (11, 22, 12) and C_m in (C11, C22, C12). On a curved reference (finshell_kink) the bows of the three sides are independent
!> and there is a third difference, with the pairs 13, 23, 33.
module finshell_drilling
   use finshell_kinds, only: wp, lanes, rows_3
   use finshell_kink, only: kink_t
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_reference, only: reference_t, alpha_b
   use finshell_voigt, only: row, column
   implicit none
   private
   public :: drilling_t, new_drilling, add_drilling_hessian

   type :: quadratic_t
      real(wp) :: z(lanes, rows_3, 6, 3) !< (Voigt, ab, m)
      real(wp) :: value(lanes, rows_3)
      real(wp) :: da(lanes, rows_3, 3) !< with respect to the differences
      real(wp) :: de(lanes, rows_3, 3) !< with respect to the midsurface strain
   end type quadratic_t

   type :: drilling_t
      integer :: differences !< 2, on a curved reference 3
      real(wp) :: a(lanes, 3) !< drilling differences
      real(wp) :: dj(lanes, 3) !< dJ/d(midsurface strain)
      real(wp) :: eta(lanes), deta(lanes), ddeta(lanes) !< derivatives with respect to s
      real(wp) :: ds(lanes, 3), dds(lanes, 6) !< of s with respect to the midsurface strain
      real(wp) :: linear(lanes, rows_3) !< d
      type(quadratic_t) :: qbar, q
      real(wp) :: strain(lanes, rows_3)
      real(wp) :: strain_a(lanes, rows_3, 3), strain_e(lanes, rows_3, 3)
   end type drilling_t

contains

   !> Drilling strain of a block of elements with its first derivatives.
   !>
   !> eta is a smooth step of s = 2 J^2/tr C - 1 between 0 and 1: 2 J^2/tr C is the harmonic mean of the squared principal
   !> stretches (over `area`, from the stress-free state), so <Q>, which a compressive stress would turn against the drilling
   !> stiffness, acts only where both directions
   !> are stretched.
   pure subroutine new_drilling(level, ref, c, jacobian, tau, kink, area, d)
      integer, intent(in) :: level
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: c(lanes, 3), jacobian(lanes)
      real(wp), intent(in) :: tau(lanes, 3) !< drilling angles
      type(kink_t), intent(in) :: kink
      real(wp), intent(in) :: area(lanes) !< of the stress-free element over that of the reference
      type(drilling_t), intent(inout) :: d
      real(wp), dimension(lanes) :: free, inverse, mean, s
      real(wp) :: basic(lanes, rows_3, 3)
      integer :: i, v

      d%a(:, 1) = tau(:, 1) - tau(:, 3)
      d%a(:, 2) = tau(:, 2) - tau(:, 3)
      d%differences = 2
      if (kink%any) then
         d%differences = 3
         d%a(:, 3) = 0
         d%a = d%a + kink%value
      end if
      inverse = 1/(c(:, 1) + c(:, 2))
      free = 1/area
      mean = 2*jacobian**2*inverse*free
      s = min(max(mean - 1, 0.0_wp), 1.0_wp)
      d%eta = s**3*(10 - 15*s + 6*s**2)
      if (level >= level_force) then
         d%deta = 30*(s*(1 - s))**2
         d%ds(:, 1) = (4*c(:, 2)*free - 2*mean)*inverse
         d%ds(:, 2) = (4*c(:, 1)*free - 2*mean)*inverse
         d%ds(:, 3) = -4*c(:, 3)*free*inverse
      end if
      if (level >= level_tangent) then
         d%ddeta = 60*s*(1 - s)*(1 - 2*s)
         d%dds(:, 1) = -4*d%ds(:, 1)*inverse
         d%dds(:, 2) = -4*d%ds(:, 2)*inverse
         d%dds(:, 3) = -4*free*inverse
         d%dds(:, 4) = (8*free - 2*d%ds(:, 1) - 2*d%ds(:, 2))*inverse
         d%dds(:, 5) = -2*d%ds(:, 3)*inverse
         d%dds(:, 6) = d%dds(:, 5)
      end if
      inverse = 1/jacobian
      d%dj(:, 1) = c(:, 2)*inverse
      d%dj(:, 2) = c(:, 1)*inverse
      d%dj(:, 3) = -c(:, 3)*inverse
      call mean_gradient_part(1, 3, ref%basic, d%qbar)
      if (kink%any) call mean_gradient_part(4, 6, ref%basic, d%qbar)
      call bubble_part(kink%any, ref, d%q)
      call evaluate(level, kink%any, c, d%a, d%qbar)
      call evaluate(level, kink%any, c, d%a, d%q)
      basic(:, rows_3, :) = 0
      basic(:, 1:3, :) = ref%basic
      do v = 1, rows_3
         d%linear(:, v) = basic(:, v, 1)*d%a(:, 1) + basic(:, v, 2)*d%a(:, 2)
      end do
      if (kink%any) then
         do v = 1, rows_3
            d%linear(:, v) = d%linear(:, v) + basic(:, v, 3)*d%a(:, 3)
         end do
      end if
      do v = 1, rows_3
         d%strain(:, v) = jacobian*d%linear(:, v) + (1 - d%eta)*d%qbar%value(:, v) + d%eta*d%q%value(:, v)
      end do
      if (level < level_force) return
      do i = 1, merge(3, 2, kink%any)
         do v = 1, rows_3
            d%strain_a(:, v, i) = jacobian*basic(:, v, i) + (1 - d%eta)*d%qbar%da(:, v, i) + d%eta*d%q%da(:, v, i)
         end do
      end do
      do i = 1, 3
         do v = 1, rows_3
            d%strain_e(:, v, i) = d%dj(:, i)*d%linear(:, v) + d%deta*d%ds(:, i)*(d%q%value(:, v) - d%qbar%value(:, v)) &
               + (1 - d%eta)*d%qbar%de(:, v, i) + d%eta*d%q%de(:, v, i)
         end do
      end do
   end subroutine new_drilling

   !> z of Qbar = 1/2 d adj(C) d, from the basic strain of each difference, B_a = [p r; r q].
   pure subroutine mean_gradient_part(from, to, basic, quadratic)
      integer, intent(in) :: from, to !< pairs
      real(wp), intent(in) :: basic(lanes, 3, 3)
      type(quadratic_t), intent(inout) :: quadratic
      integer, parameter :: first(6) = [1, 2, 1, 1, 2, 3], second(6) = [1, 2, 2, 3, 3, 3]
      real(wp), dimension(lanes) :: pa, qa, ra, pb, qb, rb
      integer :: ab
      do ab = from, to
         pa = basic(:, 1, first(ab))
         qa = basic(:, 2, first(ab))
         ra = 0.5_wp*basic(:, 3, first(ab))
         pb = basic(:, 1, second(ab))
         qb = basic(:, 2, second(ab))
         rb = 0.5_wp*basic(:, 3, second(ab))
         if (rows_3 > 3) quadratic%z(:, rows_3, ab, :) = 0
         quadratic%z(:, 1, ab, 1) = ra*rb
         quadratic%z(:, 1, ab, 2) = pa*pb
         quadratic%z(:, 1, ab, 3) = -(pa*rb + ra*pb)
         quadratic%z(:, 2, ab, 1) = qa*qb
         quadratic%z(:, 2, ab, 2) = ra*rb
         quadratic%z(:, 2, ab, 3) = -(ra*qb + qa*rb)
         quadratic%z(:, 3, ab, 1) = ra*qb + rb*qa
         quadratic%z(:, 3, ab, 2) = pa*rb + pb*ra
         quadratic%z(:, 3, ab, 3) = -(pa*qb + pb*qa + 2*ra*rb)
      end do
   end subroutine mean_gradient_part

   !> z of <Q>: bubbles (alpha_b/8)(tau_j - tau_i) L_k 4 zeta_i zeta_j on the sides.
   pure subroutine bubble_part(curved, ref, quadratic)
      logical, intent(in) :: curved
      type(reference_t), intent(in) :: ref
      type(quadratic_t), intent(inout) :: quadratic
      real(wp), parameter :: factor = (alpha_b/8)**2
      real(wp) :: mean(lanes, rows_3, 6), metric(lanes, 3, 6)
      integer :: kl, m, v
      mean(:, rows_3, :) = 0
      mean(:, 1:3, :) = factor*ref%bubble_mean
      do kl = 1, 6
         associate (lk => ref%side(:, :, row(kl)), ll => ref%side(:, :, column(kl)))
            metric(:, 1, kl) = lk(:, 1)*ll(:, 1)
            metric(:, 2, kl) = lk(:, 2)*ll(:, 2)
            metric(:, 3, kl) = lk(:, 1)*ll(:, 2) + lk(:, 2)*ll(:, 1)
         end associate
      end do
      if (any(ref%bulge < 1)) call remove_straight(ref%bulge, mean)
      ! side differences from a: (a2 - a1 + a3, -a2, a1)
      do m = 1, 3
         do v = 1, rows_3
            quadratic%z(:, v, 1, m) = mean(:, v, 1)*metric(:, m, 1) + mean(:, v, 3)*metric(:, m, 3) &
               - 2*(mean(:, v, 5)*metric(:, m, 5))
            quadratic%z(:, v, 2, m) = mean(:, v, 1)*metric(:, m, 1) + mean(:, v, 2)*metric(:, m, 2) &
               - 2*(mean(:, v, 4)*metric(:, m, 4))
            quadratic%z(:, v, 3, m) = mean(:, v, 4)*metric(:, m, 4) + mean(:, v, 5)*metric(:, m, 5) &
               - mean(:, v, 1)*metric(:, m, 1) - mean(:, v, 6)*metric(:, m, 6)
         end do
      end do
      if (.not. curved) return
      do m = 1, 3
         do v = 1, rows_3
            quadratic%z(:, v, 4, m) = mean(:, v, 5)*metric(:, m, 5) - mean(:, v, 1)*metric(:, m, 1)
            quadratic%z(:, v, 5, m) = mean(:, v, 1)*metric(:, m, 1) - mean(:, v, 4)*metric(:, m, 4)
            quadratic%z(:, v, 6, m) = mean(:, v, 1)*metric(:, m, 1)
         end do
      end do
   end subroutine bubble_part

   !> Straight sides have no bubble.
   pure subroutine remove_straight(bulge, mean)
      real(wp), intent(in) :: bulge(lanes, 3)
      real(wp), intent(inout) :: mean(lanes, rows_3, 6)
      integer :: kl, v
      do kl = 1, 6
         do v = 1, 3
            mean(:, v, kl) = bulge(:, row(kl))*bulge(:, column(kl))*mean(:, v, kl)
         end do
      end do
   end subroutine remove_straight

   pure subroutine evaluate(level, curved, c, a, quadratic)
      integer, intent(in) :: level
      logical, intent(in) :: curved
      real(wp), intent(in) :: c(lanes, 3), a(lanes, 3)
      type(quadratic_t), intent(inout) :: quadratic
      real(wp) :: half(lanes, 6), w(lanes, rows_3, 6)
      integer :: ab, m, v
      half(:, 1) = 0.5_wp*a(:, 1)**2
      half(:, 2) = 0.5_wp*a(:, 2)**2
      half(:, 3) = a(:, 1)*a(:, 2)
      associate (z => quadratic%z)
         do ab = 1, 3
            do v = 1, rows_3
               w(:, v, ab) = z(:, v, ab, 1)*c(:, 1) + z(:, v, ab, 2)*c(:, 2) + z(:, v, ab, 3)*c(:, 3)
            end do
         end do
         do v = 1, rows_3
            quadratic%da(:, v, 1) = w(:, v, 1)*a(:, 1) + w(:, v, 3)*a(:, 2)
            quadratic%da(:, v, 2) = w(:, v, 3)*a(:, 1) + w(:, v, 2)*a(:, 2)
            quadratic%value(:, v) = 0.5_wp*(quadratic%da(:, v, 1)*a(:, 1) + quadratic%da(:, v, 2)*a(:, 2))
         end do
         if (level >= level_force) then
            do v = 1, rows_3
               quadratic%de(:, v, 1) = 2*(z(:, v, 1, 1)*half(:, 1) + z(:, v, 2, 1)*half(:, 2) + z(:, v, 3, 1)*half(:, 3))
               quadratic%de(:, v, 2) = 2*(z(:, v, 1, 2)*half(:, 1) + z(:, v, 2, 2)*half(:, 2) + z(:, v, 3, 2)*half(:, 3))
               quadratic%de(:, v, 3) = z(:, v, 1, 3)*half(:, 1) + z(:, v, 2, 3)*half(:, 2) + z(:, v, 3, 3)*half(:, 3)
            end do
         end if
      end associate
      if (.not. curved) return
      ! the third difference
      half(:, 4) = a(:, 1)*a(:, 3)
      half(:, 5) = a(:, 2)*a(:, 3)
      half(:, 6) = 0.5_wp*a(:, 3)**2
      do v = 1, rows_3
         do ab = 4, 6
            w(:, v, ab) = quadratic%z(:, v, ab, 1)*c(:, 1) + quadratic%z(:, v, ab, 2)*c(:, 2) + quadratic%z(:, v, ab, 3)*c(:, 3)
         end do
         quadratic%value(:, v) = quadratic%value(:, v) + (w(:, v, 4)*half(:, 4) + w(:, v, 5)*half(:, 5) + w(:, v, 6)*half(:, 6))
         quadratic%da(:, v, 1) = quadratic%da(:, v, 1) + w(:, v, 4)*a(:, 3)
         quadratic%da(:, v, 2) = quadratic%da(:, v, 2) + w(:, v, 5)*a(:, 3)
         quadratic%da(:, v, 3) = w(:, v, 4)*a(:, 1) + w(:, v, 5)*a(:, 2) + w(:, v, 6)*a(:, 3)
         if (level < level_force) cycle
         associate (z => quadratic%z(:, v, :, :))
            do m = 1, 3
               quadratic%de(:, v, m) = quadratic%de(:, v, m) &
                  + merge(1, 2, m == 3)*(z(:, 4, m)*half(:, 4) + z(:, 5, m)*half(:, 5) + z(:, 6, m)*half(:, 6))
            end do
         end associate
      end do
   end subroutine evaluate

   !> Second derivatives of n . strain for a fixed membrane force n, added to the core Hessian.
   pure subroutine add_drilling_hessian(ref, c, jacobian, d, n, ee, ea, aa)
      type(reference_t), intent(in) :: ref
      real(wp), intent(in) :: c(lanes, 3), jacobian(lanes)
      type(drilling_t), intent(in) :: d
      real(wp), intent(in) :: n(lanes, 3)
      real(wp), intent(out) :: ee(lanes, 6) !< strain-strain, packed symmetric
      real(wp), intent(out) :: ea(lanes, 3, 3) !< strain-difference
      real(wp), intent(out) :: aa(lanes, 6) !< difference-difference, by pairs
      integer, parameter :: pair(3, 3) = reshape([1, 3, 4, 3, 2, 5, 4, 5, 6], [3, 3])
      real(wp) :: zn(lanes, 6, 3), de(lanes, 3), da(lanes), nb(lanes), za(lanes)
      real(wp), dimension(lanes) :: difference, inverse, nd
      integer :: ab, i, j, k, m

      ! z is blended once, then contracted with n
      do m = 1, 3
         do ab = 1, merge(6, 3, d%differences == 3)
            zn(:, ab, m) = (1 - d%eta)*(n(:, 1)*d%qbar%z(:, 1, ab, m) + n(:, 2)*d%qbar%z(:, 2, ab, m) &
                                        + n(:, 3)*d%qbar%z(:, 3, ab, m)) &
               + d%eta*(n(:, 1)*d%q%z(:, 1, ab, m) + n(:, 2)*d%q%z(:, 2, ab, m) + n(:, 3)*d%q%z(:, 3, ab, m))
         end do
      end do
      do ab = 1, merge(6, 3, d%differences == 3)
         aa(:, ab) = zn(:, ab, 1)*c(:, 1) + zn(:, ab, 2)*c(:, 2) + zn(:, ab, 3)*c(:, 3)
      end do
      difference = n(:, 1)*(d%q%value(:, 1) - d%qbar%value(:, 1)) + n(:, 2)*(d%q%value(:, 2) - d%qbar%value(:, 2)) &
         + n(:, 3)*(d%q%value(:, 3) - d%qbar%value(:, 3))
      nd = n(:, 1)*d%linear(:, 1) + n(:, 2)*d%linear(:, 2) + n(:, 3)*d%linear(:, 3)
      do i = 1, 3
         de(:, i) = d%deta*(n(:, 1)*(d%q%de(:, 1, i) - d%qbar%de(:, 1, i)) + n(:, 2)*(d%q%de(:, 2, i) - d%qbar%de(:, 2, i)) &
                            + n(:, 3)*(d%q%de(:, 3, i) - d%qbar%de(:, 3, i)))
      end do
      do j = 1, d%differences
         nb = n(:, 1)*ref%basic(:, 1, j) + n(:, 2)*ref%basic(:, 2, j) + n(:, 3)*ref%basic(:, 3, j)
         da = d%deta*(n(:, 1)*(d%q%da(:, 1, j) - d%qbar%da(:, 1, j)) + n(:, 2)*(d%q%da(:, 2, j) - d%qbar%da(:, 2, j)) &
                      + n(:, 3)*(d%q%da(:, 3, j) - d%qbar%da(:, 3, j)))
         do i = 1, 3
            za = zn(:, pair(1, j), i)*d%a(:, 1) + zn(:, pair(2, j), i)*d%a(:, 2)
            if (d%differences > 2) za = za + zn(:, pair(3, j), i)*d%a(:, 3)
            ea(:, i, j) = merge(1, 2, i == 3)*za + d%dj(:, i)*nb + d%ds(:, i)*da
         end do
      end do
      ! J J,ab = (J^2),ab/2 - J,a J,b with (J^2),12 = 4 and (J^2),33 = -2
      inverse = 1/jacobian
      do k = 1, 6
         i = row(k)
         j = column(k)
         ee(:, k) = -nd*inverse*d%dj(:, i)*d%dj(:, j) + d%ds(:, i)*de(:, j) + d%ds(:, j)*de(:, i) &
            + difference*(d%ddeta*d%ds(:, i)*d%ds(:, j) + d%deta*d%dds(:, k))
      end do
      ee(:, 3) = ee(:, 3) - nd*inverse
      ee(:, 4) = ee(:, 4) + 2*nd*inverse
   end subroutine add_drilling_hessian
end module finshell_drilling
