!> From a law in space to plane stress.
!>
!> The law is a function of E11, E22, E33 and 2 E12; of the shear through the thickness there is none, which makes no stress where
!> the plane is one of symmetry of the material. Stress T = dW/dE and tangent A have four and ten components: (11, 22, 33, 12), and
!> A as (11, 22, 33, 44, 12, 13, 14, 23, 24, 34) of these. E33 = g(E11, E22, 2 E12) is eliminated:
!> an incompressible material has C33 = 1/det C, all others T33 = 0 (a local Newton iteration, in the logarithm of C33).
module finshell_condensation
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use, intrinsic :: iso_c_binding, only: c_ptr
   use finshell_evaluation, only: level_force, level_tangent
   use finshell_incompressible, only: metric_limit, shape_limit
   use finshell_kinds, only: wp, i4
   use finshell_status, only: status_material_limit
   implicit none
   private
   public :: asked_t, evaluate_interface, incompressible_plane, plane_of_solid, solid_stretch

   !> finshell_points of finshell.h: what a law is asked.
   type, bind(c) :: asked_t
      integer(i4) :: n !< points, a multiple of `strip`
      integer(i4) :: level !< finshell_evaluation
      real(wp) :: time !< at the end of the step
      real(wp) :: step !< of time
      type(c_ptr) :: data
   end type asked_t

   abstract interface
      !> A law from outside, in the plane or in space. Arrays (n, components), those of states (n, states).
      pure subroutine evaluate_interface(at, parameters, strain, energy, stress, tangent, begin, end, codes) bind(c)
         import :: asked_t, i4, wp
         type(asked_t), intent(in) :: at
         real(wp), intent(in) :: parameters(*), strain(*)
         real(wp), intent(inout) :: energy(*), stress(*), tangent(*)
         real(wp), intent(in) :: begin(*)
         real(wp), intent(inout) :: end(*)
         integer(i4), intent(inout) :: codes(*) !< zero on entry
      end subroutine evaluate_interface
   end interface

   integer, parameter :: three(3) = [1, 2, 4] !< places of 11, 22, 12 among the four
   integer, parameter :: with_33(3) = [6, 8, 10] !< A13, A23, A43
   integer, parameter :: plane(6) = [1, 2, 4, 5, 7, 9] !< A of the plane
   integer, parameter :: row(6) = [1, 2, 3, 1, 1, 2], column(6) = [1, 2, 3, 2, 3, 3]

   integer, parameter :: most_iterations = 60
   real(wp), parameter :: longest = 0.5_wp !< change of ln C33 in an iteration
   real(wp), parameter :: precise = 1.0e4_wp*epsilon(1.0_wp) !< the next one would be its square

