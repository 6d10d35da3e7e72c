!> C interface: what a section is to be made of, while it is being said.
!>
!> All procedures that can fail are to be called in the critical region `finshell_texts` (finshell_capi_common).
module finshell_capi_recipe
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int32_t, c_loc, c_ptr
   use finshell_c_text, only: text_from
   use finshell_capi_common, only: accept, c_status_t, refuse, refuse_memory
   use finshell_capi_handle, only: card_t, handle_t, name_length, new_handle
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: wp
   use finshell_material, only: material_t
   use finshell_parameter, only: lower
   use finshell_registry, only: material_parameters, new_material, parameter_t
   use finshell_section, only: formulation_s, new_layered_section, ply_t, points_by_law
   use finshell_status, only: status_invalid_argument
   implicit none
   private
   public :: recipe_t, start, add_layer, set_law, law_by_name, write_card, set_option, layer_option, read_pairs, make_section

   !> A section to be, after `start`. Layers from the bottom.
   type :: recipe_t
      type(ply_t), allocatable :: plies(:)
      type(card_t), allocatable :: cards(:)
      character(len=name_length), allocatable :: options(:) !< names of those that are set
      real(wp), allocatable :: beta0, slack !< unallocated: the default
      real(wp) :: offset = 0
      integer :: arc = 1, membrane = 0, wrinkling = 0
      integer :: formulation = formulation_s
   end type recipe_t

   character(len=*), parameter :: known_options = 'formulation, beta0, arc, offset, membrane, wrinkling, slack'

