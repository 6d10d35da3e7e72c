!> C interface: a section of layers, said step by step. See finshell.h for what the functions promise.
!>
!> The law of a layer is a step of its own, so that laws may come from elsewhere than the registry.
module finshell_capi_builder
   use, intrinsic :: iso_c_binding, only: c_associated, c_double, c_f_pointer, c_int32_t, c_int64_t, c_loc, c_null_ptr, c_ptr
   use finshell_c_text, only: text_from
   use finshell_capi_common, only: accept, c_status_t, refuse, refuse_memory
   use finshell_capi_handle, only: card_t, is_marked, name_length, wipe
   use finshell_capi_recipe, only: add_layer, law_by_name, make_section, recipe_t, set_law, set_option, start
   use finshell_environment, only: environment_t, hold, release
   use finshell_error, only: error_t, raise, text_of
   use finshell_material, only: material_t
   use finshell_status, only: status_invalid_argument, status_ok, status_out_of_memory
   implicit none
   private
   public :: begin, layer, law, option, build, destroy, builder_t, receive_builder, give_law

   integer(c_int64_t), parameter :: magic = int(z'46494E4255494C44', c_int64_t) !< 'FINBUILD', see finshell_capi_handle

   type :: builder_t
      integer(c_int64_t) :: mark = magic
      type(recipe_t) :: recipe
      integer(c_int32_t) :: code = status_ok !< of the first call that failed
      character(len=40) :: place = '' !< its name
      character(len=244) :: message = '' !< what it said
   end type builder_t

contains

   function begin(builder, status) result(code) bind(c, name='finshell_builder_begin')
      type(c_ptr), intent(out), optional :: builder
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_builder_begin'
      type(builder_t), pointer :: made
      integer :: memory
      if (.not. present(builder)) then
         code = refuse(status, place, 'builder, where the handle is put, is NULL')
         return
      end if
      builder = c_null_ptr
      allocate (made, stat=memory)
      if (memory /= 0) then
         code = refuse_memory(status, place)
         return
      end if
      call start(made%recipe)
      builder = c_loc(made)
      code = accept(status)
   end function begin

   function layer(builder, thickness, angle, points, density, status) result(code) bind(c, name='finshell_builder_layer')
      type(c_ptr), value :: builder
      real(c_double), value :: thickness, angle, density
      integer(c_int32_t), value :: points
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_builder_layer'
      type(builder_t), pointer :: b
      type(environment_t) :: environment
      integer :: memory
      call hold(environment)
!$omp critical (finshell_texts)
      code = receive_builder(place, builder, b, status)
      if (code == status_ok) then
         call add_layer(b%recipe, thickness, angle, points, density, memory)
         if (memory /= 0) code = spoil(place, b, status)
      end if
!$omp end critical (finshell_texts)
      call release(environment)
   end function layer

   function law(builder, material, parameters, names, values, status) result(code) bind(c, name='finshell_builder_law')
      type(c_ptr), value :: builder, material, names, values
      integer(c_int32_t), value :: parameters
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      call hold(environment)
!$omp critical (finshell_texts)
      code = named_law(builder, material, parameters, names, values, status)
!$omp end critical (finshell_texts)
      call release(environment)
   end function law

   function option(builder, name, value, status) result(code) bind(c, name='finshell_builder_option')
      type(c_ptr), value :: builder, name
      real(c_double), value :: value
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(environment_t) :: environment
      call hold(environment)
!$omp critical (finshell_texts)
      code = named_option(builder, name, value, status)
!$omp end critical (finshell_texts)
      call release(environment)
   end function option

   function build(builder, section, status) result(code) bind(c, name='finshell_builder_build')
      type(c_ptr), value :: builder
      type(c_ptr), intent(out), optional :: section
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_builder_build'
      type(builder_t), pointer :: b
      type(environment_t) :: environment
      if (present(section)) section = c_null_ptr
      call hold(environment)
!$omp critical (finshell_texts)
      code = receive_builder(place, builder, b, status)
      if (code == status_ok) code = make_section(place, b%recipe, section, status)
