!> Dynamic relaxation: to a stable equilibrium state under a given load through a motion that loses its energy, with explicit
!> steps.
!>
!> The masses are fictitious: as small as they may be for steps of length 1 to be stable (`fictitious_masses`), so that all
!> parts of the structure move as fast as they can. The load comes in over the first steps. A shell is stopped where its kinetic
!> energy passes a peak (Cundall 1976, Barnes 1988). A membrane trembles in its slack parts and passes peaks all the time: its
!> motion is damped critically, by the frequency that the Rayleigh quotient of the velocity and of the change of the forces gives
!> (Underwood 1983, Oakley & Knight 1995). Measured, each does in a third of the steps, or at all, what the other takes.
!>
!> The motion goes over wrinkles and snaps that stop Newton's method and hold up a descent. What it comes near to is made an
!> equilibrium state by Newton's method, to the same tolerances as ever; else the motion goes on, to a smaller residual. It suits
!> structures that the load stretches. One that only bends, a slender one most of all, is slow by nature and takes more steps
!> than are allowed; it is left to a descent from where it has come.
module finshell_relaxation
   use finshell_kinds, only: wp
   use finshell_status, only: status_not_converged
   use finshell_error, only: error_t, text_of
   use finshell_equations, only: field_displacement
   use finshell_factor, only: factor_at
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

   !> The motion.
   type :: motion_t
      real(wp), allocatable :: mass(:), velocity(:)
      real(wp), allocatable :: before(:) !< the residual a step before
      real(wp) :: heaviness = 1 !< of the masses, in those that are just enough
      real(wp) :: limit = 0 !< of a stride
      real(wp) :: square = 0 !< of the frequency with which it goes on
      real(wp) :: kinetic = 0 !< energy
      logical :: starts = .true. !< it is at rest
      integer :: age = 0 !< of the masses, steps
      integer :: setbacks = 0 !< steps that led where no element can be evaluated
      logical :: viscous = .false.
   end type motion_t

   integer, parameter :: most_steps = 30000, most_setbacks = 30
   integer, parameter :: ramp = 100 !< steps in which the load comes in
   real(wp), parameter :: longest_stride = 0.1_wp !< rotation, or displacement over the length of an element, in a step
   real(wp), parameter :: most_damping = 1.9_wp
   real(wp), parameter :: heaviest = 16 !< masses, in those that are just enough
   integer, parameter :: young = 30, old = 100 !< steps: masses may be kept; are to be renewed
   integer, parameter :: look = 10 !< steps from one look at the residual to the next
   real(wp), parameter :: near = 0.01_wp !< residual at which a state is tried
   real(wp), parameter :: nearer = 0.2_wp !< ratio by which it has to fall before another one is

