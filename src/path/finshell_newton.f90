!> Full Newton iteration for one increment, closed by a constraint (finshell_control): one assembly, one factorisation and one
!> or two back substitutions an iteration. The residual after a correction comes with the next tangent, unless the correction
!> is so small that the increment is likely to be done: then the force alone is computed (once an increment).
!>
!> The whole correction is shortened where a node would turn by more than the limit. A line search was tried and left out: it
!> took 57 iterations instead of 18 for the cantilever with end shear in one increment, and failed for the pinched hemisphere.
!> So were corrections with the factors of the iteration before (doc/path_following.md).
!> Mixed iteration (finshell_problem) pays where a correction that bends a thin shell also stretches it, by the curvature of the
!> motion: the residual is then many times the loads, and the elements' own stresses, wrong by as much, spoil the tangent.
!> Where the residual stays below the loads the own stresses are better than predicted ones: large stretch, laws with
!> switches. So the residual decides, iteration by iteration.
module finshell_newton
   use finshell_kinds, only: wp
   use finshell_status, only: status_ok, status_not_converged, status_singular_matrix
   use finshell_error, only: error_t, text_of
   use finshell_factor, only: factor_at
   use finshell_problem, only: problem_t, stress_kept, stress_own, stress_predicted
   use finshell_step, only: convergence_t, control_load, control_volume, mixed_always, mixed_auto
   use finshell_control, only: constraint_t, factor_change, arc_product
   use finshell_newton_result, only: newton_result_t, give_up
   use finshell_rounding_limit, only: weigh_rounding
   use finshell_convergence, only: residual_ratio, correction_ratio, field_norms
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   implicit none
   private
   public :: newton_result_t, solve_increment, give_up, too_soft, loosest_misfit

   !> A correction that leads where the element cannot be evaluated is halved this many times before giving up.
   integer, parameter :: halvings = 3
   real(wp), parameter :: fade = 0.1_wp !< of the stand-in stiffness, from iteration to iteration
   real(wp), parameter :: least_regularisation = 1.0e-6_wp
   real(wp), parameter :: falling = 0.5_wp !< from iteration to iteration: a residual that falls so fast does not diverge
   real(wp), parameter :: wild = 1 !< residual, in loads and reactions: beyond it an iteration is mixed, where it may choose
   real(wp), parameter :: too_soft = 4 !< rotation (radian) of the first correction from rest: a flat sheet, which may wrinkle
   real(wp), parameter :: volume_rounding = 100 !< of a volume, in epsilons
   real(wp), parameter :: loosest_misfit = 1.0e-11_wp !< of a volume to the fluid in it

