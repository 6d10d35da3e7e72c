!> The groups &monitor and &output of an input file.
module finshell_input_output
   use finshell_kinds, only: wp
   use finshell_error, only: error_t
   use finshell_mesh, only: mesh_t
   use finshell_monitor, only: monitor_t, output_t, quantity_of
   use finshell_monitor, only: monitor_displacement, monitor_rotation, monitor_reaction, monitor_reaction_moment
   use finshell_monitor, only: monitor_volume, monitor_energy, monitor_membrane_force, monitor_moment
   use finshell_namelist, only: group_t, get, get_strings, has, check_all_used, complain_about
   use finshell_input_common, only: get_set, get_component, check_name, kind_node, kind_element
   implicit none
   private
   public :: read_monitor, read_output

   !> Fields of the result file beside the displacement, which is always there.
   character(len=*), parameter :: field_names = &
      'displacement, rotation, reaction, thickness_stretch, membrane_force, moment, stress'
   !> Columns of the history that are always there.
   character(len=*), parameter :: own_columns = &
      ', increment, load_factor, iterations, negative_pivots, critical_point, residual, correction,'

contains

   !> &monitor: a column of the history.
   subroutine read_monitor(group, mesh, monitor, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(monitor_t), intent(out) :: monitor
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: quantity, quantities
      integer :: unused

      if (allocated(error)) return
      call quantity_of('', unused, quantities)
      call get(group, 'name', monitor%name, error)
      if (.not. allocated(error)) call check_name(group, 'name', monitor%name, error)
      call get(group, 'quantity', quantity, error, choices=quantities)
      call get(group, 'factor', monitor%factor, error, default=1.0_wp)
      if (allocated(error)) return
      if (index(own_columns, ', '//monitor%name//',') > 0) then
         call complain_about(group, 'name', "the history has a column '"//monitor%name//"' of its own", error)
         return
      end if
      call quantity_of(quantity, monitor%quantity, quantities)
      select case (monitor%quantity)
      case (monitor_displacement, monitor_rotation, monitor_reaction, monitor_reaction_moment)
         call get_set(group, kind_node, mesh, monitor%node_set, error)
         call get_component(group, 'x, y, z', monitor%component, error, required=.true.)
      case (monitor_volume, monitor_energy)
      case default
         if (has(group, 'element_set') .and. has(group, 'node_set')) then
            call complain_about(group, 'node_set', 'either node_set or element_set is expected', error)
         else if (has(group, 'node_set')) then
            call get_set(group, kind_node, mesh, monitor%node_set, error)
         else
            call get_set(group, kind_element, mesh, monitor%element_set, error, default='all')
         end if
         if (monitor%quantity == monitor_membrane_force .or. monitor%quantity == monitor_moment) &
            call get_component(group, '11, 22, 12', monitor%component, error, required=.true.)
      end select
      call check_all_used(group, error)
   end subroutine read_monitor

   !> &output: what goes into the result file, and how often.
   subroutine read_output(group, output, error)
      type(group_t), intent(inout) :: group
      type(output_t), intent(out) :: output
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: fields(:)

      if (allocated(error)) return
      call get_strings(group, 'fields', fields, error, choices=field_names)
      call get(group, 'every', output%every, error, default=output%every, minimum=0)
      call get(group, 'restart', output%restart, error, default=output%restart)
      call check_all_used(group, error)
      if (allocated(error)) return
      output%fields = output%every > 0
      if (size(fields) == 0) return
      output%rotation = any(fields == 'rotation')
      output%reaction = any(fields == 'reaction')
      output%thickness_stretch = any(fields == 'thickness_stretch')
      output%membrane_force = any(fields == 'membrane_force')
      output%moment = any(fields == 'moment')
      output%stress = any(fields == 'stress')
   end subroutine read_output
end module finshell_input_output
