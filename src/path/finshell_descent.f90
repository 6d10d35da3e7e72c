!> Descent to a stable equilibrium state under a given load, from any state: what an increment falls back on where Newton's method
!> fails, because the tangent says little about what comes (a flat sheet, which has no stiffness against pressure until it
!> stretches) or is indefinite (a sheet that wrinkles).
!>
!> A trust region by inertia: the matrix K + a M, M a lumped mass, takes the place of K. The number a is large enough for the
!> matrix to be positive definite, so that each correction goes down in energy, and for no node to turn or move too far; it falls
!> as long as K predicts the forces, and at the end it is zero: the last iterations are Newton's, and equilibrium is that of the
!> problem itself. Until then the symmetric part of K stands in for an unsymmetric one (pressure on a free edge). How far to go is
!> judged by the work of the residual along the correction, which no energy need exist for.
!>
!> It costs one to two hundred linear solves from a flat sheet to one with all its wrinkles, whatever the size of the increment,
!> where Newton's method takes five in a tame one: it is no replacement.
module finshell_descent
   use finshell_kinds, only: wp, i4
   use finshell_status, only: status_not_converged, status_singular_matrix
   use finshell_error, only: error_t, text_of
   use finshell_equations, only: field_displacement
   use finshell_factor, only: factor_at, by_load_factor
   use finshell_problem, only: problem_t
   use finshell_state, only: state_t
   use finshell_step, only: convergence_t
   use finshell_convergence, only: residual_ratio, correction_ratio
   use finshell_control, only: arc_norm
   use finshell_newton, only: loosest_misfit, newton_result_t
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   implicit none
   private
   public :: descend, most_iterations

   !> A correction as far as it is known before it is made.
   type :: course_t
      real(wp), allocatable :: x(:) !< solution of the linear system
      integer :: scaling = by_load_factor !< the factor that changes (finshell_factor)
      real(wp) :: change = 0 !< of it
      real(wp) :: work = 0 !< of the residual along x
      real(wp) :: inertia = 0 !< x M x
      real(wp) :: stride = 0 !< the larger of the largest rotation and the largest displacement over the size of the structure
      real(wp) :: part = 1 !< of x that is made
      real(wp) :: damping = 0 !< with which x was found
      logical :: cut = .false. !< the part is less than was intended
      logical :: unstable = .false. !< the matrix was indefinite somewhere on the way
      integer :: climbs = 0 !< times that a had to be raised for the matrix to become positive definite
   end type course_t

   integer, parameter :: patience = 12 !< iterations, times those allowed to Newton's method
   !> Iterations times unknowns that a descent may cost, once it has had `least_patience` times those of Newton's method: on
   !> large meshes it would go on for hours. Most that end take less than 100 iterations.
   real(wp), parameter :: effort = 3.0e7_wp
   integer, parameter :: least_patience = 2
   real(wp), parameter :: longest_stride = 0.4_wp !< where the step has no rotation limit
   real(wp), parameter :: tolerated = 1.5_wp !< a stride that is longer by this is shortened along the line, not by a larger a
   real(wp), parameter :: climb = 4.0_wp !< ratio by which a rises where the matrix is indefinite
   real(wp), parameter :: fall = 0.1_wp, slow_fall = 0.5_wp !< ratios by which it falls; slow after it had to rise
   !> The work of the residual after the correction, relative to that before: below the first the correction went too far; nearer
   !> than the second to what K predicts, a falls; farther than the third, it rises.
   real(wp), parameter :: too_far = -0.5_wp, as_predicted = 0.25_wp, surprise = 0.5_wp
   real(wp), parameter :: negligible = 1.0e-3_wp !< a relative to the curvature of the energy along the correction
   real(wp), parameter :: lent = 1.0e-3_wp !< part of the stand-in that `lean` has in the matrix
   real(wp), parameter :: closer = 1.0e-3_wp !< part of the tolerance of the residual that it asks for
   real(wp), parameter :: steeply = 0.02_wp !< fall of the residual in an iteration while it goes on
   !> The first a where the matrix is singular makes this part of the largest force of a displacement of the size of the structure.
   real(wp), parameter :: least_inertia = 1.0e-12_wp
   real(wp), parameter :: shortest = 1.0e-8_wp !< stride; below it there is a wall

