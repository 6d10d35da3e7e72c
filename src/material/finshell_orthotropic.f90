!> Orthotropic, linear between second Piola-Kirchhoff stress and Green-Lagrange strain; axis 1 along e1.
!>
!> Plane stress gives E33 = -(nu13/e1) S11 - (nu23/e2) S22; the law ends where E33 <= -1/2, that is where the thickness vanishes.
module finshell_orthotropic
   use finshell_incompressible, only: metric_limit
   use finshell_kinds, only: wp, i4, strip
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_material, only: material_t
   use finshell_parameter, only: parameter_t, optional_parameter, required_parameter
   use finshell_status, only: status_material_limit
   implicit none
   private
   public :: linear_t, orthotropic_parameters, new_orthotropic

   !> A law that is linear in e; also St Venant-Kirchhoff.
   type, extends(material_t) :: linear_t
      real(wp) :: d11 = 0.0_wp, d22 = 0.0_wp, d12 = 0.0_wp, d33 = 0.0_wp
      real(wp) :: k1 = 0.0_wp, k2 = 0.0_wp !< E33 = -k1 E11 - k2 E22
   contains
      procedure :: plane_stress
      procedure :: thickness_stretch
      procedure :: reference_tangent
   end type linear_t

   real(wp), parameter :: not_given = -9.0_wp

contains

   pure function orthotropic_parameters() result(parameters)
      type(parameter_t), allocatable :: parameters(:)
      parameters = [required_parameter('e1', 'Young''s modulus along axis 1 (stress)', 3300.0_wp), &
                    required_parameter('e2', 'Young''s modulus along axis 2 (stress)', 1100.0_wp), &
                    required_parameter('nu12', 'contraction along axis 2 under stress along axis 1', 0.25_wp), &
                    required_parameter('g12', 'shear modulus (stress)', 660.0_wp), &
                    optional_parameter('nu13', not_given, 'contraction of the thickness under stress along axis 1; default nu12', &
                                       not_given), &
                    optional_parameter('nu23', not_given, 'contraction of the thickness under stress along axis 2; default nu12', &
                                       0.3_wp)]
   end function orthotropic_parameters

   !> The law from its parameters; `message` is allocated when they make no sense.
   subroutine new_orthotropic(values, law, message)
      real(wp), intent(in) :: values(:) !< in the order of `orthotropic_parameters`
      class(material_t), allocatable, intent(out) :: law
      character(len=:), allocatable, intent(out) :: message
      type(linear_t) :: linear
      real(wp) :: nu13, nu23, r
      associate (e1 => values(1), e2 => values(2), nu12 => values(3), g12 => values(4))
         nu13 = merge(values(5), nu12, values(5) > not_given)
         nu23 = merge(values(6), nu12, values(6) > not_given)
         if (.not. min(e1, e2, g12) > 0.0_wp) then
            message = 'e1, e2 and g12 must be positive'
         else if (.not. nu12*nu12*e2 < e1) then
            message = 'nu12 must be smaller than sqrt(e1/e2)'
         else
            r = 1.0_wp/(1.0_wp - nu12*nu12*e2/e1)
            linear%d11 = r*e1
            linear%d22 = r*e2
            linear%d12 = r*nu12*e2
            linear%d33 = g12
            linear%k1 = nu13/e1*linear%d11 + nu23/e2*linear%d12
            linear%k2 = nu13/e1*linear%d12 + nu23/e2*linear%d22
         end if
      end associate
      linear%isotropic = .false.
      linear%linear = .true.
      law = linear
   end subroutine new_orthotropic

   pure subroutine plane_stress(self, n, level, e, w, s, d, status)
      class(linear_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6)
      integer(i4), intent(inout) :: status(n)
      real(wp), dimension(strip) :: s1, s2, s3
      real(wp) :: d11, d22, d12, d33
      integer :: b, i
      d11 = self%d11
      d22 = self%d22
      d12 = self%d12
      d33 = self%d33
      call check(self%k1, self%k2, n, e, status)
      do b = 0, n - strip, strip