contains

   !> Iterate from the (predicted) state of the problem. On success the state is the new equilibrium; on failure it is anything.
   subroutine solve_increment(problem, constraint, settings, mean_levels, result, stable, predicted, whole)
      class(problem_t), intent(inout) :: problem
      type(constraint_t), intent(in) :: constraint
      type(convergence_t), intent(in) :: settings
      real(wp), intent(in) :: mean_levels(2) !< mean force and moment level of the converged increments
      type(newton_result_t), intent(out) :: result
      !> Give up where a structure too soft for its load turns unstable on the way from rest: there is another start.
      logical, intent(in), optional :: stable
      real(wp), intent(in), optional :: predicted(:, :) !< stresses for the first tangent of a mixed iteration (`evaluate`)
      real(wp), intent(in), optional :: whole(2) !< norms of an increment that this is part of (`correction_ratio`)
      type(error_t), allocatable :: error
      real(wp), allocatable :: x(:), increment(:), stress(:, :)
      real(wp) :: change, scale, angle, earlier(2), before
      logical :: complete, likely, guess, rounded, reached, mixed, choose, forces_only

      allocate (x(problem%n), increment(problem%n))
      earlier = huge(1.0_wp)
      before = huge(1.0_wp)
      guess = .true.
      rounded = .false.
      if (problem%limp .and. .not. any(abs(problem%base%displacement) > 0)) result%stand_in = 1
      choose = settings%mixed == mixed_auto
      mixed = settings%mixed == mixed_always
      if (mixed) call better_stress()
      call problem%evaluate(.true., error, result%stand_in, stress, constraint%scaling)
      if (choose .and. .not. allocated(error)) then
         mixed = is_wild(misfit())
         call problem%increment(increment)
         if (mixed .and. (present(predicted) .or. any(abs(increment) > 0))) then
            call better_stress()
            call problem%evaluate(.true., error, result%stand_in, stress, constraint%scaling)
         end if
      end if
      if (allocated(error)) then
         call give_up(result, error%code, 'the predicted state cannot be evaluated: '//error%message)
         return
      end if
      call problem%tell(method(), 0, mean_levels, constraint%scaling, 0.0_wp, 0.0_wp, 1.0_wp, factorised=.false.)
      do
         if (result%iterations >= settings%maximum_iterations) then
            call give_up(result, status_not_converged, 'no convergence in '//text_of(result%iterations) &
               //' iterations (residual '//text_of(real(result%residual, kind(1.0d0)))//', correction ' &
               //text_of(real(result%correction, kind(1.0d0)))//')')
            return
         end if
         call correction_from(problem, constraint, x, change, complete, result)
         if (result%code == status_singular_matrix .and. problem%soft) &
            call stand_in(problem, constraint, stress, x, change, complete, result)
         if (result%code /= status_ok) return
         if (result%iterations == 1) then
            result%first_change = change
            if (allocated(result%x_t)) then
               result%first = problem%tangent_along(result%x_t, change)
            else if (abs(change) > 0) then
               result%first = problem%tangent_along(x/change, change)
            end if
         end if
         if (problem%limp .and. .not. problem%crumples .and. constraint%control == control_load) then
            ! a wrinkled tube under pressure has none of its stiffness left: Newton's method leads to radius zero
            if (problem%energy_along(problem%residual + change*problem%rate, x) < 0) then
               call give_up(result, status_not_converged, 'a correction leads up in energy')
               return
            end if
         end if
         if (result%stand_in > 0) then
            complete = .false.
            result%regularised = result%regularised + 1
            result%stand_in = fade*result%stand_in
            if (result%stand_in < least_regularisation) result%stand_in = 0
         end if
         angle = problem%largest_rotation(x, change, constraint%scaling)
         if (result%iterations == 1) then
            result%first_rotation = angle
            if (angle > too_soft .and. .not. any(abs(problem%base%displacement) > 0)) choose = .false.
            mixed = mixed .and. (choose .or. settings%mixed == mixed_always)
         end if
         if (present(stable) .and. result%first_rotation > too_soft) then
            if (stable .and. problem%negative_pivots > 0 .and. result%iterations > 1 .and. .not. problem%fills()) then
               call give_up(result, status_not_converged, 'the structure is unstable on the way from rest')
               return
            end if
         end if
         scale = 1
         if (settings%rotation_limit > 0 .and. angle > settings%rotation_limit) scale = settings%rotation_limit/angle
         if (scale < 1) complete = .false.
         call problem%keep_iterate()
         call apply(problem, settings, mixed, constraint%scaling, x, change, scale, complete, guess, stress, increment, likely, &
                    result, whole)
         if (result%code /= status_ok) return

         result%residual = misfit()
         call problem%tell(method(), result%iterations, mean_levels, constraint%scaling, result%correction, angle, scale)
         if (.not. ieee_is_finite(result%residual)) then
            call give_up(result, status_not_converged, 'the residual is not a number')
            return
         end if
         reached = met(problem, constraint, settings%correction)
         forces_only = likely .and. guess
         likely = likely .and. reached
         result%converged = likely .and. result%residual <= settings%residual
         if (.not. result%converged) then
            if (complete .and. reached) then
               call weigh_rounding(problem, settings, mean_levels, scale*x, earlier(1), likely, rounded, result)
            else
               rounded = .false.
            end if
         end if
         if (result%converged) then
            call find_tangent(problem, increment, result)
            return
         end if
         ! While the residual falls as near a solution, a growing correction is no bad sign: the softer modes come last.
         if (complete .and. 4*result%iterations >= 3*settings%maximum_iterations &
             .and. result%correction > maxval(earlier) .and. result%residual > falling*before) then
            call give_up(result, status_not_converged, 'the iteration diverges (correction ' &
               //text_of(real(result%correction, kind(1.0d0)))//' of the increment after '//text_of(result%iterations) &
               //' iterations)')
            return
         end if
         earlier = [result%correction, earlier(1)]
         before = result%residual
         if (choose .and. .not. mixed .and. is_wild(result%residual)) then
            call problem%back_to_iterate()
            call problem%move(scale*x, scale*change, stress_predicted, stress, constraint%scaling)
            call problem%evaluate(.true., error, result%stand_in, stress, constraint%scaling)
         else if (forces_only) then
            call problem%evaluate(.true., error, result%stand_in, stress, constraint%scaling)
         end if
         if (forces_only) guess = .false.
         if (choose) mixed = is_wild(result%residual)
         if (allocated(error)) then
            call give_up(result, error%code, error%message)
            return
         end if
      end do

   contains

      !> Stresses for the first tangent of a mixed iteration.
      subroutine better_stress()
         if (present(predicted)) then
            stress = predicted
         else
            call keep_stress(problem, constraint%scaling, stress)
         end if
      end subroutine better_stress

      function misfit(least) result(ratio)
         real(wp), intent(in), optional :: least(2)
         real(wp) :: ratio
         ratio = residual_ratio(problem%residual, problem%field, [problem%force_level, problem%moment_level], mean_levels, &
                                problem%size, problem%detail, least)
      end function misfit

      function method() result(name)
         character(len=:), allocatable :: name
         name = trim(merge('mixed ', 'Newton', mixed))
         if (result%stand_in > 0) name = name//', stand-in'
      end function method

      logical function is_wild(residual) result(yes) ! beyond the loads, and not because of rounding
         real(wp), intent(in) :: residual
         real(wp) :: unknowns(problem%n), added(problem%n)
         yes = .false.
         if (.not. residual > wild) return
         call problem%magnitude(unknowns, added)
         yes = misfit(epsilon(1.0_wp)*field_norms(added, problem%field)) > wild
      end function is_wild
   end subroutine solve_increment

   !> The state as it is, with the stresses that the base has.
   subroutine keep_stress(problem, scaling, stress)
      class(problem_t), intent(inout) :: problem
      integer, intent(in) :: scaling !< the factor that changed
      real(wp), intent(inout), allocatable :: stress(:, :)
      real(wp), allocatable :: x(:)
      real(wp) :: change, time
      allocate (x(problem%n))
      call problem%increment(x)
      change = problem%change(scaling)
      time = problem%state%time
      call problem%restore()
      problem%state%time = time ! what follows it goes along with the move
      call problem%move(x, change, stress_kept, stress, scaling)
   end subroutine keep_stress

   !> The tangent to the path where the iteration has converged; load control has not solved for it yet.
   subroutine find_tangent(problem, increment, result)
      class(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: increment(:)
      type(newton_result_t), intent(inout) :: result
      type(error_t), allocatable :: error
      real(wp), allocatable :: x(:)
      if (result%regularised > 0) then
         result%first%known = .false.
         return
      end if
      if (allocated(result%x_t)) then
         x = result%x_t
      else
         allocate (x(problem%n))
         call problem%solve(problem%rate, x, error)
         if (allocated(error)) return
      end if
      result%last = problem%tangent_along(x, arc_product(increment, x, problem%field))
   end subroutine find_tangent

   !> Where the law has lost its stiffness: the correction with the stand-in. It fades in the iterations that follow.
   subroutine stand_in(problem, constraint, stress, x, change, complete, result)
      class(problem_t), intent(inout) :: problem
      type(constraint_t), intent(in) :: constraint
      real(wp), intent(in), optional :: stress(:, :)
      real(wp), intent(out) :: x(:), change
      logical, intent(out) :: complete
      type(newton_result_t), intent(inout) :: result
      type(error_t), allocatable :: error
      x = 0
      change = 0
      complete = .false.
      result%stand_in = merge(least_regularisation, 1.0_wp, result%regularised > 0)
      call problem%evaluate(.true., error, result%stand_in, stress, constraint%scaling)
      if (allocated(error)) then
         call give_up(result, error%code, error%message)
         return
      end if
      result%code = status_ok
      call correction_from(problem, constraint, x, change, complete, result)
   end subroutine stand_in

   !> Do fluids fill their chambers, and is a prescribed volume met, as far as rounding lets it?
   !> Being nonlinear in the unknowns, it is not by construction.
   function met(problem, constraint, tolerance) result(yes)
      class(problem_t), intent(in) :: problem
      type(constraint_t), intent(in) :: constraint
      real(wp), intent(in) :: tolerance
      logical :: yes
      yes = problem%misfit <= loosest_misfit
      if (yes .and. constraint%control == control_volume) yes = abs(problem%monitored(problem%state) - constraint%target) &
         <= max(tolerance*abs(constraint%target - problem%monitored(problem%base)), &
                volume_rounding*epsilon(1.0_wp)*abs(constraint%target))
   end function met

   !> The correction x and the change of the factor that satisfy the linearised equations and the constraint.
   subroutine correction_from(problem, constraint, x, change, complete, result)
      class(problem_t), intent(inout) :: problem
      type(constraint_t), intent(in) :: constraint
      real(wp), intent(out) :: x(:), change
      logical, intent(out) :: complete !< false: shortened by the constraint
      type(newton_result_t), intent(inout) :: result
      type(error_t), allocatable :: error
      real(wp), allocatable :: x_t(:), increment(:)
      real(wp) :: eta
      logical :: ok

      complete = .true.
      change = 0
      x = 0
      call problem%factorise(error)
      if (allocated(error)) then
         call give_up(result, error%code, error%message)
         return
      end if
      result%iterations = result%iterations + 1
      if (result%iterations == 1) then
         result%first_pivots = problem%negative_pivots
         result%first_determinant = problem%determinant_sign
      end if
      if (constraint%control == control_load) then
         change = constraint%target - factor_at(problem%state, constraint%scaling)
         call problem%solve(problem%residual + change*problem%rate, x, error)
      else
         allocate (x_t(problem%n), increment(problem%n))
         call problem%solve(problem%residual, x, error)
         if (.not. allocated(error)) call problem%solve(problem%rate, x_t, error)
         if (.not. allocated(error)) then
            call problem%increment(increment)
            call factor_change(constraint, problem%field, x, x_t, increment, problem%change(constraint%scaling), &
               factor_at(problem%state, constraint%scaling), problem%monitored_or_zero(), problem%watched_or_empty(), &
               problem%watched_rate, change, eta, ok)
            if (.not. ok) then
               call give_up(result, status_not_converged, 'no equilibrium state at this distance along the path was found')
               return
            end if
            x = eta*x + change*x_t
            complete = eta >= 1
            call move_alloc(x_t, result%x_t)
         end if
      end if
      if (allocated(error)) then
         call give_up(result, error%code, error%message)
      else if (.not. all(ieee_is_finite(x)) .or. .not. ieee_is_finite(change)) then
         call give_up(result, status_not_converged, 'the correction is not a number: the tangent is singular')
      end if
   end subroutine correction_from

   !> Move by the correction and evaluate there; halve the correction where the element cannot be evaluated.
   subroutine apply(problem, settings, mixed, scaling, x, change, scale, complete, guess, stress, increment, likely, result, whole)
      class(problem_t), intent(inout) :: problem
      type(convergence_t), intent(in) :: settings
      logical, intent(in) :: mixed
      integer, intent(in) :: scaling !< the factor that changes
      real(wp), intent(in) :: x(:), change
      real(wp), intent(inout) :: scale
      logical, intent(inout) :: complete
      logical, intent(in) :: guess !< no tangent where the increment is likely to be done
      real(wp), intent(inout), allocatable :: stress(:, :)
      real(wp), intent(inout) :: increment(:)
      logical, intent(out) :: likely !< the correction is small enough
      type(newton_result_t), intent(inout) :: result
      real(wp), intent(in), optional :: whole(2)
      type(error_t), allocatable :: error
      integer :: attempt

      do attempt = 0, halvings
         call problem%move(scale*x, scale*change, merge(stress_predicted, stress_own, mixed), stress, scaling)
         call problem%increment(increment)
         result%correction = correction_ratio(scale*x, increment, problem%field, problem%size, problem%detail, whole)
         likely = complete .and. result%correction <= settings%correction
         call problem%evaluate(.not. (likely .and. guess), error, result%stand_in, stress, scaling)
         if (.not. allocated(error)) exit
         if (error%code < 0 .or. attempt == halvings) then
            call give_up(result, error%code, error%message)
            return
         end if
         call problem%back_to_iterate()
         scale = 0.5_wp*scale
         complete = .false.
      end do
   end subroutine apply
end module finshell_newton
