!> From an input file to a model: the groups of doc/namelist.md, checked, every message with file and line.
module finshell_input
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: wp
   use finshell_field, only: name_characters
   use finshell_status, only: status_input_error
   use finshell_structure, only: has_constants, structure_t
   use finshell_step, only: control_explicit, is_in_time, step_t
   use finshell_mesh, only: mesh_t
   use finshell_monitor, only: monitor_t, output_t
   use finshell_support, only: support_t
   use finshell_namelist, only: namelist_t, read_namelist, parse_namelist, check_groups, count_groups
   use finshell_namelist, only: get, group_t, check_all_used, complain_about
   use finshell_bisection, only: bisection_t
   use finshell_input_accuracy, only: accuracy_t, read_accuracy, read_coarser
   use finshell_input_common, only: check_name
   use finshell_input_counts, only: check_counts
   use finshell_input_points, only: choose_points
   use finshell_input_preset, only: preset_t, read_preset
   use finshell_input_normals, only: normals_choice_t, apply_normals
   use finshell_input_refinement, only: read_any_mesh
   use finshell_setting, only: setting_t
   use finshell_input_section, only: named_material_t, read_material, read_section, check_sections
   use finshell_input_solver, only: solver_choice_t, read_solver
   use finshell_input_support, only: read_supports, check_supports
   use finshell_input_case, only: find_scales, name_t, scales_t
   use finshell_input_initial_velocity, only: add_initial_velocity
   use finshell_imperfection, only: imperfection_t
   use finshell_input_imperfection, only: modes_end, read_imperfections
   use finshell_input_chamber, only: is_chamber_column, read_chamber
   use finshell_input_load, only: read_load
   use finshell_input_field, only: field_t, read_fields
   use finshell_input_growth, only: check_explicit_growth, read_growths
   use finshell_input_step, only: read_step
   use finshell_input_way, only: check_ways
   use finshell_input_joint, only: check_joints, read_joints
   use finshell_input_connector, only: connector_groups, read_connectors
   use finshell_input_monitor, only: read_monitor
   use finshell_input_node, only: add_nodes
   use finshell_input_output, only: read_outputs
   use finshell_input_probe, only: probe_t, read_probes
   use finshell_input_sensitivity, only: read_sensitivities
   use finshell_sensitivity_choice, only: sensitivity_choice_t
   implicit none
   private
   public :: input_t, read_input, parse_input, job_name, group_names

   character(len=*), parameter :: group_names = &
      'job, mesh, node, node_set, element_set, material, field, section, support, tie, rigid_body, equal, equation, load, ' &
      //'growth, chamber, amplitude, step, initial_velocity, imperfection, monitor, sensitivity, probe, output, ' &
      //'accuracy, '//connector_groups

   !> All that an input file says.
   type :: input_t
      character(len=:), allocatable :: file
      character(len=:), allocatable :: text !< the whole file
      character(len=:), allocatable :: title
      character(len=:), allocatable :: name !< of the job: its files are NAME.vtkhdf, NAME.xdmf, NAME.history.csv
      integer :: threads = 0 !< 0: as OpenMP would
      type(solver_choice_t) :: solver
      type(preset_t) :: preset !< of what is not given
      type(structure_t) :: structure
      type(step_t), allocatable :: steps(:)
      type(scales_t) :: scales !< of loads, supports, growths and chambers
      type(field_t), allocatable :: fields(:)
      type(name_t), allocatable :: factors(:) !< names of their factors
      integer, allocatable :: load_lines(:), chamber_lines(:), step_lines(:) !< where loads, chambers and steps stand in the file
      real(wp), allocatable :: velocity(:, :) !< (n_nodal, nodes) and spins at the beginning of the first step in time
      type(monitor_t), allocatable :: monitors(:)
      type(sensitivity_choice_t), allocatable :: sensitivities(:)
      type(probe_t), allocatable :: probes(:)
      type(output_t), allocatable :: outputs(:) !< result files; of the first one all keys count
      type(accuracy_t), allocatable :: accuracy !< unallocated: the mesh stays as it is
      type(normals_choice_t) :: normals
      type(imperfection_t), allocatable :: imperfections(:)
   end type input_t

