!> The groups &material and &section of an input file.
module finshell_input_section
   use finshell_kinds, only: wp
   use finshell_error, only: error_t, text_of
   use finshell_gauss, only: max_gauss_points
   use finshell_material, only: material_t
   use finshell_outside_law, only: description_t
   use finshell_plugin, only: is_plugin, load_plugin, plugin_name
   use finshell_registry, only: new_material, material_names, material_parameters, parameter_t
   use finshell_section, only: new_layered_section, ply_t, formulation_s, formulation_p
   use finshell_mesh, only: find_element_set
   use finshell_structure, only: structure_t
   use finshell_namelist, only: group_t, get, get_strings, has, check_all_used, complain_about
   use finshell_input_common, only: get_sets, place_error, kind_element
   use finshell_input_direction, only: read_direction
   use finshell_input_field, only: field_t
   use finshell_input_thickness, only: get_offset, usual_thickness, vary_section
   use finshell_namelist_values, only: suggestion
   implicit none
   private
   public :: named_material_t, read_material, read_section, check_sections

   type :: named_material_t
      character(len=:), allocatable :: name
      class(material_t), allocatable :: law
      real(wp) :: density = 0
      integer :: line = 0
   end type named_material_t

contains

   !> &material: name, law, the parameters of the law by their own names, density; the library that holds the law.
   subroutine read_material(group, folder, material, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: folder !< prefix of the name of a library
      type(named_material_t), intent(out) :: material
      type(error_t), allocatable, intent(inout) :: error
      type(parameter_t), allocatable :: parameters(:)
      type(error_t), allocatable :: refusal
      type(description_t) :: description
      character(len=:), allocatable :: law
      character(len=32), allocatable :: names(:)
      real(wp), allocatable :: values(:)
      logical, allocatable :: given(:)
      integer :: i

      if (allocated(error)) return
      material%line = group%line
      call get(group, 'name', material%name, error)
      if (has(group, 'library')) then
         call name_of_plugin(group, folder, law, error)
      else
         call get(group, 'law', law, error, choices=law_names())
      end if
      call get(group, 'density', material%density, error, default=0.0_wp, minimum=0.0_wp)
      if (allocated(error)) return
      if (is_plugin(law)) then
         call load_plugin(law, description, refusal)
         if (allocated(refusal)) then
            call place_error(group, 'library', refusal)
            call move_alloc(refusal, error)
            return
         end if
      end if
      parameters = material_parameters(law)
      allocate (values(size(parameters)), given(size(parameters)), names(size(parameters)))
      do i = 1, size(parameters)
         names(i) = parameters(i)%name
         given(i) = has(group, trim(names(i)))
         call get(group, trim(names(i)), values(i), error, default=parameters(i)%default)
      end do
      call check_all_used(group, error)
      if (allocated(error)) return
      call new_material(material%law, law, pack(names, given), pack(values, given), refusal)
      if (allocated(refusal)) then
         call place_error(group, '', refusal)
         call move_alloc(refusal, error)
      end if
   end subroutine read_material

   !> The law of a shared library: a file in the folder of the input, or what the loader finds. Without `law` it is the only one.
   subroutine name_of_plugin(group, folder, law, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: folder
      character(len=:), allocatable, intent(out) :: law
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: library, name
      logical :: there
      call get(group, 'library', library, error)
      call get(group, 'law', name, error, default='')
      if (allocated(error)) return
      there = .false.
      if (index(library, '/') /= 1) inquire (file=folder//library, exist=there)
      if (there) library = folder//library
      ! a name without a folder is looked for in those of the system only
      if (there .and. index(library, '/') == 0) library = './'//library
      law = plugin_name(library, name)
   end subroutine name_of_plugin

   !> The laws of the registry, 'one, two'.
   function law_names() result(text)
      character(len=:), allocatable :: text
      integer :: i
      associate (names => material_names())
         text = ''
         do i = 1, size(names)
            if (i > 1) text = text//', '
            text = text//trim(names(i))
         end do
      end associate
   end function law_names

   !> &section: append one section and give it its elements.
   subroutine read_section(group, folder, materials, fields, number, structure, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: folder !< prefix of the files that the group names
      type(named_material_t), intent(in) :: materials(:)
      type(field_t), intent(in) :: fields(:)
      integer, intent(in) :: number !< of this section: structure%sections, %density and %element_section are there
      type(structure_t), intent(inout) :: structure
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: refusal
      type(ply_t), allocatable :: plies(:)
      character(len=:), allocatable :: sets(:), formulation, kind
      real(wp), allocatable :: beta0
      real(wp) :: offset, slack, usual
      logical :: arc, wrinkling

      if (allocated(error)) return
      call get_sets(group, kind_element, structure%mesh, sets, error, required=.false.)
      call take_elements(group, sets, number, structure, error)
      call usual_thickness(group, fields, structure, number, usual, error)
      call read_layers(group, materials, usual, plies, error)
      call get(group, 'type', kind, error, default='shell', choices='shell, membrane')
      if (allocated(error)) return
      call refuse_keys(group, kind, error)
      call get(group, 'wrinkling', wrinkling, error, default=.false.)
      call get(group, 'slack', slack, error, default=1.0e-6_wp, minimum=0.0_wp, maximum=1.0_wp)
      if (has(group, 'slack') .and. .not. wrinkling .and. .not. allocated(error)) &
         call complain_about(group, 'slack', 'only a sheet with wrinkling = .true. can be slack', error)
      call get_offset(group, sum(plies%thickness), offset, error)
      call get(group, 'formulation', formulation, error, default='S', choices='S, P')
      call get(group, 'arc', arc, error, default=.true.)
      if (has(group, 'beta0')) then
         allocate (beta0)
         call get(group, 'beta0', beta0, error, above=0.0_wp)
      end if
      if (allocated(error)) return
      call new_layered_section(structure%sections(number), plies, refusal, &
         merge(formulation_s, formulation_p, formulation == 'S'), beta0, offset, arc, wrinkling, slack, kind == 'membrane')
      if (allocated(refusal)) then
         call place_error(group, '', refusal)
         call move_alloc(refusal, error)
         return
      end if
      structure%density(number) = sum(plies%density*plies%thickness)/sum(plies%thickness)
      call vary_section(group, fields, number, structure, error)
      call read_direction(group, folder, number, structure, error)
      call check_all_used(group, error)
   end subroutine read_section

   !> Give a section the elements of sets, without a set all.
   subroutine take_elements(group, sets, number, structure, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: sets(:)
      integer, intent(in) :: number
      type(structure_t), intent(inout) :: structure
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name
      integer :: e, i
      if (allocated(error)) return
      do i = 1, max(1, size(sets))
         name = 'all'
         if (size(sets) > 0) name = trim(sets(i))
         associate (elements => structure%mesh%element_sets(find_element_set(structure%mesh, name))%members)
            do e = 1, size(elements)
               if (structure%element_section(elements(e)) > 0) then
                  call complain_about(group, 'element_set', 'element '//text_of(elements(e))//" of '"//name &
                     //"' has a section already (the section number "//text_of(structure%element_section(elements(e))) &
                     //' of this file)', error)
                  return
               end if
               structure%element_section(elements(e)) = number
            end do
         end associate
      end do
   end subroutine take_elements

   !> Keys that mean nothing to the kind of section.
   subroutine refuse_keys(group, kind, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: kind
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), parameter :: of_shells(7) = [character(len=16) :: 'offset', 'offset_ratio', 'offset_field', 'formulation', &
                                                     'arc', 'beta0', 'thickness_points']
      character(len=*), parameter :: of_membranes(2) = [character(len=16) :: 'wrinkling', 'slack']
      integer :: i
      do i = 1, size(of_shells)
         if (kind == 'membrane' .and. has(group, trim(of_shells(i))) .and. .not. allocated(error)) &
            call complain_about(group, trim(of_shells(i)), "a section of type 'membrane' has none: it does not bend", error)
      end do
      do i = 1, size(of_membranes)
         if (kind == 'shell' .and. has(group, trim(of_membranes(i))) .and. .not. allocated(error)) &
            call complain_about(group, trim(of_membranes(i)), "only a section of type 'membrane' has it", error)
      end do
   end subroutine refuse_keys

   !> The layers of a section, bottom to top: material, thickness, angle and thickness_points have one value for all layers or one
   !> for each; there are as many layers as the longest of these lists has values.
   subroutine read_layers(group, materials, usual, plies, error)
      type(group_t), intent(inout) :: group
      type(named_material_t), intent(in) :: materials(:)
      real(wp), intent(in) :: usual !< thickness of a section that says none; 0: it has to
      type(ply_t), allocatable, intent(out) :: plies(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), parameter :: keys(4) = [character(len=16) :: 'material', 'thickness', 'angle', 'thickness_points']
      character(len=:), allocatable :: names(:)
      real(wp), allocatable :: thickness(:), angle(:)
      integer, allocatable :: points(:)
      integer :: given(4), i, k, m, n

      call get_strings(group, 'material', names, error, required=size(materials) /= 1)
      call get(group, 'thickness', thickness, error, required=.not. usual > 0, above=0.0_wp)
      if (size(thickness) == 0 .and. usual > 0) thickness = [usual]
      call get(group, 'angle', angle, error)
      call get(group, 'thickness_points', points, error, minimum=1, maximum=max_gauss_points)
      if (allocated(error)) return
      given = [size(names), size(thickness), size(angle), size(points)]
      n = maxval(given)
      do k = 1, size(keys)
         if (given(k) <= 1 .or. given(k) == n) cycle
         i = maxloc(given, 1)
         call complain_about(group, trim(keys(k)), text_of(given(k))//' values, but '//trim(keys(i))//' has '//text_of(n) &
            //'; expected one value for all layers or one for each', error)
         return
      end do
      allocate (plies(n))
      m = 1
      do i = 1, n
         if (i <= size(names)) call find_material(group, trim(names(i)), materials, m, error)
         if (allocated(error)) return
         allocate (plies(i)%law, source=materials(m)%law)
         plies(i)%density = materials(m)%density
         plies(i)%thickness = thickness(min(i, size(thickness)))
         if (size(angle) > 0) plies(i)%angle = angle(min(i, size(angle)))
         if (size(points) > 0) plies(i)%points = points(min(i, size(points)))
      end do
   end subroutine read_layers

   !> A material by its name.
   subroutine find_material(group, name, materials, m, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: name
      type(named_material_t), intent(in) :: materials(:)
      integer, intent(out) :: m
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: names, guess

      names = ''
      do m = 1, size(materials)
         if (materials(m)%name == name) return
         if (m > 1) names = names//', '
         names = names//materials(m)%name
      end do
      guess = suggestion(name, names)
      if (names == '') names = '(none: a group &material is missing)'
      call complain_about(group, 'material', "there is no material '"//name//"'"//guess//'; materials: '//names, error)
   end subroutine find_material

   !> Every element needs a section.
   subroutine check_sections(group, structure, error)
      type(group_t), intent(in) :: group !< the last &section, for the message
      type(structure_t), intent(in) :: structure
      type(error_t), allocatable, intent(inout) :: error
      integer :: missing

      if (allocated(error)) return
      missing = count(structure%element_section == 0)
      if (missing > 0) call complain_about(group, '', text_of(missing)//' elements have no section, the first is element ' &
         //text_of(findloc(structure%element_section, 0, dim=1)), error)
   end subroutine check_sections
end module finshell_input_section
