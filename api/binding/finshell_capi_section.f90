!> C interface: sections. See finshell.h for what the functions promise.
!>
!> One thread at a time creates a section (see finshell_capi_common).
module finshell_capi_section
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int32_t, c_loc, c_null_ptr, c_ptr
   use finshell_capi_common, only: accept, c_status_t, refuse, refuse_memory, text_from
   use finshell_capi_elements, only: freedoms_of, receive_section
   use finshell_capi_handle, only: free_handle, handle_t, new_handle
   use finshell_environment, only: environment_t, hold, release
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: wp
   use finshell_registry, only: new_material
   use finshell_section, only: formulation_s, new_layered_section, ply_t, section_t
   use finshell_status, only: status_invalid_argument, status_ok
   implicit none
   private
   public :: c_layer_t, create, create_layered, destroy, freedoms, read_pairs

   !> finshell_layer of the header.
   type, bind(c) :: c_layer_t
      type(c_ptr) :: material
      type(c_ptr) :: names
      type(c_ptr) :: values
      integer(c_int32_t) :: parameters
      integer(c_int32_t) :: points
      real(c_double) :: thickness
      real(c_double) :: angle
      real(c_double) :: density
   end type c_layer_t

   !> What the options say.
   type :: options_t
      real(wp), allocatable :: beta0, slack !< unallocated: the default
      real(wp) :: offset = 0
      integer :: arc = 1, membrane = 0, wrinkling = 0
      integer :: formulation = formulation_s
   end type options_t

   character(len=*), parameter :: known_options = 'formulation, beta0, arc, offset, membrane, wrinkling, slack'
   integer, parameter :: name_length = 32 !< longer names are unknown ones

contains

   function create(material, parameters, names, values, thickness, options, option_names, option_values, section, status) &
      result(code) bind(c, name='finshell_section_create')
      type(c_ptr), value :: material, names, values
      integer(c_int32_t), value :: parameters, options
      real(c_double), value :: thickness
      type(c_ptr), value :: option_names, option_values
      type(c_ptr), intent(out), optional :: section
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      call hold(environment)
!$omp critical (finshell_texts)
      code = one_layer(material, parameters, names, values, thickness, options, option_names, option_values, section, status)
!$omp end critical (finshell_texts)
      call release(environment)
   end function create

   function create_layered(layers, layer, options, option_names, option_values, section, status) result(code) &
      bind(c, name='finshell_section_create_layered')
      integer(c_int32_t), value :: layers, options
      type(c_ptr), value :: layer, option_names, option_values
      type(c_ptr), intent(out), optional :: section
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      call hold(environment)
!$omp critical (finshell_texts)
      code = many_layers(layers, layer, options, option_names, option_values, section, status)
