!> Thicknesses and offsets that differ from element to element, in the group &section of an input file.
module finshell_input_thickness
   use finshell_error, only: error_t, text_of
   use finshell_input_field, only: field_t, get_field
   use finshell_kinds, only: wp
   use finshell_namelist, only: complain_about, get, group_t, has
   use finshell_structure, only: structure_t, thickness_of
   implicit none
   private
   public :: usual_thickness, get_offset, vary_section

contains

   !> The mean thickness of the field of a section, for one that says none itself; 0: no field.
   subroutine usual_thickness(group, fields, structure, number, usual, error)
      type(group_t), intent(inout) :: group
      type(field_t), intent(in) :: fields(:)
      type(structure_t), intent(in) :: structure
      integer, intent(in) :: number !< of the section: structure%element_section says which elements it has
      real(wp), intent(out) :: usual
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: values(:, :)
      integer :: e
      usual = 0
      if (allocated(error) .or. .not. has(group, 'thickness_field')) return
      associate (mine => pack([(e, e=1, size(structure%element_section))], structure%element_section == number))
         call get_field(group, 'thickness_field', fields, mine, 1, 1, values, error)
         if (allocated(error)) return
         e = findloc(.not. values(1, :) > 0, .true., dim=1)
         if (e > 0) then
            call complain_about(group, 'thickness_field', 'element '//text_of(mine(e))//' gets the thickness ' &
                                //text_of(values(1, e))//'; expected is a positive number', error)
         else if (size(values) > 0) then
            usual = sum(values)/size(values)
         end if
      end associate
   end subroutine usual_thickness

   !> The height of the middle of a section above the surface of the nodes, by `offset` or as a part of its thickness.
   subroutine get_offset(group, thickness, offset, error)
      type(group_t), intent(inout) :: group
      real(wp), intent(in) :: thickness
      real(wp), intent(out) :: offset
      type(error_t), allocatable, intent(inout) :: error
      character(len=*), parameter :: keys(3) = [character(len=12) :: 'offset', 'offset_ratio', 'offset_field']
      real(wp) :: ratio
      integer :: i
      offset = 0
      if (count([(has(group, trim(keys(i))), i=1, size(keys))]) > 1) then
         if (.not. allocated(error)) call complain_about(group, '', 'at most one of offset, offset_ratio and offset_field is ' &
                                                         //'expected', error)
         return
      end if
      call get(group, 'offset', offset, error, default=0.0_wp)
      call get(group, 'offset_ratio', ratio, error, default=0.0_wp)
      if (has(group, 'offset_ratio') .and. .not. allocated(error)) offset = ratio*thickness
   end subroutine get_offset

   !> The thickness and the offset of the elements of a section, where they have fields.
   subroutine vary_section(group, fields, number, structure, error)
      type(group_t), intent(inout) :: group
      type(field_t), intent(in) :: fields(:)
      integer, intent(in) :: number
      type(structure_t), intent(inout) :: structure
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: values(:, :)
      real(wp) :: ratio
      integer :: e
      if (allocated(error)) return
      associate (mine => pack([(e, e=1, size(structure%element_section))], structure%element_section == number), &
                 section => structure%sections(number))
         ratio = section%offset/section%thickness
         if (has(group, 'thickness_field')) then
            call get_field(group, 'thickness_field', fields, mine, 1, 1, values, error)
            if (allocated(error)) return
            if (.not. allocated(structure%thickness)) structure%thickness = by_section(structure, structure%sections%thickness)
            structure%thickness(mine) = values(1, :)
         else if (allocated(structure%thickness)) then
            structure%thickness(mine) = section%thickness
         end if
         if (has(group, 'offset_field')) then
            call get_field(group, 'offset_field', fields, mine, 1, 1, values, error)
            if (allocated(error)) return
            if (.not. allocated(structure%offset)) structure%offset = by_section(structure, structure%sections%offset)
            structure%offset(mine) = values(1, :)
         else if (has(group, 'thickness_field') .and. has(group, 'offset_ratio')) then
            if (.not. allocated(structure%offset)) structure%offset = by_section(structure, structure%sections%offset)
            structure%offset(mine) = ratio*[(thickness_of(structure, mine(e)), e=1, size(mine))]
         else if (allocated(structure%offset)) then
            structure%offset(mine) = section%offset
         end if
      end associate
   end subroutine vary_section

   !> What the elements that have a section already have by it; the others get theirs with it.
   pure function by_section(structure, of_sections) result(values)
      type(structure_t), intent(in) :: structure
      real(wp), intent(in) :: of_sections(:)
      real(wp) :: values(size(structure%element_section))
      integer :: e
      values = 0
      do e = 1, size(values)
         if (structure%element_section(e) > 0) values(e) = of_sections(structure%element_section(e))
      end do
   end function by_section
end module finshell_input_thickness
