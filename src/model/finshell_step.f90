!> Steps: how the path of equilibrium states is followed, from the state where the step before ended. Data only.
module finshell_step
   use finshell_kinds, only: wp
   use finshell_status, only: status_invalid_argument
   use finshell_error, only: error_t, raise
   use finshell_factor, only: by_load_factor, by_release
   use finshell_time_plan, only: time_plan_t
   implicit none
   private
   public :: step_t, convergence_t, convergence_preset, ramp_before
   public :: control_load, control_displacement, control_arc_length, control_volume, control_linear, control_buckling, control_name
   public :: control_frequencies, leaves_state, is_mode, mass_higher_order, mass_consistent, mass_lumped
   public :: control_dynamic, control_explicit, is_in_time, is_motion, scheme_generalised_alpha, scheme_conserving
   public :: control_timed, has_course
   public :: prescribes_monitored, off_the_way, snap_ignore, snap_mark, snap_refuse, mixed_never, mixed_always, mixed_auto, &
      tangent_never, tangent_always, tangent_auto

   !> What is prescribed in an increment: the load factor; a displacement; the length of the increment; an enclosed volume.
   integer, parameter :: control_load = 1, control_displacement = 2, control_arc_length = 3, control_volume = 4
   !> Steps in time: the time is prescribed.
   integer, parameter :: control_dynamic = 21, control_explicit = 22
   !> The same without inertia: load, displacement or volume control with a duration (finshell_timed_step).
   integer, parameter :: control_timed = 23
   !> Steps that leave the state as it is: a linear solution, linear buckling, frequencies (finshell_linear_step, finshell_buckling,
   !> finshell_frequencies).
   integer, parameter :: control_linear = 11, control_buckling = 12, control_frequencies = 13

   !> Mass matrices: consistent with linear displacements; lumped, a third of each element at its nodes; of higher order: with
   !> deflections that follow the rotations between the nodes (finshell_linked_mass), of membranes the mean of the other two.
   integer, parameter :: mass_higher_order = 1, mass_consistent = 2, mass_lumped = 3

   !> Schemes of implicit steps in time.
   integer, parameter :: scheme_generalised_alpha = 1, scheme_conserving = 2

   !> What becomes of an increment that snaps to another state, after it has been refined.
   integer, parameter :: snap_ignore = 0, snap_mark = 1, snap_refuse = 2

   !> Mixed-integration-point Newton: never, always, or in iterations that ask for it (finshell_newton).
   integer, parameter :: mixed_never = 0, mixed_always = 1, mixed_auto = 2
   !> The predictor along the tangent: never, always, or while the path is smooth (finshell_tracker).
   integer, parameter :: tangent_never = 0, tangent_always = 1, tangent_auto = 2

   !> When an increment counts as converged: both criteria at once (norms: `finshell_convergence`).
   type :: convergence_t
      real(wp) :: residual = 5.0e-3_wp !< out-of-balance force over reference force, and moments likewise
      real(wp) :: correction = 1.0e-2_wp !< last correction over the whole increment, displacements and rotations
      integer :: maximum_iterations = 25
      !> Mixed-integration-point Newton: the geometric part of the tangent uses stresses predicted by the linearisation. The
      !> solution is unchanged; thin shells take much larger increments.
      integer :: mixed = mixed_auto
      real(wp) :: rotation_limit = 0.4_wp !< largest rotation (radian) of a node in one iteration; <= 0: no limit
   end type convergence_t

   type :: step_t
      character(len=:), allocatable :: name
      integer :: control = control_load
      integer :: case = 1 !< whose factor is the load factor of the step; 1: that of loads and supports without a case
      integer :: scaling = by_load_factor !< the factor that it changes (finshell_factor): what is called the load factor below
      !> The step ends at this load factor, or when the monitored displacement reaches the last of `displacements`, whichever
      !> comes first.
      real(wp) :: final_load_factor = 1
      logical :: ends_at_load_factor = .true. !< false: only `displacements` end the step (the usual case of displacement control)
      real(wp), allocatable :: load_levels(:) !< load factors to land on exactly, in the order of passing
      !> Monitored displacement: mean over a node set of a global component 1..3. Needed by displacement control; in arc-length
      !> and load control it can end the step.
      character(len=:), allocatable :: node_set
      integer :: component = 0
      real(wp), allocatable :: displacements(:) !< values to land on exactly, in the order of passing; the last one ends the step
      !> Volume control, and other controls if `volumes` are given: the volume behind an element set is monitored instead of a
      !> displacement; unallocated: behind the elements whose pressure follows the load factor.
      character(len=:), allocatable :: element_set
      real(wp), allocatable :: volumes(:) !< as `displacements`

      !> Size of the first increment: of the load factor (load control, arc-length) or of the displacement or volume (where that is
      !> prescribed). 0: a tenth of the way to the end of the step. An arc-length step whose first load level lies ahead on the path
      !> of the step before (or that has none) goes on along that path with its last size.
      real(wp) :: first_increment = 0
      real(wp) :: largest_increment = 0 !< same measure, magnitude; 0: no bound
      real(wp) :: smallest_increment = 0 !< 0: 1e-6 of the way
      integer :: maximum_increments = 1000
      integer :: maximum_cuts = 5 !< in a row
      logical :: automatic = .true. !< increments grow and shrink; else all have the first size (cuts apart)
      real(wp) :: growth = 2.0_wp !< largest ratio of an increment to the one before
      integer :: wanted_iterations = 0 !< the size aims at this number of iterations; 0: 5, or 7 with tight tolerances
      logical :: extrapolate = .true. !< start an increment from the extrapolated path
      integer :: tangent_predictor = tangent_auto !< and along its tangent (finshell_predictor)
      real(wp) :: load_scale = 0 !< arc-length: weight of the load factor in the length, 0 cylindrical, 1 spherical
      integer :: modes = 4 !< buckling, frequencies: number of modes
      real(wp) :: near = 0 !< modes nearest to this load factor or frequency; 0: the lowest above the present one, or of all
      integer :: mass = mass_higher_order !< frequencies: the mass matrix (finshell_mass_assembly)
      logical :: rotatory = .true. !< with the inertia of the thickness against rotation
      !> Displacement and volume control: arc-length stands in where the prescribed quantity turns round.
      logical :: switch_control = .true.
      logical :: descent = .true. !< load control: where Newton's method fails, look for a stable state near by going down in energy
      logical :: relaxes = .false. !< load control: every state by dynamic relaxation (finshell_relaxation)
      logical :: fallback = .true. !< load control: where all else fails, go on by dynamic relaxation
      real(wp) :: stabilise = 0 !< load control: part of the energy of the first increment that damping would take; 0: no damping
      logical :: cautious = .false. !< refuse increments that bend sharply, jump in pivots or miss their prediction by far
      integer :: snap = snap_mark !< see finshell_caution; snap_ignore: as any other increment
      integer :: patience = 200 !< increments without coming nearer to the target than before; 0: no limit
      logical :: locate = .false. !< locate limit and bifurcation points
      integer :: switch_branch = 0 !< follow the branch from this bifurcation point, counted within the step; 0: never
      !> Largest displacement of the first increment there; its sign chooses the side; 0: 1 % of the size of the structure.
      real(wp) :: branch_amplitude = 0
      type(convergence_t) :: convergence

      ! Steps in time; their increments are measured in time.
      integer :: prescribes = control_load !< of a static one: control_load, control_displacement or control_volume
      type(time_plan_t) :: time
      integer :: scheme = scheme_generalised_alpha
      real(wp) :: rho_infinity = 0.8_wp !< generalised-alpha: what an increment leaves of the fastest vibrations
      real(wp) :: time_tolerance = 1.0e-3_wp !< estimated error of an increment, relative to the motion
      real(wp) :: safety = 0.9_wp !< explicit: of the increment that is estimated to be stable
      real(wp) :: rotation_scaling = 0.125_wp !< explicit: least rotatory inertia over mass times area of an element
      integer :: history_rows = 200 !< explicit: evenly spaced increments that are reported, beside those at output times
      real(wp) :: mass_damping = 0 !< Rayleigh damping: times the masses, 1/time
      real(wp) :: stiffness_damping = 0 !< Rayleigh damping: times the stiffness of the material, time
   end type step_t

