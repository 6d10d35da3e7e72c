!> prototype
module finshell_relaxation
   use finshell_kinds, only: wp, i4
   use finshell_status, only: status_not_converged
   use finshell_error, only: error_t, text_of
   use finshell_equations, only: field_displacement
   use finshell_factor, only: factor_at, by_load_factor, set_factor
   use finshell_problem, only: problem_t
   use finshell_state, only: state_t
   use finshell_step, only: convergence_t, control_load, mixed_never
   use finshell_convergence, only: residual_ratio
   use finshell_control, only: constraint_t
   use finshell_newton, only: newton_result_t, solve_increment
   use finshell_descent, only: descend
   implicit none
   private
   public :: relax

contains

   subroutine relax(problem, target, settings, mean_levels, result, scaling)
      class(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: target
      type(convergence_t), intent(in) :: settings
      real(wp), intent(in) :: mean_levels(2)
      type(newton_result_t), intent(out) :: result
      integer, intent(in), optional :: scaling
      type(error_t), allocatable :: error
      type(state_t) :: kept
      type(constraint_t) :: constraint
      type(convergence_t) :: plain
      type(newton_result_t) :: finish
      real(wp), allocatable :: v(:), m(:), x(:), before(:)
      real(wp) :: safety, full, change, kinetic, previous, ratio, wanted, stride, c, w2, limit
      integer :: i, ramp, most, active, solves, fresh, since, peaks, reg
      character(len=16) :: damp
      real(wp) :: t0, t1
      call cpu_time(t0)

      call get_environment_variable('DAMP', damp)
      most = 40000
      ramp = 100
      active = by_load_factor
      if (present(scaling)) active = scaling
      plain = settings
      plain%mixed = mixed_never
      constraint%control = control_load
      constraint%scaling = active
      constraint%target = target
      allocate (v(problem%n), m(problem%n), x(problem%n), before(problem%n))
      full = target - factor_at(problem%state, active)
      safety = 1
      wanted = 0.01_wp
      limit = 0.1_wp
      solves = 0
      v = 0
      previous = 0
      since = 0
      fresh = 0
      peaks = 0
      reg = 0
      kept = problem%state
      call weigh()
      if (allocated(error)) goto 9
      do i = 1, most
         change = 0
         if (i <= ramp) change = full/ramp
         if (i == ramp) change = target - factor_at(problem%state, active)
         before = problem%residual
         select case (damp)
         case ('viscous')
            w2 = 0
            if (i > 1) w2 = c
            c = 2*sqrt(max(w2, 0.0_wp))
            c = min(c, 1.9_wp)
            v = ((1 - c/2)*v + problem%residual/m)/(1 + c/2)
         case default
            v = v + merge(0.5_wp, 1.0_wp, since == 0)*problem%residual/m
         end select
         since = since + 1
         stride = max(problem%largest_rotation(v, change, active), &
            maxval(abs(v), mask=problem%field == field_displacement)/problem%detail)
         if (stride > limit) v = v*limit/stride
         call problem%move(v, change, scaling=active)
         call problem%evaluate(.false., error, scaling=active)
         kinetic = dot_product(v, m*v)
         if (allocated(error)) then
            if (error%code < 0 .or. safety > 100) exit
            write (98, *) i, 'back ', error%message
            ramp = max(ramp, i) ! stay
            change = factor_at(problem%state, active)
            problem%state = kept
            full = 0
            safety = 2*safety
            deallocate (error)
            call weigh()
            if (allocated(error)) exit
            v = 0
            since = 0
            previous = 0
            cycle
         end if
         if (damp == 'viscous') c = max(0.0_wp, -dot_product(v, problem%residual - before)/max(kinetic, tiny(kinetic)))
         if (damp /= 'viscous' .and. kinetic < previous .and. i > ramp) then
            v = 0
            since = 0
            previous = 0
            peaks = peaks + 1
         else
            previous = kinetic
         end if
         fresh = fresh + 1
         if ((since == 0 .and. fresh >= 30) .or. fresh >= 100) then
            kept = problem%state
            call weigh()
            if (allocated(error)) exit
         end if
         if (mod(i, 10) == 0 .and. i > ramp) then
            ratio = residual_ratio(problem%residual, problem%field, [problem%force_level, problem%moment_level], mean_levels, &
                                   problem%size, problem%detail)
            if (mod(i, 200) == 0) then
               call cpu_time(t1)
               write (98, '(i6,4es12.4,i6,f8.2)') i, kinetic, ratio, wanted, safety, peaks, t1 - t0
            end if
            if (ratio < wanted) then
               kept = problem%state
               call solve_increment(problem, constraint, plain, mean_levels, finish)
               solves = solves + finish%iterations
               write (98, *) i, 'newton', finish%converged, finish%iterations, finish%residual, &
                  finish%correction, problem%negative_pivots
               if (finish%converged .and. problem%negative_pivots <= 0) then
                  result = finish
                  result%iterations = solves
                  result%regularised = 1
                  return
               end if
               problem%state = kept
               wanted = 0.2_wp*ratio
               call weigh()
               v = 0
               since = 0
               previous = 0
               if (allocated(error)) exit
            end if
         end if
      end do
9     continue
      result%iterations = solves
      result%regularised = 1
      result%code = status_not_converged
      result%reason = 'relaxation does not settle'
      if (allocated(error)) result%reason = result%reason//': '//error%message
   contains
      subroutine weigh()
         real(wp) :: part
         part = merge(1.0_wp, 0.0_wp, problem%soft)
         call problem%evaluate(.true., error, part, scaling=active)
         if (allocated(error)) return
         call problem%inertia(m)
         m = safety*m
         fresh = 0
      end subroutine weigh
   end subroutine relax
end module finshell_relaxation
