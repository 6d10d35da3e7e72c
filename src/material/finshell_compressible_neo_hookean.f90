!> Compressible neo-Hookean: W = mu/2 (I1 - 3 - 2 ln J) + lambda/2 (ln J)^2.
!>
!> Plane stress, S33 = 0, is one equation for x = C33 - 1: 2 mu x + lambda ln(det C (1 + x)) = 0. Once x is known everything is
!> in closed form: S = mu (I - C33 C^-1), and the condensed tangent is
!> 2 lambda mu'/(lambda + 2 mu') C^-1 (x) C^-1 + 2 mu' C^-1 (.) C^-1 with mu' = mu C33.
!> Evaluated from the strain with the notation of finshell_mooney_rivlin, without cancellation for small strains.
module finshell_compressible_neo_hookean
   use finshell_elementary, only: log_remainder
   use finshell_incompressible, only: metric_limit, shape_limit
   use finshell_kinds, only: wp, i4, lanes
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_material, only: material_t
   use finshell_parameter, only: parameter_t, optional_parameter
   use finshell_status, only: status_material_limit
   implicit none
   private
   public :: compressible_neo_hookean_t, compressible_neo_hookean_parameters, new_compressible_neo_hookean

   type, extends(material_t) :: compressible_neo_hookean_t
      real(wp) :: mu = 0.0_wp, lambda = 0.0_wp !< Lame's constants
   contains
      procedure :: plane_stress
      procedure :: thickness_stretch
      procedure :: reference_tangent
   end type compressible_neo_hookean_t

   integer, parameter :: most_iterations = 60
   !> Below this C33, x = C33 - 1 begins to say little about it.
   real(wp), parameter :: c33_thin = 1.0_wp/16, log_thin = log(c33_thin)

contains

   pure function compressible_neo_hookean_parameters() result(parameters)
      type(parameter_t), allocatable :: parameters(:)
      parameters = [optional_parameter('e', 0.0_wp, 'Young''s modulus (stress), with nu; or give mu and lambda', 1000.0_wp), &
                    optional_parameter('nu', 0.0_wp, 'Poisson''s ratio, 0 <= nu < 0.5', 0.3_wp), &
                    optional_parameter('mu', 0.0_wp, 'shear modulus (stress), with lambda; or give e and nu', 0.0_wp), &
                    optional_parameter('lambda', 0.0_wp, 'Lame''s first constant (stress), >= 0', 0.0_wp)]
   end function compressible_neo_hookean_parameters

   !> The law from its parameters; `message` is allocated when they make no sense.
   subroutine new_compressible_neo_hookean(values, law, message)
      real(wp), intent(in) :: values(:) !< in the order of `compressible_neo_hookean_parameters`
      class(material_t), allocatable, intent(out) :: law
      character(len=:), allocatable, intent(out) :: message
      type(compressible_neo_hookean_t) :: made
      real(wp) :: mu, lambda
      associate (e => values(1), nu => values(2))
         mu = values(3)
         lambda = values(4)
         if ((abs(e) > 0.0_wp .or. abs(nu) > 0.0_wp) .eqv. (abs(mu) > 0.0_wp .or. abs(lambda) > 0.0_wp)) then
            message = 'give either e and nu or mu and lambda'
         else if (abs(e) > 0.0_wp .or. abs(nu) > 0.0_wp) then
            if (.not. e > 0.0_wp) then
               message = 'e must be positive'
            else if (.not. (nu >= 0.0_wp .and. nu < 0.5_wp)) then
               message = 'nu must be at least 0 and less than 0.5 (use neo_hookean for an incompressible material)'
            else
               mu = 0.5_wp*e/(1.0_wp + nu)
               lambda = e*nu/((1.0_wp + nu)*(1.0_wp - 2.0_wp*nu))
            end if
         else if (.not. mu > 0.0_wp) then
            message = 'mu must be positive'
         else if (.not. lambda >= 0.0_wp) then
            message = 'lambda must not be negative'
         end if
      end associate
      made%mu = mu
      made%lambda = lambda
      allocate (law, source=made)
   end subroutine new_compressible_neo_hookean

   pure subroutine plane_stress(self, n, level, e, w, s, d, status)
      class(compressible_neo_hookean_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6)
      integer(i4), intent(inout) :: status(n)
      real(wp), dimension(lanes) :: c, f, q, x, c33, energy
      real(wp) :: a1, a2, a3, k, m, mu, lambda
      integer :: b, i
      mu = self%mu
      lambda = self%lambda
      do b = 0, n - lanes, lanes
         call solve_thickness(mu, lambda, e(b + 1:b + lanes, 1), e(b + 1:b + lanes, 2), e(b + 1:b + lanes, 3), c, f, q, x, c33, &
                              energy, status(b + 1:b + lanes))
!GCC$ ivdep
         do i = 1, lanes
            w(b + i) = energy(i)
         end do
         if (level < level_force) cycle
