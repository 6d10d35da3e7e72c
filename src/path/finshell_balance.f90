!> Energy balance of an increment: does what the loads and moved supports do on the way fit the energy that is stored?
!>
!> On a smooth path the change of the stored energy is the integral of load factor * (force . rate of displacement), of
!> reaction * (motion of the support), and of what growth stores where nothing moves. The trapezoidal rule over the increment
!> misses it by the third order of its length; with the tangents to the path at both ends (cubic Hermite polynomials of
!> factor, work and reaction over the length) by the fifth. What a snap dissipates is of lower order: no rule that knows the two
!> ends only can explain it.
module finshell_balance
   use finshell_kinds, only: wp, i1
   use finshell_freedoms, only: rx, rz, ux, uz
   use finshell_quaternion, only: quaternion_product, quaternion_conjugate, quaternion_to_rotation_vector
   use finshell_state, only: state_t
   use finshell_control, only: arc_norm
   use finshell_equations, only: field_pressure
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   implicit none
   private
   public :: balance_t, tangent_t, verdict_t, tangent_of, judge, judge_descent, work_along, hermite_correction

   !> Of an increment.
   type :: balance_t
      logical :: known = .false.
      real(wp) :: energy = 0 !< change of the stored energy
      real(wp) :: work = 0 !< of loads, growth and moved supports, trapezoidal rule
      real(wp), allocatable :: by_factor(:) !< its parts: of loads and growth by the factor that scales them (finshell_factor)
      real(wp) :: supports = 0 !< and of moved supports
      real(wp) :: least = 0 !< work with the smaller of the forces at both ends
      real(wp) :: level = 0 !< the stored energy
      real(wp) :: negligible = 0 !< beside what growth would have stored if all were held
      real(wp) :: throughput = 0 !< magnitude of the work, whether or not it cancels on the way
      real(wp) :: duality = 0 !< (change of the displacement that does work per factor) - (change of the reaction to the motion)
      real(wp), allocatable :: pressure(:), volume(:) !< changes in chambers; unallocated: there are none
   contains
      procedure :: spend
   end type balance_t

   !> The tangent to the path at one of its states.
   type :: tangent_t
      logical :: known = .false.
      real(wp), allocatable :: x(:) !< change of the unknowns per change of the factor
      real(wp) :: length = 0 !< of its displacements
      real(wp) :: sense = 1 !< of the factor along the path
      real(wp) :: stiffness = 0 !< derivative of -duality with respect to the factor
      real(wp) :: held = 0 !< the part of it that moved supports have when all else is held
      real(wp), allocatable :: pressure(:), volume(:) !< of chambers: derivatives with respect to the factor
   end type tangent_t

   !> What is thought of an increment.
   type :: verdict_t
      logical :: known = .false.
      logical :: snap = .false. !< it leads to a state that the path does not lead to, or over more than two states can tell
      real(wp) :: misfit = 0 !< (work - energy) over the larger of both, by the better of both rules
      real(wp) :: shortfall = 0 !< part of the change that both tangents say which a prescribed factor has not made
   end type verdict_t

   !> Limits, chosen by counts over examples/ (doc/path_following.md).
   real(wp), parameter :: largest_misfit = 0.1_wp, largest_shortfall = 0.5_wp
   real(wp), parameter :: seasoned_misfit = 0.05_wp, seasoned_shortfall = 0.4_wp !< load control, behind another increment
   real(wp), parameter :: noise = 1.0e-9_wp !< of the stored energy: what rounding and tolerances may do
   real(wp), parameter :: rigid = 1.0e-11_wp !< of the energy of supports moved against a held structure: a rigid motion
   real(wp), parameter :: largest_turn = 2.5_wp !< beyond this a relative rotation may be one of more than half a turn