contains

   !> Read an input file. File names in it are relative to its folder.
   subroutine read_input(file_name, input, error, levels, bisection, settings)
      character(len=*), intent(in) :: file_name
      type(input_t), intent(out) :: input
      type(error_t), allocatable, intent(out) :: error
      integer, intent(in), optional :: levels !< of refinement beyond what &mesh says
      type(bisection_t), intent(inout), optional :: bisection !< begun here (intent of a new one), later the mesh to take
      type(setting_t), intent(in), optional :: settings(:) !< other values than those of the file
      type(namelist_t) :: namelist
      character(len=:), allocatable :: text
      integer :: i

      call read_namelist(file_name, namelist, error, text, settings)
      if (.not. allocated(error)) call translate_preset(namelist, text, file_name, input, error, levels, bisection)
      if (.not. (allocated(error) .and. present(settings))) return
      do i = 1, size(settings)
         if (index(error%message, '--set ') /= 1) error%message = error%message//' (with --set '//settings(i)%text//')'
      end do
   end subroutine read_input

   !> The same from a text; file_name is used in messages and to find other files.
   subroutine parse_input(text, file_name, input, error, levels, given)
      character(len=*), intent(in) :: text
      character(len=*), intent(in) :: file_name
      type(input_t), intent(out) :: input
      type(error_t), allocatable, intent(out) :: error
      integer, intent(in), optional :: levels !< as for `read_input`
      type(mesh_t), intent(in), optional :: given !< the mesh, which the text does not have; &accuracy cannot refine it
      type(namelist_t) :: namelist

      call parse_namelist(text, file_name, namelist, error)
      if (allocated(error)) return
      if (present(given)) then
         call translate(namelist, text, file_name, input, error, given=given)
      else
         call translate_preset(namelist, text, file_name, input, error, levels)
      end if
   end subroutine parse_input

   !> The name of the job of an input file, of which nothing else is checked.
   subroutine job_name(file_name, settings, name, error)
      character(len=*), intent(in) :: file_name
      type(setting_t), intent(in) :: settings(:)
      character(len=:), allocatable, intent(out) :: name
      type(error_t), allocatable, intent(out) :: error
      type(namelist_t) :: namelist
      type(input_t) :: input
      call read_namelist(file_name, namelist, error, settings=settings)
      input%file = file_name
      if (.not. allocated(error)) call translate_job(namelist, input, error)
      if (.not. allocated(error)) name = input%name
   end subroutine job_name

   !> With a preset that makes the mesh coarser, if the input without `levels` can have such a mesh: its numbers of cells may be
   !> odd, its sets may need nodes that would go.
   subroutine translate_preset(namelist, text, file_name, input, error, levels, bisection)
      type(namelist_t), intent(inout) :: namelist
      character(len=*), intent(in) :: text, file_name
      type(input_t), intent(inout) :: input
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in), optional :: levels
      type(bisection_t), intent(inout), optional :: bisection
      type(input_t) :: whole
      type(error_t), allocatable :: refusal
      logical :: refined

      refined = .false.
      if (present(levels)) refined = levels /= 0
      call translate(namelist, text, file_name, input, error, levels, bisection)
      if (input%preset%refine >= 0) return
      if (refined) then
         call translate(namelist, text, file_name, whole, refusal)
         if (.not. allocated(refusal)) return
      else if (.not. allocated(error)) then
         return
      end if
      if (allocated(error)) deallocate (error)
      input = input_t()
      if (present(bisection)) bisection = bisection_t()
      call translate(namelist, text, file_name, input, error, levels, bisection, same_mesh=.true.)
   end subroutine translate_preset

   !> The order of the groups in the file does not matter, but that of groups of the same name.
   subroutine translate(namelist, text, file_name, input, error, levels, bisection, same_mesh, given)
      type(namelist_t), intent(inout) :: namelist
      character(len=*), intent(in) :: text, file_name
      type(input_t), intent(inout) :: input
      type(error_t), allocatable, intent(inout) :: error
      integer, intent(in), optional :: levels
      type(bisection_t), intent(inout), optional :: bisection
      logical, intent(in), optional :: same_mesh !< whatever the preset says
      type(mesh_t), intent(in), optional :: given !< see `parse_input`
      integer :: coarser, finer

      finer = 0
      input%file = file_name
      input%text = text
      call check_groups(namelist, group_names, error)
      call check_counts(namelist, error)
      if (.not. allocated(error)) call translate_job(namelist, input, error)
      if (allocated(error)) return
      if (present(same_mesh)) input%preset%refine = 0
      if (count_groups(namelist, 'accuracy') > 0 .and. present(bisection)) then
         call read_coarser(namelist, coarser, error)
         if (present(levels)) finer = levels
         call read_any_mesh(namelist, folder_of(input%file), input%structure%mesh, input%normals, input%preset, error, &
                            finer - coarser, bisection)
         if (allocated(error) .and. coarser > 0) error%message = error%message//' (coarser = '//text_of(coarser)//' in &accuracy)'
      else
         call read_any_mesh(namelist, folder_of(input%file), input%structure%mesh, input%normals, input%preset, error, levels, &
                            given=given)
      end if
      if (.not. allocated(error)) call add_nodes(namelist, input%structure%mesh, error)
      if (.not. allocated(error)) call read_fields(namelist, folder_of(input%file), input%structure%mesh, input%fields, error)
      if (.not. allocated(error)) call translate_sections(namelist, input, error)
      call read_joints(namelist, input%structure, error)
      if (.not. allocated(error)) call read_connectors(namelist, input%structure%mesh, input%structure%connectors, error)
      if (.not. allocated(error)) call translate_supports(namelist, input, error)
      call check_joints(input%structure, input%file, error)
      if (.not. allocated(error)) call translate_loads_and_steps(namelist, input, error)
      if (.not. allocated(error)) call translate_output(namelist, input, error)
   end subroutine translate

   subroutine translate_job(namelist, input, error)
      type(namelist_t), intent(inout) :: namelist
      type(input_t), intent(inout) :: input
      type(error_t), allocatable, intent(inout) :: error
      integer :: i

      input%title = ''
      input%name = base_name(input%file)
      do i = 1, size(namelist%groups)
         associate (group => namelist%groups(i))
            if (group%name /= 'job') cycle
            call get(group, 'title', input%title, error, default='')
            call get(group, 'name', input%name, error, default=input%name)
            call check_name(group, 'name', input%name, error)
            call get(group, 'threads', input%threads, error, default=0, minimum=0, maximum=1024)
            call read_solver(group, input%solver, error)
            call read_preset(group, input%preset, error)
            call check_all_used(group, error)
         end associate
      end do
   end subroutine translate_job

   subroutine translate_sections(namelist, input, error)
      type(namelist_t), intent(inout) :: namelist
      type(input_t), intent(inout) :: input
      type(error_t), allocatable, intent(inout) :: error
      type(named_material_t), allocatable :: materials(:)
      integer :: i, j, n

      allocate (materials(count_groups(namelist, 'material')))
      n = 0
      do i = 1, size(namelist%groups)
         if (namelist%groups(i)%name /= 'material') cycle
         n = n + 1
         call read_material(namelist%groups(i), folder_of(input%file), materials(n), error)
         if (allocated(error)) return
         do j = 1, n - 1
            if (materials(j)%name /= materials(n)%name) cycle
            call complain_about(namelist%groups(i), 'name', "there is a material '"//materials(n)%name//"' in line " &
               //text_of(materials(j)%line)//' already', error)
            return
         end do
      end do
      n = count_groups(namelist, 'section')
      associate (s => input%structure)
         allocate (s%sections(n), s%density(n), s%element_section(size(s%mesh%triangles, 2)))
         s%density = 0
         s%element_section = 0
         n = 0
         do i = 1, size(namelist%groups)
            if (namelist%groups(i)%name /= 'section') cycle
            n = n + 1
            call read_section(namelist%groups(i), folder_of(input%file), materials, input%fields, n, s, error)
            if (allocated(error)) return
            if (n == size(s%sections)) call check_sections(namelist%groups(i), s, error)
         end do
      end associate
   end subroutine translate_sections

   subroutine translate_supports(namelist, input, error)
      type(namelist_t), intent(inout) :: namelist
      type(input_t), intent(inout) :: input
      type(error_t), allocatable, intent(inout) :: error
      type(support_t), allocatable :: supports(:)
      type(group_t), allocatable :: groups(:) ! (a section passed as it is would be a copy that gfortran never frees)
      integer, allocatable :: last(:), where_they_are(:)
      integer :: i

      call find_scales(namelist, input%scales, error)
      if (allocated(error)) return
      call read_supports(namelist, input%structure%mesh, input%scales, supports, last, where_they_are, error)
      if (allocated(error)) return
      call move_alloc(supports, input%structure%supports)
      groups = namelist%groups(where_they_are)
      call check_supports(groups, last, input%structure%mesh, input%structure%supports, input%file, error)
      do i = 1, size(namelist%groups)
         if (namelist%groups(i)%name == 'mesh' .and. .not. allocated(error)) &
            call apply_normals(namelist%groups(i), folder_of(input%file), input%normals, input%structure, error)
      end do
      if (.not. allocated(error)) call choose_points(input%structure, input%preset)
   end subroutine translate_supports

   subroutine translate_loads_and_steps(namelist, input, error)
      type(namelist_t), intent(inout) :: namelist
      type(input_t), intent(inout) :: input
      type(error_t), allocatable, intent(inout) :: error
      integer :: i, n

      allocate (input%structure%loads(0), input%structure%chambers(0), input%chamber_lines(0))
      allocate (input%steps(count_groups(namelist, 'step')), input%load_lines(0), input%step_lines(0))
      n = 0
      do i = 1, size(namelist%groups)
         select case (namelist%groups(i)%name)
         case ('load')
            call read_load(namelist%groups(i), input%structure, input%scales, error)
            input%load_lines = [input%load_lines, namelist%groups(i)%line]
         case ('chamber')
            call read_chamber(namelist%groups(i), input%structure, input%scales, error)
            input%chamber_lines = [input%chamber_lines, namelist%groups(i)%line]
         case ('step')
            n = n + 1
            call read_step(namelist%groups(i), input%structure%mesh, 'step '//text_of(n), input%scales, input%preset, &
                           input%steps(n), error)
            input%step_lines = [input%step_lines, namelist%groups(i)%line]
            if (input%steps(n)%control == control_explicit .and. allocated(input%structure%joints)) &
               call complain_about(namelist%groups(i), 'control', "explicit steps do not know &tie, &rigid_body, &equal and " &
                                   //"&equation; control = 'dynamic' does", error)
         end select
         if (allocated(error)) return
      end do
      call read_growths(namelist, input%fields, input%structure, input%scales, error)
      call check_explicit_growth(namelist, input%structure, input%scales, input%steps, error)
      if (allocated(error)) return
      input%factors = [input%scales%cases, input%scales%names]
      input%structure%cases = size(input%factors)
      if (size(input%scales%followers) > 0) input%structure%followers = input%scales%followers
      do i = 1, size(namelist%groups)
         if (namelist%groups(i)%name /= 'initial_velocity') cycle
         call add_initial_velocity(namelist%groups(i), input%structure%mesh, input%steps, input%velocity, error)
         if (allocated(error)) return
      end do
      call read_imperfections(namelist, folder_of(input%file), input%structure, input%steps, input%imperfections, error)
      if (allocated(error)) return
      call check_ways(namelist, input%steps, modes_end(input%imperfections), &
                      has_constants(input%structure), error)
   end subroutine translate_loads_and_steps

   subroutine translate_output(namelist, input, error)
      type(namelist_t), intent(inout) :: namelist
      type(input_t), intent(inout) :: input
      type(error_t), allocatable, intent(inout) :: error
      integer :: i, j, n

      call read_outputs(namelist, input%structure%mesh, input%steps, input%preset, input%outputs, error)
      allocate (input%monitors(count_groups(namelist, 'monitor')))
      n = 0
      do i = 1, size(namelist%groups)
         if (namelist%groups(i)%name /= 'monitor') cycle
         n = n + 1
         call read_monitor(namelist%groups(i), input%structure%mesh, input%structure%sections, input%structure%connectors, &
                           any(is_in_time(input%steps%control)), input%outputs(1)%energy, input%monitors(n), error)
         if (allocated(error)) return
         do j = 1, n - 1
            if (input%monitors(j)%name /= input%monitors(n)%name) cycle
            call complain_about(namelist%groups(i), 'name', "there is a monitor '"//input%monitors(n)%name//"' already", error)
            return
         end do
         if (is_chamber_column(input%monitors(n)%name, input%structure%chambers)) then
            call complain_about(namelist%groups(i), 'name', "'"//input%monitors(n)%name//"' is a column of a chamber already", &
                                error)
            return
         end if
      end do
      call read_sensitivities(namelist, input%monitors, input%steps, input%sensitivities, error)
      call read_probes(namelist, input%structure%mesh, input%probes, error)
      do i = 1, size(namelist%groups)
         if (namelist%groups(i)%name /= 'accuracy' .or. allocated(error)) cycle
         allocate (input%accuracy)
         call read_accuracy(namelist%groups(i), input%structure, input%load_lines, input%steps, input%monitors, input%accuracy, &
                            error)
      end do
   end subroutine translate_output

   !> 'folder/' of 'folder/file', '' of 'file'.
   pure function folder_of(file) result(folder)
      character(len=*), intent(in) :: file
      character(len=:), allocatable :: folder
      folder = file(:index(file, '/', back=.true.))
   end function folder_of

   !> 'file' of 'folder/file.nml', with characters that a name cannot have replaced by _.
   pure function base_name(file) result(name)
      character(len=*), intent(in) :: file
      character(len=:), allocatable :: name
      integer :: i
      name = file(index(file, '/', back=.true.) + 1:)
      i = index(name, '.', back=.true.)
      if (i > 1) name = name(:i - 1)
      do i = 1, len(name)
         if (index(name_characters, name(i:i)) == 0) name(i:i) = '_'
      end do
      if (verify(name, '.') == 0) name = 'job'
   end function base_name
end module finshell_input
