!> Damping that helps a static step under load control over snaps and wrinkles that are local: a force against each increment,
!> viscosity * mass * increment / (change of the load factor), as if the load factor were a time.
!>
!> The first increment goes without; the viscosity is such that the force would have taken a given part of the energy that the
!> increment has stored (as Abaqus' stabilisation does). As the force goes with the increment over its size, shorter increments
!> are damped more. The energy that it takes is bounded, in parts of the stored energy; an increment that would exceed the bound
!> is refused and tried with a weaker force. At load levels and at the end of the step the force fades to nothing: those states
!> are equilibrium states as any other.
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
      procedure :: object
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

   !> After the increment has converged (`result`): note what was taken. With `completely` go on to equilibrium without damping;
   !> where that fails, so has the increment.
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
   subroutine calibrate(self, problem, scaling, change)
      class(stabiliser_t), intent(inout) :: self
      class(problem_t), intent(inout) :: problem
      integer, intent(in) :: scaling !< the factor that changed
      real(wp), intent(in) :: change !< of it
      type(balance_t) :: balance
      real(wp), allocatable :: x(:)
      real(wp) :: moved
      if (.not. self%part > 0) return
      balance = problem%balance(scaling)
      if (balance%known) self%stored = balance%level
      self%taken = self%taken + problem%taken
      if (self%viscosity > 0 .or. .not. (balance%known .and. abs(change) > 0)) return
      allocate (x(problem%n))
      call problem%increment(x)
      moved = dot_product(x, problem%weight*x)
      if (moved > 0) self%viscosity = self%part*abs(balance%energy)*abs(change)/moved
   end subroutine calibrate

   !> Object to an increment that takes more than is allowed; the next attempt is damped less.
   subroutine object(self, problem, scaling, complaint)
      class(stabiliser_t), intent(inout) :: self
      class(problem_t), intent(inout) :: problem
      integer, intent(in) :: scaling !< the factor that changed
      character(len=:), allocatable, intent(inout) :: complaint
      type(balance_t) :: balance
      if (.not. problem%taken > 0) return
      balance = problem%balance(scaling)
      if (.not. balance%known) return
      if (self%taken + problem%taken <= bound*balance%level) return
      self%viscosity = weaker*self%viscosity
      complaint = 'the stabilisation would take more energy than it may'
   end subroutine object

   !> Part of the stored energy that the step has taken.
   pure real(wp) function share(self)
      class(stabiliser_t), intent(in) :: self
      share = 0
      if (self%stored > 0) share = self%taken/self%stored
   end function share
end module finshell_stabilisation