contains

   !> Some of the work has gone into damping.
   pure subroutine spend(self, energy)
      class(balance_t), intent(inout) :: self
      real(wp), intent(in) :: energy
      self%work = self%work - energy
      self%least = self%least - energy
   end subroutine spend

   !> The tangent in scalars. `rate`, `held`, `compliance`, `inflow` (finshell_problem): derivative of the residual, stiffness of
   !> the motion of supports and what chambers do, where x was solved for.
   pure function tangent_of(x, rate, held, field, sense, compliance, inflow) result(tangent)
      real(wp), intent(in) :: x(:), rate(:), held
      integer(i1), intent(in) :: field(:)
      real(wp), intent(in) :: sense
      real(wp), intent(in), optional :: compliance(:), inflow(:)
      type(tangent_t) :: tangent
      tangent%x = x
      tangent%length = arc_norm(x, field, 0.0_wp, 0.0_wp)
      tangent%sense = sign(1.0_wp, sense)
      tangent%held = held
      tangent%stiffness = held - dot_product(rate, x)
      if (present(compliance) .and. present(inflow)) then
         tangent%pressure = pack(x, field == field_pressure)
         tangent%volume = inflow - compliance*tangent%pressure
         tangent%stiffness = tangent%stiffness + dot_product(pack(rate, field == field_pressure), tangent%pressure)
      end if
      tangent%known = tangent%length > 0 .and. ieee_is_finite(tangent%length) .and. ieee_is_finite(tangent%stiffness)
   end function tangent_of

   !> Is an increment the continuation of the path, as far as its two ends tell? Where the factor is prescribed it rises all the
   !> way on a smooth path; if both ends say that it rises much faster than it did, it has fallen between them: a jump over
   !> two limit points, which no balance sees where the two branches are one path. A first increment may be very long, and a path
   !> that is free to turn may be followed coarsely: there nothing is said where the two rules enclose the energy.
   pure function judge(balance, from, to, x, change, prescribed, seasoned, field) result(verdict)
      type(balance_t), intent(in) :: balance
      type(tangent_t), intent(in) :: from, to
      real(wp), intent(in) :: x(:) !< the increment
      real(wp), intent(in) :: change !< of the factor
      logical, intent(in) :: prescribed !< load control
      logical, intent(in) :: seasoned !< not the first increment
      integer(i1), intent(in) :: field(:)
      type(verdict_t) :: verdict
      real(wp) :: length, slower, plain, corrected, scale
      logical :: strict

      verdict%known = balance%known .and. from%known .and. to%known
      if (.not. verdict%known) return
      length = arc_norm(x, field, 0.0_wp, 0.0_wp)
      plain = balance%work - balance%energy
      corrected = plain + hermite_correction(from, to, length, change, balance%duality) &
                  + chamber_correction(from, to, length, balance)
      strict = prescribed .and. seasoned
      ! a cubic that goes farther than the larger of both forces does over the whole way excuses nothing
      if (strict .and. abs(corrected - plain) > balance%throughput) corrected = plain
      scale = max(abs(balance%work), abs(balance%energy), rigid*max(from%held, to%held)*change**2, balance%negligible)
      if (.not. strict) scale = max(scale, 0.5_wp*balance%throughput)
      verdict%known = length > 0 .and. scale > 0 .and. ieee_is_finite(corrected) .and. ieee_is_finite(scale)
      if (.not. verdict%known) return
      if (strict .or. (plain > 0 .eqv. corrected > 0)) verdict%misfit = sign(min(abs(plain), abs(corrected)), plain)
      if (abs(verdict%misfit) <= noise*balance%level) verdict%misfit = 0
      verdict%misfit = verdict%misfit/scale

      slower = sign(1.0_wp, change)*min(sign(1.0_wp, change)*from%sense*length/from%length, &
                                        sign(1.0_wp, change)*to%sense*length/to%length)
      if (prescribed .and. slower*change > 0) verdict%shortfall = max(0.0_wp, 1 - change/slower)
      verdict%snap = abs(verdict%misfit) > merge(seasoned_misfit, largest_misfit, strict) &
                     .or. verdict%shortfall > merge(seasoned_shortfall, largest_shortfall, strict)
   end function judge

   !> The same of the work of the pressures in chambers.
   pure function chamber_correction(from, to, length, balance) result(work)
      type(tangent_t), intent(in) :: from, to
      real(wp), intent(in) :: length
      type(balance_t), intent(in) :: balance
      real(wp) :: work
      real(wp) :: a, b
      work = 0
      if (.not. (allocated(balance%pressure) .and. allocated(from%pressure) .and. allocated(to%pressure))) return
      a = from%sense*length/from%length
      b = to%sense*length/to%length
      work = sum((a*from%pressure - b*to%pressure)*balance%volume - (a*from%volume - b*to%volume)*balance%pressure)/10 &
             - a*b*sum(from%pressure*to%volume - to%pressure*from%volume)/60
   end function chamber_correction

   !> Of a state found by a descent (finshell_descent), which goes along no path: what it has dissipated for certain, whatever the
   !> forces did between.
   pure function judge_descent(balance) result(verdict)
      type(balance_t), intent(in) :: balance
      type(verdict_t) :: verdict
      real(wp) :: scale
      scale = max(abs(balance%work), abs(balance%energy))
      verdict%known = balance%known .and. scale > 0 .and. ieee_is_finite(scale)
      if (.not. verdict%known) return
      verdict%misfit = max(0.0_wp, balance%least - balance%energy)/scale
      verdict%snap = verdict%misfit > seasoned_misfit
   end function judge_descent

   !> Work of nodal forces from one state to another: force times change of displacement, moment times relative rotation.
   !> `known` is false where a node under a moment turns too far to tell by how much.
   pure subroutine work_along(from, to, force, work, known)
      type(state_t), intent(in) :: from, to
      real(wp), intent(in) :: force(:, :) !< (n_nodal, nodes)
      real(wp), intent(out) :: work
      logical, intent(out) :: known
      real(wp) :: turn(3), largest
      integer :: i
      work = 0
      known = .true.
      do i = 1, size(force, 2)
         work = work + dot_product(force(ux:uz, i), to%displacement(:, i) - from%displacement(:, i))
      end do
      if (.not. any(abs(force(rx:rz, :)) > 0)) return
      largest = 0
      do i = 1, size(force, 2)
         turn = quaternion_to_rotation_vector(quaternion_product(to%rotation(:, i), quaternion_conjugate(from%rotation(:, i))))
         largest = max(largest, norm2(turn))
         work = work + dot_product(force(rx:rz, i), turn)
      end do
      known = largest < largest_turn
   end subroutine work_along

   !> What the tangents at both ends add to the trapezoidal rule.
   pure function hermite_correction(from, to, length, change, duality) result(work)
      type(tangent_t), intent(in) :: from, to
      real(wp), intent(in) :: length !< of the increment
      real(wp), intent(in) :: change !< of the factor
      real(wp), intent(in) :: duality
      real(wp) :: work
      real(wp) :: a, b
      a = from%sense*length/from%length
      b = to%sense*length/to%length
      work = ((a - b)*duality + change*(from%stiffness*a - to%stiffness*b))/10 - a*b*(from%stiffness - to%stiffness)/60
   end function hermite_correction
end module finshell_balance
