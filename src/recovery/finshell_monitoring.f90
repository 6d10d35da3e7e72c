!> Values of monitored quantities and result fields at an equilibrium state.
module finshell_monitoring
   use finshell_kinds, only: wp, i4
   use finshell_connectors, only: measure_connector
   use finshell_cut, only: cut_t, new_cut
   use finshell_freedoms, only: rx, rz, ux, uz
   use finshell_discretisation, only: evaluate_gathered, gather_elements, gathered_t
   use finshell_enclosed_volume, only: volume_behind
   use finshell_equilibrium, only: equilibrium_t
   use finshell_error_indicator, only: estimate_error, indicator_t
   use finshell_field, only: motion_columns
   use finshell_field_batch, only: element_field_t, element_fields, n_element_fields
   use finshell_mesh, only: mesh_t, find_element_set, find_node_set, twice_area_vector
   use finshell_monitor, only: monitor_t, reduce_mean, reduce_sum, reduce_max, reduce_min
   use finshell_node_fields, only: node_field_t, node_fields, node_results_t, n_node_fields
   use finshell_recovery, only: recovery_t, recover, recovered
   use finshell_result_fields, only: result_field_t, result_fields, error_entry, on_connector, on_cut, on_nodes, on_elements
   use finshell_rotation, only: cross_product
   use finshell_section_force, only: section_resultant
   use finshell_state, only: state_t, moved_state, linear_change_t, small_part
   use finshell_structure, only: thickness_of
   implicit none
   private
   public :: watch_t, new_watch, monitored_values, watched_elements, watched_entries, new_node_results, slack_share, &
      stored_energy

   !> A monitor with its field, its nodes or its elements looked up.
   type :: watch_t
      type(result_field_t) :: field
      integer :: component = 1, place = 1, reduce = reduce_mean
      real(wp) :: factor = 1
      integer, allocatable :: nodes(:), elements(:)
      character(len=:), allocatable :: connector
      real(wp), allocatable :: point(:) !< (3) reactions: moments of forces about it count
      type(cut_t) :: cut
   end type watch_t

