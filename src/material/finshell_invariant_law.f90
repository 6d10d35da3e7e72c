!> Incompressible laws given as a function of I1 and of the stretch of up to two families of fibres in the plane.
!>
!> A law only supplies W(I1 - 3, I4 - 1) with its first and second derivatives (`response`); strain measures, stress and tangent
!> are made here. C33 = 1/det C is eliminated, so that I1 = tr C + 1/det C. Notation as in finshell_mooney_rivlin.
module finshell_invariant_law
   use finshell_incompressible, only: incompressible_t, metric_limit, shape_limit
   use finshell_kinds, only: wp, i4, strip
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_status, only: status_material_limit
   implicit none
   private
   public :: invariant_law_t, response_t

   !> Energy and its derivatives at `strip` points: 1 with respect to I1, 4 to I4 of each family. There is no coupling of families.
   type :: response_t
      real(wp) :: w(strip), w1(strip), w11(strip)
      real(wp) :: w4(strip, 2), w14(strip, 2), w44(strip, 2)
      logical :: valid(strip) !< false: the law has ended
      !> Given: what a family looks at must be larger for its stiffness to count. Near 0; energy and stress switch at 0.
      real(wp) :: threshold(strip, 2)
   end type response_t

   type, extends(incompressible_t), abstract :: invariant_law_t
      integer :: families = 0 !< of fibres, 0 to 2
      !> Cosine squared, sine squared and their product of the angle between material axis 1 and the fibres.
      real(wp) :: fibre(3, 2) = 0.0_wp
      real(wp) :: kappa = 0.0_wp !< dispersion: a family looks at kappa (I1 - 3) + (1 - 3 kappa) (I4 - 1)
   contains
      procedure(response_interface), deferred :: response
      procedure :: plane_stress
      procedure :: switched_plane_stress
      procedure :: fibres
   end type invariant_law_t

   abstract interface
      pure subroutine response_interface(self, x1, x4, r)
         import :: invariant_law_t, response_t, strip, wp
         class(invariant_law_t), intent(in) :: self
         real(wp), intent(in) :: x1(strip) !< I1 - 3 >= 0
         real(wp), intent(in) :: x4(strip, 2) !< I4 - 1 of each family
         !> Zero on entry, but `threshold`. Where it is not valid the values must still be finite.
         type(response_t), intent(inout) :: r
      end subroutine response_interface
   end interface

contains

   pure subroutine plane_stress(self, n, level, e, w, s, d, status)
      class(invariant_law_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6)
      integer(i4), intent(inout) :: status(n)
      call evaluate(self, n, level, e, w, s, d, status)
   end subroutine plane_stress

   !> See finshell_material.
   pure subroutine fibres(self, families, fibre)
      class(invariant_law_t), intent(in) :: self
      integer, intent(out) :: families
      real(wp), intent(out) :: fibre(3, 2)
      families = self%families
      fibre = self%fibre
   end subroutine fibres

   !> See finshell_material.
   pure subroutine switched_plane_stress(self, n, level, e, floor, w, s, d, status, rate, rate_floor)
      class(invariant_law_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3), floor(n)
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6)
      integer(i4), intent(inout) :: status(n)
      real(wp), intent(in), optional :: rate(n, 3), rate_floor(n)
      call evaluate(self, n, level, e, w, s, d, status, floor, rate, rate_floor)
   end subroutine switched_plane_stress

   pure subroutine evaluate(self, n, level, e, w, s, d, status, floor, rate, rate_floor)
      class(invariant_law_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6)
      integer(i4), intent(inout) :: status(n)
      real(wp), intent(in), optional :: floor(n), rate(n, 3), rate_floor(n)
      type(response_t) :: r
      real(wp), dimension(strip) :: e1, e2, e3, c, x1, d1, d2, d3
      real(wp) :: x4(strip, 2), p, q, delta, det, f, g, a1, a2, a3, k, m1, m2, m3
      integer :: b, i, j
      logical :: ok
      do b = 0, n - strip, strip
