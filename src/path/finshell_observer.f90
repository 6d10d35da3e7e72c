!> What is told about a converged increment, and to whom.
module finshell_observer
   use finshell_account, only: account_t
   use finshell_kinds, only: wp, dp
   use finshell_error, only: error_t, raise
   use finshell_state, only: state_t, linear_change_t
   implicit none
   private
   public :: record_t, observer_t, vibration_t, motion_t
   public :: stop_is_wanted, raise_stop

   !> Code of the error by which an observer ends a run because somebody wants it to end.
   integer, parameter :: stop_is_wanted = 101

   !> Of a mode of vibration (finshell_frequencies).
   type :: vibration_t
      real(wp) :: frequency = 0 !< cycles per unit of time
      real(wp) :: generalised_mass = 0 !< of the mode with a largest displacement of 1
      real(wp) :: effective_mass(3) = 0 !< along x, y, z
      real(wp) :: whole_mass = 0 !< of the structure
   end type vibration_t

   !> Of a state in motion. Momenta, energies and works are those of the whole structure.
   type :: motion_t
      real(wp) :: time = 0
      logical :: landing = .false. !< fields are asked for at this time
      real(wp) :: kinetic_energy = 0
      real(wp) :: stored_energy = 0 !< in the structure and in foundations
      real(wp) :: work = 0 !< of loads and moved supports, since the step began
      real(wp) :: damped = 0 !< energy taken by damping, since the step began
      real(wp) :: misfit = 0 !< of energies and works: what a scheme that keeps the energy leaves at zero
      real(wp) :: momentum(3) = 0
      real(wp) :: angular_momentum(3) = 0 !< about the origin
   end type motion_t

   type :: record_t
      integer :: increment = 0 !< number of this converged increment, from 1
      integer :: control = 0 !< control of this increment (finshell_step); landing on a load level is load control
      integer :: iterations = 0 !< linear solves of this increment, those of failed attempts included
      integer :: cuts = 0 !< failed attempts before this one
      integer :: negative_pivots = -1 !< of the last tangent; -1: not known (unsymmetric matrix)
      integer :: event = 0 !< limit or bifurcation point (finshell_stability) between this increment and the one before
      logical :: located = .false. !< the event is at this increment
      logical :: snap = .false. !< it leads to another state than the path does (finshell_balance), after refining
      real(wp) :: misfit = 0 !< of work and stored energy, relative
      real(wp) :: load_cosine = 0 !< located: between the null vector and the load
      integer :: regularised = 0 !< iterations with a stand-in for the stiffness that the law does not have (finshell_ground)
      logical :: descended = .false. !< found by a descent (finshell_descent), after Newton's method had failed
      logical :: relaxed = .false. !< found by dynamic relaxation (finshell_relaxation)
      integer :: steps = 0 !< of it, failed attempts included
      real(wp) :: taken = 0 !< by stabilisation since the step began, in parts of the stored energy
      integer :: switched = 0 !< linear solutions that it took to find the fibres that act; 0: no law has such fibres
      real(wp) :: load_factor = 0
      real(wp) :: monitored = 0 !< the step's displacement or volume, 0 when it has none
      real(wp) :: size = 0 !< of the increment, in the measure of its control
      real(wp) :: residual = 0 !< relative, at convergence
      real(wp) :: correction = 0 !< relative, at convergence
      logical :: stands_in = .false. !< arc-length stands in for the control of the step
      logical :: rounding = .false. !< one of them stayed above its tolerance because of rounding
      type(vibration_t) :: vibration !< of a mode
      type(motion_t) :: motion !< of a step in time
      type(account_t) :: account !< of energy, where it was asked for
      real(dp) :: cpu_time = 0 !< seconds since the path began
      integer :: total_increments = 0, total_iterations = 0, total_cuts = 0 !< since the path began
   end type record_t

   type, abstract :: observer_t
   contains
      !> Called after each converged increment. An error ends the run; the state is kept.
      procedure(increment_interface), deferred :: increment
      !> Asked between reports by what has many increments without one: is the run to end here?
      procedure :: wants_stop => never
   end type observer_t

   abstract interface
      subroutine increment_interface(self, state, record, error, change)
         import :: observer_t, state_t, record_t, error_t, linear_change_t
         class(observer_t), intent(inout) :: self
         type(state_t), intent(in) :: state
         type(record_t), intent(in) :: record
         type(error_t), allocatable, intent(out) :: error
         !> What is reported: the linear change that led to `state`, not the state itself.
         type(linear_change_t), intent(in), optional, target :: change
      end subroutine increment_interface
   end interface

contains

   logical function never(self)
      class(observer_t), intent(in) :: self
      never = .false. .and. same_type_as(self, self)
   end function never

   !> End a run as somebody wants.
   pure subroutine raise_stop(error)
      type(error_t), allocatable, intent(inout) :: error
      call raise(error, stop_is_wanted, 'interrupted')
   end subroutine raise_stop
end module finshell_observer
