!> Start from rest of a structure that is far too soft for a linear answer to its load (a flat sheet under pressure): the load grows
!> by steps from where the linear answer turns no node far, each from the path along its tangent. These states are on the way
!> only: nobody sees them, so they are loosely converged; the last one is an increment like any other.
!>
!> What Newton's method makes of the whole increment at once depends on the mesh: the shape of the linear answer stretches a sheet
!> unevenly, the more so the finer the mesh, and the iteration goes astray. This start costs the same on any mesh. It is given up
!> where the sheet turns out to be unstable (it wrinkles): on from there a path has hundreds of branches.
module finshell_start
   use finshell_kinds, only: wp
   use finshell_status, only: status_not_converged
   use finshell_factor, only: factor_at
   use finshell_problem, only: problem_t
   use finshell_state, only: state_t
   use finshell_step, only: convergence_t, control_load
   use finshell_control, only: constraint_t, arc_norm, arc_product
   use finshell_increment, only: toward
   use finshell_newton, only: newton_result_t, solve_increment, give_up
   use finshell_predictor, only: history_t
   implicit none
   private
   public :: start_softly

   real(wp), parameter :: first_turn = 0.1_wp !< rotation (radian) of the linear answer to the first step
   real(wp), parameter :: growth = 10 !< of the steps; the path goes with the third root of the load
   real(wp), parameter :: loose_residual = 0.1_wp, loose_correction = 0.2_wp
   integer, parameter :: most = 40 !< steps

contains

   !> From rest, the base of the problem, to equilibrium at the load factor `target`. On success the state is the new
   !> equilibrium; on failure it is anything. The base is what it was. result%first is not known: the energy of so long an
   !> increment cannot be judged by the tangents at its ends.
   subroutine start_softly(problem, target, turn, settings, mean_levels, scaling, result)
      class(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: target
      real(wp), intent(in) :: turn !< largest rotation of a node in the linear answer to all of it
      type(convergence_t), intent(in) :: settings
      real(wp), intent(in) :: mean_levels(2) !< as for solve_increment
      integer, intent(in) :: scaling !< the factor that changes
      type(newton_result_t), intent(out) :: result
      type(constraint_t) :: constraint
      type(convergence_t) :: loose
      type(newton_result_t) :: part, first
      type(history_t) :: history
      type(state_t) :: rest, reached
      real(wp), allocatable :: x(:)
      real(wp) :: from, size, way, change
      integer :: i, solves
      logical :: known, along, last

      allocate (x(problem%n))
      rest = problem%base
      loose = settings
      loose%residual = max(settings%residual, loose_residual)
      loose%correction = max(settings%correction, loose_correction)
      constraint%control = control_load
      constraint%scaling = scaling
      size = first_turn/turn*(target - factor_at(rest, scaling))
      solves = 0
      do i = 1, most
         from = factor_at(problem%base, scaling)
         way = toward(abs(size), from, target)
         if (i > 1) then
            do
               call history%predict(control_load, way, x, change, known, along)
               if (along .or. abs(way) < abs(history%factor(1))) exit
               way = 0.5_wp*way
            end do
            call problem%move(x, way, scaling=scaling)
         end if
         last = abs(target - from - way) <= 1.0e-6_wp*abs(way)
         constraint%target = merge(target, from + way, last)
         call solve_increment(problem, constraint, merge(settings, loose, last), mean_levels, part)
         solves = solves + part%iterations
         if (i == 1) first = part
         if (part%converged .and. problem%negative_pivots /= 0) &
            call give_up(part, status_not_converged, 'the structure is unstable on the way from rest')
         if (last .or. .not. part%converged) exit
         change = problem%change(scaling)
         call problem%increment(x)
         call problem%transport(x)
         call history%remember(x, change, 0.0_wp, arc_norm(x, problem%field, 0.0_wp, 0.0_wp))
         if (part%last%known) call history%point(part%last%x, 0.0_wp, arc_norm(part%last%x, problem%field, 0.0_wp, 0.0_wp), &
                                                 arc_product(x, part%last%x, problem%field))
         call problem%accept()
         size = growth*change
      end do
      result = part
      result%iterations = solves
      result%first%known = .false.
      result%first_pivots = first%first_pivots
      result%first_determinant = first%first_determinant
      result%first_change = first%first_change
      result%first_rotation = turn
      if (result%converged .and. .not. last) &
         call give_up(result, status_not_converged, 'the load is too far from rest')
      reached = problem%state
      problem%state = rest
      call problem%accept()
      problem%state = reached
   end subroutine start_softly
end module finshell_start