!GCC$ ivdep
         do i = 1, lanes
            k = 2.0_wp*mu*c33(i)*c(i)
            s(b + i, 1) = mu*(f(i) - x(i) + x(i)*f(i)) - k*e(b + i, 2)
            s(b + i, 2) = mu*(f(i) - x(i) + x(i)*f(i)) - k*e(b + i, 1)
            s(b + i, 3) = 0.5_wp*k*e(b + i, 3)
         end do
         if (level < level_tangent) cycle
!GCC$ ivdep
         do i = 1, lanes
            a1 = 1.0_wp + 2.0_wp*e(b + i, 2)
            a2 = 1.0_wp + 2.0_wp*e(b + i, 1)
            a3 = -e(b + i, 3)
            m = 2.0_wp*mu*c33(i)*c(i)*c(i)
            k = m*(lambda/(lambda + 2.0_wp*mu*c33(i)) + 1.0_wp)
            ! C^-1 (.) C^-1 and C^-1 (x) C^-1 differ by det A = det C in two components only
            d(b + i, 1) = k*a1*a1
            d(b + i, 2) = k*a2*a2
            d(b + i, 3) = k*a3*a3 + 0.5_wp*m*(a1*a2 - a3*a3)
            d(b + i, 4) = k*a3*a3 + (k - m)*(a1*a2 - a3*a3)
            d(b + i, 5) = k*a1*a3
            d(b + i, 6) = k*a2*a3
         end do
      end do
   end subroutine plane_stress

   pure subroutine thickness_stretch(self, n, level, e, l, dl, ddl, status)
      class(compressible_neo_hookean_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: l(n), dl(n, 3), ddl(n, 6)
      integer(i4), intent(inout) :: status(n)
      real(wp), dimension(lanes) :: c, f, q, x, c33, energy
      real(wp) :: a1, a2, a3, k, m, mu, lambda, r, phi
      integer :: b, i
      mu = self%mu
      lambda = self%lambda
      do b = 0, n - lanes, lanes
         call solve_thickness(mu, lambda, e(b + 1:b + lanes, 1), e(b + 1:b + lanes, 2), e(b + 1:b + lanes, 3), c, f, q, x, c33, &
                              energy, status(b + 1:b + lanes))
!GCC$ ivdep
         do i = 1, lanes
            l(b + i) = sqrt(c33(i))
         end do
         if (level < level_force) cycle
!GCC$ ivdep
         do i = 1, lanes
            ! dl = -phi C^-1, phi = lambda l/(lambda + 2 mu l^2), by differentiating the plane-stress condition
            a1 = 1.0_wp + 2.0_wp*e(b + i, 2)
            a2 = 1.0_wp + 2.0_wp*e(b + i, 1)
            a3 = -e(b + i, 3)
            r = lambda/(lambda + 2.0_wp*mu*c33(i))
            phi = r*l(b + i)*c(i)
            dl(b + i, 1) = -phi*a1
            dl(b + i, 2) = -phi*a2
            dl(b + i, 3) = -phi*a3
         end do
         if (level < level_tangent) cycle
!GCC$ ivdep
         do i = 1, lanes
            a1 = 1.0_wp + 2.0_wp*e(b + i, 2)
            a2 = 1.0_wp + 2.0_wp*e(b + i, 1)
            a3 = -e(b + i, 3)
            r = lambda/(lambda + 2.0_wp*mu*c33(i))
            phi = r*l(b + i)*c(i)
            m = 2.0_wp*phi*c(i)
            k = m + phi*c(i)*r*(2.0_wp*r - 1.0_wp)
            ddl(b + i, 1) = k*a1*a1
            ddl(b + i, 2) = k*a2*a2
            ddl(b + i, 3) = k*a3*a3 + 0.5_wp*m*(a1*a2 - a3*a3)
            ddl(b + i, 4) = k*a3*a3 + (k - m)*(a1*a2 - a3*a3)
            ddl(b + i, 5) = k*a1*a3
            ddl(b + i, 6) = k*a2*a3
         end do
      end do
   end subroutine thickness_stretch

   !> x = C33 - 1 and C33 from S33 = 0, each to rounding, for `lanes` strains; and the energy, for which all terms are at hand.
   !>
   !> g(x) = x + r (ln det C + ln(1 + x)), r = lambda/(2 mu) >= 0, increases and is concave, and its root lies between 0
   !> (no Poisson effect) and 1/det C - 1 (incompressible): Halley's iteration clipped to that bracket cannot fail. Where C33
   !> is small y = ln C33 is the unknown.
   pure subroutine solve_thickness(mu, lambda, e1, e2, e3, c, f, q, x, c33, energy, status)
      real(wp), intent(in) :: mu, lambda
      real(wp), intent(in) :: e1(lanes), e2(lanes), e3(lanes)
      real(wp), intent(out) :: c(lanes) !< 1/det C
      real(wp), intent(out) :: f(lanes) !< 1 - 1/det C
      real(wp), intent(out) :: q(lanes) !< 4 det E
      real(wp), intent(out) :: x(lanes), c33(lanes)
      real(wp), intent(out) :: energy(lanes)
      integer(i4), intent(inout) :: status(lanes)
      real(wp), dimension(lanes) :: delta, det, md, log_det, mx, step
      real(wp) :: p, r, g, dg, y, tolerance
      integer :: i, iteration
      logical :: ok, thin(lanes)
      r = 0.5_wp*(lambda/mu)
      do i = 1, lanes
         p = 2.0_wp*(e1(i) + e2(i))
         q(i) = 4.0_wp*e1(i)*e2(i) - e3(i)*e3(i)
         delta(i) = p + q(i)
         det(i) = (1.0_wp + 2.0_wp*e1(i))*(1.0_wp + 2.0_wp*e2(i)) - e3(i)*e3(i)
         ok = det(i)*shape_limit > (2.0_wp + p)**2 .and. p > -2.0_wp .and. max(delta(i), p) < metric_limit
         delta(i) = merge(delta(i), 0.0_wp, ok)
         q(i) = merge(q(i), 0.0_wp, ok)
         status(i) = merge(status(i), status_material_limit, ok)
         det(i) = merge(det(i), 1.0_wp, ok)
         c(i) = 1.0_wp/det(i)
         f(i) = delta(i)*c(i)
      end do
      call log_remainder(lanes, delta, md, log_det)
      if (any(delta < -0.5_wp)) then ! where det C is small, better from the product
         do i = 1, lanes
            if (delta(i) >= -0.5_wp) cycle
            log_det(i) = log(det(i))
            md(i) = delta(i) - log_det(i)
         end do
      end if
      do i = 1, lanes
         y = -r*log_det(i)/(1.0_wp + r)
         y = y + 0.5_wp*y*y*(1.0_wp - 1.0_wp/(1.0_wp + r)) ! right to second order
         x(i) = max(min(y, max(0.0_wp, -f(i))), min(0.0_wp, -f(i)))
         thin(i) = r*(log_det(i) + log_thin) > 1.0_wp - c33_thin ! g(c33_thin - 1) > 0
         x(i) = merge(0.0_wp, x(i), thin(i))
         step(i) = merge(0.0_wp, 1.0_wp, thin(i))
      end do
      tolerance = epsilon(1.0_wp)**0.4_wp ! the error of a cubically convergent iteration is far below its last step's
      do iteration = 1, most_iterations
         if (all(step <= 0.0_wp)) exit
         call log_remainder(lanes, x, mx)
!GCC$ ivdep
         do i = 1, lanes
            g = x(i) + r*(log_det(i) + (x(i) - mx(i)))
            y = r/(1.0_wp + x(i))
            dg = 1.0_wp + y
            y = x(i) - 2.0_wp*g*dg/max(2.0_wp*dg*dg + g*y/(1.0_wp + x(i)), dg*dg)
            y = max(min(y, max(0.0_wp, -f(i))), min(0.0_wp, -f(i)))
            ! a lane that has converged rests, so that its bits do not depend on its neighbours
            y = merge(y, x(i), step(i) > 0.0_wp)
            step(i) = merge(abs(y - x(i)) - tolerance*abs(y), step(i), step(i) > 0.0_wp)
            x(i) = y
         end do
      end do
      call log_remainder(lanes, x, mx)
      do i = 1, lanes
         c33(i) = 1.0_wp + x(i)
      end do
      if (any(thin)) then
         do i = 1, lanes
            if (.not. thin(i)) cycle
            call solve_thin(r, log_det(i), y, c33(i))
            x(i) = c33(i) - 1.0_wp
            mx(i) = x(i) - y
         end do
      end if
      do i = 1, lanes
         ! stationary in x: an error of x counts by its square
         g = log_det(i) + (x(i) - mx(i))
         energy(i) = 0.5_wp*mu*((md(i) - q(i)) + mx(i) + 0.5_wp*r*g*g)
         if (step(i) > 0.0_wp) status(i) = status_material_limit
      end do
   end subroutine solve_thickness

   !> y = ln C33 < log_thin of e^y - 1 + r (ln det C + y) = 0. The left side is convex and increasing: Newton's iteration from above
   !> the root stays above it and cannot fail.
   pure subroutine solve_thin(r, log_det, y, c33)
      real(wp), intent(in) :: r, log_det
      real(wp), intent(out) :: y, c33
      real(wp) :: step
      integer :: iteration
      y = min(1.0_wp/r - log_det, log_thin)
      do iteration = 1, most_iterations
         c33 = exp(y)
         step = ((c33 - 1.0_wp) + r*(log_det + y))/(c33 + r)
         y = y - step
         if (step*step < epsilon(1.0_wp)) exit
      end do
      c33 = exp(y)
   end subroutine solve_thin

   pure function reference_tangent(self) result(d)
      class(compressible_neo_hookean_t), intent(in) :: self
      real(wp) :: d(6)
      real(wp) :: k
      k = 2.0_wp*self%mu*(self%lambda/(self%lambda + 2.0_wp*self%mu))
      d = [k + 2.0_wp*self%mu, k + 2.0_wp*self%mu, self%mu, k, 0.0_wp, 0.0_wp]
   end function reference_tangent
end module finshell_compressible_neo_hookean
