!> The group &monitor of an input file.
module finshell_input_monitor
   use finshell_kinds, only: wp
   use finshell_connector, only: connector_t, find_connector, is_spring
   use finshell_cut, only: cut_nodes
   use finshell_error, only: error_t
   use finshell_field, only: motion_columns
   use finshell_mesh, only: mesh_t
   use finshell_monitor, only: monitor_t, reduce_mean, reduce_sum, reduce_names
   use finshell_namelist, only: group_t, get, has, check_all_used, complain_about
   use finshell_input_common, only: get_set, get_component, get_vector, position_of, check_name, kind_node, kind_element
   use finshell_result_fields, only: result_field_t, result_fields, find_field, field_names, on_connector, on_cut, on_nodes, &
      on_elements
   use finshell_section, only: section_t
   implicit none
   private
   public :: read_monitor

   character(len=*), parameter :: height_names = 'bottom, middle, top'
   !> Columns of the history that are always there.
   character(len=*), parameter :: own_columns = &
      ', increment, load_factor, iterations, negative_pivots, critical_point, residual, correction, snap, found_by, &
      &stabilisation,'
   character(len=*), parameter :: energy_columns = ', stored_energy, work, damped, energy_residual,'

contains

   !> &monitor: a column of the history.
   subroutine read_monitor(group, mesh, sections, connectors, in_time, energy, monitor, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(section_t), intent(in) :: sections(:)
      type(connector_t), intent(in) :: connectors(:)
      logical, intent(in) :: in_time !< the history has the columns of the motion
      logical, intent(in) :: energy !< the history has those of the balance of energy
      type(monitor_t), intent(out) :: monitor
      type(error_t), allocatable, intent(inout) :: error
      type(result_field_t), allocatable :: table(:)
      character(len=:), allocatable :: quantity, field_list
      integer :: i

      if (allocated(error)) return
      table = result_fields()
      field_list = field_names(only_items=.false.)
      call get(group, 'name', monitor%name, error)
      if (.not. allocated(error)) call check_name(group, 'name', monitor%name, error)
      call get(group, 'quantity', quantity, error, choices=field_list)
      call get(group, 'factor', monitor%factor, error, default=1.0_wp)
      if (allocated(error)) return
      if (index(own_columns, ', '//monitor%name//',') > 0 .or. (in_time .and. any(motion_columns == monitor%name)) .or. &
          (energy .and. (index(monitor%name, 'work_') == 1 .or. index(energy_columns, ', '//monitor%name//',') > 0))) then
         call complain_about(group, 'name', "the history has a column '"//monitor%name//"' of its own", error)
         return
      end if
      monitor%quantity = find_field(quantity)
      associate (field => table(monitor%quantity))
         select case (field%on)
         case (on_nodes)
            call get_set(group, kind_node, mesh, monitor%node_set, error)
         case (on_elements)
            if (has(group, 'element_set') .and. has(group, 'node_set')) then
               call complain_about(group, 'node_set', 'either node_set or element_set is expected', error)
            else if (has(group, 'node_set')) then
               call get_set(group, kind_node, mesh, monitor%node_set, error)
            else
               call get_set(group, kind_element, mesh, monitor%element_set, error, default='all')
            end if
            call read_place(group, field, sections, monitor, error)
         case (on_connector)
            call get(group, 'connector', monitor%connector, error)
            if (allocated(error)) return
            i = find_connector(connectors, monitor%connector)
            if (i > 0) i = merge(i, 0, is_spring(connectors(i)))
            if (i == 0) call complain_about(group, 'connector', "there is no spring, bar or cable '"//monitor%connector//"'", error)
         end select
         if (field%on == on_cut) call read_cut(group, mesh, monitor, error)
         if (quantity == 'reaction_moment' .or. quantity == 'section_moment') call read_point(group, monitor, error)
         if (field%components /= '') call get_component(group, trim(field%components), monitor%component, error, required=.true.)
         monitor%reduce = merge(reduce_sum, reduce_mean, field%adds_up)
         if (any(field%on == [on_nodes, on_elements, on_connector]) .and. .not. allocated(monitor%point)) &
            call read_choice(group, 'reduce', reduce_names, monitor%reduce, error)
      end associate
      call check_all_used(group, error)
   end subroutine read_monitor

   !> The elements on one side of a cut, and the nodes of the cut where these are not all that they share with others.
   subroutine read_cut(group, mesh, monitor, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(monitor_t), intent(inout) :: monitor
      type(error_t), allocatable, intent(inout) :: error
      call get_set(group, kind_element, mesh, monitor%element_set, error)
      if (has(group, 'node_set')) call get_set(group, kind_node, mesh, monitor%node_set, error)
      if (allocated(error)) return
      if (any(cut_nodes(mesh, monitor%element_set, monitor%node_set))) return
      if (allocated(monitor%node_set)) then
         call complain_about(group, 'node_set', "no node of the set '"//monitor%node_set//"' is one of the element set '" &
                             //monitor%element_set//"'", error)
      else
         call complain_about(group, 'element_set', "no other elements touch those of the set '"//monitor%element_set &
                             //"': the elements on one side of a cut are expected, or with node_set the nodes of the cut", error)
      end if
   end subroutine read_cut

   !> The point about which moments are taken.
   subroutine read_point(group, monitor, error)
      type(group_t), intent(inout) :: group
      type(monitor_t), intent(inout) :: monitor
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: point(3)
      if (.not. has(group, 'point')) return
      call get_vector(group, 'point', point, error)
      monitor%point = point
   end subroutine read_point

   !> The place in the element of a field that has several.
   subroutine read_place(group, field, sections, monitor, error)
      type(group_t), intent(inout) :: group
      type(result_field_t), intent(in) :: field
      type(section_t), intent(in) :: sections(:)
      type(monitor_t), intent(inout) :: monitor
      type(error_t), allocatable, intent(inout) :: error
      integer :: i
      if (field%surfaces) then
         monitor%place = 2
         call read_choice(group, 'height', height_names, monitor%place, error)
      else if (field%layers) then
         call get(group, 'layer', monitor%place, error, default=1, minimum=1, &
                  maximum=maxval([(size(sections(i)%layers), i=1, size(sections))]))
      end if
   end subroutine read_place

   !> The position of a word in a list of choices; an absent key leaves it as it is.
   subroutine read_choice(group, key, list, position, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key, list
      integer, intent(inout) :: position
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: word
      call get(group, key, word, error, default='', choices=list)
      if (allocated(error) .or. word == '') return
      position = position_of(word, list)
   end subroutine read_choice
end module finshell_input_monitor
