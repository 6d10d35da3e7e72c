!> The groups &output of an input file: the result files, and what else a run writes.
module finshell_input_output
   use finshell_kinds, only: wp
   use finshell_error, only: error_t
   use finshell_input_common, only: check_name, get_set, kind_element, kind_node
   use finshell_input_preset, only: preset_t
   use finshell_mesh, only: mesh_t
   use finshell_monitor, only: output_t, restart_all, restart_last, restart_none
   use finshell_namelist, only: check_all_used, complain_about, get, get_strings, group_t, has, namelist_t
   use finshell_result_fields, only: field_names, result_field_t, result_fields
   use finshell_step, only: is_in_time, step_t
   implicit none
   private
   public :: read_outputs

contains

   !> All groups: that without a name first, which is there in any case, then the others.
   subroutine read_outputs(namelist, mesh, steps, preset, outputs, error)
      type(namelist_t), intent(inout) :: namelist
      type(mesh_t), intent(in) :: mesh
      type(step_t), intent(in) :: steps(:)
      type(preset_t), intent(inout) :: preset !< of what is not given
      type(output_t), allocatable, intent(out) :: outputs(:)
      type(error_t), allocatable, intent(inout) :: error
      type(output_t) :: output
      logical :: first, chosen
      integer :: i, k

      allocate (outputs(1))
      if (allocated(error)) return
      outputs(1)%single = preset%single
      first = .false.
      chosen = .false. ! some file has the precision that the preset chooses
      do i = 1, size(namelist%groups)
         associate (group => namelist%groups(i))
            if (group%name /= 'output') cycle
            call read_output(group, mesh, any(is_in_time(steps%control)), preset%single, output, error)
            if (allocated(error)) return
            chosen = chosen .or. (output%fields .and. .not. has(group, 'precision'))
            if (allocated(output%name)) then
               do k = 2, size(outputs)
                  if (outputs(k)%name == output%name) call complain_about(group, 'name', "there is an output '"//output%name &
                                                                          //"' already", error)
                  if (allocated(error)) return
               end do
               outputs = [outputs, output]
            else
               if (first) call complain_about(group, '', 'there is a group without a name already; further ones need a name', error)
               if (allocated(error)) return
               first = .true.
               outputs(1) = output
            end if
         end associate
      end do
      if (preset%single .and. (chosen .or. .not. first)) call preset%note('precision', "'single'")
   end subroutine read_outputs

   !> What goes into a result file, and when.
   subroutine read_output(group, mesh, in_time, single, output, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      logical, intent(in) :: in_time !< there are steps in time
      logical, intent(in) :: single !< precision where the group does not say
      type(output_t), intent(out) :: output
      type(error_t), allocatable, intent(inout) :: error
      type(result_field_t), allocatable :: table(:)
      character(len=:), allocatable :: fields(:), field_list, name, precision
      integer :: i

      field_list = field_names(only_items=.true.)
      call get_strings(group, 'fields', fields, error, choices=field_list)
      call get(group, 'name', name, error, default='')
      if (has(group, 'name')) then
         call check_name(group, 'name', name, error)
         output%name = name
      else
         call read_run(group, output, error)
      end if
      call read_part(group, mesh, output, error)
      call read_times(group, in_time, output, error)
      call get(group, 'compress', output%compress, error, default=output%compress, minimum=0, maximum=9)
      call get(group, 'precision', precision, error, default='', choices='double, single')
      call check_all_used(group, error)
      if (allocated(error)) return
      output%single = precision == 'single' .or. (single .and. precision == '')
      if (size(fields) == 0) return
      table = result_fields()
      output%wanted = pack([(i, i=1, size(table))], [(any(fields == table(i)%name) .or. table(i)%name == 'displacement', &
                                                      i=1, size(table))])
   end subroutine read_output

   !> What belongs to the run, not to one of its result files.
   subroutine read_run(group, output, error)
      type(group_t), intent(inout) :: group
      type(output_t), intent(inout) :: output
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: restart
      call get(group, 'restart', restart, error, default='last', choices='last, every, none')
      call get(group, 'verbose', output%verbose, error, default=.false.)
      call get(group, 'energy', output%energy, error, default=.false.)
      if (allocated(error)) return
      select case (restart)
      case ('every'); output%restart = restart_all
      case ('none'); output%restart = restart_none
      case default; output%restart = restart_last
      end select
   end subroutine read_run

   !> The part of the mesh.
   subroutine read_part(group, mesh, output, error)
      type(group_t), intent(inout) :: group
      type(mesh_t), intent(in) :: mesh
      type(output_t), intent(inout) :: output
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      if (allocated(error)) return
      call get(group, 'element_set', name, error, default='')
      call get(group, 'node_set', name, error, default='')
      if (has(group, 'element_set') .and. has(group, 'node_set')) then
         call complain_about(group, 'node_set', 'either node_set or element_set is expected', error)
      else if (has(group, 'element_set')) then
         call get_set(group, kind_element, mesh, output%element_set, error)
      else if (has(group, 'node_set')) then
         call get_set(group, kind_node, mesh, output%node_set, error)
      end if
   end subroutine read_part

   !> The increments.
   subroutine read_times(group, in_time, output, error)
      type(group_t), intent(inout) :: group
      logical, intent(in) :: in_time
      type(output_t), intent(inout) :: output
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: values(:)
      character(len=11), parameter :: others(3) = [character(len=11) :: 'every', 'load_levels', 'times']
      integer :: i
      if (allocated(error)) return
      call get(group, 'last', output%last, error, default=.false.)
      call get(group, 'load_levels', values, error)
      if (allocated(error)) return
      if (size(values) > 0) output%load_levels = values
      call get(group, 'times', values, error, minimum=0.0_wp)
      if (allocated(error)) return
      if (size(values) > 0) output%times = values
      if (allocated(output%load_levels) .or. allocated(output%times)) output%every = 0
      call get(group, 'every', output%every, error, default=output%every, minimum=0)
      output%fields = output%every > 0 .or. output%last .or. allocated(output%load_levels) .or. allocated(output%times)
      if (allocated(output%times) .and. .not. in_time) &
         call complain_about(group, 'times', 'there is no step in time', error)
      do i = 1, size(others)
         if (output%last .and. has(group, trim(others(i))) .and. .not. allocated(error)) &
            call complain_about(group, 'last', 'either last or '//trim(others(i))//' is expected', error)
      end do
      if (.not. output%fields .and. allocated(output%name) .and. .not. allocated(error)) &
         call complain_about(group, 'every', 'a result file without increments: 1 or more is expected', error)
   end subroutine read_times
end module finshell_input_output
