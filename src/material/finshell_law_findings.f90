!> What every law must keep, looked at from outside: derivatives against differences, symmetry, objectivity, the limit of small
!> strains, refusal of what cannot be. For laws from outside (finshell_outside_law) and for our own alike.
!>
!> Laws with states are looked at in a step of no time from the state zero.
module finshell_law_findings
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_quiet_nan, ieee_value
   use finshell_evaluation, only: level_energy, level_force, level_tangent
   use finshell_kinds, only: wp, i4, strip
   use finshell_material, only: material_t
   implicit none
   private
   public :: finding_t, check_law, n_findings

   !> One thing that was looked at.
   type :: finding_t
      character(len=24) :: name = ''
      character(len=112) :: meaning = ''
      real(wp) :: found = 0, allowed = 0
      logical :: passed = .false.
   end type finding_t

   integer, parameter :: n_findings = 12
   integer, parameter :: points = 6*strip
   real(wp), parameter :: widths(2) = [0.02_wp, 0.15_wp] !< of the strains that are tried
   real(wp), parameter :: step = 1.0e-3_wp !< of differences of fourth order: errors of about 1e-11
   integer, parameter :: row(6) = [1, 2, 3, 1, 1, 2], column(6) = [1, 2, 3, 2, 3, 3]

   type :: answer_t
      real(wp) :: w(points), s(points, 3), d(points, 6), l(points), dl(points, 3), ddl(points, 6)
      integer(i4) :: status(points) = 0, stretch_status(points) = 0
   end type answer_t