!GCC$ ivdep
         do i = 1, strip
            s1(i) = d11*e(b + i, 1) + d12*e(b + i, 2)
            s2(i) = d12*e(b + i, 1) + d22*e(b + i, 2)
            s3(i) = d33*e(b + i, 3)
            w(b + i) = 0.5_wp*(s1(i)*e(b + i, 1) + s2(i)*e(b + i, 2) + s3(i)*e(b + i, 3))
         end do
         if (level < level_force) cycle
!GCC$ ivdep
         do i = 1, strip
            s(b + i, 1) = s1(i)
            s(b + i, 2) = s2(i)
            s(b + i, 3) = s3(i)
         end do
         if (level < level_tangent) cycle
!GCC$ ivdep
         do i = 1, strip
            d(b + i, 1) = d11
            d(b + i, 2) = d22
            d(b + i, 3) = d33
            d(b + i, 4) = d12
            d(b + i, 5) = 0.0_wp
            d(b + i, 6) = 0.0_wp
         end do
      end do
   end subroutine plane_stress

   pure subroutine thickness_stretch(self, n, level, e, l, dl, ddl, status)
      class(linear_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: l(n), dl(n, 3), ddl(n, 6)
      integer(i4), intent(inout) :: status(n)
      real(wp) :: k1, k2, l2, r
      integer :: b, i
      k1 = self%k1
      k2 = self%k2
      call check(k1, k2, n, e, status)
      do b = 0, n - strip, strip
!GCC$ ivdep
         do i = 1, strip
            l2 = 1.0_wp - 2.0_wp*(k1*e(b + i, 1) + k2*e(b + i, 2))
            l(b + i) = sqrt(merge(l2, 1.0_wp, l2 > 0.0_wp))
         end do
         if (level < level_force) cycle
!GCC$ ivdep
         do i = 1, strip
            r = 1.0_wp/l(b + i)
            dl(b + i, 1) = -k1*r
            dl(b + i, 2) = -k2*r
            dl(b + i, 3) = 0.0_wp
         end do
         if (level < level_tangent) cycle
!GCC$ ivdep
         do i = 1, strip
            r = 1.0_wp/l(b + i)
            r = r*r*r
            ddl(b + i, 1) = -k1*k1*r
            ddl(b + i, 2) = -k2*k2*r
            ddl(b + i, 3) = 0.0_wp
            ddl(b + i, 4) = -k1*k2*r
            ddl(b + i, 5) = 0.0_wp
            ddl(b + i, 6) = 0.0_wp
         end do
      end do
   end subroutine thickness_stretch

   !> The law ends where the thickness vanishes, and where e is not the strain of any deformation.
   pure subroutine check(k1, k2, n, e, status)
      real(wp), intent(in) :: k1, k2
      integer, intent(in) :: n
      real(wp), intent(in) :: e(n, 3)
      integer(i4), intent(inout) :: status(n)
      real(wp) :: det, trace, least
      integer :: i
      logical :: ok
      do i = 1, n
         trace = 2.0_wp*(e(i, 1) + e(i, 2))
         det = 1.0_wp + (trace + (4.0_wp*e(i, 1)*e(i, 2) - e(i, 3)*e(i, 3)))
         least = min(2.0_wp + trace, 1.0_wp - 2.0_wp*(k1*e(i, 1) + k2*e(i, 2)))
         ! det alone is sure to be NaN when anything is
         ok = det > 0.0_wp .and. least > 0.0_wp .and. max(det, trace) < metric_limit
         status(i) = merge(status(i), status_material_limit, ok)
      end do
   end subroutine check

   pure function reference_tangent(self) result(d)
      class(linear_t), intent(in) :: self
      real(wp) :: d(6)
      d = [self%d11, self%d22, self%d33, self%d12, 0.0_wp, 0.0_wp]
   end function reference_tangent
end module finshell_orthotropic
