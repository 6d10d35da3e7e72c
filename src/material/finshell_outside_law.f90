!> A law that is not ours: a function of the caller's, or of a shared library, as finshell_law of finshell.h describes it.
!>
!> It is given in the plane, or in space and brought to plane stress here (finshell_condensation). Its arrays are those of
!> finshell_material, handed over as they are: a strip of points or more in a call. What it returns is not trusted: a point with a
!> code, or with a number that is not finite, is one that the law refuses.
module finshell_outside_law
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use, intrinsic :: iso_c_binding, only: c_null_ptr, c_ptr
   use finshell_condensation, only: asked_t, evaluate_interface, incompressible_plane, plane_of_solid, solid_stretch
   use finshell_error, only: error_t, raise, text_of
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_incompressible, only: inverse_area_stretch
   use finshell_kinds, only: wp, dp, i4, strip
   use finshell_material, only: material_t
   use finshell_parameter, only: parameter_t
   use finshell_status, only: status_invalid_argument, status_material_limit
   implicit none
   private
   public :: description_t, outside_law_t, new_outside_law, stretch_interface, kind_plane, kind_solid, kind_incompressible
   public :: most_states

   !> What the function is: plane stress; energy of strain in space; the same, of an incompressible material.
   integer, parameter :: kind_plane = 1, kind_solid = 2, kind_incompressible = 3
   integer, parameter :: most_states = 1000

   abstract interface
      !> Thickness stretch and its derivatives: `thickness_stretch` of finshell_material.
      pure subroutine stretch_interface(at, parameters, strain, stretch, first, second, codes) bind(c)
         import :: asked_t, i4, wp
         type(asked_t), intent(in) :: at
         real(wp), intent(in) :: parameters(*), strain(*)
         real(wp), intent(inout) :: stretch(*), first(*), second(*)
         integer(i4), intent(inout) :: codes(*)
      end subroutine stretch_interface
   end interface

   !> A law, whatever its parameters.
   type :: description_t
      character(len=:), allocatable :: name
      type(parameter_t), allocatable :: parameters(:)
      integer :: kind = kind_plane
      logical :: isotropic = .true.
      integer :: states = 0
      procedure(evaluate_interface), pointer, nopass :: evaluate => null()
      procedure(stretch_interface), pointer, nopass :: stretch => null() !< of laws in the plane; null: they are incompressible
      type(c_ptr) :: data = c_null_ptr !< handed through
   end type description_t

   type, extends(material_t) :: outside_law_t
      private
      integer :: kind = kind_plane
      procedure(evaluate_interface), pointer, nopass :: evaluate => null()
      procedure(stretch_interface), pointer, nopass :: stretch => null()
      type(c_ptr) :: data = c_null_ptr
      real(wp), allocatable :: parameters(:)
      real(wp) :: reference(6) = 0 !< tangent at rest
      real(wp) :: contraction = 0 !< of laws in space: thickness strain over area strain at rest, with the sign changed
   contains
      procedure :: plane_stress
      procedure :: plane_stress_from
      procedure :: thickness_stretch
      procedure :: reference_tangent
   end type outside_law_t

