!> St Venant-Kirchhoff: isotropic, linear between second Piola-Kirchhoff stress and Green-Lagrange strain.
!>
!> Plane stress gives E33 = -nu/(1 - nu) (E11 + E22); the law ends where E33 <= -1/2, that is where the thickness would vanish.
module finshell_st_venant_kirchhoff
   use finshell_incompressible, only: metric_limit
   use finshell_kinds, only: wp, i4, lanes
   use finshell_material, only: level_force, level_tangent, material_t
   use finshell_parameter, only: parameter_t, required_parameter
   use finshell_status, only: status_material_limit
   implicit none
   private
   public :: st_venant_kirchhoff_t, st_venant_kirchhoff_parameters, new_st_venant_kirchhoff

   type, extends(material_t) :: st_venant_kirchhoff_t
      real(wp) :: modulus = 0.0_wp !< E/(1 - nu^2)
      real(wp) :: nu = 0.0_wp
   contains
      procedure :: plane_stress
      procedure :: thickness_stretch
      procedure :: reference_tangent
   end type st_venant_kirchhoff_t

contains

   pure function st_venant_kirchhoff_parameters() result(parameters)
      type(parameter_t), allocatable :: parameters(:)
      parameters = [required_parameter('e', 'Young''s modulus (stress)', 1000.0_wp), &
                    required_parameter('nu', 'Poisson''s ratio, -1 < nu < 0.5', 0.3_wp)]
   end function st_venant_kirchhoff_parameters

   !> The law from its parameters; `message` is allocated when they make no sense.
   subroutine new_st_venant_kirchhoff(values, law, message)
      real(wp), intent(in) :: values(:) !< in the order of `st_venant_kirchhoff_parameters`
      class(material_t), allocatable, intent(out) :: law
      character(len=:), allocatable, intent(out) :: message
      real(wp) :: modulus
      modulus = 0.0_wp
      associate (e => values(1), nu => values(2))
         if (.not. e > 0.0_wp) then
            message = 'e must be positive'
         else if (.not. (nu > -1.0_wp .and. nu < 0.5_wp)) then
            message = 'nu must lie between -1 and 0.5 (use neo_hookean or mooney_rivlin for an incompressible material)'
         else
            modulus = e/((1.0_wp - nu)*(1.0_wp + nu))
         end if
         law = st_venant_kirchhoff_t(isotropic=.true., modulus=modulus, nu=nu)
      end associate
   end subroutine new_st_venant_kirchhoff

   pure subroutine plane_stress(self, n, level, e, w, s, d, status)
      class(st_venant_kirchhoff_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6)
      integer(i4), intent(inout) :: status(n)
      real(wp) :: k, kn, ks, s1, s2, s3
      integer :: b, i
      k = self%modulus
      kn = k*self%nu
      ks = 0.5_wp*k*(1.0_wp - self%nu)
      call check(self%nu/(1.0_wp - self%nu), n, e, status)
      do b = 0, n - lanes, lanes
!GCC$ ivdep
         do i = 1, lanes
            s1 = k*e(b + i, 1) + kn*e(b + i, 2)
            s2 = kn*e(b + i, 1) + k*e(b + i, 2)
            s3 = ks*e(b + i, 3)
            w(b + i) = 0.5_wp*(s1*e(b + i, 1) + s2*e(b + i, 2) + s3*e(b + i, 3))
         end do
         if (level < level_force) cycle
!GCC$ ivdep
         do i = 1, lanes
            s(b + i, 1) = k*e(b + i, 1) + kn*e(b + i, 2)
            s(b + i, 2) = kn*e(b + i, 1) + k*e(b + i, 2)
            s(b + i, 3) = ks*e(b + i, 3)
         end do
         if (level < level_tangent) cycle
!GCC$ ivdep
         do i = 1, lanes
            d(b + i, 1) = k
            d(b + i, 2) = k
            d(b + i, 3) = ks
            d(b + i, 4) = kn
            d(b + i, 5) = 0.0_wp
            d(b + i, 6) = 0.0_wp
         end do
      end do
   end subroutine plane_stress

   pure subroutine thickness_stretch(self, n, level, e, l, dl, ddl, status)
      class(st_venant_kirchhoff_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: l(n), dl(n, 3), ddl(n, 6)
      integer(i4), intent(inout) :: status(n)
      real(wp) :: kappa, l2, r
      integer :: b, i
      kappa = self%nu/(1.0_wp - self%nu)
      call check(kappa, n, e, status)
      do b = 0, n - lanes, lanes
!GCC$ ivdep
         do i = 1, lanes
            l2 = 1.0_wp - 2.0_wp*kappa*(e(b + i, 1) + e(b + i, 2))
            l(b + i) = sqrt(merge(l2, 1.0_wp, l2 > 0.0_wp))
         end do
         if (level < level_force) cycle
!GCC$ ivdep
         do i = 1, lanes
            r = kappa/l(b + i)
            dl(b + i, 1) = -r
            dl(b + i, 2) = -r
            dl(b + i, 3) = 0.0_wp
         end do
         if (level < level_tangent) cycle
!GCC$ ivdep
         do i = 1, lanes
            r = kappa/l(b + i)
            ddl(b + i, 1) = -r*r/l(b + i)
            ddl(b + i, 2) = ddl(b + i, 1)
            ddl(b + i, 3) = 0.0_wp
            ddl(b + i, 4) = ddl(b + i, 1)
            ddl(b + i, 5) = 0.0_wp
            ddl(b + i, 6) = 0.0_wp
         end do
      end do
   end subroutine thickness_stretch

   !> The law ends where the thickness vanishes, and where e is not the strain of any deformation.
   pure subroutine check(kappa, n, e, status)
      real(wp), intent(in) :: kappa
      integer, intent(in) :: n
      real(wp), intent(in) :: e(n, 3)
      integer(i4), intent(inout) :: status(n)
      real(wp) :: det, trace, least
      integer :: i
      do i = 1, n
         trace = 2.0_wp*(e(i, 1) + e(i, 2))
         det = 1.0_wp + (trace + (4.0_wp*e(i, 1)*e(i, 2) - e(i, 3)*e(i, 3)))
         least = min(det, 2.0_wp + trace, 1.0_wp - kappa*trace)
         status(i) = merge(status(i), status_material_limit, least > 0.0_wp .and. det < metric_limit)
      end do
   end subroutine check

   pure function reference_tangent(self) result(d)
      class(st_venant_kirchhoff_t), intent(in) :: self
      real(wp) :: d(6)
      d = self%modulus*[1.0_wp, 1.0_wp, 0.5_wp*(1.0_wp - self%nu), self%nu, 0.0_wp, 0.0_wp]
   end function reference_tangent
end module finshell_st_venant_kirchhoff
