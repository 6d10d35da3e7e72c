!> Values of monitored quantities and result fields at an equilibrium state.
module finshell_monitoring
   use finshell_kinds, only: wp, i4
   use finshell_batch, only: evaluate_elements, recover_elements, rotation_quaternion
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error, only: error_t, raise, text_of
   use finshell_field, only: field_t
   use finshell_mesh, only: mesh_t, find_element_set, find_node_set
   use finshell_monitor, only: monitor_t, output_t, monitor_displacement, monitor_rotation, monitor_reaction, &
      monitor_reaction_moment, monitor_thickness_stretch, monitor_volume, monitor_energy, monitor_membrane_force, monitor_moment
   use finshell_pressure, only: enclosed_volume
   use finshell_quaternion, only: quaternion_to_rotation_vector, update_quaternion
   use finshell_state, only: state_t
   use finshell_status, only: status_ok, status_text
   implicit none
   private
   public :: watch_t, new_watch, monitored_values, point_fields, cell_fields

   !> A monitor with its nodes or elements looked up.
   type :: watch_t
      integer :: quantity = monitor_displacement, component = 0
      real(wp) :: factor = 1
      integer, allocatable :: nodes(:), elements(:)
   end type watch_t

   !> What recovery gives, for a list of elements.
   type :: recovery_t
      real(wp), allocatable :: stretch(:), force(:, :), moment(:, :), stress(:, :, :)
   end type recovery_t

