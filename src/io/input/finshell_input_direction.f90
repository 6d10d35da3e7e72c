!> The material direction in the group &section of an input file: a vector, a field about a line or a point, or a file.
module finshell_input_direction
   use finshell_kinds, only: wp
   use finshell_rotation, only: cross_product
   use finshell_error, only: error_t, text_of
   use finshell_lineage, only: parent_element
   use finshell_structure, only: structure_t
   use finshell_namelist, only: group_t, get, has, complain_about
   use finshell_input_common, only: get_vector
   use finshell_input_number_file, only: read_vector_file
   implicit none
   private
   public :: read_direction

   !> Sine of the angle to the normal below which a direction is not projected on an element (the kernel would replace it).
   real(wp), parameter :: nearly_normal = 2.0e-3_wp
   character(len=*), parameter :: fields = 'circumferential, axial, radial, central'

contains

   !> Material direction 1 of the elements of a section.
   subroutine read_direction(group, folder, number, structure, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: folder !< prefix of the name of a file
      integer, intent(in) :: number !< of the section: structure%element_section says which elements it has
      type(structure_t), intent(inout) :: structure
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: field, file, key
      real(wp), allocatable :: given(:, :)
      real(wp) :: vector(3), axis(3), origin(3), d(3), normal(3), sides(3, 2)
      integer :: e

      call get_vector(group, 'direction', vector, error, default=[0.0_wp, 0.0_wp, 0.0_wp], nonzero=.true.)
      call get_vector(group, 'direction_axis', axis, error, default=[0.0_wp, 0.0_wp, 0.0_wp], nonzero=.true.)
      call get_vector(group, 'direction_origin', origin, error, default=[0.0_wp, 0.0_wp, 0.0_wp])
      call get(group, 'direction_field', field, error, default='', choices=fields)
      call get(group, 'direction_file', file, error, default='')
      call check_combination(group, field, error)
      if (allocated(error)) return
      if (has(group, 'direction')) then
         field = 'constant'
         key = 'direction'
      else if (has(group, 'direction_file')) then
         field = 'file'
         key = 'direction_file'
         if (index(file, '/') /= 1) file = folder//file
         if (allocated(structure%mesh%lineage)) then
            call read_vector_file(group, 'direction_file', file, 'element', size(structure%mesh%lineage%triangles, 2), given, error)
            if (allocated(error)) return
            given = given(:, [(parent_element(structure%mesh%lineage, e), e=1, size(structure%element_section))])
         else
            call read_vector_file(group, 'direction_file', file, 'element', size(structure%element_section), given, error)
            if (allocated(error)) return
         end if
      else if (has(group, 'direction_axis') .or. field /= '') then
         if (field == '') field = 'circumferential'
         key = 'direction_field'
         if (.not. has(group, 'direction_field')) key = 'direction_axis'
         if (norm2(axis) > 0) axis = axis/norm2(axis)
      else
         return
      end if

      if (.not. allocated(structure%direction)) &
         structure%direction = spread([1.0_wp, 0.0_wp, 0.0_wp], 2, size(structure%element_section)) ! the default: global x
      do e = 1, size(structure%element_section)
         if (structure%element_section(e) /= number) cycle
         associate (x => structure%mesh%coordinates(:, structure%mesh%triangles(:, e)))
            d = sum(x, dim=2)/3 - origin
            sides = x(:, 2:3) - x(:, [1, 1])
         end associate
         select case (field)
         case ('constant'); d = vector
         case ('file'); d = given(:, e)
         case ('circumferential'); d = cross_product(axis, d)
         case ('axial'); d = axis
         case ('radial'); d = d - dot_product(axis, d)*axis
         end select
         normal = cross_product(sides(:, 1), sides(:, 2))
         if (.not. norm2(cross_product(normal, d)) > nearly_normal*norm2(normal)*norm2(d)) then
            call complain_about(group, key, 'it gives element '//text_of(e) &
               //' no direction: the vector there is zero or normal to the element', error)
            return
         end if
         structure%direction(:, e) = d/norm2(d)
      end do
   end subroutine read_direction

   !> Which keys go together.
   subroutine check_combination(group, field, error)
      type(group_t), intent(in) :: group
      character(len=*), intent(in) :: field
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), parameter :: kinds(3) = [character(len=14) :: 'direction', 'direction_axis', 'direction_file']
      integer :: i, k

      if (allocated(error)) return
      do i = 1, size(kinds)
         do k = i + 1, size(kinds)
            if (has(group, trim(kinds(i))) .and. has(group, trim(kinds(k)))) then
               call complain_about(group, trim(kinds(k)), 'either '//trim(kinds(i))//' or '//trim(kinds(k))//' is expected', error)
               return
            end if
         end do
      end do
      if (field /= '' .and. (has(group, 'direction') .or. has(group, 'direction_file'))) then
         call complain_about(group, 'direction_field', 'either a field or direction or direction_file is expected', error)
      else if (field == 'central' .and. has(group, 'direction_axis')) then
         call complain_about(group, 'direction_axis', "the field 'central' has no axis, only direction_origin", error)
      else if (field /= '' .and. field /= 'central' .and. .not. has(group, 'direction_axis')) then
         call complain_about(group, 'direction_field', 'it needs direction_axis, which is missing', error)
      else if (has(group, 'direction_origin') .and. .not. has(group, 'direction_axis') .and. field /= 'central') then
         call complain_about(group, 'direction_origin', 'it belongs to direction_axis or direction_field, which are missing', error)
      end if
   end subroutine check_combination
end module finshell_input_direction