!$omp end critical (finshell_texts)
      call release(environment)
   end function build

   subroutine destroy(builder) bind(c, name='finshell_builder_destroy')
      type(c_ptr), value :: builder
      type(builder_t), pointer :: b
      if (.not. is_marked(builder, magic)) return
      call c_f_pointer(builder, b)
      call wipe(builder)
      deallocate (b)
   end subroutine destroy

   function named_law(builder, material, parameters, names, values, status) result(code)
      type(c_ptr), intent(in) :: builder, material, names, values
      integer(c_int32_t), intent(in) :: parameters
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_builder_law'
      type(builder_t), pointer :: b
      class(material_t), allocatable :: found
      type(card_t) :: card
      type(error_t), allocatable :: error
      code = receive_builder(place, builder, b, status)
      if (code /= status_ok) return
      call law_by_name(material, parameters, names, values, found, card, error)
      code = give_law(place, b, found, card, error, status)
   end function named_law

   function named_option(builder, name, value, status) result(code)
      type(c_ptr), intent(in) :: builder, name
      real(c_double), intent(in) :: value
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_builder_option'
      type(builder_t), pointer :: b
      character(len=:), allocatable :: text
      character(len=name_length) :: short
      type(error_t), allocatable :: error
      code = receive_builder(place, builder, b, status)
      if (code /= status_ok) return
      if (.not. c_associated(name)) then
         call raise(error, status_invalid_argument, 'the name of the option is NULL')
      else
         text = text_from(name)
         short = text
         if (len(text) > name_length) short = text(:name_length - 3)//'...'
         call set_option(b%recipe, short, value, '', error)
      end if
      if (allocated(error)) code = spoil(place, b, status, error%message)
   end function named_option

   !> The last layer gets a law that was made by the caller, or could not be made (`error`).
   function give_law(place, builder, found, card, error, status) result(code)
      character(len=*), intent(in) :: place !< name of the C function
      type(builder_t), intent(inout) :: builder
      class(material_t), allocatable, intent(inout) :: found
      type(card_t), intent(in) :: card
      type(error_t), allocatable, intent(inout) :: error
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      if (.not. allocated(error)) call set_law(builder%recipe, found, card, error)
      if (.not. allocated(error)) then
         code = accept(status)
      else if (size(builder%recipe%plies) > 0) then
         code = spoil(place, builder, status, 'layer '//text_of(size(builder%recipe%plies))//': '//error%message)
      else
         code = spoil(place, builder, status, error%message)
      end if
   end function give_law

   !> The builder behind a handle. One that a call has spoiled goes on saying what that call said.
   function receive_builder(place, pointer, builder, status) result(code)
      character(len=*), intent(in) :: place
      type(c_ptr), intent(in) :: pointer
      type(builder_t), pointer, intent(out) :: builder
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      nullify (builder)
      if (.not. c_associated(pointer)) then
         code = refuse(status, place, 'builder is NULL')
      else if (.not. is_marked(pointer, magic)) then
         code = refuse(status, place, 'builder is no handle: it was destroyed, or finshell_builder_begin did not make it')
      else
         call c_f_pointer(pointer, builder)
         code = repeat_failure(builder, status)
      end if
   end function receive_builder

   !> A call has failed, for lack of memory when there is no message; those that follow fail as it did.
   function spoil(place, builder, status, message) result(code)
      character(len=*), intent(in) :: place
      type(builder_t), intent(inout) :: builder
      type(c_status_t), intent(out), optional :: status
      character(len=*), intent(in), optional :: message
      integer(c_int32_t) :: code
      builder%place = place
      builder%code = status_out_of_memory
      if (present(message)) then
         builder%code = status_invalid_argument
         builder%message = message
      end if
      code = repeat_failure(builder, status)
   end function spoil

   function repeat_failure(builder, status) result(code)
      type(builder_t), intent(in) :: builder
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      select case (builder%code)
      case (status_ok)
         code = accept(status)
      case (status_out_of_memory)
         code = refuse_memory(status, trim(builder%place))
      case default
         code = refuse(status, trim(builder%place), trim(builder%message))
      end select
   end function repeat_failure
end module finshell_capi_builder
