!> What all incompressible laws share: the thickness stretch is the inverse of the area stretch.
module finshell_incompressible
   use finshell_kinds, only: wp, i4, strip
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_material, only: material_t
   use finshell_status, only: status_material_limit
   implicit none
   private
   public :: incompressible_t, metric_limit, shape_limit, inverse_area_stretch

   !> det C beyond this, or below its inverse, is refused: no shell is meant to stretch 1e10-fold, and nothing overflows.
   real(wp), parameter :: metric_limit = 1.0e40_wp

   !> (tr C)^2/det C beyond this, a ratio of principal stretches of 3000, is refused by laws that divide by det C: det C and what is
   !> made of it would have lost more than half of their digits, however accurate the strain is (exponents magnify the loss).
   real(wp), parameter :: shape_limit = 1.0e7_wp

   type, extends(material_t), abstract :: incompressible_t
   contains
      procedure :: thickness_stretch
   end type incompressible_t

contains

   pure subroutine thickness_stretch(self, n, level, e, l, dl, ddl, status)
      class(incompressible_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: l(n), dl(n, 3), ddl(n, 6)
      integer(i4), intent(inout) :: status(n)
      call inverse_area_stretch(n, level, e, l, dl, ddl, status)
   end subroutine thickness_stretch

   !> l = (det C)^(-1/2) with its derivatives; see finshell_material.
   pure subroutine inverse_area_stretch(n, level, e, l, dl, ddl, status)
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: l(n), dl(n, 3), ddl(n, 6)
      integer(i4), intent(inout) :: status(n)
      real(wp), dimension(strip) :: a1, a2, a3, c, lc, lcc
      real(wp) :: det
      integer :: b, i
      logical :: ok
      do b = 0, n - strip, strip
!GCC$ ivdep
         do i = 1, strip
            ! the adjugate of C
            a1(i) = 1.0_wp + 2.0_wp*e(b + i, 2)
            a2(i) = 1.0_wp + 2.0_wp*e(b + i, 1)
            a3(i) = -e(b + i, 3)
            det = a1(i)*a2(i) - a3(i)*a3(i)
            ok = det*shape_limit > (a1(i) + a2(i))**2 .and. a1(i) + a2(i) > 0.0_wp .and. max(det, a1(i) + a2(i)) < metric_limit
            c(i) = 1.0_wp/merge(det, 1.0_wp, ok)
            l(b + i) = sqrt(c(i))
            status(b + i) = merge(status(b + i), status_material_limit, ok)
         end do
         if (level < level_force) cycle
!GCC$ ivdep
         do i = 1, strip
            lc(i) = l(b + i)*c(i)
            dl(b + i, 1) = -lc(i)*a1(i)
            dl(b + i, 2) = -lc(i)*a2(i)
            dl(b + i, 3) = -lc(i)*a3(i)
         end do
         if (level < level_tangent) cycle
!GCC$ ivdep
         do i = 1, strip
            lcc(i) = 3.0_wp*lc(i)*c(i)
            ddl(b + i, 1) = lcc(i)*a1(i)*a1(i)
            ddl(b + i, 2) = lcc(i)*a2(i)*a2(i)
            ddl(b + i, 3) = lcc(i)*a3(i)*a3(i) + lc(i)
            ddl(b + i, 4) = ddl(b + i, 3)
            ddl(b + i, 5) = lcc(i)*a1(i)*a3(i)
            ddl(b + i, 6) = lcc(i)*a2(i)*a3(i)
         end do
      end do
   end subroutine inverse_area_stretch
end module finshell_incompressible
