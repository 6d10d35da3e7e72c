!> C interface: laws of the caller's, and what laws remember. See finshell.h for what the functions promise.
module finshell_capi_law
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_pointer, c_int32_t, c_ptr
   use finshell_capi_builder, only: builder_t, give_law, receive_builder
   use finshell_c_text, only: store_text, text_from
   use finshell_capi_common, only: accept, c_status_t, refuse
   use finshell_capi_elements, only: receive_section
   use finshell_capi_handle, only: card_t, name_length
   use finshell_capi_recipe, only: read_pairs, write_card
   use finshell_environment, only: environment_t, hold, release
   use finshell_error, only: error_t, raise
   use finshell_law_findings, only: check_law, finding_t, n_findings
   use finshell_law_description, only: read_description
   use finshell_material, only: material_t
   use finshell_outside_law, only: description_t
   use finshell_registry, only: new_described_material, new_material
   use finshell_section, only: first_state, section_t, states_of
   use finshell_status, only: status_invalid_argument, status_material_limit, status_ok
   implicit none
   private
   public :: own_law, check, section_states, layer_states, c_finding_t

   integer, parameter :: name_size = 24, meaning_size = 112

   !> finshell_law_finding of the header.
   type, bind(c) :: c_finding_t
      character(kind=c_char) :: name(name_size)
      character(kind=c_char) :: meaning(meaning_size)
      real(c_double) :: found
      real(c_double) :: allowed
      integer(c_int32_t) :: passed
      integer(c_int32_t) :: padding
   end type c_finding_t

contains

   function section_states(section, status) result(number) bind(c, name='finshell_section_states')
      type(c_ptr), value :: section
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: number
      type(section_t), pointer :: s
      number = receive_section('finshell_section_states', section, s, status)
      if (number /= status_ok) return
      number = accept(status)
      number = states_of(s)
   end function section_states

   function layer_states(section, layer, first, points, variables, status) result(code) &
      bind(c, name='finshell_section_layer_states')
      type(c_ptr), value :: section
      integer(c_int32_t), value :: layer
      integer(c_int32_t), intent(out), optional :: first, points, variables
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_section_layer_states'
      type(section_t), pointer :: s
      code = receive_section(place, section, s, status)
      if (code /= status_ok) return
      if (layer < 0 .or. layer >= size(s%layers)) then
         code = refuse(status, place, 'layer is #, expected 0 to one less than the number of layers', layer)
         return
      end if
      if (present(first)) first = first_state(s, layer + 1)
      if (present(points)) points = s%layers(layer + 1)%points
      if (present(variables)) variables = s%layers(layer + 1)%law%states
      code = accept(status)
   end function layer_states

   function check(law, material, parameters, names, values, finding, status) result(code) bind(c, name='finshell_law_check')
      type(c_ptr), value :: law, material, names, values, finding
      integer(c_int32_t), value :: parameters
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      call hold(environment)
!$omp critical (finshell_texts)
      code = look_at(law, material, parameters, names, values, finding, status)
!$omp end critical (finshell_texts)
      call release(environment)
   end function check

   function own_law(builder, law, parameters, names, values, status) result(code) bind(c, name='finshell_builder_own_law')
      type(c_ptr), value :: builder, law, names, values
      integer(c_int32_t), value :: parameters
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      call hold(environment)
!$omp critical (finshell_texts)
      code = described_law(builder, law, parameters, names, values, status)
!$omp end critical (finshell_texts)
      call release(environment)
   end function own_law

   function described_law(builder, law, parameters, names, values, status) result(code)
      type(c_ptr), intent(in) :: builder, law, names, values
      integer(c_int32_t), intent(in) :: parameters
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_builder_own_law'
      type(builder_t), pointer :: b
      class(material_t), allocatable :: made
      type(card_t) :: card
      type(error_t), allocatable :: error
      type(description_t) :: description
      character(len=name_length), allocatable :: words(:)
      real(c_double), pointer :: numbers(:)
      code = receive_builder(place, builder, b, status)
      if (code /= status_ok) return
      call read_description(law, description, error)
      if (.not. allocated(error)) call read_pairs('parameter', parameters, names, values, words, numbers, error)
      if (.not. allocated(error)) call new_described_material(made, description, words, numbers, error)
      if (.not. allocated(error)) call write_card(card, made, description%parameters, words, numbers)
      code = give_law(place, b, made, card, error, status)
   end function described_law

   function look_at(law, material, parameters, names, values, finding, status) result(code)
      type(c_ptr), intent(in) :: law, material, names, values, finding
      integer(c_int32_t), intent(in) :: parameters
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_law_check'
      class(material_t), allocatable :: made
      type(finding_t) :: list(n_findings)
      type(c_finding_t), pointer :: shown(:)
      type(error_t), allocatable :: error, refusal
      type(description_t) :: description
      character(len=name_length), allocatable :: words(:)
      real(c_double), pointer :: numbers(:)
      integer :: i

      call read_pairs('parameter', parameters, names, values, words, numbers, error)
      if (allocated(error)) then
         continue
      else if (c_associated(law)) then
         call read_description(law, description, error)
         if (.not. allocated(error)) call new_described_material(made, description, words, numbers, error)
      else if (c_associated(material)) then
         call new_material(made, text_from(material), words, numbers, refusal)
         if (allocated(refusal)) call move_alloc(refusal, error)
      else
         call raise(error, status_invalid_argument, 'law and material are NULL, expected one of them')
      end if
      if (allocated(error)) then
         code = refuse(status, place, error%message)
         return
      end if
      call check_law(made, list)
      code = accept(status)
      if (c_associated(finding)) then
         call c_f_pointer(finding, shown, [n_findings])
         do i = 1, n_findings
            call store_text(list(i)%name, name_size, shown(i)%name)
            call store_text(list(i)%meaning, meaning_size, shown(i)%meaning)
            shown(i)%found = list(i)%found
            shown(i)%allowed = list(i)%allowed
            shown(i)%passed = merge(1, 0, list(i)%passed)
            shown(i)%padding = 0
         end do
      end if
      if (all(list%passed)) return
      code = status_material_limit
      if (.not. present(status)) return
      status%code = code
      status%failed = count(.not. list%passed)
      i = findloc(list%passed, .false., dim=1)
      call store_text(place//': '//trim(list(i)%name)//': '//trim(list(i)%meaning), size(status%message), status%message)
   end function look_at
end module finshell_capi_law