contains

   !> Relax from the present state of the problem to equilibrium at the load factor `target`. On success the state is the new
   !> equilibrium, stable as far as pivots are known; on failure it is anything. result%steps counts the steps, result%iterations
   !> the linear solves. Where moved supports lead the way they move in the first steps.
   subroutine relax(problem, target, settings, mean_levels, result, scaling)
      class(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: target
      type(convergence_t), intent(in) :: settings
      real(wp), intent(in) :: mean_levels(2) !< as for solve_increment
      type(newton_result_t), intent(out) :: result
      integer, intent(in) :: scaling !< the factor that changes
      type(error_t), allocatable :: error
      type(newton_result_t) :: finish
      type(motion_t) :: motion
      type(state_t) :: kept
      real(wp) :: way, change, ratio, wanted
      integer :: step, loaded, solves

      if (problem%confined) then
         result%code = status_not_converged
         result%reason = 'dynamic relaxation needs fluids that yield'
         return
      end if
      problem%condensed = .true.
      allocate (motion%mass(problem%n), motion%velocity(problem%n), motion%before(problem%n))
      motion%viscous = problem%limp
      motion%limit = longest_stride
      way = target - factor_at(problem%state, scaling)
      wanted = near
      ratio = huge(ratio)
      solves = 0
      loaded = 0
      kept = problem%state
      call renew(problem, scaling, motion, error)
      do step = 1, most_steps
         if (allocated(error)) exit
         result%steps = step
         change = 0
         if (loaded < ramp) change = way/ramp
         if (loaded == ramp - 1) change = target - factor_at(problem%state, scaling)
         loaded = min(loaded + 1, ramp)
         call go(problem, scaling, change, loaded == ramp, motion, error)
         if (allocated(error)) then
            if (error%code < 0 .or. motion%setbacks >= most_setbacks) exit
            loaded = nint(ramp*(1 - (target - factor_at(kept, scaling))/merge(way, 1.0_wp, abs(way) > 0)))
            if (.not. abs(way) > 0) loaded = ramp
            problem%state = kept
            motion%setbacks = motion%setbacks + 1
            motion%heaviness = min(2*motion%heaviness, heaviest)
            motion%limit = 0.5_wp*motion%limit
            call renew(problem, scaling, motion, error)
            cycle
         end if
         if (motion%age >= merge(young, old, motion%starts)) then
            kept = problem%state
            motion%limit = min(longest_stride, 1.5_wp*motion%limit)
            call renew(problem, scaling, motion, error, goes_on=.true.)
         end if
         if (allocated(error) .or. loaded < ramp .or. modulo(step, look) /= 0) cycle
         ratio = residual_ratio(problem%residual, problem%field, [problem%force_level, problem%moment_level], mean_levels, &
                                problem%size, problem%detail)
         call problem%tell('relaxation', step, mean_levels, scaling, 0.0_wp, 0.0_wp, 1.0_wp, factorised=.false.)
         if (.not. ratio < wanted) cycle
         kept = problem%state
         call settle(problem, target, settings, mean_levels, scaling, finish)
         solves = solves + finish%iterations
         if (finish%converged) exit
         problem%state = kept
         wanted = nearer*ratio
         call renew(problem, scaling, motion, error)
      end do
      if (.not. finish%converged) then
         ! from where it has come
         problem%state = kept
         if (abs(target - factor_at(kept, scaling)) <= 1.0e-9_wp*abs(way)) then
            call descend(problem, target, settings, mean_levels, huge(1.0_wp), finish, scaling)
            solves = solves + finish%iterations
         end if
      end if
      problem%condensed = .false.
      step = result%steps
      result = finish
      result%steps = step
      result%iterations = solves
      result%regularised = max(1, finish%regularised)
      result%first%known = .false.
      if (result%converged) return
      result%code = status_not_converged
      result%reason = 'dynamic relaxation does not settle: residual '//text_of(real(ratio, kind(1.0d0)))//' after ' &
         //text_of(step)//' steps'
      if (allocated(error)) result%reason = result%reason//'; '//error%message
   end subroutine relax

   !> One step. A motion that passes a peak of its kinetic energy is stopped, unless the load is still coming in.
   subroutine go(problem, scaling, change, loaded, motion, error)
      class(problem_t), intent(inout) :: problem
      integer, intent(in) :: scaling
      real(wp), intent(in) :: change !< of the factor
      logical, intent(in) :: loaded
      type(motion_t), intent(inout) :: motion
      type(error_t), allocatable, intent(out) :: error
      real(wp) :: damping, stride, kinetic

      associate (v => motion%velocity, m => motion%mass, r => problem%residual)
         damping = 0
         if (motion%viscous) damping = min(2*sqrt(motion%square), most_damping)
         if (motion%starts) then
            v = 0.5_wp*r/m
         else
            v = ((1 - 0.5_wp*damping)*v + r/m)/(1 + 0.5_wp*damping)
         end if
         stride = max(problem%largest_rotation(v, change, scaling), &
                      maxval(abs(v), mask=problem%field == field_displacement)/problem%detail)
         if (stride > motion%limit) v = v*(motion%limit/stride)
         motion%before = r
         call problem%move(v, change, scaling=scaling)
         call problem%evaluate(.false., error, scaling=scaling)
         if (allocated(error)) return
         kinetic = dot_product(v, m*v)
         motion%age = motion%age + 1
         motion%starts = .false.
         if (motion%viscous) then
            motion%square = max(0.0_wp, dot_product(v, motion%before - r))/max(kinetic, tiny(kinetic))
         else if (loaded .and. kinetic < motion%kinetic) then
            motion%starts = .true.
            kinetic = 0
         end if
         motion%kinetic = kinetic
      end associate
   end subroutine go

   !> Masses for the present state; the motion begins anew, or goes on.
   subroutine renew(problem, scaling, motion, error, goes_on)
      class(problem_t), intent(inout) :: problem
      integer, intent(in) :: scaling
      type(motion_t), intent(inout) :: motion
      type(error_t), allocatable, intent(out) :: error
      logical, intent(in), optional :: goes_on
      call problem%evaluate(.true., error, merge(1.0_wp, 0.0_wp, problem%soft), scaling=scaling)
      if (allocated(error)) return
      call problem%fictitious_masses(motion%mass)
      motion%mass = motion%heaviness*motion%mass
      motion%age = 0
      if (present(goes_on)) return
      motion%starts = .true.
      motion%kinetic = 0
      motion%square = 0
   end subroutine renew

   !> Make a state that is near to equilibrium one that is in equilibrium, and stable as far as pivots are known.
   subroutine settle(problem, target, settings, mean_levels, scaling, result)
      class(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: target, mean_levels(2)
      type(convergence_t), intent(in) :: settings
      integer, intent(in) :: scaling
      type(newton_result_t), intent(out) :: result
      type(constraint_t) :: constraint
      type(convergence_t) :: plain
      plain = settings
      plain%mixed = mixed_never
      constraint%control = control_load
      constraint%scaling = scaling
      constraint%target = target
      call solve_increment(problem, constraint, plain, mean_levels, result)
      result%converged = result%converged .and. problem%negative_pivots <= 0
   end subroutine settle
end module finshell_relaxation
