!> Ogden: W = sum_p mu_p/alpha_p (l1^alpha_p + l2^alpha_p + l3^alpha_p - 3), incompressible, up to six terms.
!>
!> In principal axes, with logarithmic stretches y_a from the strain: S_a = (t(y_a) - t(y_3))/C_a, t(y) = sum mu e^(alpha y).
!> Every difference is formed from e^z - 1 and ln(1 + z), so that nothing cancels for small strains; the shear term
!> (S1 - S2)/(E1 - E2) is a quotient of such differences that has no singularity at equal stretches. Large exponents make terms of
!> very different size: a difference of exponentials is the larger one times a function of order 1, and S_a is turned from the
!> principal axes without adding S_1 and S_2.
module finshell_ogden
   use finshell_elementary, only: exp_remainder, log_remainder
   use finshell_incompressible, only: incompressible_t, metric_limit, shape_limit
   use finshell_kinds, only: wp, i4, strip
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_material, only: material_t
   use finshell_parameter, only: parameter_t, optional_parameter, required_parameter
   use finshell_status, only: status_material_limit
   implicit none
   private
   public :: ogden_t, ogden_parameters, new_ogden

   integer, parameter :: most_terms = 6
   !> Beyond this exponent |alpha y| the law is left; e^200 = 7e86.
   real(wp), parameter :: largest_exponent = 200.0_wp

   type, extends(incompressible_t) :: ogden_t
      integer :: terms = 0
      real(wp) :: mu(most_terms) = 0.0_wp, alpha(most_terms) = 1.0_wp
   contains
      procedure :: plane_stress
      procedure :: reference_tangent
   end type ogden_t

