!> Values of monitored quantities and result fields at an equilibrium state.
module finshell_monitoring
   use finshell_kinds, only: wp, i4
   use finshell_discretisation, only: evaluate_gathered, gather_elements, gathered_t
   use finshell_equilibrium, only: equilibrium_t
   use finshell_field, only: field_t
   use finshell_mesh, only: mesh_t, find_element_set, find_node_set
   use finshell_monitor, only: monitor_t, output_t, monitor_displacement, monitor_rotation, monitor_reaction, &
      monitor_reaction_moment, monitor_thickness_stretch, monitor_volume, monitor_energy, monitor_membrane_force, monitor_moment
   use finshell_volume, only: volume_behind
   use finshell_quaternion, only: quaternion_to_rotation_vector
   use finshell_recovery, only: recovery_t, recover, small_part
   use finshell_state, only: state_t, moved_state
   implicit none
   private
   public :: watch_t, new_watch, monitored_values, needed_elements, point_fields, cell_fields, has_cell_fields

   !> A monitor with its nodes or elements looked up.
   type :: watch_t
      integer :: quantity = monitor_displacement, component = 0
      real(wp) :: factor = 1
      integer, allocatable :: nodes(:), elements(:)
   end type watch_t

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
   recursive subroutine monitored_values(problem, state, watches, values, missing, recovery)
      type(equilibrium_t), intent(in) :: problem
      type(state_t), intent(in) :: state
      type(watch_t), intent(in) :: watches(:)
      real(wp), intent(out) :: values(:) !< (size(watches))
      logical, intent(out) :: missing(:) !< (size(watches)) an element has no such value; that of the watch is 0
      type(recovery_t), intent(in), optional :: recovery !< of the elements that the watches need, if there is one already
      type(recovery_t) :: own
      real(wp) :: vector(3)
      integer :: i, k

      if (.not. present(recovery)) then
         call recover(problem, state, needed_elements(watches, size(problem%structure%mesh%triangles, 2)), .false., own)
         call monitored_values(problem, state, watches, values, missing, own)
         return
      end if
      missing = .false.
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
               associate (place => recovery%place(w%elements))
                  missing(i) = any(recovery%missing(place))
                  if (missing(i)) cycle
                  select case (w%quantity)
                  case (monitor_thickness_stretch); values(i) = sum(recovery%stretch(place))/size(place)
                  case (monitor_membrane_force); values(i) = sum(recovery%force(w%component, place))/size(place)
                  case (monitor_moment); values(i) = sum(recovery%moment(w%component, place))/size(place)
                  end select
               end associate
            case (monitor_volume)
               values(i) = changed_volume(problem, state)
            case (monitor_energy)
               values(i) = changed_energy(problem, state)
            end select
            values(i) = w%factor*values(i)
         end associate
      end do
   end subroutine monitored_values

   !> The elements whose recovered results the watches use.
   pure function needed_elements(watches, elements) result(list)
      type(watch_t), intent(in) :: watches(:)
      integer, intent(in) :: elements !< their number in the mesh
      integer, allocatable :: list(:)
      logical :: needed(elements)
      integer :: i
      needed = .false.
      do i = 1, size(watches)
         select case (watches(i)%quantity)
         case (monitor_thickness_stretch, monitor_membrane_force, monitor_moment)
            needed(watches(i)%elements) = .true.
         end select
      end do
      list = pack([(i, i=1, elements)], needed)
   end function needed_elements

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
      associate (motion => problem%change%motion)
         part = small_part(motion, problem%detail)
         volume = (pressurised_volume(problem, moved_state(problem%state, motion, part)) &
                   - pressurised_volume(problem, moved_state(problem%state, motion, -part)))/(2*part)
      end associate
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

   !> Are there element fields, so that all elements have to be recovered?
   pure logical function has_cell_fields(output)
      type(output_t), intent(in) :: output
      has_cell_fields = output%fields &
         .and. (output%thickness_stretch .or. output%membrane_force .or. output%moment .or. output%stress)
   end function has_cell_fields

   !> Element result fields, from the recovery of all elements.
   function cell_fields(output, recovery) result(fields)
      type(output_t), intent(in) :: output
      type(recovery_t), intent(in) :: recovery
      type(field_t), allocatable :: fields(:)
      character(len=*), parameter :: heights(3) = [character(len=6) :: 'bottom', 'middle', 'top']
      integer :: i
      allocate (fields(0))
      associate (r => recovery)
         if (output%thickness_stretch) &
            fields = [fields, field_t('thickness_stretch', 1, reshape(r%stretch, [1, size(r%stretch)]), r%missing)]
         if (output%membrane_force) fields = [fields, field_t('membrane_force', 3, r%force, r%missing)]
         if (output%moment) fields = [fields, field_t('moment', 3, r%moment, r%missing)]
         if (output%stress) then
            do i = 1, 3
               fields = [fields, field_t('stress_'//trim(heights(i)), 3, (r%stress(:, i, :)), (r%missing_stress(i, :)))]
            end do
         end if
      end associate
   end function cell_fields
end module finshell_monitoring