contains

   !> Plane stress of an incompressible law in space.
   pure subroutine incompressible_plane(evaluate, asked, parameters, states, n, e, w, s, d, begin, end, codes)
      procedure(evaluate_interface) :: evaluate
      type(asked_t), intent(in) :: asked
      integer, intent(in) :: states, n
      real(wp), intent(in) :: parameters(:), e(n, 3), begin(n, states)
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6), end(n, states)
      integer(i4), intent(inout) :: codes(n)
      real(wp) :: x(n, 4), t(n, 4), a(n, 10), g(n, 3), h(n, 6), det(n), c
      logical :: good(n)
      integer :: i, k

      call admit(n, e, x, det, good)
      do i = 1, n
         ! (1/det C - 1)/2 without loss of digits
         x(i, 3) = -(x(i, 1) + x(i, 2) + 2*x(i, 1)*x(i, 2) - 0.5_wp*x(i, 4)**2)/det(i)
         c = 1/det(i)
         h(i, 1) = 1 + 2*x(i, 2) ! the adjugate of C, for a moment
         h(i, 2) = 1 + 2*x(i, 1)
         h(i, 3) = -x(i, 4)
         g(i, :) = -c*c*h(i, 1:3)
         h(i, 4:6) = 4*c**3*[h(i, 1)*h(i, 2), h(i, 1)*h(i, 3), h(i, 2)*h(i, 3)]
         h(i, 1:3) = 4*c**3*h(i, 1:3)**2
         h(i, 4) = h(i, 4) - 2*c*c
         h(i, 3) = h(i, 3) + c*c
      end do
      call evaluate(asked, parameters, x, w, t, a, begin, end, codes)
      where (.not. good) codes = status_material_limit
      if (asked%level < level_force) return
      do k = 1, 3
         s(:, k) = t(:, three(k)) + t(:, 3)*g(:, k)
      end do
      if (asked%level < level_tangent) return
      do k = 1, 6
         d(:, k) = a(:, plane(k)) + a(:, with_33(row(k)))*g(:, column(k)) + a(:, with_33(column(k)))*g(:, row(k)) &
            + a(:, 3)*g(:, row(k))*g(:, column(k)) + t(:, 3)*h(:, k)
      end do
   end subroutine incompressible_plane

   !> Plane stress of a law in space that can change its volume.
   pure subroutine plane_of_solid(evaluate, asked, parameters, states, contraction, n, e, w, s, d, begin, end, codes)
      procedure(evaluate_interface) :: evaluate
      type(asked_t), intent(in) :: asked
      integer, intent(in) :: states, n
      real(wp), intent(in) :: contraction !< of the thickness at rest, over the strain of the area
      real(wp), intent(in) :: parameters(:), e(n, 3), begin(n, states)
      real(wp), intent(inout) :: w(n), s(n, 3), d(n, 6), end(n, states)
      integer(i4), intent(inout) :: codes(n)
      real(wp) :: x(n, 4), t(n, 4), a(n, 10), log_c(n), det(n)
      logical :: good(n)
      integer :: k

      call admit(n, e, x, det, good)
      log_c = -contraction*log(det)
      call relax(evaluate, asked, parameters, states, n, x, log_c, w, t, a, begin, end, codes)
      where (.not. good) codes = status_material_limit
      if (asked%level < level_force) return
      ! what is left of T33 is taken away to first order
      do k = 1, 3
         s(:, k) = t(:, three(k)) - t(:, 3)*a(:, with_33(k))/a(:, 3)
      end do
      if (asked%level < level_tangent) return
      do k = 1, 6
         d(:, k) = a(:, plane(k)) - a(:, with_33(row(k)))*a(:, with_33(column(k)))/a(:, 3)
      end do
   end subroutine plane_of_solid

   !> Thickness stretch sqrt(1 + 2 g) of such a law. Its second derivatives would be third ones of W: differences of the first.
   pure subroutine solid_stretch(evaluate, asked, parameters, states, contraction, n, e, l, dl, ddl, codes)
      procedure(evaluate_interface) :: evaluate
      type(asked_t), intent(in) :: asked
      integer, intent(in) :: states, n
      real(wp), intent(in) :: contraction, parameters(:), e(n, 3)
      real(wp), intent(inout) :: l(n), dl(n, 3), ddl(n, 6)
      integer(i4), intent(inout) :: codes(n)
      real(wp) :: change(n, 3, 3), log_c(n), moved_log(n), moved(n, 3), value(n), slope(n, 3), det(n), x(n, 4), h
      logical :: good(n)
      integer :: j, k, side

      call admit(n, e, x, det, good)
      log_c = -contraction*log(det)
      call stretch(e, log_c, l, dl)
      if (asked%level < level_tangent) return
      h = epsilon(1.0_wp)**(1.0_wp/3)
      change = 0
      do j = 1, 3
         do side = -1, 1, 2
            moved = e
            moved(:, j) = e(:, j) + side*h
            moved_log = log_c
            call stretch(moved, moved_log, value, slope)
            change(:, :, j) = change(:, :, j) + side*slope/(2*h)
         end do
      end do
      do k = 1, 6
         ddl(:, k) = 0.5_wp*(change(:, row(k), column(k)) + change(:, column(k), row(k)))
      end do

   contains

      pure subroutine stretch(strain, log_c, value, slope)
         real(wp), intent(in) :: strain(n, 3)
         real(wp), intent(inout) :: log_c(n)
         real(wp), intent(inout) :: value(n), slope(n, 3)
         real(wp) :: y(n, 4), w(n), t(n, 4), a(n, 10), begin(n, states), end(n, states), determinant(n)
         integer(i4) :: found(n)
         logical :: fine(n)
         integer :: v
         begin = 0
         end = 0
         call admit(n, strain, y, determinant, fine)
         found = 0
         call relax(evaluate, asked, parameters, states, n, y, log_c, w, t, a, begin, end, found)
         value = exp(0.5_wp*log_c)
         do v = 1, 3
            slope(:, v) = -a(:, with_33(v))/(a(:, 3)*value)
         end do
      end subroutine stretch
   end subroutine solid_stretch

   !> Find ln C33 of each point, so that T33 = 0. A point that is found stays, whatever the others need.
   pure subroutine relax(evaluate, asked, parameters, states, n, x, log_c, w, t, a, begin, end, codes)
      procedure(evaluate_interface) :: evaluate
      type(asked_t), intent(in) :: asked
      integer, intent(in) :: states, n
      real(wp), intent(in) :: parameters(:), begin(n, states)
      real(wp), intent(inout) :: x(n, 4) !< E33 is set
      real(wp), intent(inout) :: log_c(n) !< a guess, then the root
      real(wp), intent(inout) :: w(n), t(n, 4), a(n, 10), end(n, states)
      integer(i4), intent(inout) :: codes(n)
      type(asked_t) :: at
      real(wp) :: change(n), c, first, second
      logical :: found(n)
      integer :: i, iteration

      at = asked
      at%level = level_tangent
      t = 0
      a = 0
      change = 0
      found = .false.
      do iteration = 1, most_iterations
         do i = 1, n
            x(i, 3) = 0.5_wp*(exp(log_c(i)) - 1)
         end do
         codes = 0
         call evaluate(at, parameters, x, w, t, a, begin, end, codes)
         do i = 1, n
            if (found(i)) cycle
            if (codes(i) /= 0 .or. .not. (ieee_is_finite(t(i, 3)) .and. ieee_is_finite(a(i, 3)))) then
               ! too far: half of the way back; where there was no way, the law cannot be asked
               change(i) = 0.5_wp*change(i)
               log_c(i) = log_c(i) - change(i)
               found(i) = abs(change(i)) < precise
               if (found(i)) codes(i) = status_material_limit
               cycle
            end if
            c = 1 + 2*x(i, 3)
            first = 0.5_wp*t(i, 3)*c
            second = 0.25_wp*a(i, 3)*c**2
            if (second + first > 0.1_wp*second) second = second + first
            if (.not. second > 0) second = max(abs(first), tiny(1.0_wp))
            if (abs(first) <= precise*second) then
               found(i) = .true.
            else
               change(i) = -sign(min(abs(first/second), longest), first)
               log_c(i) = log_c(i) + change(i)
            end if
         end do
         if (all(found)) exit
      end do
      where (.not. found) codes = status_material_limit
      do i = 1, n
         if (ieee_is_finite(a(i, 3))) then
            if (a(i, 3) > 0) cycle
         end if
         codes(i) = status_material_limit
         a(i, 3) = 1
      end do
   end subroutine relax

   !> Strains in space, where they are admissible; a point that is not is evaluated like one at rest, so that nothing overflows.
   pure subroutine admit(n, e, x, det, good)
      integer, intent(in) :: n
      real(wp), intent(in) :: e(n, 3)
      real(wp), intent(out) :: x(n, 4), det(n)
      logical, intent(out) :: good(n)
      real(wp) :: trace
      integer :: i
      do i = 1, n
         trace = 2 + 2*(e(i, 1) + e(i, 2))
         det(i) = (1 + 2*e(i, 1))*(1 + 2*e(i, 2)) - e(i, 3)**2
         good(i) = det(i)*shape_limit > trace**2 .and. trace > 0 .and. max(det(i), trace) < metric_limit
         det(i) = merge(det(i), 1.0_wp, good(i))
         x(i, 1) = merge(e(i, 1), 0.0_wp, good(i))
         x(i, 2) = merge(e(i, 2), 0.0_wp, good(i))
         x(i, 3) = 0
         x(i, 4) = merge(e(i, 3), 0.0_wp, good(i))
      end do
   end subroutine admit
end module finshell_condensation