contains

   !> Look up the sets of a monitor; they exist, the input was checked.
   pure subroutine new_watch(watch, monitor, mesh)
      type(watch_t), intent(out) :: watch
      type(monitor_t), intent(in) :: monitor
      type(mesh_t), intent(in) :: mesh
      type(result_field_t), allocatable :: table(:)
      logical, allocatable :: member(:)
      integer :: e

      table = result_fields()
      watch%field = table(monitor%quantity)
      watch%component = max(1, monitor%component)
      watch%place = monitor%place
      watch%reduce = monitor%reduce
      watch%factor = monitor%factor
      if (allocated(monitor%connector)) watch%connector = monitor%connector
      if (watch%field%on == on_cut) then
         call new_cut(watch%cut, mesh, monitor%element_set, monitor%node_set, monitor%point)
         return
      end if
      if (allocated(monitor%point)) watch%point = monitor%point
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
   recursive subroutine monitored_values(problem, state, watches, values, missing, recovery, change, motion)
      type(equilibrium_t), intent(in), target :: problem
      type(state_t), intent(in), target :: state
      type(watch_t), intent(in) :: watches(:)
      real(wp), intent(out) :: values(:) !< (size(watches))
      logical, intent(out) :: missing(:) !< (size(watches)) an element has no such value; that of the watch is 0
      type(recovery_t), intent(in), optional :: recovery !< of the elements that the watches need, if there is one already
      type(linear_change_t), intent(in), optional, target :: change !< what is reported, instead of the state
      real(wp), intent(in), optional :: motion(:) !< values of motion_columns; absent: at rest
      type(recovery_t) :: own
      type(node_results_t) :: results
      type(indicator_t) :: indicator
      type(node_field_t) :: nodal(n_node_fields)
      real(wp), allocatable :: one(:, :)
      real(wp) :: resultant(rz)
      integer :: i, k

      if (.not. present(recovery)) then
         call recover(problem, state, watched_elements(watches, size(problem%structure%mesh%triangles, 2)), &
                      watched_entries(watches), own, change)
         call monitored_values(problem, state, watches, values, missing, own, change, motion)
         return
      end if
      missing = .false.
      nodal = node_fields()
      call new_node_results(problem, state, results, change)
      do i = 1, size(watches)
         associate (w => watches(i))
            values(i) = 0
            select case (w%field%on)
            case (on_nodes)
               one = reshape([(nodal(w%field%entry)%recover(results, w%nodes(k)), k=1, size(w%nodes))], [3, size(w%nodes)])
               if (allocated(w%point)) one = one + arms(w)
               values(i) = reduced(one(w%component, :), w%reduce)
            case (on_cut)
               resultant = section_resultant(problem, state, w%cut, change)
               values(i) = resultant(w%component + merge(rx - ux, 0, w%field%name == 'section_moment'))
            case (on_elements)
               associate (field => recovery%fields(recovered(recovery, w%field%entry)), list => recovery%place(w%elements))
                  missing(i) = any(field%missing(w%place, list))
                  if (missing(i)) cycle
                  values(i) = reduced(field%values(w%component, w%place, list), w%reduce)
               end associate
            case (on_connector)
               values(i) = reduced(changed_connector(problem, state, w%connector, w%field%name == 'connector_force', change), &
                                   w%reduce)
            case default
               if (w%field%name == 'volume') values(i) = changed_volume(problem, state, change)
               if (w%field%name == 'energy') values(i) = changed_energy(problem, state, change)
               if (w%field%name == 'time') values(i) = state%time
               if (present(motion)) values(i) = values(i) + moving(w%field%name, w%component, motion)
               if (w%field%name == 'relative_error') then
                  call estimate_error(problem, state, indicator, change)
                  values(i) = indicator%relative
               end if
            end select
            values(i) = w%factor*values(i)
         end associate
      end do

   contains

      !> Moments of the reactions of the nodes about the point of a watch. Of a linear change the arms are those of the state.
      function arms(w) result(moments)
         type(watch_t), intent(in) :: w
         real(wp) :: moments(3, size(w%nodes)), place(3)
         integer :: n
         do n = 1, size(w%nodes)
            place = problem%structure%mesh%coordinates(:, w%nodes(n)) + problem%state%displacement(:, w%nodes(n))
            moments(:, n) = cross_product(place - w%point, results%internal_force(ux:uz, w%nodes(n)) &
                                          - results%external_force(ux:uz, w%nodes(n)))
         end do
      end function arms
   end subroutine monitored_values

   !> A quantity of the whole structure in motion, 0 if it is none.
   pure real(wp) function moving(name, component, motion)
      character(len=*), intent(in) :: name
      integer, intent(in) :: component
      real(wp), intent(in) :: motion(:) !< values of motion_columns
      integer :: first
      moving = 0
      select case (name)
      case ('kinetic_energy'); first = findloc(motion_columns, 'kinetic_energy', dim=1)
      case ('momentum'); first = findloc(motion_columns, 'momentum_x', dim=1)
      case ('angular_momentum'); first = findloc(motion_columns, 'angular_momentum_x', dim=1)
      case default; return
      end select
      moving = motion(first + component - 1)
   end function moving

   !> One number out of several.
   pure real(wp) function reduced(values, reduce)
      real(wp), intent(in) :: values(:)
      integer, intent(in) :: reduce
      select case (reduce)
      case (reduce_sum); reduced = sum(values)
      case (reduce_max); reduced = maxval(values)
      case (reduce_min); reduced = minval(values)
      case default; reduced = sum(values)/size(values)
      end select
   end function reduced

   !> The elements whose recovered results the watches use.
   pure function watched_elements(watches, elements) result(list)
      type(watch_t), intent(in) :: watches(:)
      integer, intent(in) :: elements !< their number in the mesh
      integer, allocatable :: list(:)
      logical :: needed(elements)
      integer :: i
      needed = .false.
      do i = 1, size(watches)
         if (watches(i)%field%on == on_elements) needed(watches(i)%elements) = .true.
      end do
      list = pack([(i, i=1, elements)], needed)
   end function watched_elements

   !> The element fields that the watches use.
   pure function watched_entries(watches) result(list)
      type(watch_t), intent(in) :: watches(:)
      integer, allocatable :: list(:)
      integer :: i
      list = pack([(i, i=1, error_entry)], &
                  [(any(watches%field%on == on_elements .and. watches%field%entry == i), i=1, error_entry)])
   end function watched_entries

   !> What nodal fields are made of.
   subroutine new_node_results(problem, state, results, change)
      type(equilibrium_t), intent(in), target :: problem
      type(state_t), intent(in), target :: state
      type(node_results_t), intent(out) :: results
      type(linear_change_t), intent(in), optional, target :: change
      results%state => state
      results%internal_force => problem%internal_force
      results%external_force => problem%external_force
      if (problem%equations%links%any()) results%joined = problem%equations%links%folded(problem%internal_force &
                                                                                         - problem%external_force)
      if (.not. present(change)) return
      results%spin => change%motion(rx:rz, :)
      if (.not. change%alone) results%base => problem%state%rotation
   end subroutine new_node_results

   !> Volume of the state, or linearised.
   function changed_volume(problem, state, change) result(volume)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(linear_change_t), intent(in), optional :: change
      real(wp) :: volume
      real(wp) :: part
      if (.not. present(change)) then
         volume = pressurised_volume(problem, state)
         return
      end if
      associate (motion => change%motion)
         part = small_part(motion, problem%detail)
         volume = (pressurised_volume(problem, moved_state(problem%state, motion, part)) &
                   - pressurised_volume(problem, moved_state(problem%state, motion, -part)))/(2*part)
      end associate
      if (.not. change%alone) volume = volume + pressurised_volume(problem, problem%state)
   end function changed_volume

   !> Forces or extensions of the members of a connector, or linearised.
   function changed_connector(problem, state, name, forces, change) result(values)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      character(len=*), intent(in) :: name
      logical, intent(in) :: forces
      type(linear_change_t), intent(in), optional :: change
      real(wp), allocatable :: values(:)
      real(wp) :: part
      if (.not. present(change)) then
         values = at(state)
         return
      end if
      part = small_part(change%motion, problem%detail)
      values = (at(moved_state(problem%state, change%motion, part)) - at(moved_state(problem%state, change%motion, -part)))/(2*part)
      if (.not. change%alone) values = values + at(problem%state)

   contains

      function at(where_it_is) result(found)
         type(state_t), intent(in) :: where_it_is
         real(wp), allocatable :: found(:), force(:), extension(:)
         call measure_connector(problem%external%list, name, problem%structure, where_it_is, force, extension)
         if (forces) call move_alloc(force, found)
         if (.not. forces) call move_alloc(extension, found)
      end function at
   end function changed_connector

   !> Stored energy, to second order of a linear change.
   function changed_energy(problem, state, change) result(energy)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(linear_change_t), intent(in), optional :: change
      real(wp) :: energy
      if (.not. present(change)) then
         energy = stored_energy(problem, state)
      else
         energy = change%energy
         if (.not. change%alone) energy = energy + stored_energy(problem, problem%state)
      end if
   end function changed_energy

   !> Volume between the pressurised elements and the origin of their pressure.
   function pressurised_volume(problem, state) result(volume)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: volume
      integer :: i
      volume = 0
      do i = 1, size(problem%external%pressures)
         associate (region => problem%external%pressures(i))
            volume = volume + volume_behind(problem%structure, region%elements, region%curved, region%origin, state, &
                                             problem%equations%held)
         end associate
      end do
   end function pressurised_volume

   function stored_energy(problem, state) result(energy)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      real(wp) :: energy
      type(gathered_t) :: g
      real(wp), allocatable :: e(:)
      integer, allocatable :: elements(:)
      integer(i4), allocatable :: status(:)
      integer :: i, s
      energy = problem%external%standing_energy(problem%structure, problem%equations, state)
      associate (structure => problem%structure)
         do s = 1, size(structure%sections)
            elements = pack([(i, i=1, size(structure%element_section))], structure%element_section == s)
            call gather_elements(structure, state, elements, g, problem%equations%held)
            allocate (status(size(elements)), e(size(elements)))
            call evaluate_gathered(structure%sections(s), g, status, energy=e)
            energy = energy + sum(e)
            deallocate (status, e)
         end do
      end associate
   end function stored_energy

   !> Part of the energy of sheets that wrinkle which they hold by what is left of their stiffness against compression
   !> (finshell_slack).
   function slack_share(problem) result(share)
      type(equilibrium_t), intent(in) :: problem
      real(wp) :: share
      type(element_field_t) :: table(n_element_fields)
      type(recovery_t) :: r
      integer, allocatable :: elements(:)
      real(wp) :: energy(2), volume
      integer :: entries(2), i, j
      energy = 0
      associate (s => problem%structure)
         elements = pack([(i, i=1, size(s%element_section))], s%sections(s%element_section)%wrinkling)
         table = element_fields()
         do i = 1, n_element_fields
            if (table(i)%name == 'energy_density') entries(1) = i
            if (table(i)%name == 'slack_energy_density') entries(2) = i
         end do
         call recover(problem, problem%state, elements, entries, r)
         do i = 1, size(elements)
            volume = thickness_of(s, elements(i))*norm2(twice_area_vector(s%mesh, elements(i)))/2
            energy = energy + volume*[(r%fields(j)%values(1, 1, i), j=1, 2)]
         end do
      end associate
      share = energy(2)/max(energy(1), tiny(1.0_wp))
   end function slack_share
end module finshell_monitoring
