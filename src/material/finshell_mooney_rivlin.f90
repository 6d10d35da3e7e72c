!> Incompressible Mooney-Rivlin: W = c10 (I1 - 3) + c01 (I2 - 3), paper eq. (40); neo-Hookean for c01 = 0.
!>
!> Everything is evaluated from the strain, never from C - I, so that stress and energy keep their relative accuracy
!> however small the strain is. With p = tr C - 2, q = 4 det E, delta = p + q = det C - 1, c = 1/det C = C33 and f = delta c
!> (c from the product, delta from the sum: each is accurate where the other cancels):
!> I1 - 3 = delta f - q = p - f and I2 - 3 = delta f - q c. A = adj C, so that C^-1 = c A.
module finshell_mooney_rivlin
   use finshell_incompressible, only: incompressible_t, metric_limit, shape_limit
   use finshell_kinds, only: wp, i4, strip
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_material, only: material_t
   use finshell_parameter, only: parameter_t, optional_parameter, required_parameter
   use finshell_status, only: status_material_limit
   implicit none
   private
   public :: mooney_rivlin_t, mooney_rivlin_parameters, new_mooney_rivlin

   type, extends(incompressible_t) :: mooney_rivlin_t
      real(wp) :: c10 = 0.0_wp, c01 = 0.0_wp
   contains
      procedure :: plane_stress
      procedure :: reference_tangent
   end type mooney_rivlin_t

contains

   pure function mooney_rivlin_parameters() result(parameters)
      type(parameter_t), allocatable :: parameters(:)
      parameters = [required_parameter('c10', 'coefficient of I1 - 3 (stress)', 80.0_wp), &
                    optional_parameter('c01', 0.0_wp, 'coefficient of I2 - 3 (stress)', 20.0_wp)]
   end function mooney_rivlin_parameters

   !> The law from its parameters; `message` is allocated when they make no sense.
   subroutine new_mooney_rivlin(values, law, message)
      real(wp), intent(in) :: values(:) !< in the order of `mooney_rivlin_parameters`
      class(material_t), allocatable, intent(out) :: law
      character(len=:), allocatable, intent(out) :: message
      type(mooney_rivlin_t) :: made
      if (.not. values(1) + values(2) > 0.0_wp) message = 'c10 + c01, half the shear modulus, must be positive'
      made%c10 = values(1)
      made%c01 = values(2)
      allocate (law, source=made)
   end subroutine new_mooney_rivlin

   pure subroutine plane_stress(self, n, level, e, w, s, d, status)
      class(mooney_rivlin_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6)
      integer(i4), intent(inout) :: status(n)
      real(wp), dimension(strip) :: p, f, c, h
      real(wp) :: q, delta, det, g, a1, a2, a3, c2, k, wc
      real(wp) :: c10, c01
      integer :: b, i
      logical :: ok
      c10 = self%c10
      c01 = self%c01
      do b = 0, n - strip, strip
!GCC$ ivdep
         do i = 1, strip
            p(i) = 2.0_wp*(e(b + i, 1) + e(b + i, 2))
            q = 4.0_wp*e(b + i, 1)*e(b + i, 2) - e(b + i, 3)*e(b + i, 3)
            delta = p(i) + q
            det = (1.0_wp + 2.0_wp*e(b + i, 1))*(1.0_wp + 2.0_wp*e(b + i, 2)) - e(b + i, 3)*e(b + i, 3)
            ok = det*shape_limit > (2.0_wp + p(i))**2 .and. p(i) > -2.0_wp .and. max(delta, p(i)) < metric_limit
            ! a refused strain is evaluated like none, so that nothing traps or overflows
            p(i) = merge(p(i), 0.0_wp, ok)
            q = merge(q, 0.0_wp, ok)
            delta = merge(delta, 0.0_wp, ok)
            c(i) = 1.0_wp/merge(det, 1.0_wp, ok)
            f(i) = delta*c(i)
            status(b + i) = merge(status(b + i), status_material_limit, ok)
            ! of the two forms of I1 - 3 the one without cancellation
            w(b + i) = c10*merge(p(i) - f(i), delta*f(i) - q, delta > 1.0_wp) + c01*(delta*f(i) - q*c(i))
         end do
         if (level < level_force) cycle
!GCC$ ivdep
         do i = 1, strip
            c2 = c(i)*c(i)
            g = f(i)*(1.0_wp + c(i)) ! 1 - c^2
            h(i) = 1.0_wp - (2.0_wp + p(i))*c2
            k = c10*g + c01*((2.0_wp + p(i))*g - p(i) - f(i))
            wc = c10*c2 - c01*h(i)
            s(b + i, 1) = 2.0_wp*(k - 2.0_wp*wc*e(b + i, 2))
            s(b + i, 2) = 2.0_wp*(k - 2.0_wp*wc*e(b + i, 1))
            s(b + i, 3) = 2.0_wp*wc*e(b + i, 3)
         end do
         if (level < level_tangent) cycle
!GCC$ ivdep
         do i = 1, strip
            c2 = c(i)*c(i)
            a1 = 1.0_wp + 2.0_wp*e(b + i, 2)
            a2 = 1.0_wp + 2.0_wp*e(b + i, 1)
            a3 = -e(b + i, 3)
            k = 8.0_wp*c2*c(i)*(c10 + c01*(2.0_wp + p(i)))
            wc = 4.0_wp*c01*c2
            d(b + i, 1) = (k*a1 - 2.0_wp*wc)*a1
            d(b + i, 2) = (k*a2 - 2.0_wp*wc)*a2
            d(b + i, 3) = k*a3*a3 + 2.0_wp*(c10*c2 - c01*h(i))
            d(b + i, 4) = k*a3*a3 + 4.0_wp*(c10*c2 + c01)
            d(b + i, 5) = (k*a1 - wc)*a3
            d(b + i, 6) = (k*a2 - wc)*a3
         end do
      end do
   end subroutine plane_stress

   pure function reference_tangent(self) result(d)
      class(mooney_rivlin_t), intent(in) :: self
      real(wp) :: d(6)
      d = (self%c10 + self%c01)*[8.0_wp, 8.0_wp, 2.0_wp, 4.0_wp, 0.0_wp, 0.0_wp]
   end function reference_tangent
end module finshell_mooney_rivlin