!$omp end critical (finshell_texts)
      call release(environment)
   end function create_layered

   function one_layer(material, parameters, names, values, thickness, options, option_names, option_values, section, status) &
      result(code)
      type(c_ptr), intent(in) :: material, names, values, option_names, option_values
      integer(c_int32_t), intent(in) :: parameters, options
      real(c_double), intent(in) :: thickness
      type(c_ptr), intent(out), optional :: section
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_section_create'
      type(ply_t) :: ply(1)
      type(options_t) :: chosen
      type(error_t), allocatable :: error

      if (present(section)) section = c_null_ptr
      ply(1)%thickness = thickness
      call read_options(options, option_names, option_values, chosen, error, ply(1))
      if (.not. allocated(error)) call read_material(material, parameters, names, values, ply(1), error)
      if (allocated(error)) then
         code = refuse(status, place, error%message)
      else
         code = finish(place, ply, chosen, section, status)
      end if
   end function one_layer

   function many_layers(layers, layer, options, option_names, option_values, section, status) result(code)
      integer(c_int32_t), intent(in) :: layers, options
      type(c_ptr), intent(in) :: layer, option_names, option_values
      type(c_ptr), intent(out), optional :: section
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_section_create_layered'
      type(c_layer_t), pointer :: given(:)
      type(ply_t), allocatable :: plies(:)
      type(options_t) :: chosen
      type(error_t), allocatable :: error
      integer :: i, memory

      if (present(section)) section = c_null_ptr
      if (layers < 1 .or. .not. c_associated(layer)) then
         code = refuse(status, place, 'at least one layer is expected; layers is '//text_of(layers))
         return
      end if
      call c_f_pointer(layer, given, [layers])
      allocate (plies(layers), stat=memory)
      if (memory /= 0) then
         code = refuse_memory(status, place)
         return
      end if
      call read_options(options, option_names, option_values, chosen, error)
      do i = 1, layers
         if (allocated(error)) exit
         plies(i)%thickness = given(i)%thickness
         plies(i)%angle = given(i)%angle
         plies(i)%density = given(i)%density
         if (given(i)%points /= 0) plies(i)%points = given(i)%points
         if (chosen%membrane == 1 .and. given(i)%points /= 0) then
            call raise(error, status_invalid_argument, 'points is '//text_of(given(i)%points)//', and a membrane has none: leave 0')
         else
            call read_material(given(i)%material, given(i)%parameters, given(i)%names, given(i)%values, plies(i), error)
         end if
         if (allocated(error)) error%message = 'layer '//text_of(i)//': '//error%message
      end do
      if (allocated(error)) then
         code = refuse(status, place, error%message)
      else
         code = finish(place, plies, chosen, section, status)
      end if
   end function many_layers

   subroutine destroy(section) bind(c, name='finshell_section_destroy')
      type(c_ptr), value :: section
      call free_handle(section)
   end subroutine destroy

   function freedoms(section, status) result(number) bind(c, name='finshell_section_freedoms')
      type(c_ptr), value :: section
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: number
      type(section_t), pointer :: s
      number = receive_section('finshell_section_freedoms', section, s, status)
      if (number /= status_ok) return
      number = accept(status)
      number = freedoms_of(s)
   end function freedoms

   !> Make the section, or say why not.
   function finish(place, plies, chosen, section, status) result(code)
      character(len=*), intent(in) :: place
      type(ply_t), intent(in) :: plies(:)
      type(options_t), intent(in) :: chosen
      type(c_ptr), intent(inout), optional :: section
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(handle_t), pointer :: made
      type(error_t), allocatable :: error

      if (.not. present(section)) then
         code = refuse(status, place, 'section, where the handle is put, is NULL')
         return
      end if
      made => new_handle()
      if (.not. associated(made)) then
         code = refuse_memory(status, place)
         return
      end if
      call new_layered_section(made%section, plies, error, chosen%formulation, chosen%beta0, chosen%offset, chosen%arc /= 0, &
                               chosen%wrinkling /= 0, chosen%slack, chosen%membrane /= 0)
      if (allocated(error)) then
         deallocate (made)
         code = refuse(status, place, error%message)
         return
      end if
      section = c_loc(made)
      code = accept(status)
   end function finish

   !> The law of a layer, from C arrays of names and values.
   subroutine read_material(material, parameters, names, values, ply, error)
      type(c_ptr), intent(in) :: material, names, values
      integer(c_int32_t), intent(in) :: parameters
      type(ply_t), intent(inout) :: ply
      type(error_t), allocatable, intent(inout) :: error
      character(len=name_length), allocatable :: list(:)
      real(c_double), pointer :: numbers(:)
      type(error_t), allocatable :: refusal

      if (.not. c_associated(material)) then
         call raise(error, status_invalid_argument, 'the name of the material law is NULL')
         return
      end if
      call read_pairs('parameter', parameters, names, values, list, numbers, error)
      if (allocated(error)) return
      call new_material(ply%law, text_from(material), list, numbers, refusal)
      if (allocated(refusal)) call move_alloc(refusal, error)
   end subroutine read_material

   !> The options; those of the one layer of a section only where it is given.
   subroutine read_options(options, names, values, chosen, error, ply)
      integer(c_int32_t), intent(in) :: options
      type(c_ptr), intent(in) :: names, values
      type(options_t), intent(inout) :: chosen
      type(error_t), allocatable, intent(inout) :: error
      type(ply_t), intent(inout), optional :: ply
      character(len=name_length), allocatable :: list(:)
      real(c_double), pointer :: numbers(:)
      integer :: i, j

      call read_pairs('option', options, names, values, list, numbers, error)
      if (allocated(error)) return
      do i = 1, options
         do j = 1, i - 1
            if (list(j) == list(i)) call raise(error, status_invalid_argument, 'option '''//trim(list(i))//''' is given twice')
         end do
         select case (list(i))
         case ('formulation')
            call whole_number(list(i), numbers(i), chosen%formulation, error)
         case ('beta0')
            chosen%beta0 = numbers(i)
         case ('arc')
            call yes_or_no(list(i), numbers(i), chosen%arc, error)
         case ('offset')
            chosen%offset = numbers(i)
         case ('membrane')
            call yes_or_no(list(i), numbers(i), chosen%membrane, error)
         case ('wrinkling')
            call yes_or_no(list(i), numbers(i), chosen%wrinkling, error)
         case ('slack')
            chosen%slack = numbers(i)
         case default
            if (.not. present(ply)) then
               call raise(error, status_invalid_argument, unknown(list(i), known_options))
            else if (list(i) == 'thickness_points') then
               call whole_number(list(i), numbers(i), ply%points, error)
            else if (list(i) == 'density') then
               ply%density = numbers(i)
            else
               call raise(error, status_invalid_argument, unknown(list(i), known_options//', thickness_points, density'))
            end if
         end select
         if (allocated(error)) return
      end do
      call check_kind(list, chosen%membrane == 1, error)
   end subroutine read_options

   !> Options that mean nothing to the kind of section.
   subroutine check_kind(list, membrane, error)
      character(len=*), intent(in) :: list(:)
      logical, intent(in) :: membrane
      type(error_t), allocatable, intent(inout) :: error
      integer :: i
      do i = 1, size(list)
         select case (list(i))
         case ('formulation', 'beta0', 'arc', 'offset', 'thickness_points')
            if (membrane) call raise(error, status_invalid_argument, &
               'a membrane has no option '''//trim(list(i))//''': it does not bend')
         case ('wrinkling', 'slack')
            if (.not. membrane) call raise(error, status_invalid_argument, &
               'only a membrane has the option '''//trim(list(i))//''': give membrane = 1, too')
         end select
         if (allocated(error)) return
      end do
   end subroutine check_kind

   pure function unknown(name, known) result(text)
      character(len=*), intent(in) :: name, known
      character(len=:), allocatable :: text
      text = 'unknown option '''//trim(name)//'''; options are '//known
   end function unknown

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
end module finshell_capi_section