contains

   !> The step under load control that comes before a given one: it brings in constant loads and supports, or lets go what is to be
   !> let go.
   pure function ramp_before(step, scaling) result(ramp)
      type(step_t), intent(in) :: step
      integer, intent(in) :: scaling !< by_constant_factor, by_release, or that of a host
      type(step_t) :: ramp
      ramp%convergence = step%convergence
      ramp%name = 'constant loads'
      if (scaling == by_release) ramp%name = 'what goes before '//step%name
      if (scaling > by_release) ramp%name = 'loads of the host'
      ramp%scaling = scaling
      if (scaling == by_release) ramp%final_load_factor = 0
      ramp%first_increment = 1
      ramp%growth = step%growth
      ramp%descent = step%descent
      ramp%relaxes = step%relaxes
      ramp%fallback = step%fallback
      ramp%wanted_iterations = step%wanted_iterations
   end function ramp_before

   !> Named tolerances: 'paper' (0.5 % of force, 1 % of the increment) or 'tight' (1e-8 of both). Error: unknown name.
   pure subroutine convergence_preset(name, convergence, error)
      character(len=*), intent(in) :: name
      type(convergence_t), intent(inout) :: convergence
      type(error_t), allocatable, intent(out) :: error
      select case (name)
      case ('paper')
         convergence%residual = 5.0e-3_wp
         convergence%correction = 1.0e-2_wp
      case ('tight')
         convergence%residual = 1.0e-8_wp
         convergence%correction = 1.0e-8_wp
      case default
         call raise(error, status_invalid_argument, "unknown convergence preset '"//name//"': use 'paper' or 'tight'")
      end select
   end subroutine convergence_preset

   !> Does a control prescribe the monitored quantity (a displacement or a volume)?
   elemental function prescribes_monitored(control) result(yes)
      integer, intent(in) :: control
      logical :: yes
      yes = control == control_displacement .or. control == control_volume
   end function prescribes_monitored

   !> Position of the first value that does not lie further on the way than the one before it (0: all do): a quantity that is
   !> prescribed does not turn round by itself. `start`: where the way begins, if that is known; the first value may be there.
   pure function off_the_way(values, start) result(at)
      real(wp), intent(in) :: values(:)
      real(wp), intent(in), optional :: start
      integer :: at
      real(wp), parameter :: rounding = 1.0e-10_wp
      real(wp) :: way
      integer :: i
      at = 0
      way = 0
      if (size(values) == 0) return
      if (present(start)) way = values(1) - start
      if (abs(way) <= rounding*maxval(abs(values))) way = 0
      do i = 2, size(values)
         if (.not. abs(way) > 0) way = values(i) - values(i - 1)
         if ((values(i) - values(i - 1))*way > 0) cycle
         at = i
         return
      end do
   end function off_the_way

   !> Does a step with this control look for modes?
   elemental logical function is_mode(control)
      integer, intent(in) :: control
      is_mode = control == control_buckling .or. control == control_frequencies
   end function is_mode

   !> Does time pass in a step with this control?
   elemental logical function is_in_time(control)
      integer, intent(in) :: control
      is_in_time = is_motion(control) .or. control == control_timed
   end function is_in_time

   !> Does it follow a course of implicit increments in time (finshell_course)?
   elemental logical function has_course(control)
      integer, intent(in) :: control
      has_course = control == control_dynamic .or. control == control_timed
   end function has_course

   !> With inertia?
   elemental logical function is_motion(control)
      integer, intent(in) :: control
      is_motion = control == control_dynamic .or. control == control_explicit
   end function is_motion

   !> Does a step with this control leave the state as it is?
   elemental logical function leaves_state(control)
      integer, intent(in) :: control
      leaves_state = control == control_linear .or. is_mode(control)
   end function leaves_state

   pure function control_name(control) result(name)
      integer, intent(in) :: control
      character(len=:), allocatable :: name
      select case (control)
      case (control_load); name = 'load control'
      case (control_displacement); name = 'displacement control'
      case (control_arc_length); name = 'arc-length'
      case (control_volume); name = 'volume control'
      case (control_dynamic); name = 'dynamic'
      case (control_explicit); name = 'explicit'
      case (control_timed); name = 'static in time'
      case (control_linear); name = 'linear'
      case (control_buckling); name = 'buckling'
      case (control_frequencies); name = 'frequencies'
      case default; name = 'unknown control'
      end select
   end function control_name
end module finshell_step