contains

   pure function ogden_parameters() result(parameters)
      type(parameter_t), allocatable :: parameters(:)
      parameters = [required_parameter('mu1', 'coefficient of term 1 (stress)', 630.0_wp), &
                    required_parameter('alpha1', 'exponent of term 1', 1.3_wp), &
                    optional_parameter('mu2', 0.0_wp, 'coefficient of term 2 (stress)', 1.2_wp), &
                    optional_parameter('alpha2', 0.0_wp, 'exponent of term 2', 5.0_wp), &
                    optional_parameter('mu3', 0.0_wp, 'coefficient of term 3 (stress)', -10.0_wp), &
                    optional_parameter('alpha3', 0.0_wp, 'exponent of term 3', -2.0_wp), &
                    optional_parameter('mu4', 0.0_wp, 'coefficient of term 4 (stress)', 0.0_wp), &
                    optional_parameter('alpha4', 0.0_wp, 'exponent of term 4', 0.0_wp), &
                    optional_parameter('mu5', 0.0_wp, 'coefficient of term 5 (stress)', 0.0_wp), &
                    optional_parameter('alpha5', 0.0_wp, 'exponent of term 5', 0.0_wp), &
                    optional_parameter('mu6', 0.0_wp, 'coefficient of term 6 (stress)', 0.0_wp), &
                    optional_parameter('alpha6', 0.0_wp, 'exponent of term 6', 0.0_wp)]
   end function ogden_parameters

   !> The law from its parameters; `message` is allocated when they make no sense.
   subroutine new_ogden(values, law, message)
      real(wp), intent(in) :: values(:) !< in the order of `ogden_parameters`
      class(material_t), allocatable, intent(out) :: law
      character(len=:), allocatable, intent(out) :: message
      type(ogden_t) :: ogden
      logical :: present_term(most_terms)
      associate (mu => values(1::2), alpha => values(2::2))
         present_term = abs(mu) > 0.0_wp
         ogden%terms = count(present_term)
         ogden%mu(:ogden%terms) = pack(mu, present_term)
         ogden%alpha(:ogden%terms) = pack(alpha, present_term)
         if (any(present_term .neqv. abs(alpha) > 0.0_wp)) then
            message = 'mu and alpha of a term must both be given and not be zero'
         else if (.not. sum(mu*alpha) > 0.0_wp) then
            message = 'the sum of mu alpha, twice the shear modulus, must be positive'
         end if
      end associate
      law = ogden
   end subroutine new_ogden

   pure subroutine plane_stress(self, n, level, e, w, s, d, status)
      class(ogden_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6)
      integer(i4), intent(inout) :: status(n)
      ! per point: strains, principal strain difference, 1/C_a, logarithmic stretches y (the third from incompressibility)
      real(wp), dimension(strip) :: e1, e2, e3, gap, r1, r2, y1, y2, y3, dy
      real(wp), dimension(strip) :: x1, x2, x3, m1, m2, m3, w1, w2, w3, u, energy, t1, t2, k1, k2, k3, g
      real(wp), dimension(strip) :: c2, c3, a, b ! of the angle of the principal axes: cos 2, sin 2, cos^2, sin^2
      real(wp) :: alpha, mu, p, det, mean, quotient, s1, s2, shear, d11, d22, d12, limit
      integer :: first, i, term
      logical :: ok, valid(strip)
      ! an exponent magnifies what det C has lost
      limit = shape_limit/max(1.0_wp, maxval(abs(self%alpha(:self%terms))))
      do first = 0, n - strip, strip
         do i = 1, strip
            e1(i) = e(first + i, 1)
            e2(i) = e(first + i, 2)
            e3(i) = e(first + i, 3)
            p = 2.0_wp*(e1(i) + e2(i))
            det = (1.0_wp + 2.0_wp*e1(i))*(1.0_wp + 2.0_wp*e2(i)) - e3(i)*e3(i)
            ok = det*limit > (2.0_wp + p)**2 .and. p > -2.0_wp .and. max(det, p) < metric_limit
            valid(i) = ok
            e1(i) = merge(e1(i), 0.0_wp, ok)
            e2(i) = merge(e2(i), 0.0_wp, ok)
            e3(i) = merge(e3(i), 0.0_wp, ok)
            det = merge(det, 1.0_wp, ok)
            mean = e1(i) + e2(i)
            gap(i) = sqrt((e1(i) - e2(i))**2 + e3(i)*e3(i))
            ! the smaller of the two by the determinant, where adding would cancel
            x1(i) = mean + gap(i)
            u(i) = det/(1.0_wp + x1(i)) - 1.0_wp
            x2(i) = merge(mean - gap(i), u(i), mean - gap(i) > -0.5_wp)
            r1(i) = 1.0_wp/(1.0_wp + x1(i))
            r2(i) = 1.0_wp/(1.0_wp + x2(i))
            u(i) = 2.0_wp*gap(i)*r2(i) ! C1/C2 - 1
         end do
         call log_remainder(strip, x1, m1, w1)
         call log_remainder(strip, x2, m2, w2)
         call log_remainder(strip, u, m3, w3)
         do i = 1, strip
            y1(i) = 0.5_wp*w1(i)
            y2(i) = 0.5_wp*w2(i)
            y3(i) = -(y1(i) + y2(i))
            dy(i) = 0.5_wp*w3(i)
            ! (y1 - y2)/(E1 - E2), with its limit 1/C2
            ok = u(i) > 0.0_wp
            k3(i) = r2(i)*merge(2.0_wp*dy(i)/merge(u(i), 1.0_wp, ok), 1.0_wp, ok)
            ! principal axes, any where they are not defined; the smaller of the squares from their product
            ok = gap(i) > 0.0_wp
            c2(i) = merge((e1(i) - e2(i))/merge(gap(i), 1.0_wp, ok), 1.0_wp, ok)
            c3(i) = merge(e3(i)/merge(gap(i), 1.0_wp, ok), 0.0_wp, ok)
            a(i) = 0.5_wp*(1.0_wp + abs(c2(i)))
            b(i) = 0.25_wp*c3(i)*c3(i)/a(i)
            ok = c2(i) >= 0.0_wp
            p = merge(a(i), b(i), ok)
            b(i) = merge(b(i), a(i), ok)
            a(i) = p
         end do
         energy = 0.0_wp
         t1 = 0.0_wp
         t2 = 0.0_wp
         k1 = 0.0_wp
         k2 = 0.0_wp
         g = 0.0_wp
         u = k3
         k3 = 0.0_wp
         do term = 1, self%terms
            alpha = self%alpha(term)
            mu = self%mu(term)
            do i = 1, strip
               valid(i) = valid(i) .and. abs(alpha)*max(abs(y1(i)), abs(y2(i)), abs(y3(i))) < largest_exponent
               x1(i) = merge(alpha*y1(i), 0.0_wp, valid(i))
               x2(i) = merge(alpha*y2(i), 0.0_wp, valid(i))
               x3(i) = merge(alpha*y3(i), 0.0_wp, valid(i))
            end do
            call exp_remainder(strip, x1, m1, w1)
            call exp_remainder(strip, x2, m2, w2)
            call exp_remainder(strip, x3, m3, w3)
            do i = 1, strip
               energy(i) = energy(i) + mu/alpha*(m1(i) + m2(i) + m3(i)) ! the exponents add to zero
               ! e^x1 - e^x3 from e^x - 1 where both are near 1
               t1(i) = t1(i) + mu*merge((x1(i) - x3(i)) + (m1(i) - m3(i)), w1(i) - w3(i), max(abs(x1(i)), abs(x3(i))) < 1.0_wp)
               t2(i) = t2(i) + mu*merge((x2(i) - x3(i)) + (m2(i) - m3(i)), w2(i) - w3(i), max(abs(x2(i)), abs(x3(i))) < 1.0_wp)
               k1(i) = k1(i) + mu*alpha*w1(i)
               k2(i) = k2(i) + mu*alpha*w2(i)
               k3(i) = k3(i) + mu*alpha*w3(i)
            end do
            if (level < level_force) cycle
            do i = 1, strip
               x1(i) = merge(-abs(alpha)*dy(i), 0.0_wp, valid(i))
            end do
            call exp_remainder(strip, x1, m1, w3)
            do i = 1, strip
               ! (e^x1 - e^x2)/(x1 - x2): the larger exponential times (1 - e^z)/(-z), z = -|x1 - x2|
               ok = abs(x1(i)) > 0.0_wp
               quotient = 1.0_wp + merge(m1(i)/merge(x1(i), 1.0_wp, ok), 0.0_wp, ok)
               if (x1(i) < -1.0_wp) quotient = (w3(i) - 1.0_wp)/x1(i)
               g(i) = g(i) + mu*alpha*max(w1(i), w2(i))*quotient
            end do
         end do
         do i = 1, strip
            w(first + i) = energy(i)
            status(first + i) = merge(status(first + i), status_material_limit, valid(i))
         end do
         if (level < level_force) cycle
