!> The groups &growth of an input file: growth, prestretch and thermal expansion.
module finshell_input_growth
   use finshell_error, only: error_t, text_of
   use finshell_factor, only: by_case, by_load_factor
   use finshell_stress_free, only: growth_t, new_growths
   use finshell_input_case, only: get_scaling, get_span, scales_t
   use finshell_input_common, only: get_few, get_sets, in_element_sets, kind_element
   use finshell_input_field, only: field_t, get_field
   use finshell_kinds, only: wp
   use finshell_namelist, only: check_all_used, complain_about, get, group_t, has, namelist_t
   use finshell_step, only: control_explicit, step_t
   use finshell_structure, only: structure_t
   use finshell_table, only: by_time
   implicit none
   private
   public :: read_growths, check_explicit_growth

   character(len=*), parameter :: kinds(5) = [character(len=16) :: 'growth', 'growth_field', 'prestretch', 'prestretch_field', &
                                              'expansion']

contains

   !> All groups. The sections of the structure must be there.
   subroutine read_growths(namelist, fields, structure, scales, error)
      type(namelist_t), intent(inout) :: namelist
      type(field_t), intent(in) :: fields(:)
      type(structure_t), intent(inout) :: structure
      type(scales_t), intent(inout) :: scales
      type(error_t), allocatable, intent(inout) :: error
      type(growth_t), allocatable :: list(:)
      type(growth_t) :: one
      integer :: i
      allocate (list(0))
      do i = 1, size(namelist%groups)
         if (allocated(error)) return
         if (namelist%groups(i)%name /= 'growth') cycle
         call read_growth(namelist%groups(i), fields, structure, scales, one, error)
         if (.not. allocated(error)) list = [list, one]
      end do
      if (allocated(error) .or. size(list) == 0) return
      allocate (structure%growths)
      call new_growths(structure%growths, list, size(structure%element_section))
   end subroutine read_growths

   !> Refuse growth that changes in explicit steps: what it stores there is in no balance of energy.
   subroutine check_explicit_growth(namelist, structure, scales, steps, error)
      type(namelist_t), intent(in) :: namelist
      type(structure_t), intent(in) :: structure
      type(scales_t), intent(in) :: scales
      type(step_t), intent(in) :: steps(:)
      type(error_t), allocatable, intent(inout) :: error
      integer :: factor, g, i, j, n
      if (allocated(error) .or. .not. allocated(structure%growths)) return
      n = 0
      do i = 1, size(namelist%groups)
         if (namelist%groups(i)%name /= 'step') cycle
         n = n + 1
         if (steps(n)%control /= control_explicit) cycle
         do g = 1, size(structure%growths%list)
            if (.not. structure%growths%list(g)%span%covers(n)) cycle
            factor = structure%growths%list(g)%scaling
            do j = 1, size(scales%followers)
               if (scales%followers(j)%factor == structure%growths%list(g)%scaling) factor = scales%followers(j)%parent
            end do
            if (factor /= by_time .and. factor /= merge(by_load_factor, by_case + steps(n)%case - 1, steps(n)%case == 1)) cycle
            call complain_about(namelist%groups(i), 'control', 'explicit steps do not know growth that changes with them ' &
                                //"(&growth number "//text_of(g)//"); control = 'dynamic' does, and constant = .true. or a case " &
                                //'of its own keeps it as it is', error)
            return
         end do
      end do
   end subroutine check_explicit_growth

   subroutine read_growth(group, fields, structure, scales, one, error)
      type(group_t), intent(inout) :: group
      type(field_t), intent(in) :: fields(:)
      type(structure_t), intent(in) :: structure
      type(scales_t), intent(inout) :: scales
      type(growth_t), intent(out) :: one
      type(error_t), allocatable, intent(inout) :: error
      real(wp), parameter :: degree = acos(-1.0_wp)/180
      real(wp), allocatable :: values(:, :)
      character(len=:), allocatable :: key
      real(wp) :: angle
      integer :: at
      call read_elements(group, structure, one%elements, error)
      call read_layers(group, structure, one, error)
      call get_scaling(group, scales, one%scaling, error)
      call get_span(group, scales, one%span, error)
      call get(group, 'angle', angle, error, default=0.0_wp)
      if (.not. allocated(error)) call find_kind(group, key, error)
      if (allocated(error)) return
      one%cosine = cos(degree*angle)
      one%sine = sin(degree*angle)
      if (key == 'expansion') then
         call read_expansion(group, fields, one, error)
      else
         if (index(key, '_field') > 0) then
            call get_field(group, key, fields, one%elements, 1, 3, values, error)
         else
            call get_numbers(group, key, values, error)
         end if
         if (.not. allocated(error)) call take_stretches(values, index(key, 'prestretch') == 1, one)
      end if
      call check_all_used(group, error)
      call check_membranes(group, structure, one, error)
      if (allocated(error)) return
      if (all(one%stretch(:2, :) > 0) .and. all(one%stretch(3, :) >= 0)) return
      at = findloc(any(one%stretch(:2, :) <= 0, dim=1) .or. one%stretch(3, :) < 0, .true., dim=1)
      call complain_about(group, key, 'the stretch of element '//text_of(one%elements(at))//' is ' &
         //text_of(minval(one%stretch(:, at)))//'; expected is a positive number, 1 where nothing grows', error)
   end subroutine read_growth

   !> The key that says what grows.
   subroutine find_kind(group, key, error)
      type(group_t), intent(in) :: group
      character(len=:), allocatable, intent(out) :: key
      type(error_t), allocatable, intent(inout) :: error
      logical :: given(size(kinds))
      integer :: i
      given = [(has(group, trim(kinds(i))), i=1, size(kinds))]
      key = ''
      if (count(given) == 1) then
         key = trim(kinds(findloc(given, .true., dim=1)))
      else
         call complain_about(group, '', 'one of growth, growth_field, prestretch, prestretch_field and expansion is expected; ' &
                             //text_of(count(given))//' were found', error)
      end if
   end subroutine find_kind

   !> The elements of the sets, each once; without a set all.
   subroutine read_elements(group, structure, elements, error)
      type(group_t), intent(inout) :: group
      type(structure_t), intent(in) :: structure
      integer, allocatable, intent(out) :: elements(:)
      type(error_t), allocatable, intent(inout) :: error
      character(len=:), allocatable :: sets(:)
      integer :: e
      allocate (elements(0))
      call get_sets(group, kind_element, structure%mesh, sets, error, required=.false.)
      if (allocated(error)) return
      elements = pack([(e, e=1, size(structure%element_section))], size(sets) == 0 .or. in_element_sets(structure%mesh, sets))
   end subroutine read_elements

   !> Layers, which all sections of the elements must have.
   subroutine read_layers(group, structure, one, error)
      type(group_t), intent(inout) :: group
      type(structure_t), intent(in) :: structure
      type(growth_t), intent(inout) :: one
      type(error_t), allocatable, intent(inout) :: error
      integer :: e, layers
      call get(group, 'layer', one%layers, error, minimum=1)
      if (allocated(error) .or. size(one%layers) == 0) return
      do e = 1, size(one%elements)
         layers = size(structure%sections(structure%element_section(one%elements(e)))%layers)
         if (maxval(one%layers) <= layers) cycle
         call complain_about(group, 'layer', 'layer '//text_of(maxval(one%layers))//' was found; the section of element ' &
                             //text_of(one%elements(e))//' has '//text_of(layers), error)
         return
      end do
   end subroutine read_layers

   !> The layers of a membrane grow together: it cannot bend.
   subroutine check_membranes(group, structure, one, error)
      type(group_t), intent(in) :: group
      type(structure_t), intent(in) :: structure
      type(growth_t), intent(in) :: one
      type(error_t), allocatable, intent(inout) :: error
      integer :: e
      logical :: alike
      if (allocated(error)) return
      do e = 1, size(one%elements)
         associate (section => structure%sections(structure%element_section(one%elements(e))), &
                    stretch => one%stretch(:, min(e, size(one%stretch, 2))))
            if (.not. section%membrane .or. size(section%layers) == 1) cycle
            alike = all(abs(section%layers%cosine*section%layers(1)%sine - section%layers%sine*section%layers(1)%cosine) <= 0) &
                    .or. abs(stretch(1) - stretch(2)) <= 0
            if (size(one%layers) == 0 .and. alike) cycle
            call complain_about(group, '', 'the layers of the membrane of element '//text_of(one%elements(e)) &
                                //' would grow apart; they can only grow alike, as a membrane does not bend', error)
            return
         end associate
      end do
   end subroutine check_membranes

   !> One to three numbers, the same for all elements.
   subroutine get_numbers(group, key, values, error)
      type(group_t), intent(inout) :: group
      character(len=*), intent(in) :: key
      real(wp), allocatable, intent(out) :: values(:, :) !< (numbers, 1)
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: numbers(:)
      call get_few(group, key, numbers, error)
      values = reshape(numbers, [size(numbers), 1])
   end subroutine get_numbers

   !> One number: growth of all lengths, prestretch in the plane. Two: along and across, where growth leaves the thickness and
   !> prestretch the volume. Three: and of the thickness.
   pure subroutine take_stretches(values, inverse, one)
      real(wp), intent(in) :: values(:, :)
      logical, intent(in) :: inverse
      type(growth_t), intent(inout) :: one
      integer :: n
      n = size(values, 1)
      one%inverse = inverse
      allocate (one%stretch(3, size(values, 2)))
      one%stretch(1, :) = values(1, :)
      one%stretch(2, :) = values(min(2, n), :)
      if (n == 3) then
         one%stretch(3, :) = values(3, :)
      else if (inverse) then
         one%stretch(3, :) = 0
      else
         one%stretch(3, :) = merge(values(1, :), 0*values(1, :) + 1, n == 1)
      end if
   end subroutine take_stretches

   !> 1 + coefficient * change of temperature; with a field that many times what it says.
   subroutine read_expansion(group, fields, one, error)
      type(group_t), intent(inout) :: group
      type(field_t), intent(in) :: fields(:)
      type(growth_t), intent(inout) :: one
      type(error_t), allocatable, intent(inout) :: error
      real(wp), allocatable :: coefficient(:, :), temperature(:, :)
      real(wp) :: change
      integer :: e
      call get_numbers(group, 'expansion', coefficient, error)
      if (has(group, 'temperature_field')) then
         call get(group, 'temperature', change, error, default=1.0_wp)
         call get_field(group, 'temperature_field', fields, one%elements, 1, 1, temperature, error)
         temperature = change*temperature
      else
         change = 0
         call get(group, 'temperature', change, error)
         temperature = reshape([change], [1, 1])
      end if
      if (allocated(error)) return
      allocate (one%stretch(3, size(temperature, 2)))
      do e = 1, size(temperature, 2)
         one%stretch(:, e) = 1 + coefficient([1, min(2, size(coefficient, 1)), size(coefficient, 1)], 1)*temperature(1, e)
      end do
   end subroutine read_expansion
end module finshell_input_growth