contains

   !> Go down from the present state of the problem to equilibrium at the load factor `target`. On success the state is the new
   !> equilibrium; on failure it is anything. result%regularised counts the iterations that were not plain Newton.
   subroutine descend(problem, target, settings, mean_levels, reach, result, scaling)
      class(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: target
      type(convergence_t), intent(in) :: settings
      real(wp), intent(in) :: mean_levels(2) !< as for solve_increment
      real(wp), intent(in) :: reach !< norm of the increment (arc_norm) beyond which the descent is given up
      type(newton_result_t), intent(out) :: result
      integer, intent(in), optional :: scaling !< the factor that changes, by default by_load_factor
      problem%condensed = .true.
      call go_down(problem, target, settings, mean_levels, reach, result, scaling)
      problem%condensed = .false.
   end subroutine descend

   subroutine go_down(problem, target, settings, mean_levels, reach, result, scaling)
      class(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: target
      type(convergence_t), intent(in) :: settings
      real(wp), intent(in) :: mean_levels(2)
      real(wp), intent(in) :: reach
      type(newton_result_t), intent(out) :: result
      integer, intent(in), optional :: scaling
      type(error_t), allocatable :: error
      type(course_t) :: course
      real(wp), allocatable :: increment(:)
      real(wp) :: a, falls, after, limit, curvature, agreement
      logical :: ok

      limit = settings%rotation_limit
      if (.not. limit > 0) limit = longest_stride
      allocate (increment(problem%n))
      if (present(scaling)) course%scaling = scaling
      if (problem%limp .and. .not. problem%crumples) then
         call lean(problem, target, settings, mean_levels, course%scaling, result)
         if (result%converged) return
      end if
      a = 0
      falls = fall
      call problem%evaluate(.true., error, scaling=scaling)
      if (allocated(error)) then
         call give_up(error%code, error%message)
         return
      end if
      do
         call find_course(problem, target, limit, most_iterations(problem%n, settings%maximum_iterations), a, course, result, ok)
         if (.not. abs(result%first_change) > 0) result%first_change = course%change
         if (ok) call follow(problem, course, after, result, ok)
         if (.not. ok) then
            return
         end if
         call problem%increment(increment)
         result%correction = correction_ratio(course%part*course%x, increment, problem%field, problem%size, problem%detail)
         result%residual = residual_ratio(problem%residual, problem%field, [problem%force_level, problem%moment_level], &
                                          mean_levels, problem%size, problem%detail)
         call problem%tell('descent', result%iterations, mean_levels, course%scaling, result%correction, course%stride, course%part)
         if (a > 0 .or. course%part < 1) then
            result%regularised = result%regularised + 1
         else if (result%residual <= settings%residual .and. result%correction <= settings%correction &
                  .and. problem%misfit <= loosest_misfit) then
            result%converged = .true.
            return
         end if
         if (arc_norm(increment, problem%field, 0.0_wp, 0.0_wp) > reach) then
            call give_up(status_not_converged, &
               'there is no equilibrium state near: at this load a descent leads far away, as a snap does')
            return
         end if

         ! As work = x (K + a M) x, there should remain of it the inertia and what the part leaves over.
         curvature = course%work/course%inertia
         agreement = 0
         if (course%work > 0) agreement = (after - course%part*a*course%inertia - (1 - course%part)*course%work)/course%work
         if (course%cut) then
            falls = slow_fall
            a = max(a, curvature - a)*min(climb, 1/course%part)
         else if (abs(agreement) < as_predicted) then
            if (course%climbs > 0) falls = slow_fall
            a = falls*a
            falls = max(fall, 0.5_wp*falls)
         else if (abs(agreement) > surprise) then
            a = 2*a
         end if
         if (a < negligible*(curvature - course%damping)) a = 0
      end do

   contains

      subroutine give_up(code, reason)
         integer(i4), intent(in) :: code
         character(len=*), intent(in) :: reason
         result%code = code
         result%reason = reason
      end subroutine give_up
   end subroutine go_down

   !> Iterations that a descent may take: bounded by their number, and on large meshes by the work.
   pure integer function most_iterations(unknowns, of_newton) result(most)
      integer, intent(in) :: unknowns, of_newton
      most = min(patience*of_newton, max(least_patience*of_newton, int(min(effort/max(unknowns, 1), 1.0e6_wp))))
   end function most_iterations

   !> Newton's iteration with a small part of the stand-in in the matrix, and exact forces, as long as it converges fast.
   !>
   !> A sheet that wrinkles and is pulled along one direction has next to no stiffness across while it is narrower than its
   !> natural width, and is in equilibrium at the kink where it becomes taut: there the tangent sends a correction far over to the
   !> other side. With the stand-in it stays near. As next to nothing acts on the width, the residual is small on both sides, and
   !> it is asked to be much smaller than elsewhere. Where it does not fall fast the descent goes on from the best state.
   subroutine lean(problem, target, settings, mean_levels, scaling, result)
      class(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: target, mean_levels(2)
      type(convergence_t), intent(in) :: settings
      integer, intent(in) :: scaling
      type(newton_result_t), intent(inout) :: result
      type(error_t), allocatable :: error
      type(state_t) :: best
      real(wp), allocatable :: x(:), increment(:)
      real(wp) :: change, before
      logical :: fast
      best = problem%state
      before = huge(before)
      fast = .true.
      allocate (x(problem%n), increment(problem%n))
      call problem%evaluate(.true., error, lent, scaling=scaling)
      do while (fast .and. .not. allocated(error))
         change = target - factor_at(problem%state, scaling)
         if (result%iterations == 0) result%first_change = change
         result%iterations = result%iterations + 1
         result%regularised = result%regularised + 1
         call problem%factorise(error)
         if (.not. allocated(error)) call problem%solve(problem%residual + change*problem%rate, x, error)
         if (allocated(error)) exit
         if (problem%negative_pivots > 0 .or. .not. all(ieee_is_finite(x))) exit
         call problem%move(x, change, scaling=scaling)
         call problem%evaluate(.true., error, lent, scaling=scaling)
         if (allocated(error)) exit
         call problem%increment(increment)
         result%correction = correction_ratio(x, increment, problem%field, problem%size, problem%detail)
         result%residual = residual_ratio(problem%residual, problem%field, [problem%force_level, problem%moment_level], &
                                          mean_levels, problem%size, problem%detail)
         call problem%tell('leaning', result%iterations, mean_levels, scaling, result%correction, &
                           problem%largest_rotation(x, change, scaling), 1.0_wp)
         result%converged = result%residual <= closer*settings%residual .and. result%correction <= settings%correction &
                            .and. problem%misfit <= loosest_misfit
         if (result%converged) return
         if (.not. result%residual < before) exit
         best = problem%state
         fast = result%residual <= steeply*before
         before = result%residual
      end do
      problem%state = best
      result%regularised = 0
   end subroutine lean

   !> Solve for the correction, with a large enough for a positive definite matrix and a stride within the limit.
   subroutine find_course(problem, target, limit, most, a, course, result, ok)
      class(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: target, limit
      integer, intent(in) :: most !< iterations
      real(wp), intent(inout) :: a
      type(course_t), intent(inout) :: course
      type(newton_result_t), intent(inout) :: result
      logical, intent(out) :: ok
      type(error_t), allocatable :: error
      real(wp), allocatable :: rhs(:)
      real(wp) :: curvature
      logical :: singular

      ok = .false.
      if (.not. allocated(course%x)) allocate (course%x(problem%n), source=0.0_wp)
      course%change = target - factor_at(problem%state, course%scaling)
      rhs = problem%residual + course%change*problem%rate
      course%climbs = 0
      do
         if (result%iterations >= most) then
            result%code = status_not_converged
            result%spent = .true.
            result%reason = 'no convergence in '//text_of(result%iterations)//' iterations of a descent, the most for ' &
               //text_of(problem%n)//' unknowns (residual '//text_of(real(result%residual, kind(1.0d0)))//')'
            return
         end if
         course%damping = a
         result%iterations = result%iterations + 1
         call problem%factorise(error, a)
         if (.not. allocated(error)) call problem%solve(rhs, course%x, error)
         singular = allocated(error)
         if (singular) then
            if (error%code /= status_singular_matrix) then
               result%code = error%code
               result%reason = error%message
               return
            end if
         else
            singular = .not. all(ieee_is_finite(course%x))
         end if
         if (singular) then
            a = max(10*a, least_inertia*maxval(abs(rhs))/(maxval(problem%weight)*problem%size))
            cycle
         end if
         course%work = problem%energy_along(rhs, course%x)
         course%inertia = dot_product(course%x, problem%weight*course%x)
         course%stride = max(problem%largest_rotation(course%x, course%change, course%scaling), &
            maxval(abs(course%x), mask=problem%field == field_displacement)/problem%size)
         if (.not. course%inertia > 0) course%inertia = 1 ! equilibrium to the last bit: nothing moves
         curvature = abs(course%work)/course%inertia
         if (problem%negative_pivots > 0 .or. problem%determinant_sign < 0 .or. course%work < 0) then
            course%climbs = course%climbs + 1
            course%unstable = .true.
            a = max(climb*a, min(curvature, 1.0e3_wp*a))
            if (.not. a > 0) a = curvature
         else if (course%stride > tolerated*limit) then
            a = a + curvature*(course%stride/limit - 1)
         else
            exit
         end if
      end do
      course%part = min(1.0_wp, limit/max(course%stride, tiny(limit)))
      course%cut = .false.
      ok = .true.
   end subroutine find_course

   !> Make the correction, or the part of it that does not go too far; evaluate there. `after`: work of the new residual along x.
   subroutine follow(problem, course, after, result, ok)
      class(problem_t), intent(inout) :: problem
      type(course_t), intent(inout) :: course
      real(wp), intent(out) :: after
      type(newton_result_t), intent(inout) :: result
      logical, intent(out) :: ok
      type(error_t), allocatable :: error

      ok = .false.
      call problem%keep_iterate()
      do
         call problem%move(course%part*course%x, course%part*course%change, scaling=course%scaling)
         call problem%evaluate(.true., error, scaling=course%scaling)
         if (.not. allocated(error)) then
            after = dot_product(problem%residual, course%x)
            if (after >= too_far*course%work) exit
            course%part = course%part*min(max(course%work/(course%work - after), 0.1_wp), 0.5_wp)
         else if (error%code < 0) then
            result%code = error%code
            result%reason = error%message
            return
         else
            course%part = 0.25_wp*course%part
         end if
         course%cut = .true.
         if (course%part*course%stride < shortest) then
            result%code = status_not_converged
            result%reason = 'the residual falls no further than '//text_of(real(result%residual, kind(1.0d0)))
            if (allocated(error)) then
               result%code = error%code
               result%reason = error%message
            end if
            result%reason = result%reason//' (a descent at this load leads there'
            if (course%unstable) result%reason = result%reason//', buckling or wrinkling on the way'
            result%reason = result%reason//')'
            return
         end if
         call problem%back_to_iterate()
      end do
      ok = .true.
   end subroutine follow
end module finshell_descent
