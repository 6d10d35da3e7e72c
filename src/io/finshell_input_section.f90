!> The groups &material and &section of an input file.
module finshell_input_section
   use finshell_kinds, only: wp
   use finshell_error, only: error_t, text_of
   use finshell_gauss, only: max_gauss_points
   use finshell_material, only: material_t
   use finshell_registry, only: new_material, material_names, material_parameters, parameter_t
   use finshell_section, only: new_section, formulation_s, formulation_p, default_beta0, default_points
   use finshell_mesh, only: find_element_set
   use finshell_structure, only: structure_t
   use finshell_namelist, only: group_t, get, has, check_all_used, complain_about
   use finshell_input_common, only: get_sets, get_vector, place_error, kind_element
   use finshell_text, only: nearest_name
   implicit none
   private
   public :: named_material_t, read_material, read_section, check_sections

   !> Sine of the angle to the normal below which a direction is not projected on an element (the kernel would replace it).
   real(wp), parameter :: nearly_normal = 2.0e-3_wp

   type :: named_material_t
      character(len=:), allocatable :: name
      class(material_t), allocatable :: law
      real(wp) :: density = 0
      integer :: line = 0
   end type named_material_t

contains

   !> &material: name, law, the parameters of the law by their own names, density.
   subroutine read_material(group, material, error)
      type(group_t), intent(inout) :: group
      type(named_material_t), intent(out) :: material
      type(error_t), allocatable, intent(inout) :: error
      type(parameter_t), allocatable :: parameters(:)
      type(error_t), allocatable :: refusal
      character(len=:), allocatable :: law
      character(len=16), allocatable :: names(:)
      real(wp), allocatable :: values(:)
      logical, allocatable :: given(:)
      integer :: i

      if (allocated(error)) return
      material%line = group%line
      call get(group, 'name', material%name, error)
      call get(group, 'law', law, error, choices=law_names())
      call get(group, 'density', material%density, error, default=0.0_wp, minimum=0.0_wp)
      if (allocated(error)) return
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
      if (.not. allocated(refusal)) return
      call place_error(group, '', refusal)
      call move_alloc(refusal, error)
   end subroutine read_material

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
   subroutine read_section(group, materials, number, structure, error)
      type(group_t), intent(inout) :: group
      type(named_material_t), intent(in) :: materials(:)
      integer, intent(in) :: number !< of this section: structure%sections, %density and %element_section are there
      type(structure_t), intent(inout) :: structure
      type(error_t), allocatable, intent(inout) :: error
      type(error_t), allocatable :: refusal
      character(len=:), allocatable :: sets(:), formulation
      real(wp) :: thickness, beta0
      integer :: points, m, i, e

      if (allocated(error)) return
      call find_material(group, materials, m, error)
      call get(group, 'thickness', thickness, error, above=0.0_wp)
      call get(group, 'thickness_points', points, error, default=default_points, minimum=1, maximum=max_gauss_points)
      call get(group, 'formulation', formulation, error, default='S', choices='S, P')
      call get(group, 'beta0', beta0, error, default=default_beta0, above=0.0_wp)
      call get_sets(group, kind_element, structure%mesh, sets, error, required=.false.)
      if (allocated(error)) return
      if (size(sets) == 0) sets = ['all']
      call new_section(structure%sections(number), materials(m)%law, thickness, refusal, &
         merge(formulation_s, formulation_p, formulation == 'S'), beta0, points)
      if (allocated(refusal)) then
         call place_error(group, '', refusal)
         call move_alloc(refusal, error)
         return
      end if
      structure%density(number) = materials(m)%density
      do i = 1, size(sets)
         associate (elements => structure%mesh%element_sets(find_element_set(structure%mesh, trim(sets(i))))%members)
            do e = 1, size(elements)
               if (structure%element_section(elements(e)) > 0) then
                  call complain_about(group, 'element_set', 'element '//text_of(elements(e))//" of '"//trim(sets(i)) &
                     //"' has a section already (the section number "//text_of(structure%element_section(elements(e))) &
                     //' of this file)', error)
                  return
               end if
               structure%element_section(elements(e)) = number
            end do
         end associate
      end do
      call read_direction(group, number, structure, error)
      call check_all_used(group, error)
   end subroutine read_section

   !> The material a section refers to.
   subroutine find_material(group, materials, m, error)
      type(group_t), intent(inout) :: group
      type(named_material_t), intent(in) :: materials(:)
      integer, intent(out) :: m
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: name, names, guess

      m = 0
      names = ''
      if (size(materials) == 1) then
         call get(group, 'material', name, error, default=materials(1)%name)
      else
         call get(group, 'material', name, error)
      end if
      if (allocated(error)) return
      do m = 1, size(materials)
         if (materials(m)%name == name) return
         if (m > 1) names = names//', '
         names = names//materials(m)%name
      end do
      guess = nearest_name(name, names)
      if (guess /= '') guess = ", did you mean '"//guess//"'?"
      if (names == '') names = '(none: a group &material is missing)'
      call complain_about(group, 'material', "there is no material '"//name//"'"//guess//'; materials: '//names, error)
   end subroutine find_material

   !> Material direction 1 of the elements of a section: a constant vector, or around an axis.
   subroutine read_direction(group, number, structure, error)
      type(group_t), intent(inout) :: group
      integer, intent(in) :: number
      type(structure_t), intent(inout) :: structure
      type(error_t), allocatable, intent(inout) :: error
      real(wp) :: vector(3), axis(3), origin(3), d(3), normal(3), sides(3, 2)
      integer :: e

      call get_vector(group, 'direction', vector, error, default=[0.0_wp, 0.0_wp, 0.0_wp], nonzero=.true.)
      call get_vector(group, 'direction_axis', axis, error, default=[0.0_wp, 0.0_wp, 0.0_wp], nonzero=.true.)
      call get_vector(group, 'direction_origin', origin, error, default=[0.0_wp, 0.0_wp, 0.0_wp])
      if (allocated(error)) return
      if (has(group, 'direction') .and. has(group, 'direction_axis')) then
         call complain_about(group, 'direction_axis', 'either direction or direction_axis is expected', error)
         return
      end if
      if (has(group, 'direction_origin') .and. .not. has(group, 'direction_axis')) then
         call complain_about(group, 'direction_origin', 'it belongs to direction_axis, which is missing', error)
         return
      end if
      if (.not. has(group, 'direction') .and. .not. has(group, 'direction_axis')) return
      if (.not. allocated(structure%direction)) &
         structure%direction = spread([1.0_wp, 0.0_wp, 0.0_wp], 2, size(structure%element_section)) ! the default: global x
      do e = 1, size(structure%element_section)
         if (structure%element_section(e) /= number) cycle
         associate (x => structure%mesh%coordinates(:, structure%mesh%triangles(:, e)))
            d = vector
            if (has(group, 'direction_axis')) d = cross(axis, sum(x, dim=2)/3 - origin)
            sides = x(:, 2:3) - x(:, [1, 1])
         end associate
         normal = cross(sides(:, 1), sides(:, 2))
         if (norm2(cross(normal, d)) <= nearly_normal*norm2(normal)*norm2(d)) then
            call complain_about(group, trim(merge('direction     ', 'direction_axis', has(group, 'direction'))), &
               'it gives element '//text_of(e)//' no direction: the vector there is zero or normal to the element', error)
            return
         end if
         structure%direction(:, e) = d/norm2(d)
      end do
   end subroutine read_direction

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

   pure function cross(a, b) result(c)
      real(wp), intent(in) :: a(3), b(3)
      real(wp) :: c(3)
      c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
   end function cross
end module finshell_input_section
