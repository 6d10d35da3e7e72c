!> What path following needs to know of a problem: n unknowns x and a load factor, a residual r(x, factor) and its derivatives.
!>
!> The unknowns live in `state` (the trial state); `base` is the last converged state and `iterate` the state before the last
!> correction. Corrections are vectors over the n equations; a problem knows how to apply them (rotations multiply).
module finshell_problem
   use finshell_kinds, only: wp, i1
   use finshell_status, only: status_invalid_argument
   use finshell_error, only: error_t, raise
   use finshell_factor, only: factor_at
   use finshell_state, only: state_t
   use finshell_step, only: step_t
   use finshell_convergence, only: residual_ratios
   use finshell_equations, only: field_rotation
   use finshell_balance, only: balance_t, tangent_of, tangent_t
   use finshell_listener, only: iteration_t, listener_t
   implicit none
   private
   public :: problem_t, stress_own, stress_predicted, stress_kept

   !> What the stresses that the geometric part of the tangent is made of are after a `move`: the elements' own; predicted
   !> (mixed iteration); as they were before, since the motion follows the path of earlier increments, not a
   !> solution of the linearised equations: predicted along it, they would be those of a wrong membrane strain.
   integer, parameter :: stress_own = 0, stress_predicted = 1, stress_kept = 2

   type, abstract :: problem_t
      integer :: n = 0
      integer(i1), allocatable :: field(:) !< (n) field_displacement, field_rotation, field_pressure (finshell_equations)
      real(wp) :: size = 1 !< length of the structure
      real(wp) :: detail = 1 !< length of an element
      type(state_t) :: state, base, iterate
      logical :: has_constants = .false. !< there are constant loads or supports
      real(wp) :: slenderness = huge(1.0_wp) !< least thickness over `size`
      !> The matrix has lost its stiffness in the reference state by the nature of the law: a stand-in can be added to it.
      logical :: soft = .false.
      !> There are parts without stiffness in the reference state where rounding may hide it: membranes.
      logical :: limp = .false.
      logical :: crumples = .false. !< there are membranes that bear compression: under it they fold from element to element
      !> Damping of a static step: times `weight` and the increment, a force against it; `evaluate` adds it to residual and matrix.
      real(wp) :: drag = 0
      real(wp) :: taken = 0 !< energy that it has taken in the increment
      real(wp), allocatable :: weight(:) !< (n) a lumped mass of density 1, for a descent (finshell_descent)
      class(listener_t), pointer :: listener => null() !< of iterations, where somebody asked for one

      !> Pressures that follow from the volumes do so, instead of being unknowns: for those who go by the energy.
      logical :: condensed = .false.
      logical :: confined = .false. !< there are pressures that do not follow from volumes: of liquids that do not yield

      ! Left by `evaluate`:
      real(wp), allocatable :: residual(:) !< (n) external minus internal force
      real(wp), allocatable :: rate(:) !< (n) derivative of the residual with respect to the factor
      real(wp) :: force_level = 0 !< Euclidean norm of the external forces or of the reactions, whichever is larger
      real(wp) :: moment_level = 0 !< of the moments likewise
      real(wp) :: misfit = 0 !< of volumes to what fills them, relative
      !> With tangent, of each pressure among the unknowns: minus the derivative of the room of the fluid with respect to it, and
      !> the derivative of that room with respect to the factor. Unallocated: there are no pressures.
      real(wp), allocatable :: compliance(:), inflow(:)
      real(wp), allocatable :: gradient(:, :) !< (n less pressures, pressures) derivatives of the volumes, with tangent
      real(wp) :: motion_stiffness = 0 !< moved supports: derivative of the reaction to the motion, other nodes held
      ! Left by `factorise`:
      integer :: negative_pivots = -1 !< -1: not known
      integer :: determinant_sign = 0 !< 0: not known

      ! Left by `watch`; where a volume is monitored, also by `evaluate` with tangent.
      real(wp), allocatable :: watched(:) !< (n) its derivative with respect to the unknowns
      real(wp) :: watched_rate = 0 !< its derivative with respect to the load factor
   contains
      procedure(evaluate_interface), deferred :: evaluate
      procedure(factorise_interface), deferred :: factorise
      procedure(solve_interface), deferred :: solve
      procedure(move_interface), deferred :: move
      procedure(increment_interface), deferred :: increment
      procedure(watch_interface), deferred :: watch
      procedure(monitored_interface), deferred :: monitored
      procedure :: watch_volume
      procedure :: watch_step
      procedure :: monitored_or_zero
      procedure :: watched_or_empty
      procedure :: balance
      procedure :: energy_along
      procedure :: fills
      procedure :: tangent_along
      procedure :: keep_base
      procedure :: largest_rotation
      procedure :: magnitude
      procedure :: fictitious_masses
      procedure :: resist
      procedure :: tell
      procedure :: say
      procedure :: taken_by_drag
      procedure :: change
      procedure :: transport
      procedure :: accept
      procedure :: restore
      procedure :: keep_iterate
      procedure :: back_to_iterate
   end type problem_t

   abstract interface
      !> Residual, rate and levels at `state`; with `tangent` also the matrix -d residual/d x for `factorise`.
      !> A recoverable error (code > 0) asks for a shorter correction or increment.
      subroutine evaluate_interface(self, tangent, error, stand_in, stress, scaling)
         import :: problem_t, error_t, wp
         class(problem_t), intent(inout) :: self
         logical, intent(in) :: tangent
         type(error_t), allocatable, intent(out) :: error
         real(wp), intent(in), optional :: stand_in !< part of the stand-in stiffness added to the matrix, not to the residual
         real(wp), intent(in), optional :: stress(:, :) !< for the geometric part of the matrix, as `move` leaves it; absent: own
         integer, intent(in), optional :: scaling !< the factor that `rate` belongs to (finshell_factor; default by_load_factor)
      end subroutine evaluate_interface

      !> Factorise the matrix of the last `evaluate` with tangent.
      subroutine factorise_interface(self, error, damping)
         import :: problem_t, error_t, wp
         class(problem_t), intent(inout) :: self
         type(error_t), allocatable, intent(out) :: error
         real(wp), intent(in), optional :: damping !< times `weight`: added to the diagonal
      end subroutine factorise_interface

      !> Solve matrix * x = b.
      subroutine solve_interface(self, b, x, error)
         import :: problem_t, error_t, wp
         class(problem_t), intent(inout) :: self
         real(wp), intent(in), contiguous :: b(:)
         real(wp), intent(out), contiguous :: x(:)
         type(error_t), allocatable, intent(out) :: error
      end subroutine solve_interface

      !> state <- state moved by the correction x and by a change of a factor.
      subroutine move_interface(self, x, factor_change, kind, stress, scaling)
         import :: problem_t, wp
         class(problem_t), intent(inout) :: self
         real(wp), intent(in) :: x(:), factor_change
         integer, intent(in), optional :: kind !< of `stress`: stress_own (default), stress_predicted or stress_kept
         real(wp), intent(inout), allocatable, optional :: stress(:, :) !< for `evaluate`; unallocated where it is the elements' own
         integer, intent(in), optional :: scaling !< the factor that changes (default by_load_factor)
      end subroutine move_interface

      !> The single correction x that leads from `base` to `state`.
      subroutine increment_interface(self, x)
         import :: problem_t, wp
         class(problem_t), intent(in) :: self
         real(wp), intent(out) :: x(:)
      end subroutine increment_interface

      !> Choose the monitored displacement: mean of a component over a node set. Errors: unknown set, bad component.
      subroutine watch_interface(self, node_set, component, error)
         import :: problem_t, error_t
         class(problem_t), intent(inout) :: self
         character(len=*), intent(in) :: node_set
         integer, intent(in) :: component
         type(error_t), allocatable, intent(out) :: error
      end subroutine watch_interface

      !> The monitored displacement or volume at a state.
      function monitored_interface(self, state) result(value)
         import :: problem_t, state_t, wp
         class(problem_t), intent(in) :: self
         type(state_t), intent(in) :: state
         real(wp) :: value
      end function monitored_interface
   end interface