!GCC$ ivdep
         do i = 1, strip
            s1 = t1(i)*r1(i)
            s2 = t2(i)*r2(i)
            g(i) = (g(i)*u(i) - 2.0_wp*s2)*r1(i) ! (S1 - S2)/(E1 - E2)
            ! mean and difference while the principal axes are ill defined
            ok = gap(i)*r2(i) > 0.01_wp
            p = g(i)*(e1(i) - e2(i))
            s(first + i, 1) = merge(a(i)*s1 + b(i)*s2, 0.5_wp*((s1 + s2) + p), ok)
            s(first + i, 2) = merge(b(i)*s1 + a(i)*s2, 0.5_wp*((s1 + s2) - p), ok)
            s(first + i, 3) = 0.5_wp*g(i)*e3(i)
         end do
         if (level < level_tangent) cycle
!GCC$ ivdep
         do i = 1, strip
            d11 = (k1(i) + k3(i) - 2.0_wp*t1(i))*r1(i)*r1(i)
            d22 = (k2(i) + k3(i) - 2.0_wp*t2(i))*r2(i)*r2(i)
            d12 = k3(i)*r1(i)*r2(i)
            shear = 0.5_wp*g(i)
            p = a(i)*b(i)
            d(first + i, 1) = d11*a(i)*a(i) + d22*b(i)*b(i) + 2.0_wp*d12*p + shear*c3(i)*c3(i)
            d(first + i, 2) = d11*b(i)*b(i) + d22*a(i)*a(i) + 2.0_wp*d12*p + shear*c3(i)*c3(i)
            d(first + i, 3) = (d11 + d22 - 2.0_wp*d12)*p + shear*c2(i)*c2(i)
            d(first + i, 4) = (d11 + d22)*p + d12*(a(i)*a(i) + b(i)*b(i)) - shear*c3(i)*c3(i)
            d(first + i, 5) = c3(i)*(0.5_wp*(d11*a(i) - d22*b(i) - d12*c2(i)) - shear*c2(i))
            d(first + i, 6) = c3(i)*(0.5_wp*(d11*b(i) - d22*a(i) + d12*c2(i)) + shear*c2(i))
         end do
      end do
   end subroutine plane_stress

   pure function reference_tangent(self) result(d)
      class(ogden_t), intent(in) :: self
      real(wp) :: d(6)
      associate (m => self%terms)
         d = 0.5_wp*sum(self%mu(:m)*self%alpha(:m))*[4.0_wp, 4.0_wp, 1.0_wp, 2.0_wp, 0.0_wp, 0.0_wp]
      end associate
   end function reference_tangent
end module finshell_ogden
