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
   use finshell_quaternion, only: quaternion_to_rotation_vector
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
                  vector = quaternion_to_rotation_vector(state%rotation(:, w%nodes(k)))
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
               values(i) = pressurised_volume(problem, state)
            case (monitor_energy)
               values(i) = stored_energy(problem, state)
            end select
            values(i) = w%factor*values(i)
         end associate
      end do
   end subroutine monitored_values

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
      integer, allocatable :: elements(:)
      integer(i4), allocatable :: status(:)
      integer :: i, s
      energy = 0
      associate (structure => problem%structure)
         do s = 1, size(structure%sections)
            elements = pack([(i, i=1, size(structure%element_section))], structure%element_section == s)
            call gather(problem, state, elements, x, u, q, direction)
            allocate (status(size(elements)), e(size(elements)))
            call evaluate_elements(structure%sections(s), size(elements), x, u, q, rotation_quaternion, status, energy=e, &
                                   direction=direction)
            energy = energy + sum(e)
            deallocate (status, e)
         end do
      end associate
   end function stored_energy

   !> Element arrays of some elements.
   subroutine gather(problem, state, elements, x, u, q, direction)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: elements(:)
      real(wp), allocatable, intent(out) :: x(:, :, :), u(:, :, :), q(:, :, :), direction(:, :)
      integer :: i, k, node
      allocate (x(3, 3, size(elements)), u(3, 3, size(elements)), q(4, 3, size(elements)), direction(3, size(elements)))
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

   !> Recovered results of some elements, whatever their sections; in the order of `elements`.
   subroutine recover(problem, state, elements, with_stress, r, error)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      integer, intent(in) :: elements(:)
      logical, intent(in) :: with_stress
      type(recovery_t), intent(out) :: r
      type(error_t), allocatable, intent(out) :: error
      real(wp), allocatable :: x(:, :, :), u(:, :, :), q(:, :, :), direction(:, :), l(:), n(:, :), m(:, :), sigma(:, :, :)
      integer, allocatable :: mine(:)
      integer(i4), allocatable :: status(:)
      integer :: i, s

      allocate (r%stretch(size(elements)), r%force(3, size(elements)), r%moment(3, size(elements)))
      if (with_stress) allocate (r%stress(3, 3, size(elements)))
      associate (structure => problem%structure)
         do s = 1, size(structure%sections)
            mine = pack([(i, i=1, size(elements))], structure%element_section(elements) == s)
            if (size(mine) == 0) cycle
            call gather(problem, state, elements(mine), x, u, q, direction)
            allocate (status(size(mine)), l(size(mine)), n(3, size(mine)), m(3, size(mine)), sigma(3, 3, size(mine)))
            call recover_elements(structure%sections(s), size(mine), x, u, q, rotation_quaternion, status, l, n, m, sigma, &
                                  direction)
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
   end subroutine recover

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
            rotation(:, i) = quaternion_to_rotation_vector(state%rotation(:, i))
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
            fields = [fields, field_t('stress_'//trim(heights(i)), 3, r%stress(:, i, :))]
         end do
      end if
   end subroutine cell_fields
end module finshell_monitoring