contains

   !> Monitor the volume behind an element set (default: the pressurised elements). To be overridden by problems that have one.
   subroutine watch_volume(self, error, element_set)
      class(problem_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: element_set
      if (allocated(self%watched)) deallocate (self%watched)
      if (present(element_set)) then
         call raise(error, status_invalid_argument, "step: there is no volume '"//element_set//"' to monitor")
      else
         call raise(error, status_invalid_argument, 'step: there is no volume to monitor')
      end if
   end subroutine watch_volume

   !> Monitor what a step prescribes or arc-length follows; nothing where it has neither.
   subroutine watch_step(self, step, error)
      class(problem_t), intent(inout) :: self
      type(step_t), intent(in) :: step
      type(error_t), allocatable, intent(out) :: error
      if (allocated(step%volumes)) then
         call self%watch_volume(error, step%element_set)
      else if (allocated(step%node_set)) then
         call self%watch(step%node_set, step%component, error)
      else if (allocated(self%watched)) then
         deallocate (self%watched)
      end if
   end subroutine watch_step

   !> Energy balance from `base` to `state`, between which one factor has changed. To be overridden by problems that know their
   !> energy.
   function balance(self, scaling) result(value)
      class(problem_t), intent(inout) :: self
      integer, intent(in) :: scaling
      type(balance_t) :: value
      value%known = self%n < -scaling
   end function balance

   !> Does the factor of the last tangent fill chambers? Volumes are then prescribed, as under volume control.
   pure logical function fills(self)
      class(problem_t), intent(in) :: self
      fills = .false.
      if (allocated(self%inflow)) fills = any(abs(self%inflow) > 0)
   end function fills

   !> The tangent to the path at the last evaluation with tangent: x per change of the factor.
   function tangent_along(self, x, sense) result(tangent)
      class(problem_t), intent(in) :: self
      real(wp), intent(in) :: x(:)
      real(wp), intent(in) :: sense !< of the factor along the path
      type(tangent_t) :: tangent
      tangent = tangent_of(x, self%rate, self%motion_stiffness, self%field, sense, self%compliance, self%inflow)
   end function tangent_along

   !> x^T K x, K x = rhs: the work of the forces along x. Pressures among the unknowns are eliminated from K (finshell_bordered);
   !> where one cannot be, x goes along what keeps its volume.
   pure function energy_along(self, rhs, x) result(energy)
      class(problem_t), intent(in) :: self
      real(wp), intent(in) :: rhs(:), x(:)
      real(wp) :: energy
      integer :: c, i
      energy = dot_product(rhs, x)
      if (.not. allocated(self%compliance)) return
      do c = 1, size(self%compliance)
         i = self%n - size(self%compliance) + c
         energy = energy - 2*rhs(i)*x(i)
         if (self%compliance(c) > 0) energy = energy - self%compliance(c)*x(i)**2 &
            + (rhs(i)/self%compliance(c) + x(i))*(rhs(i) + self%compliance(c)*x(i))
      end do
   end function energy_along

   !> Largest rotation (radian) of a node in a correction. To be overridden where a rotation has several components.
   pure function largest_rotation(self, x, factor_change, scaling) result(angle)
      class(problem_t), intent(in) :: self
      real(wp), intent(in) :: x(:), factor_change
      integer, intent(in) :: scaling !< the factor that changes
      real(wp) :: angle
      integer :: i
      angle = 0*factor_change*scaling
      do i = 1, size(x)
         if (self%field(i) == field_rotation) angle = max(angle, abs(x(i)))
      end do
   end function largest_rotation

   !> Magnitude of the unknowns, measured from the unloaded state, and of what was added up with them for the residual: |matrix| x,
   !> with the matrix factorised last; times epsilon this is what rounding the unknowns does to the residual. To be overridden
   !> where unknowns are stored with rounding.
   subroutine magnitude(self, x, added)
      class(problem_t), intent(in) :: self
      real(wp), intent(out) :: x(:) !< (n)
      real(wp), intent(out), optional :: added(:) !< (n)
      x = 0*self%size
      if (present(added)) added = 0
   end subroutine magnitude

   !> Masses with which no vibration of the structure is faster than steps of length 1 can follow, from the matrix of the last
   !> `evaluate` with tangent. To be overridden by problems that can be relaxed; zero: not known.
   subroutine fictitious_masses(self, mass)
      class(problem_t), intent(in) :: self
      real(wp), intent(out) :: mass(:) !< (n)
      mass = 0*self%size
   end subroutine fictitious_masses

   !> Tell the listener, if there is one, of the state that was evaluated last.
   subroutine tell(self, method, number, mean_levels, scaling, correction, rotation, part, factorised)
      class(problem_t), intent(in) :: self
      character(len=*), intent(in) :: method
      integer, intent(in) :: number !< of the iteration
      real(wp), intent(in) :: mean_levels(2) !< as for residual_ratio
      integer, intent(in) :: scaling !< the factor that changes
      real(wp), intent(in) :: correction, rotation, part !< see iteration_t
      logical, intent(in), optional :: factorised !< default: yes
      type(iteration_t) :: iteration
      if (.not. associated(self%listener)) return
      iteration%method = method
      iteration%number = number
      iteration%residual = residual_ratios(self%residual, self%field, [self%force_level, self%moment_level], mean_levels, &
                                           self%size, self%detail)
      iteration%correction = correction
      iteration%rotation = rotation
      iteration%part = part
      if (present(factorised)) iteration%factorised = factorised
      iteration%negative_pivots = self%negative_pivots
      iteration%factor = factor_at(self%state, scaling)
      call self%listener%iteration(iteration)
   end subroutine tell

   subroutine say(self, text)
      class(problem_t), intent(in) :: self
      character(len=*), intent(in) :: text
      if (associated(self%listener)) call self%listener%say(text)
   end subroutine say

   !> Subtract the drag from the residual.
   subroutine resist(self)
      class(problem_t), intent(inout) :: self
      real(wp), allocatable :: x(:)
      allocate (x(self%n))
      call self%increment(x)
      self%residual = self%residual - self%drag*self%weight*x
   end subroutine resist

   !> Energy that the drag takes from `base` to `state`.
   function taken_by_drag(self) result(energy)
      class(problem_t), intent(in) :: self
      real(wp) :: energy
      real(wp), allocatable :: x(:)
      energy = 0
      if (.not. self%drag > 0) return
      allocate (x(self%n))
      call self%increment(x)
      energy = self%drag*dot_product(x, self%weight*x)
   end function taken_by_drag

   !> Change of a factor from `base` to `state`.
   pure function change(self, scaling) result(value)
      class(problem_t), intent(in) :: self
      integer, intent(in) :: scaling
      real(wp) :: value
      value = factor_at(self%state, scaling) - factor_at(self%base, scaling)
   end function change

   !> A motion that is a correction from `base` to what it is as one from `state`. To be overridden where the same motion
   !> is another vector there.
   subroutine transport(self, x)
      class(problem_t), intent(in) :: self
      real(wp), intent(inout) :: x(:)
      x = x + 0*self%size
   end subroutine transport

   !> The trial state is an equilibrium state: start the next increment from it.
   subroutine accept(self)
      class(problem_t), intent(inout) :: self
      self%state%leaves = .true.
      if (allocated(self%state%past)) call self%state%past%settle(self%state%time)
      self%base = self%state
      call self%keep_base()
   end subroutine accept

   !> Remember of the accepted state what `balance` needs.
   subroutine keep_base(self)
      class(problem_t), intent(inout) :: self
      if (self%n < 0) call self%restore()
   end subroutine keep_base

   !> Forget the trial state.
   subroutine restore(self)
      class(problem_t), intent(inout) :: self
      self%state = self%base
   end subroutine restore

   subroutine keep_iterate(self)
      class(problem_t), intent(inout) :: self
      self%iterate = self%state
   end subroutine keep_iterate

   subroutine back_to_iterate(self)
      class(problem_t), intent(inout) :: self
      self%state = self%iterate
   end subroutine back_to_iterate

   !> The monitored quantity at `state`; 0 where nothing is watched.
   function monitored_or_zero(self) result(value)
      class(problem_t), intent(in) :: self
      real(wp) :: value
      value = 0
      if (allocated(self%watched)) value = self%monitored(self%state)
   end function monitored_or_zero

   !> Its derivative, of length 0 where nothing is watched.
   function watched_or_empty(self) result(watched)
      class(problem_t), intent(in) :: self
      real(wp), allocatable :: watched(:)
      if (allocated(self%watched)) then
         watched = self%watched
      else
         allocate (watched(0))
      end if
   end function watched_or_empty
end module finshell_problem