!GCC$ ivdep
         do i = 1, strip
            p = 2.0_wp*(e(b + i, 1) + e(b + i, 2))
            q = 4.0_wp*e(b + i, 1)*e(b + i, 2) - e(b + i, 3)*e(b + i, 3)
            delta = p + q
            det = (1.0_wp + 2.0_wp*e(b + i, 1))*(1.0_wp + 2.0_wp*e(b + i, 2)) - e(b + i, 3)*e(b + i, 3)
            ok = det*shape_limit > (2.0_wp + p)**2 .and. p > -2.0_wp .and. max(delta, p) < metric_limit
            ! a refused strain is evaluated like none, so that nothing traps or overflows
            e1(i) = merge(e(b + i, 1), 0.0_wp, ok)
            e2(i) = merge(e(b + i, 2), 0.0_wp, ok)
            e3(i) = merge(e(b + i, 3), 0.0_wp, ok)
            p = merge(p, 0.0_wp, ok)
            q = merge(q, 0.0_wp, ok)
            delta = merge(delta, 0.0_wp, ok)
            status(b + i) = merge(status(b + i), status_material_limit, ok)
            c(i) = 1.0_wp/merge(det, 1.0_wp, ok)
            f = delta*c(i)
            x1(i) = merge(p - f, delta*f - q, delta > 1.0_wp)
            ! dI1/dE/2 = I - c C^-1
            g = f*(1.0_wp + c(i))
            d1(i) = g - 2.0_wp*c(i)*c(i)*e2(i)
            d2(i) = g - 2.0_wp*c(i)*c(i)*e1(i)
            d3(i) = c(i)*c(i)*e3(i)
         end do
         x4 = 0.0_wp
         do j = 1, self%families
            do i = 1, strip
               x4(i, j) = 2.0_wp*(e1(i)*self%fibre(1, j) + e2(i)*self%fibre(2, j) + e3(i)*self%fibre(3, j))
            end do
         end do
         r%threshold = 0.0_wp
         if (present(floor)) then
            do j = 1, self%families
               do i = 1, strip
                  r%threshold(i, j) = floor(b + i)
               end do
               if (.not. (present(rate) .and. present(rate_floor))) cycle
               do i = 1, strip
                  f = 2.0_wp*(d1(i)*rate(b + i, 1) + d2(i)*rate(b + i, 2) + d3(i)*rate(b + i, 3))
                  g = 2.0_wp*(self%fibre(1, j)*rate(b + i, 1) + self%fibre(2, j)*rate(b + i, 2) + self%fibre(3, j)*rate(b + i, 3))
                  f = self%kappa*f + (1.0_wp - 3.0_wp*self%kappa)*g
                  ! never 0: what is exactly at the switch must pass
                  r%threshold(i, j) = merge(-max(floor(b + i), tiny(1.0_wp)), floor(b + i), f > rate_floor(b + i))
               end do
            end do
         end if
         r%w11 = 0.0_wp
         r%w4 = 0.0_wp
         r%w14 = 0.0_wp
         r%w44 = 0.0_wp
         r%valid = .true.
         call self%response(x1, x4, r)
         do i = 1, strip
            w(b + i) = r%w(i)
            if (.not. r%valid(i)) status(b + i) = status_material_limit
         end do
         if (level < level_force) cycle
!GCC$ ivdep
         do i = 1, strip
            s(b + i, 1) = 2.0_wp*r%w1(i)*d1(i)
            s(b + i, 2) = 2.0_wp*r%w1(i)*d2(i)
            s(b + i, 3) = 2.0_wp*r%w1(i)*d3(i)
         end do
         do j = 1, self%families
!GCC$ ivdep
            do i = 1, strip
               s(b + i, 1) = s(b + i, 1) + 2.0_wp*r%w4(i, j)*self%fibre(1, j)
               s(b + i, 2) = s(b + i, 2) + 2.0_wp*r%w4(i, j)*self%fibre(2, j)
               s(b + i, 3) = s(b + i, 3) + 2.0_wp*r%w4(i, j)*self%fibre(3, j)
            end do
         end do
         if (level < level_tangent) cycle
!GCC$ ivdep
         do i = 1, strip
            a1 = 1.0_wp + 2.0_wp*e2(i)
            a2 = 1.0_wp + 2.0_wp*e1(i)
            a3 = -e3(i)
            g = 4.0_wp*r%w1(i)*c(i)*c(i)
            k = 2.0_wp*g*c(i)
            m1 = 4.0_wp*r%w11(i)*d1(i)
            m2 = 4.0_wp*r%w11(i)*d2(i)
            m3 = 4.0_wp*r%w11(i)*d3(i)
            d(b + i, 1) = k*a1*a1 + m1*d1(i)
            d(b + i, 2) = k*a2*a2 + m2*d2(i)
            d(b + i, 3) = k*a3*a3 + 0.5_wp*g + m3*d3(i)
            d(b + i, 4) = k*a3*a3 + g + m1*d2(i)
            d(b + i, 5) = k*a1*a3 + m1*d3(i)
            d(b + i, 6) = k*a2*a3 + m2*d3(i)
         end do
         do j = 1, self%families
            associate (f1 => self%fibre(1, j), f2 => self%fibre(2, j), f3 => self%fibre(3, j))
!GCC$ ivdep
               do i = 1, strip
                  ! 4 (w14 (d f + f d) + w44 f f) = m f + f m
                  m1 = 4.0_wp*r%w14(i, j)*d1(i) + 2.0_wp*r%w44(i, j)*f1
                  m2 = 4.0_wp*r%w14(i, j)*d2(i) + 2.0_wp*r%w44(i, j)*f2
                  m3 = 4.0_wp*r%w14(i, j)*d3(i) + 2.0_wp*r%w44(i, j)*f3
                  d(b + i, 1) = d(b + i, 1) + 2.0_wp*m1*f1
                  d(b + i, 2) = d(b + i, 2) + 2.0_wp*m2*f2
                  d(b + i, 3) = d(b + i, 3) + 2.0_wp*m3*f3
                  d(b + i, 4) = d(b + i, 4) + m1*f2 + m2*f1
                  d(b + i, 5) = d(b + i, 5) + m1*f3 + m3*f1
                  d(b + i, 6) = d(b + i, 6) + m2*f3 + m3*f2
               end do
            end associate
         end do
      end do
   end subroutine evaluate
end module finshell_invariant_law