contains

   !> No layer yet, all options by default.
   subroutine start(recipe)
      type(recipe_t), intent(out) :: recipe
      allocate (recipe%plies(0), recipe%cards(0), recipe%options(0))
   end subroutine start

   !> One layer more, on top of the others, without a law yet. `memory` is not 0 when there is none.
   subroutine add_layer(recipe, thickness, angle, points, density, memory)
      type(recipe_t), intent(inout) :: recipe
      real(wp), intent(in) :: thickness
      real(wp), intent(in) :: angle !< degrees
      integer, intent(in) :: points !< 0: by the law
      real(wp), intent(in) :: density
      integer, intent(out) :: memory
      type(ply_t), allocatable :: plies(:)
      type(card_t), allocatable :: cards(:)
      integer :: i, n
      n = size(recipe%plies)
      allocate (plies(n + 1), stat=memory)
      if (memory /= 0) return
      allocate (cards(n + 1), stat=memory)
      if (memory /= 0) return
      do i = 1, n
         plies(i)%thickness = recipe%plies(i)%thickness
         plies(i)%angle = recipe%plies(i)%angle
         plies(i)%points = recipe%plies(i)%points
         plies(i)%density = recipe%plies(i)%density
         call move_alloc(recipe%plies(i)%law, plies(i)%law)
         cards(i)%law = recipe%cards(i)%law
         call move_alloc(recipe%cards(i)%names, cards(i)%names)
         call move_alloc(recipe%cards(i)%values, cards(i)%values)
      end do
      plies(n + 1)%thickness = thickness
      plies(n + 1)%angle = angle
      if (points /= 0) plies(n + 1)%points = points
      plies(n + 1)%density = density
      call move_alloc(plies, recipe%plies)
      call move_alloc(cards, recipe%cards)
   end subroutine add_layer

   !> The law of the layer that was added last, and what its card says. A layer has one law.
   subroutine set_law(recipe, law, card, error)
      type(recipe_t), intent(inout) :: recipe
      class(material_t), allocatable, intent(inout) :: law !< moved into the recipe
      type(card_t), intent(in) :: card
      type(error_t), allocatable, intent(inout) :: error
      integer :: n
      n = size(recipe%plies)
      if (n == 0) then
         call raise(error, status_invalid_argument, 'there is no layer yet that could have a law: add one first')
      else if (allocated(recipe%plies(n)%law)) then
         call raise(error, status_invalid_argument, 'it has the law '''//trim(recipe%cards(n)%law)//''' already')
      else
         call move_alloc(law, recipe%plies(n)%law)
         recipe%cards(n) = card
      end if
   end subroutine set_law

   !> A law of the library and its card, from C arrays of names and values.
   subroutine law_by_name(material, parameters, names, values, law, card, error)
      type(c_ptr), intent(in) :: material, names, values
      integer(c_int32_t), intent(in) :: parameters
      class(material_t), allocatable, intent(out) :: law
      type(card_t), intent(out) :: card
      type(error_t), allocatable, intent(inout) :: error
      character(len=name_length), allocatable :: list(:)
      real(c_double), pointer :: numbers(:)
      type(parameter_t), allocatable :: known(:)
      type(error_t), allocatable :: refusal

      if (.not. c_associated(material)) then
         call raise(error, status_invalid_argument, 'the name of the material law is NULL')
         return
      end if
      call read_pairs('parameter', parameters, names, values, list, numbers, error)
      if (allocated(error)) return
      call new_material(law, text_from(material), list, numbers, refusal)
      if (allocated(refusal)) then
         call move_alloc(refusal, error)
         return
      end if
      known = material_parameters(text_from(material))
      call write_card(card, law, known, list, numbers)
   end subroutine law_by_name

   !> What is told of a law that was made of these names and values.
   subroutine write_card(card, law, known, names, values)
      type(card_t), intent(inout) :: card
      class(material_t), intent(in) :: law
      type(parameter_t), intent(in) :: known(:) !< its parameters
      character(len=*), intent(in) :: names(:)
      real(c_double), intent(in) :: values(:)
      integer :: i
      card%law = law%name
      allocate (card%names(size(known)), card%values(size(known)))
      card%names = known%name
      card%values = known%default
      do i = 1, size(names)
         where (card%names == lower(names(i))) card%values = values(i)
      end do
   end subroutine write_card

   !> An option of the section. `more`: others that the caller knows.
   subroutine set_option(recipe, name, value, more, error)
      type(recipe_t), intent(inout) :: recipe
      character(len=name_length), intent(in) :: name
      real(wp), intent(in) :: value
      character(len=*), intent(in) :: more !< '' or ', one, another'
      type(error_t), allocatable, intent(inout) :: error
      call note(recipe, name, error)
      if (allocated(error)) return
      select case (name)
      case ('formulation')
         call whole_number(name, value, recipe%formulation, error)
      case ('beta0')
         recipe%beta0 = value
      case ('arc')
         call yes_or_no(name, value, recipe%arc, error)
      case ('offset')
         recipe%offset = value
      case ('membrane')
         call yes_or_no(name, value, recipe%membrane, error)
      case ('wrinkling')
         call yes_or_no(name, value, recipe%wrinkling, error)
      case ('slack')
         recipe%slack = value
      case default
         call raise(error, status_invalid_argument, &
                    'unknown option '''//trim(name)//'''; options are '//known_options//more)
      end select
   end subroutine set_option

   !> An option of the last layer, in the form that has one layer only; `mine` tells whether it is one.
   subroutine layer_option(recipe, name, value, mine, error)
      type(recipe_t), intent(inout) :: recipe
      character(len=name_length), intent(in) :: name
      real(wp), intent(in) :: value
      logical, intent(out) :: mine
      type(error_t), allocatable, intent(inout) :: error
      mine = name == 'thickness_points' .or. name == 'density'
      if (.not. mine) return
      call note(recipe, name, error)
      if (allocated(error)) return
      associate (ply => recipe%plies(size(recipe%plies)))
         if (name == 'density') ply%density = value
         if (name == 'thickness_points') call whole_number(name, value, ply%points, error)
      end associate
   end subroutine layer_option

   !> An option is set, for the first time.
   subroutine note(recipe, name, error)
      type(recipe_t), intent(inout) :: recipe
      character(len=name_length), intent(in) :: name
      type(error_t), allocatable, intent(inout) :: error
      if (any(recipe%options == name)) then
         call raise(error, status_invalid_argument, 'option '''//trim(name)//''' is given twice')
      else
         recipe%options = [character(len=name_length) :: recipe%options, name]
      end if
   end subroutine note

   !> Make the section, or say why not.
   function make_section(place, recipe, section, status) result(code)
      character(len=*), intent(in) :: place !< name of the C function
      type(recipe_t), intent(in) :: recipe
      type(c_ptr), intent(inout), optional :: section
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(handle_t), pointer :: made
      type(error_t), allocatable :: error
      integer :: i

      if (.not. present(section)) then
         code = refuse(status, place, 'section, where the handle is put, is NULL')
         return
      end if
      call check_kind(recipe, error)
      if (allocated(error)) then
         code = refuse(status, place, error%message)
         return
      end if
      made => new_handle()
      if (.not. associated(made)) then
         code = refuse_memory(status, place)
         return
      end if
      call new_layered_section(made%section, recipe%plies, error, recipe%formulation, recipe%beta0, recipe%offset, &
                               recipe%arc /= 0, recipe%wrinkling /= 0, recipe%slack, recipe%membrane /= 0)
      if (allocated(error)) then
         deallocate (made)
         code = refuse(status, place, error%message)
         return
      end if
      made%cards = recipe%cards
      do i = 1, size(recipe%plies)
         made%cards(i)%angle = recipe%plies(i)%angle
         made%cards(i)%density = recipe%plies(i)%density
      end do
      section = c_loc(made)
      code = accept(status)
   end function make_section

   !> What means nothing to the kind of section.
   subroutine check_kind(recipe, error)
      type(recipe_t), intent(in) :: recipe
      type(error_t), allocatable, intent(inout) :: error
      logical :: membrane
      integer :: i
      membrane = recipe%membrane == 1
      do i = 1, size(recipe%options)
         select case (recipe%options(i))
         case ('formulation', 'beta0', 'arc', 'offset', 'thickness_points')
            if (membrane) call raise(error, status_invalid_argument, &
               'a membrane has no option '''//trim(recipe%options(i))//''': it does not bend')
         case ('wrinkling', 'slack')
            if (.not. membrane) call raise(error, status_invalid_argument, &
               'only a membrane has the option '''//trim(recipe%options(i))//''': give membrane = 1, too')
         end select
         if (allocated(error)) return
      end do
      if (.not. membrane) return
      do i = 1, size(recipe%plies)
         if (recipe%plies(i)%points == points_by_law) cycle
         call raise(error, status_invalid_argument, 'layer '//text_of(i)//': points is '//text_of(recipe%plies(i)%points)// &
                    ', and a membrane has none: leave 0')
         return
      end do
   end subroutine check_kind

   subroutine whole_number(name, value, number, error)
      character(len=*), intent(in) :: name
      real(c_double), intent(in) :: value
      integer, intent(inout) :: number
      type(error_t), allocatable, intent(inout) :: error
      if (abs(value) < 1.0e6_c_double) then
         number = nint(value)
         if (abs(value - number) <= 0) return
      end if
      call raise(error, status_invalid_argument, trim(name)//' is '//text_of(value)//', expected a small whole number')
   end subroutine whole_number

   subroutine yes_or_no(name, value, number, error)
      character(len=*), intent(in) :: name
      real(c_double), intent(in) :: value
      integer, intent(inout) :: number
      type(error_t), allocatable, intent(inout) :: error
      call whole_number(name, value, number, error)
      if (.not. allocated(error) .and. number /= 0 .and. number /= 1) call raise(error, status_invalid_argument, &
         trim(name)//' is '//text_of(number)//', expected 0 or 1')
   end subroutine yes_or_no

   !> Names and values from C arrays.
   subroutine read_pairs(what, n, names, values, list, numbers, error)
      character(len=*), intent(in) :: what
      integer(c_int32_t), intent(in) :: n
      type(c_ptr), intent(in) :: names, values
      character(len=name_length), allocatable, intent(out) :: list(:)
      real(c_double), pointer, intent(out) :: numbers(:)
      type(error_t), allocatable, intent(inout) :: error
      type(c_ptr), pointer :: pointers(:)
      character(len=:), allocatable :: name
      real(c_double), target, save :: none(0)
      integer :: i

      numbers => none
      if (n < 0 .or. n > 1000) then
         call raise(error, status_invalid_argument, 'the number of '//what//'s is '//text_of(n)//', expected 0 to 1000')
      else if (n > 0 .and. .not. (c_associated(names) .and. c_associated(values))) then
         call raise(error, status_invalid_argument, what//' names or values are NULL')
      end if
      if (allocated(error)) return
      allocate (list(n))
      if (n == 0) return
      call c_f_pointer(names, pointers, [n])
      call c_f_pointer(values, numbers, [n])
      do i = 1, n
         name = text_from(pointers(i))
         list(i) = name
         if (len(name) > name_length) list(i) = name(:name_length - 3)//'...'
      end do
   end subroutine read_pairs
end module finshell_capi_recipe
