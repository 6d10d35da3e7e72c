!> C interface: sections of one layer, and what becomes of sections. See finshell.h for what the functions promise.
!>
!> One thread at a time creates a section (see finshell_capi_common).
module finshell_capi_section
   use, intrinsic :: iso_c_binding, only: c_double, c_int32_t, c_null_ptr, c_ptr
   use finshell_capi_common, only: accept, c_status_t, refuse, refuse_memory
   use finshell_capi_elements, only: freedoms_of, receive_section
   use finshell_capi_handle, only: card_t, free_handle, name_length
   use finshell_capi_recipe, only: add_layer, law_by_name, layer_option, make_section, read_pairs, recipe_t, set_law, set_option, &
      start
   use finshell_environment, only: environment_t, hold, release
   use finshell_error, only: error_t
   use finshell_kinds, only: wp
   use finshell_material, only: material_t
   use finshell_section, only: section_t
   use finshell_status, only: status_ok
   implicit none
   private
   public :: create, destroy, freedoms

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

   function one_layer(material, parameters, names, values, thickness, options, option_names, option_values, section, status) &
      result(code)
      type(c_ptr), intent(in) :: material, names, values, option_names, option_values
      integer(c_int32_t), intent(in) :: parameters, options
      real(c_double), intent(in) :: thickness
      type(c_ptr), intent(out), optional :: section
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_section_create'
      type(recipe_t) :: recipe
      type(card_t) :: card
      class(material_t), allocatable :: law
      type(error_t), allocatable :: error
      integer :: memory

      if (present(section)) section = c_null_ptr
      call start(recipe)
      call add_layer(recipe, thickness, 0.0_wp, 0, 0.0_wp, memory)
      if (memory /= 0) then
         code = refuse_memory(status, place)
         return
      end if
      call read_options(options, option_names, option_values, recipe, error)
      if (.not. allocated(error)) call law_by_name(material, parameters, names, values, law, card, error)
      if (.not. allocated(error)) call set_law(recipe, law, card, error)
      if (allocated(error)) then
         code = refuse(status, place, error%message)
      else
         code = make_section(place, recipe, section, status)
      end if
   end function one_layer

   !> Options of a section and of its layer.
   subroutine read_options(options, names, values, recipe, error)
      integer(c_int32_t), intent(in) :: options
      type(c_ptr), intent(in) :: names, values
      type(recipe_t), intent(inout) :: recipe
      type(error_t), allocatable, intent(inout) :: error
      character(len=name_length), allocatable :: list(:)
      real(c_double), pointer :: numbers(:)
      logical :: done
      integer :: i
      call read_pairs('option', options, names, values, list, numbers, error)
      if (allocated(error)) return
      do i = 1, options
         call layer_option(recipe, list(i), numbers(i), done, error)
         if (.not. done) call set_option(recipe, list(i), numbers(i), ', thickness_points, density', error)
         if (allocated(error)) return
      end do
   end subroutine read_options

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
end module finshell_capi_section
