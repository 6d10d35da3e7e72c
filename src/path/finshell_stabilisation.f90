!> Damping that helps a static step under load control over snaps and wrinkles that are local: a force against each increment,
!> viscosity * mass * increment / (change of the load factor), as if the load factor were a time.
!>
!> The first increment goes without; the viscosity is such that the force would have taken a given part of the energy that the
!> increment has stored (as Abaqus' stabilisation does; where the first increment fails, of the work of the load along the first
!> correction). As the force goes with the increment over its size, shorter increments are damped more. The energy that it takes is
!> bounded, in parts of the stored energy; an increment that would exceed the bound is refused and tried with a weaker force.
!> At load levels and at the end of the step the force fades to nothing: those states are equilibrium states as any other.
module finshell_stabilisation
   use finshell_kinds, only: wp
   use finshell_balance, only: balance_t
   use finshell_control, only: constraint_t
   use finshell_newton, only: newton_result_t, solve_increment
   use finshell_problem, only: problem_t
   use finshell_step, only: convergence_t
   implicit none
   private
   public :: stabiliser_t

   type :: stabiliser_t
      real(wp) :: part = 0 !< of the energy of the first increment; 0: there is no stabilisation
      real(wp) :: viscosity = 0 !< times `weight` of the problem
      real(wp) :: taken = 0 !< energy, in the step
      real(wp) :: stored = 0 !< energy
   contains
      procedure :: engage
      procedure :: release
      procedure :: calibrate
      procedure :: guess
      procedure :: exceeds
      procedure :: share
   end type stabiliser_t

   real(wp), parameter :: bound = 0.05_wp !< of the stored energy that may be taken
   real(wp), parameter :: weaker = 0.25_wp
   real(wp), parameter :: fading(*) = [0.1_wp, 0.01_wp, 0.0_wp]

contains

   !> Damp the increment that is about to be tried. `engage` of size 0: nothing.
   subroutine engage(self, problem, size)
      class(stabiliser_t), intent(in) :: self
      class(problem_t), intent(inout) :: problem
      real(wp), intent(in) :: size !< of the increment
      problem%taken = 0
      problem%drag = 0
      if (abs(size) > 0) problem%drag = self%viscosity/abs(size)
   end subroutine engage

   !> After the increment has converged (`result`): note what was taken. With `completely` go on to equilibrium without damping; where
   !> that fails, so has the increment.
   subroutine release(self, problem, constraint, settings, mean_levels, completely, result)
      class(stabiliser_t), intent(in) :: self
      class(problem_t), intent(inout) :: problem
      type(constraint_t), intent(in) :: constraint
      type(convergence_t), intent(in) :: settings
      real(wp), intent(in) :: mean_levels(2)
      logical, intent(in) :: completely
      type(newton_result_t), intent(inout) :: result
      type(newton_result_t) :: part
      real(wp) :: drag
      integer :: i
      drag = problem%drag
      if (.not. drag > 0) return
      problem%taken = problem%taken_by_drag()
      if (completely) then
         do i = 1, size(fading)
            problem%drag = fading(i)*drag
            call solve_increment(problem, constraint, settings, mean_levels, part)
            part%iterations = part%iterations + result%iterations
            part%first_pivots = result%first_pivots
            part%first_determinant = result%first_determinant
            part%first_rotation = result%first_rotation
            part%first_change = result%first_change
            part%first = result%first
            result = part
            if (.not. result%converged) exit
         end do
      end if
      problem%drag = 0
   end subroutine release

   !> After an accepted increment, before it becomes the base: what it has taken; the viscosity, if it is the first.
   subroutine calibrate(self, problem, balance, change)
      class(stabiliser_t), intent(inout) :: self
      class(problem_t), intent(in) :: problem
      type(balance_t), intent(in) :: balance
      real(wp), intent(in) :: change !< of the load factor
      real(wp), allocatable :: x(:)
      if (.not. self%part > 0) return
      if (balance%known) self%stored = balance%level
      self%taken = self%taken + problem%taken
      if (self%viscosity > 0 .or. .not. (balance%known .and. abs(change) > 0)) return
      allocate (x(problem%n))
      call problem%increment(x)
      call self%guess(abs(balance%energy), x, problem%weight, change)
   end subroutine calibrate

   !> The viscosity that takes the part of an energy along an increment.
   pure subroutine guess(self, energy, x, weight, change)
      class(stabiliser_t), intent(inout) :: self
      real(wp), intent(in) :: energy, x(:), weight(:), change
      real(wp) :: moved
      moved = dot_product(x, weight*x)
      if (moved > 0 .and. self%part > 0) self%viscosity = self%part*energy*abs(change)/moved
   end subroutine guess

   !> Would the increment take more than is allowed? Then the next attempt is damped less.
   logical function exceeds(self, problem, balance)
      class(stabiliser_t), intent(inout) :: self
      class(problem_t), intent(in) :: problem
      type(balance_t), intent(in) :: balance
      exceeds = problem%taken > 0 .and. balance%known
      if (exceeds) exceeds = self%taken + problem%taken > bound*balance%level
      if (exceeds) self%viscosity = weaker*self%viscosity
   end function exceeds

   !> Part of the stored energy that the step has taken.
   pure real(wp) function share(self)
      class(stabiliser_t), intent(in) :: self
      share = 0
      if (self%stored > 0) share = self%taken/self%stored
   end function share
end module finshell_stabilisation
