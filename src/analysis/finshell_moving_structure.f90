!> A structure as a problem for path following, as far as it moves: its unknowns, where a correction of them leads, and what a step
!> watches of it. The forces that it meets there are finshell_equilibrium's.
!>
!> Unknowns are displacements and spins in the axes of the nodes, then the pressures of chambers.
module finshell_moving_structure
   use finshell_kinds, only: wp
   use finshell_freedoms, only: n_nodal
   use finshell_error, only: error_t
   use finshell_assembly, only: assembly_t, predict_stress
   use finshell_batch, only: n_resultants
   use finshell_connectors, only: largest_turn_with_lines
   use finshell_description, only: describe
   use finshell_equations, only: equations_t, field_pressure, scatter, unknowns_of
   use finshell_external, only: external_t
   use finshell_factor, only: by_constant_factor, by_load_factor, factor_at, factors_at, set_factor, slopes, start_following
   use finshell_ground, only: lumped_weight
   use finshell_held_motion, only: held_change, turn_held
   use finshell_mean_displacement, only: mean_displacement_t, new_mean_displacement
   use finshell_past, only: new_past
   use finshell_problem, only: problem_t, stress_kept, stress_own
   use finshell_retraction, only: retraction_t, new_retraction
   use finshell_state, only: state_t, new_state, move_state, motion_between
   use finshell_structure, only: structure_t
   use finshell_volume, only: volume_t, new_volume
   use finshell_watched, only: watched_t
   implicit none
   private
   public :: moving_structure_t

   type, extends(problem_t), abstract :: moving_structure_t
      type(structure_t), pointer :: structure => null()
      type(equations_t) :: equations
      type(external_t) :: external
      type(assembly_t) :: assembly
      class(watched_t), allocatable, private :: quantity !< that is watched
      type(retraction_t), private :: retraction
   contains
      procedure :: begin_unloaded
      procedure :: refresh
      procedure :: move
      procedure :: increment
      procedure :: transport
      procedure :: largest_rotation
      procedure :: watch
      procedure :: watch_volume
      procedure :: renew_watched
      procedure :: monitored
   end type moving_structure_t