contains

   !> All findings about a law; stresses in parts of its stiffness at rest. Strains that cannot be are among those tried: no
   !> exception may halt.
   subroutine check_law(law, list)
      class(material_t), intent(in) :: law
      type(finding_t), intent(out) :: list(n_findings)
      type(answer_t) :: r, other
      real(wp) :: e(points, 3), scale, d0(6), change(7), turned_error, small, order, unset, kept
      integer :: a, i, used

      d0 = law%reference_tangent()
      scale = maxval(d0(1:3))
      e = 0
      call ask(law, level_tangent, e, r)
      list(1) = finding('rest', 'stress and energy without strain, and what the thickness stretch is beside 1', &
                        (maxval(abs(r%s)) + maxval(abs(r%w)))/scale + maxval(abs(r%l - 1)), 1.0e-12_wp)
      list(2) = finding('stiffness', 'tangent without strain against that at rest; it is positive definite', &
                        maxval(abs(r%d(1, :) - d0))/scale + merge(0.0_wp, 1.0_wp, definite(d0)), merge(1.0e-10_wp, huge(1.0_wp), &
                        .not. law%switched))
      change = 0
      turned_error = 0
      used = 0
      do a = 1, size(widths)
         e = strains(widths(a))
         call ask(law, level_tangent, e, r)
         used = used + count(r%status == 0)
         call differences(law, e, r, max(scale, maxval(abs(r%d))), change)
         if (law%isotropic) turned_error = max(turned_error, rotation_error(law, e, r, max(scale, maxval(abs(r%d)))))
      end do
      list(3) = finding('reach', 'part of moderate strains (0.15) that the law refuses', 1 - real(used, wp)/(size(widths)*points), &
                        0.5_wp)
      list(4) = finding('stress', 'stress against the derivative of the energy', change(1), 1.0e-6_wp)
      list(5) = finding('tangent', 'tangent against the derivative of the stress', change(2), 1.0e-6_wp)
      list(6) = finding('symmetry', 'derivative of the stress against its transpose', change(3), 1.0e-6_wp)
      list(7) = finding('stretch', 'derivatives of the thickness stretch', max(change(4), change(5)), 1.0e-6_wp)
      list(8) = finding('rotation', 'isotropic laws: energy and stress in turned axes', turned_error, 1.0e-9_wp)

      small = 1.0e-9_wp
      e = strains(small)
      call ask(law, level_tangent, e, r)
      order = 0
      do i = 1, points
         order = max(order, maxval(abs(r%s(i, :) - times(r%d(i, :), e(i, :))))/(scale*small))
         if (.not. law%switched) order = max(order, maxval(abs(r%s(i, :) - times(d0, e(i, :))))/(scale*small))
      end do
      list(9) = finding('small strains', 'stress of strains of 1e-9 against stiffness times strain', order, 1.0e-5_wp)

      ! the same numbers at each level, in each place, and again; nothing left as it was
      e = strains(widths(2))
      call ask(law, level_tangent, e, r)
      unset = 0
      call ask(law, level_force, e, other)
      unset = unset + difference(r, other, level_force, scale)
      call ask(law, level_energy, e, other)
      unset = unset + difference(r, other, level_energy, scale)
      list(10) = finding('levels', 'energy and stress asked for without derivatives against those with them', unset, 1.0e-12_wp)
      call ask(law, level_tangent, e(points:1:-1, :), other)
      kept = difference(r, reversed(other), level_tangent, scale)
      list(11) = finding('points', 'the same points in another order', kept, 0.0_wp)
      list(12) = finding('refusal', 'number of impossible strains and NaN that were not refused', refused_not(law), 0.0_wp)
   end subroutine check_law

   pure function finding(name, meaning, found, allowed) result(f)
      character(len=*), intent(in) :: name, meaning
      real(wp), intent(in) :: found, allowed
      type(finding_t) :: f
      f = finding_t(name, meaning, found, allowed, .false.)
      if (ieee_is_finite(found)) f%passed = found <= allowed
   end function finding

   !> Ask for everything at points; what the law does not set is left NaN.
   subroutine ask(law, level, e, r)
      class(material_t), intent(in) :: law
      integer, intent(in) :: level
      real(wp), intent(in) :: e(points, 3)
      type(answer_t), intent(out) :: r
      real(wp) :: nothing
      nothing = ieee_value(0.0_wp, ieee_quiet_nan)
      r%w = nothing
      r%s = nothing
      r%d = nothing
      r%l = nothing
      r%dl = nothing
      r%ddl = nothing
      call law%plane_stress(points, level, e, r%w, r%s, r%d, r%status)
      call law%thickness_stretch(points, level, e, r%l, r%dl, r%ddl, r%stretch_status)
   end subroutine ask

   !> The greatest differences so far: energy and stress, stress and tangent, symmetry, stretch and its two derivatives.
   subroutine differences(law, e, r, scale, greatest)
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: e(points, 3), scale
      type(answer_t), intent(in) :: r
      real(wp), intent(inout) :: greatest(7)
      type(answer_t) :: moved
      real(wp), parameter :: weight(-2:2) = [1.0_wp, -8.0_wp, 0.0_wp, 8.0_wp, -1.0_wp]/12
      real(wp) :: shifted(points, 3), dw(points, 3), ds(points, 3, 3), dl(points, 3), ddl(points, 3, 3)
      logical :: good(points), fine(points)
      integer :: i, j, k
      good = r%status == 0
      fine = good .and. r%stretch_status == 0
      dw = 0
      ds = 0
      dl = 0
      ddl = 0
      do j = 1, 3
         do k = -2, 2
            if (k == 0) cycle
            shifted = e
            shifted(:, j) = e(:, j) + k*step
            call ask(law, level_tangent, shifted, moved)
            good = good .and. moved%status == 0
            fine = fine .and. moved%status == 0 .and. moved%stretch_status == 0
            do i = 1, points
               ! at a switch there is no derivative
               if (good(i) .and. law%switched) &
                  good(i) = maxval(abs(moved%d(i, :) - r%d(i, :))) <= 0.2_wp*maxval(abs(r%d(i, :)))
            end do
            dw(:, j) = dw(:, j) + weight(k)/step*moved%w
            ds(:, :, j) = ds(:, :, j) + weight(k)/step*moved%s
            dl(:, j) = dl(:, j) + weight(k)/step*moved%l
            ddl(:, :, j) = ddl(:, :, j) + weight(k)/step*moved%dl
         end do
      end do
      do i = 1, points
         if (good(i)) then
            call note(greatest(1), maxval(abs(dw(i, :) - r%s(i, :)))/scale)
            do k = 1, 6
               call note(greatest(2), abs(ds(i, row(k), column(k)) - r%d(i, k))/scale)
               call note(greatest(2), abs(ds(i, column(k), row(k)) - r%d(i, k))/scale)
               call note(greatest(3), abs(ds(i, row(k), column(k)) - ds(i, column(k), row(k)))/scale)
            end do
         end if
         if (.not. fine(i)) cycle
         call note(greatest(4), maxval(abs(dl(i, :) - r%dl(i, :))))
         do k = 1, 6
            call note(greatest(5), abs(ddl(i, row(k), column(k)) - r%ddl(i, k)))
         end do
      end do
   end subroutine differences

   !> The greater one, NaN once and for all.
   pure subroutine note(greatest, value)
      real(wp), intent(inout) :: greatest
      real(wp), intent(in) :: value
      if (.not. ieee_is_finite(value)) then
         greatest = value
      else if (ieee_is_finite(greatest)) then
         greatest = max(greatest, value)
      end if
   end subroutine note

   !> Energy and stress of turned strains against the turned ones.
   real(wp) function rotation_error(law, e, r, scale) result(error)
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: e(points, 3), scale
      type(answer_t), intent(in) :: r
      type(answer_t) :: t
      real(wp) :: x(points, 3), s(3), c, n, a
      integer :: i
      a = 0.7_wp
      c = cos(a)
      n = sin(a)
      x(:, 1) = c*c*e(:, 1) + n*n*e(:, 2) + c*n*e(:, 3)
      x(:, 2) = n*n*e(:, 1) + c*c*e(:, 2) - c*n*e(:, 3)
      x(:, 3) = 2*c*n*(e(:, 2) - e(:, 1)) + (c*c - n*n)*e(:, 3)
      call ask(law, level_force, x, t)
      error = 0
      do i = 1, points
         if (r%status(i) /= 0 .or. t%status(i) /= 0) cycle
         s(1) = c*c*r%s(i, 1) + n*n*r%s(i, 2) + 2*c*n*r%s(i, 3)
         s(2) = n*n*r%s(i, 1) + c*c*r%s(i, 2) - 2*c*n*r%s(i, 3)
         s(3) = c*n*(r%s(i, 2) - r%s(i, 1)) + (c*c - n*n)*r%s(i, 3)
         call note(error, (maxval(abs(s - t%s(i, :))) + abs(t%w(i) - r%w(i)))/scale)
      end do
   end function rotation_error

   !> Greatest difference of two answers, up to a level.
   pure real(wp) function difference(a, b, level, scale) result(most)
      type(answer_t), intent(in) :: a, b
      integer, intent(in) :: level
      real(wp), intent(in) :: scale
      integer :: i
      most = real(count(a%status /= b%status), wp)
      do i = 1, points
         if (a%status(i) /= 0 .or. b%status(i) /= 0) cycle
         call note(most, abs(a%w(i) - b%w(i))/scale)
         if (level >= level_force) call note(most, maxval(abs(a%s(i, :) - b%s(i, :)))/scale)
         if (level >= level_tangent) call note(most, maxval(abs(a%d(i, :) - b%d(i, :)))/scale)
         if (a%stretch_status(i) == 0 .and. b%stretch_status(i) == 0) call note(most, abs(a%l(i) - b%l(i)))
      end do
   end function difference

   pure function reversed(a) result(b)
      type(answer_t), intent(in) :: a
      type(answer_t) :: b
      b = a
      b%w = a%w(points:1:-1)
      b%s = a%s(points:1:-1, :)
      b%d = a%d(points:1:-1, :)
      b%l = a%l(points:1:-1)
      b%status = a%status(points:1:-1)
      b%stretch_status = a%stretch_status(points:1:-1)
   end function reversed

   !> Strains of which the area is gone or turned inside out, and NaN: none may pass.
   real(wp) function refused_not(law)
      class(material_t), intent(in) :: law
      type(answer_t) :: r
      real(wp) :: e(points, 3)
      e = 0
      e(1, :) = ieee_value(0.0_wp, ieee_quiet_nan)
      e(2, 3) = ieee_value(0.0_wp, ieee_quiet_nan)
      if (.not. law%linear) then
         e(3, 1) = -0.5_wp
         e(4, 1:2) = -2
         e(5, 3) = 1.5_wp
         e(6, 1) = -1
      end if
      call ask(law, level_tangent, e, r)
      refused_not = real(count(unrefused(r, 1, merge(2, 6, law%linear))), wp)
      ! one bad point does not spoil the others
      refused_not = refused_not + real(count(r%status(7:) /= 0), wp)
   end function refused_not

   !> Points without a code; NaN without one counts as refused, because elements are.
   pure function unrefused(r, first, last) result(which)
      type(answer_t), intent(in) :: r
      integer, intent(in) :: first, last
      logical :: which(last - first + 1)
      integer :: i
      do i = first, last
         which(i - first + 1) = r%status(i) == 0 .and. ieee_is_finite(r%w(i)) .and. all(ieee_is_finite(r%s(i, :)))
      end do
   end function unrefused

   pure logical function definite(d)
      real(wp), intent(in) :: d(6)
      definite = d(1) > 0 .and. d(1)*d(2) > d(4)**2 .and. d(3)*(d(1)*d(2) - d(4)**2) &
                 - d(5)*(d(5)*d(2) - d(4)*d(6)) + d(6)*(d(5)*d(4) - d(1)*d(6)) > 0
   end function definite

   !> The packed symmetric matrix times a vector.
   pure function times(d, v) result(u)
      real(wp), intent(in) :: d(6), v(3)
      real(wp) :: u(3)
      u(1) = d(1)*v(1) + d(4)*v(2) + d(5)*v(3)
      u(2) = d(4)*v(1) + d(2)*v(2) + d(6)*v(3)
      u(3) = d(5)*v(1) + d(6)*v(2) + d(3)*v(3)
   end function times

   !> Strains all around, of equal and almost equal stretches, and uniaxial ones too.
   pure function strains(width) result(e)
      real(wp), intent(in) :: width
      real(wp) :: e(points, 3)
      integer :: i
      do i = 1, points
         e(i, :) = width*[sin(1.3_wp*i), cos(0.7_wp*i + 0.4_wp), sin(2.1_wp*i + 1.0_wp)]
         select case (modulo(i, 12))
         case (0); e(i, 2:3) = [e(i, 1), 0.0_wp]
         case (1); e(i, 2:3) = [e(i, 1)*(1 + 1.0e-12_wp), 1.0e-13_wp*e(i, 1)]
         case (2); e(i, 2:3) = 0
         end select
      end do
   end function strains
end module finshell_law_findings