contains

   !> Look up the sets of a monitor; they exist, the input was checked.
   pure subroutine new_watch(watch, monitor, mesh)
      type(watch_t), intent(out) :: watch
      type(monitor_t), intent(in) :: monitor
      type(mesh_t), intent(in) :: mesh
      logical, allocatable :: member(:)
      integer :: e

      watch%quantity = monitor%quantity
      watch%component = monitor%component
      watch%factor = monitor%factor
      if (allocated(monitor%node_set)) watch%nodes = mesh%node_sets(find_node_set(mesh, monitor%node_set))%members
      if (allocated(monitor%element_set)) then
         watch%elements = mesh%element_sets(find_element_set(mesh, monitor%element_set))%members
      else if (allocated(watch%nodes)) then
         allocate (member(size(mesh%coordinates, 2)), source=.false.)
         member(watch%nodes) = .true.
         watch%elements = pack([(e, e=1, size(mesh%triangles, 2))], &
                               [(any(member(mesh%triangles(:, e))), e=1, size(mesh%triangles, 2))])
      end if
   end subroutine new_watch

   !> One number per watch.
   subroutine monitored_values(problem, state, watches, values, error)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(watch_t), intent(in) :: watches(:)
      real(wp), intent(out) :: values(:) !< (size(watches))
      type(error_t), allocatable, intent(out) :: error
      type(recovery_t) :: recovery
      real(wp) :: vector(3)
      integer :: i, k

      do i = 1, size(watches)
         associate (w => watches(i))
            values(i) = 0
            select case (w%quantity)
            case (monitor_displacement)
               values(i) = sum(state%displacement(w%component, w%nodes))/size(w%nodes)
            case (monitor_rotation)
               do k = 1, size(w%nodes)
                  vector = rotation_of(problem, state, w%nodes(k))
                  values(i) = values(i) + vector(w%component)/size(w%nodes)
               end do
            case (monitor_reaction, monitor_reaction_moment)
               k = w%component + merge(3, 0, w%quantity == monitor_reaction_moment)
               values(i) = sum(problem%internal_force(k, w%nodes) - problem%external_force(k, w%nodes))
            case (monitor_thickness_stretch, monitor_membrane_force, monitor_moment)
               call recover(problem, state, w%elements, .false., recovery, error)
               if (allocated(error)) return
               select case (w%quantity)
               case (monitor_thickness_stretch); values(i) = sum(recovery%stretch)/size(w%elements)
               case (monitor_membrane_force); values(i) = sum(recovery%force(w%component, :))/size(w%elements)
               case (monitor_moment); values(i) = sum(recovery%moment(w%component, :))/size(w%elements)
               end select
            case (monitor_volume)
               values(i) = changed_volume(problem, state)
            case (monitor_energy)
               values(i) = changed_energy(problem, state)
            end select
            values(i) = w%factor*values(i)
         end associate
      end do
   end subroutine monitored_values

   !> Rotation vector of a node. That of a linear change may be any multiple of a turn, which its quaternion does not know.
   pure function rotation_of(problem, state, node) result(vector)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: node
      real(wp) :: vector(3)
      logical :: linear
      linear = allocated(problem%change)
      if (linear) then
         linear = problem%change%alone
         if (.not. linear) linear = .not. any(abs(problem%state%rotation(2:4, node)) > 0)
      end if
      if (linear) then
         vector = problem%change%motion(4:6, node)
      else
         vector = quaternion_to_rotation_vector(state%rotation(:, node))
      end if
   end function rotation_of

   !> The state of the problem moved by a part of its linear change.
   pure function moved_state(problem, part) result(moved)
      type(equilibrium_t), intent(in) :: problem
      real(wp), intent(in) :: part
      type(state_t) :: moved
      integer :: i
      moved = problem%state
      do i = 1, size(moved%displacement, 2)
         moved%displacement(:, i) = moved%displacement(:, i) + part*problem%change%motion(1:3, i)
         moved%rotation(:, i) = update_quaternion(moved%rotation(:, i), part*problem%change%motion(4:6, i))
      end do
   end function moved_state

   !> Part of a linear change over which a central difference gives derivatives to six digits and more.
   pure real(wp) function small_part(problem)
      type(equilibrium_t), intent(in) :: problem
      real(wp), parameter :: small_rotation = 1.0e-5_wp
      real(wp) :: largest
      associate (motion => problem%change%motion)
         largest = max(maxval(abs(motion(4:6, :))), maxval(abs(motion(1:3, :)))/problem%detail)
      end associate
      small_part = small_rotation
      if (largest > 0) small_part = small_rotation/largest
   end function small_part

   !> Volume of the state, or linearised.
   function changed_volume(problem, state) result(volume)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: volume
      real(wp) :: part
      if (.not. allocated(problem%change)) then
         volume = pressurised_volume(problem, state)
         return
      end if
      part = small_part(problem)
      volume = (pressurised_volume(problem, moved_state(problem, part)) &
                - pressurised_volume(problem, moved_state(problem, -part)))/(2*part)
      if (.not. problem%change%alone) volume = volume + pressurised_volume(problem, problem%state)
   end function changed_volume

   !> Stored energy, to second order of a linear change.
   function changed_energy(problem, state) result(energy)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: energy
      if (.not. allocated(problem%change)) then
         energy = stored_energy(problem, state)
      else
         energy = problem%change%energy
         if (.not. problem%change%alone) energy = energy + stored_energy(problem, problem%state)
      end if
   end function changed_energy

   !> Volume between the pressurised elements and the origin of their pressure.
   function pressurised_volume(problem, state) result(volume)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: volume
      real(wp), allocatable :: x(:, :, :)
      integer :: i, j, k, node
      volume = 0
      do i = 1, size(problem%external%pressures)
         associate (region => problem%external%pressures(i), mesh => problem%structure%mesh)
            allocate (x(3, 3, size(region%elements)))
            do j = 1, size(region%elements)
               do k = 1, 3
                  node = mesh%triangles(k, region%elements(j))
                  x(:, k, j) = mesh%coordinates(:, node) + state%displacement(:, node)
               end do
            end do
            volume = volume + enclosed_volume(size(region%elements), x, region%origin)
            deallocate (x)
         end associate
      end do
   end function pressurised_volume

   function stored_energy(problem, state) result(energy)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: energy
      real(wp), allocatable :: x(:, :, :), u(:, :, :), q(:, :, :), direction(:, :), e(:)
      logical, allocatable :: straight(:, :)
      integer, allocatable :: elements(:)
      integer(i4), allocatable :: status(:)
      integer :: i, s
      energy = 0
      associate (structure => problem%structure)
         do s = 1, size(structure%sections)
            elements = pack([(i, i=1, size(structure%element_section))], structure%element_section == s)
            call gather(problem, state, elements, x, u, q, direction, straight)
            allocate (status(size(elements)), e(size(elements)))
            call evaluate_elements(structure%sections(s), size(elements), x, u, q, rotation_quaternion, status, energy=e, &
                                   direction=direction, straight=straight)
            energy = energy + sum(e)
            deallocate (status, e)
         end do
      end associate
   end function stored_energy

   !> Element arrays of some elements.
   subroutine gather(problem, state, elements, x, u, q, direction, straight)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: elements(:)
      real(wp), allocatable, intent(out) :: x(:, :, :), u(:, :, :), q(:, :, :), direction(:, :)
      logical, allocatable, intent(out) :: straight(:, :) !< unallocated: none
      integer :: i, k, node
      allocate (x(3, 3, size(elements)), u(3, 3, size(elements)), q(4, 3, size(elements)), direction(3, size(elements)))
      if (allocated(problem%equations%straight)) straight = problem%equations%straight(:, elements)
      associate (structure => problem%structure)
         do i = 1, size(elements)
            do k = 1, 3
               node = structure%mesh%triangles(k, elements(i))
               x(:, k, i) = structure%mesh%coordinates(:, node)
               u(:, k, i) = state%displacement(:, node)
               q(:, k, i) = state%rotation(:, node)
            end do
            direction(:, i) = [1, 0, 0]
            if (allocated(structure%direction)) direction(:, i) = structure%direction(:, elements(i))
         end do
      end associate
   end subroutine gather

   !> Recovered results of some elements at a state, or of a linear change.
   subroutine recover(problem, state, elements, with_stress, r, error)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: elements(:)
      logical, intent(in) :: with_stress
      type(recovery_t), intent(out) :: r
      type(error_t), allocatable, intent(out) :: error
      type(recovery_t) :: forward, backward
      real(wp) :: weight, half

      if (.not. allocated(problem%change)) then
         call recover_at(problem, state, elements, with_stress, r, error)
         return
      end if
      call recover_at(problem, problem%state, elements, with_stress, r, error)
      if (.not. allocated(error)) call recover_at(problem, moved_state(problem, small_part(problem)), elements, with_stress, &
                                                  forward, error)
      if (.not. allocated(error)) call recover_at(problem, moved_state(problem, -small_part(problem)), elements, with_stress, &
                                                  backward, error)
      if (allocated(error)) return
      weight = merge(0.0_wp, 1.0_wp, problem%change%alone)
      half = 0.5_wp/small_part(problem)
      r%stretch = weight*r%stretch + half*(forward%stretch - backward%stretch)
      r%force = weight*r%force + half*(forward%force - backward%force)
      r%moment = weight*r%moment + half*(forward%moment - backward%moment)
      if (with_stress) r%stress = weight*r%stress + half*(forward%stress - backward%stress)
   end subroutine recover

   !> The same at one state, whatever the sections; in the order of `elements`.
   subroutine recover_at(problem, state, elements, with_stress, r, error)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: elements(:)
      logical, intent(in) :: with_stress
      type(recovery_t), intent(out) :: r
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: x(:, :, :), u(:, :, :), q(:, :, :), direction(:, :), l(:), n(:, :), m(:, :), sigma(:, :, :)
      integer, allocatable :: mine(:)
      logical, allocatable :: straight(:, :)
      integer(i4), allocatable :: status(:)
      integer :: i, s

      allocate (r%stretch(size(elements)), r%force(3, size(elements)), r%moment(3, size(elements)))
      if (with_stress) allocate (r%stress(3, 3, size(elements)))
      associate (structure => problem%structure)
         do s = 1, size(structure%sections)
            mine = pack([(i, i=1, size(elements))], structure%element_section(elements) == s)
            if (size(mine) == 0) cycle
            call gather(problem, state, elements(mine), x, u, q, direction, straight)
            allocate (status(size(mine)), l(size(mine)), n(3, size(mine)), m(3, size(mine)), sigma(3, 3, size(mine)))
            call recover_elements(structure%sections(s), size(mine), x, u, q, rotation_quaternion, status, l, n, m, sigma, &
                                  direction, straight=straight)
            i = findloc(status == status_ok, .false., dim=1)
            if (i > 0) then
               call raise(error, status(i), 'element '//text_of(elements(mine(i)))//': '//status_text(status(i)))
               return
            end if
            r%stretch(mine) = l
            r%force(:, mine) = n
            r%moment(:, mine) = m
            if (with_stress) r%stress(:, :, mine) = sigma
            deallocate (status, l, n, m, sigma)
         end do
      end associate
   end subroutine recover_at

   !> Nodal result fields.
   function point_fields(problem, state, output) result(fields)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(output_t), intent(in) :: output
      type(field_t), allocatable :: fields(:)
      real(wp), allocatable :: rotation(:, :)
      integer :: i
      fields = [field_t('displacement', 3, state%displacement)]
      if (output%rotation) then
         allocate (rotation(3, size(state%rotation, 2)))
         do i = 1, size(rotation, 2)
            rotation(:, i) = rotation_of(problem, state, i)
         end do
         fields = [fields, field_t('rotation', 3, rotation)]
      end if
      if (output%reaction) fields = [fields, field_t('reaction', 3, problem%internal_force(1:3, :) &
                                                     - problem%external_force(1:3, :))]
   end function point_fields

   !> Element result fields. Nothing is recovered unless asked for.
   subroutine cell_fields(problem, state, output, fields, error)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(output_t), intent(in) :: output
      type(field_t), allocatable, intent(out) :: fields(:)
      type(error_t), allocatable, intent(out) :: error
      character(len=*), parameter :: heights(3) = [character(len=6) :: 'bottom', 'middle', 'top']
      type(recovery_t) :: r
      integer :: i
      allocate (fields(0))
      if (.not. (output%thickness_stretch .or. output%membrane_force .or. output%moment .or. output%stress)) return
      call recover(problem, state, [(i, i=1, size(problem%structure%mesh%triangles, 2))], output%stress, r, error)
      if (allocated(error)) return
      if (output%thickness_stretch) fields = [fields, field_t('thickness_stretch', 1, reshape(r%stretch, [1, size(r%stretch)]))]
      if (output%membrane_force) fields = [fields, field_t('membrane_force', 3, r%force)]
      if (output%moment) fields = [fields, field_t('moment', 3, r%moment)]
      if (output%stress) then
         do i = 1, 3
            fields = [fields, field_t('stress_'//trim(heights(i)), 3, (r%stress(:, i, :)))]
         end do
      end if
   end subroutine cell_fields
end module finshell_monitoring