contains

   !> What path following is told of the structure, once its equations and loads are known, and the unloaded state. Nothing is
   !> watched yet.
   subroutine begin_unloaded(self, stage)
      class(moving_structure_t), intent(inout) :: self
      integer, intent(in) :: stage !< the step that begins
      call describe(self, self%structure, self%equations)
      associate (structure => self%structure, equations => self%equations, chambers => self%external%chambers)
         self%n = equations%n + chambers%n
         self%field = [equations%field, spread(field_pressure, 1, chambers%n)]
         self%confined = .not. chambers%yields()
         call new_retraction(self%retraction, structure)
         self%weight = [lumped_weight(structure%mesh, equations, self%detail), spread(0.0_wp, 1, chambers%n)]
         self%has_constants = self%external%has_constants .or. any(abs(equations%motion(:, :, by_constant_factor)) > 0)
         call new_state(self%state, size(structure%mesh%coordinates, 2), structure%cases + chambers%n)
         call new_past(self%state%past, structure%sections, size(structure%mesh%triangles, 2))
         self%state%stage = stage
         if (allocated(structure%growths)) self%has_constants = self%has_constants &
            .or. any(structure%growths%list%scaling == by_constant_factor .and. structure%growths%list%span%covers(stage))
         call start_following(self%state, structure%followers)
      end associate
      self%base = self%state
      self%iterate = self%state
   end subroutine begin_unloaded

   !> Dependent nodes where the others have them, and what moves them from there.
   subroutine refresh(self)
      class(moving_structure_t), intent(inout) :: self
      if (.not. self%equations%links%any()) return
      call self%equations%links%settle(self%state)
      call self%equations%links%refresh(self%state)
      call self%assembly%linked%blocks%expand(self%equations)
      call self%external%refresh(self%equations)
   end subroutine refresh

   !> Displacements add, spins turn; held components follow the factor.
   subroutine move(self, x, factor_change, kind, stress, scaling)
      class(moving_structure_t), intent(inout) :: self
      real(wp), intent(in) :: x(:), factor_change
      integer, intent(in), optional :: kind
      real(wp), intent(inout), allocatable, optional :: stress(:, :)
      integer, intent(in), optional :: scaling
      real(wp), allocatable :: nodal(:, :), before(:)
      integer :: active, many
      active = by_load_factor
      many = size(self%equations%motion, 3)
      if (present(scaling)) active = scaling
      call self%refresh()
      before = factors_at(self%state, many)
      call set_factor(self%state, active, factor_at(self%state, active) + factor_change)
      allocate (nodal(n_nodal, size(self%equations%number, 2)))
      call scatter(self%equations, x, nodal)
      nodal(:, self%equations%moved) = nodal(:, self%equations%moved) &
                                       + held_change(self%equations, factors_at(self%state, many) - before)
      call self%equations%links%extend(nodal)
      if (present(kind) .and. present(stress)) then
         if (kind == stress_own .and. allocated(stress)) deallocate (stress)
         if (kind /= stress_own .and. .not. allocated(stress)) allocate (stress(n_resultants, self%assembly%elements))
         if (allocated(stress)) &
            call predict_stress(self%assembly, self%structure, self%state, merge(0.0_wp, nodal, kind == stress_kept), stress)
      end if
      call self%retraction%turn_on(self%structure%mesh, self%equations, self%state, 1.0_wp, nodal)
      call move_state(self%state, nodal)
      call turn_held(self%equations, self%state)
      call self%equations%links%settle(self%state)
      call self%external%chambers%move(self%state, x(self%equations%n + 1:))
   end subroutine move

   !> From base to state: displacements, and the rotation vectors of the relative rotations.
   subroutine increment(self, x)
      class(moving_structure_t), intent(in) :: self
      real(wp), intent(out) :: x(:)
      real(wp), allocatable :: nodal(:, :)
      nodal = motion_between(self%base, self%state)
      call self%retraction%turn_on(self%structure%mesh, self%equations, self%base, -1.0_wp, nodal)
      call unknowns_of(self%equations, nodal, x(:self%equations%n))
      x(self%equations%n + 1:) = self%external%chambers%moved(self%base, self%state)
   end subroutine increment

   subroutine transport(self, x)
      class(moving_structure_t), intent(in) :: self
      real(wp), intent(inout) :: x(:)
      call self%retraction%transport(self%structure%mesh, self%equations, self%base, self%state, x(:self%equations%n))
   end subroutine transport

   pure function largest_rotation(self, x, factor_change, scaling) result(angle)
      class(moving_structure_t), intent(in) :: self
      real(wp), intent(in) :: x(:), factor_change
      integer, intent(in) :: scaling
      real(wp) :: angle
      angle = largest_turn_with_lines(self%external%list, self%structure, self%equations, x, &
                                      factor_change*slopes(self%state, scaling, size(self%equations%motion, 3)))
   end function largest_rotation

   !> Monitor the mean of a global displacement component over a node set.
   subroutine watch(self, node_set, component, error)
      class(moving_structure_t), intent(inout) :: self
      character(len=*), intent(in) :: node_set
      integer, intent(in) :: component
      type(error_t), allocatable, intent(out) :: error
      type(mean_displacement_t) :: mean
      if (allocated(self%watched)) deallocate (self%watched)
      call self%refresh()
      call new_mean_displacement(mean, self%structure%mesh, self%equations, node_set, component, error)
      if (.not. allocated(error)) call begin_to_watch(self, mean)
   end subroutine watch

   !> Monitor the volume behind an element set; see finshell_volume.
   subroutine watch_volume(self, error, element_set)
      class(moving_structure_t), intent(inout) :: self
      type(error_t), allocatable, intent(out) :: error
      character(len=*), intent(in), optional :: element_set
      type(volume_t) :: volume
      if (allocated(self%watched)) deallocate (self%watched)
      call new_volume(volume, self%structure, self%equations, self%external, error, element_set)
      if (.not. allocated(error)) call begin_to_watch(self, volume)
   end subroutine watch_volume

   subroutine begin_to_watch(self, quantity)
      class(moving_structure_t), intent(inout) :: self
      class(watched_t), intent(in) :: quantity
      if (allocated(self%quantity)) deallocate (self%quantity)
      allocate (self%quantity, source=quantity)
      allocate (self%watched(self%n), source=0.0_wp)
      call self%renew_watched()
   end subroutine begin_to_watch

   !> The derivatives of what is watched, at the present state.
   subroutine renew_watched(self)
      class(moving_structure_t), intent(inout) :: self
      if (allocated(self%watched)) call self%quantity%gradient(self%structure, self%equations, self%state, &
         self%watched(:self%equations%n), self%watched_rate)
   end subroutine renew_watched

   function monitored(self, state) result(value)
      class(moving_structure_t), intent(in) :: self
      type(state_t), intent(in) :: state
      real(wp) :: value
      value = self%quantity%value(self%structure, state)
   end function monitored
end module finshell_moving_structure