contains

   !> A law with these values of its parameters, all of them. It has to be there at rest: without a code, with a stiffness.
   subroutine new_outside_law(law, description, values, error)
      class(material_t), allocatable, intent(out) :: law
      type(description_t), intent(in) :: description
      real(wp), intent(in) :: values(:)
      type(error_t), allocatable, intent(inout) :: error
      type(outside_law_t) :: made
      real(wp) :: e(strip, 3), w(strip), s(strip, 3), d(strip, 6)
      integer(i4) :: status(strip)
      character(len=:), allocatable :: place

      made%name = description%name
      made%kind = description%kind
      made%isotropic = description%isotropic .and. description%states == 0 ! states have components along the law's axes
      made%states = description%states
      made%evaluate => description%evaluate
      made%stretch => description%stretch
      made%data = description%data
      made%parameters = [values, 0.0_wp] ! never empty
      e = 0
      status = 0
      if (made%kind == kind_solid) call find_contraction(made)
      call made%plane_stress(strip, level_tangent, e, w, s, d, status)
      made%reference = d(1, :)
      place = 'material law '''//description%name//''': '
      if (status(1) /= 0) then
         call raise(error, status_invalid_argument, place//'it cannot be evaluated at rest, where strains are 0: '// &
                    'it returns a code, or a number that is not finite')
      else if (.not. (d(1, 1) > 0 .and. d(1, 2) > 0 .and. d(1, 3) > 0 .and. d(1, 1)*d(1, 2) > d(1, 4)**2)) then
         call raise(error, status_invalid_argument, place//'its tangent at rest is not positive definite: 11 is '// &
                    text_of(real(d(1, 1), dp))//', 22 is '//text_of(real(d(1, 2), dp))//', shear is '// &
                    text_of(real(d(1, 3), dp)))
      end if
      if (.not. allocated(error)) allocate (law, source=made)
   end subroutine new_outside_law

   !> See finshell_material: of a law with states, a step of no time from the state zero.
   pure subroutine plane_stress(self, n, level, e, w, s, d, status)
      class(outside_law_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6)
      integer(i4), intent(inout) :: status(n)
      real(wp) :: begin(n, self%states), end(n, self%states)
      begin = 0
      end = 0
      call self%plane_stress_from(n, level, e, 0.0_wp, 0.0_wp, begin, w, s, d, end, status)
   end subroutine plane_stress

   !> See finshell_material.
   pure subroutine plane_stress_from(self, n, level, e, time, step, begin, w, s, d, end, status)
      class(outside_law_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3), time, step
      real(wp), intent(in) :: begin(n, self%states)
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6)
      real(wp), intent(inout) :: end(n, self%states)
      integer(i4), intent(inout) :: status(n)
      type(asked_t) :: at
      integer(i4) :: codes(n)
      real(wp) :: total(n)
      logical :: good(n)
      integer :: i, v

      codes = 0
      at = asked_t(n, level, time, step, self%data)
      select case (self%kind)
      case (kind_plane)
         call self%evaluate(at, self%parameters, e, w, s, d, begin, end, codes)
      case (kind_incompressible)
         call incompressible_plane(self%evaluate, at, self%parameters, self%states, n, e, w, s, d, begin, end, codes)
      case default
         call plane_of_solid(self%evaluate, at, self%parameters, self%states, self%contraction, n, e, w, s, d, begin, end, codes)
      end select
      ! zero, unless a number is not finite
      total = 0*w
      if (level >= level_force) then
         do v = 1, 3
            total = total + 0*s(:, v)
         end do
      end if
      if (level >= level_tangent) then
         do v = 1, 6
            total = total + 0*d(:, v)
         end do
      end if
      do v = 1, self%states
         total = total + 0*end(:, v)
      end do
      good = total <= 0 .and. codes == 0
      if (all(good)) return
      do i = 1, n
         if (good(i)) cycle
         status(i) = status_material_limit
         w(i) = 0
         if (level >= level_force) s(i, :) = 0
         if (level >= level_tangent) d(i, :) = 0
         end(i, :) = begin(i, :)
      end do
   end subroutine plane_stress_from

   !> See finshell_material. Laws with states have that of a step of no time from the state zero: what the element needs is a
   !> function of strain.
   pure subroutine thickness_stretch(self, n, level, e, l, dl, ddl, status)
      class(outside_law_t), intent(in) :: self
      integer, intent(in) :: n, level
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(inout) :: l(n), dl(n, 3), ddl(n, 6)
      integer(i4), intent(inout) :: status(n)
      type(asked_t) :: at
      integer(i4) :: codes(n)
      logical :: good
      integer :: i

      if (self%kind == kind_incompressible .or. (self%kind == kind_plane .and. .not. associated(self%stretch))) then
         call inverse_area_stretch(n, level, e, l, dl, ddl, status)
         return
      end if
      codes = 0
      at = asked_t(n, level, 0.0_wp, 0.0_wp, self%data)
      if (self%kind == kind_plane) then
         call self%stretch(at, self%parameters, e, l, dl, ddl, codes)
      else
         call solid_stretch(self%evaluate, at, self%parameters, self%states, self%contraction, n, e, l, dl, ddl, codes)
      end if
      do i = 1, n
         good = codes(i) == 0 .and. ieee_is_finite(l(i))
         if (good) good = l(i) > 0
         if (level >= level_force) good = good .and. all(ieee_is_finite(dl(i, :)))
         if (level >= level_tangent) good = good .and. all(ieee_is_finite(ddl(i, :)))
         if (good) cycle
         status(i) = status_material_limit
         l(i) = 1
         if (level >= level_force) dl(i, :) = 0
         if (level >= level_tangent) ddl(i, :) = 0
      end do
   end subroutine thickness_stretch

   pure function reference_tangent(self) result(d)
      class(outside_law_t), intent(in) :: self
      real(wp) :: d(6)
      d = self%reference
   end function reference_tangent

   !> Where a law in space begins to look for its thickness strain.
   pure subroutine find_contraction(law)
      type(outside_law_t), intent(inout) :: law
      real(wp) :: e(strip, 4), w(strip), s(strip, 4), d(strip, 10), begin(strip, law%states), end(strip, law%states)
      integer(i4) :: codes(strip)
      e = 0
      begin = 0
      end = 0
      d = 0
      codes = 0
      call law%evaluate(asked_t(strip, level_tangent, 0.0_wp, 0.0_wp, law%data), law%parameters, e, w, s, d, begin, end, codes)
      law%contraction = 0
      if (codes(1) /= 0 .or. .not. (ieee_is_finite(d(1, 3)) .and. ieee_is_finite(d(1, 6) + d(1, 8)))) return
      if (d(1, 3) > 0) law%contraction = max(-1.0_wp, min((d(1, 6) + d(1, 8))/(2*d(1, 3)), 2.0_wp))
   end subroutine find_contraction
end module finshell_outside_law
