!> C interface: what a section is. See finshell.h for what the functions promise.
!>
!> The structures that are filled begin with their size, as the block of a call does (finshell_capi_elements), so that members can
!> be added at their end.
module finshell_capi_query
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_pointer, c_int32_t, c_int64_t, c_int8_t, c_loc, &
      c_ptr, c_sizeof
   use finshell_c_text, only: store_text
   use finshell_capi_common, only: accept, c_status_t, refuse, report
   use finshell_capi_elements, only: freedoms_of, receive_section
   use finshell_capi_handle, only: handle_of, handle_t, name_length
   use finshell_environment, only: environment_t, hold, release
   use finshell_laminate, only: stiffness_at_rest
   use finshell_section, only: section_t
   use finshell_status, only: status_material_limit, status_ok
   implicit none
   private
   public :: properties, layer_properties, layer_parameter, stiffness, c_properties_t, c_layer_t

   !> finshell_properties of the header.
   type, bind(c) :: c_properties_t
      integer(c_int64_t) :: size = 0
      integer(c_int32_t) :: layers = 0
      integer(c_int32_t) :: freedoms = 0
      integer(c_int32_t) :: formulation = 0
      integer(c_int32_t) :: isotropic = 0
      integer(c_int32_t) :: membrane = 0
      integer(c_int32_t) :: wrinkling = 0
      real(c_double) :: thickness = 0
      real(c_double) :: offset = 0
      real(c_double) :: areal_mass = 0
      real(c_double) :: first_moment = 0
      real(c_double) :: rotatory_inertia = 0
   end type c_properties_t

   !> finshell_layer of the header.
   type, bind(c) :: c_layer_t
      integer(c_int64_t) :: size = 0
      character(kind=c_char) :: law(name_length) = ' '
      integer(c_int32_t) :: parameters = 0
      integer(c_int32_t) :: points = 0
      real(c_double) :: thickness = 0
      real(c_double) :: angle = 0
      real(c_double) :: density = 0
      real(c_double) :: height = 0
   end type c_layer_t

   integer(c_int64_t), parameter :: no_size = 4096 !< whatever is larger was not set
   integer(c_int64_t), parameter :: least_properties = 72, least_layer = 80 !< sizes of the structures in version 0.1

contains

   function properties(section, filled, status) result(code) bind(c, name='finshell_section_properties')
      type(c_ptr), value :: section, filled
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_section_properties'
      type(section_t), pointer :: s
      type(c_properties_t), target :: own
      code = receive_section(place, section, s, status)
      if (code /= status_ok) return
      own%layers = size(s%layers)
      own%freedoms = freedoms_of(s)
      own%formulation = s%formulation
      own%isotropic = merge(1, 0, s%isotropic)
      own%membrane = merge(1, 0, s%membrane)
      own%wrinkling = merge(1, 0, s%wrinkling)
      own%thickness = s%thickness
      own%offset = s%offset
      own%areal_mass = s%inertia(1)
      own%first_moment = s%inertia(2)
      own%rotatory_inertia = s%inertia(3)
      if (.not. all(ieee_is_finite([s%thickness, s%offset, s%inertia]))) then
         code = report(status, place, status_material_limit)
         return
      end if
      code = hand_out(place, 'properties', c_loc(own), c_sizeof(own), least_properties, filled, status)
   end function properties

   function layer_properties(section, i, filled, status) result(code) bind(c, name='finshell_section_layer')
      type(c_ptr), value :: section, filled
      integer(c_int32_t), value :: i
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_section_layer'
      type(handle_t), pointer :: handle
      type(c_layer_t), target :: own
      code = receive_layer(place, section, i, handle, status)
      if (code /= status_ok) return
      associate (layer => handle%section%layers(i + 1), card => handle%cards(i + 1))
         call store_text(card%law, name_length, own%law)
         own%parameters = size(card%names)
         own%points = merge(0, layer%points, handle%section%membrane)
         own%thickness = layer%thickness
         own%angle = card%angle
         own%density = card%density
         own%height = layer%middle
      end associate
      code = hand_out(place, 'layer', c_loc(own), c_sizeof(own), least_layer, filled, status)
   end function layer_properties

   function layer_parameter(section, layer, i, name, size_of_name, number, status) result(code) &
      bind(c, name='finshell_section_parameter')
      type(c_ptr), value :: section
      integer(c_int32_t), value :: layer, i, size_of_name
      ! allow(C072)
      character(kind=c_char), intent(inout), optional :: name(*)
      real(c_double), intent(out), optional :: number
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_section_parameter'
      type(handle_t), pointer :: handle
      code = receive_layer(place, section, layer, handle, status)
      if (code /= status_ok) return
      associate (card => handle%cards(layer + 1))
         if (i < 0 .or. i >= size(card%names)) then
            code = refuse(status, place, 'i is #, expected 0 to one less than the number of parameters of the layer', i)
         else if (present(name) .and. size_of_name < 1) then
            code = refuse(status, place, 'size is #, and name has room for nothing', size_of_name)
         else
            if (present(name)) call store_text(card%names(i + 1), size_of_name, name)
            if (present(number)) number = card%values(i + 1)
            code = accept(status)
         end if
      end associate
   end function layer_parameter

   function stiffness(section, matrix, status) result(code) bind(c, name='finshell_section_stiffness')
      type(c_ptr), value :: section
      real(c_double), intent(out), optional :: matrix(6, 6)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_section_stiffness'
      type(section_t), pointer :: s
      type(environment_t) :: environment
      real(c_double) :: found(6, 6)
      integer(c_int32_t) :: limit
      code = receive_section(place, section, s, status)
      if (code /= status_ok) return
      if (.not. present(matrix)) then
         code = refuse(status, place, 'stiffness is NULL')
         return
      end if
      call hold(environment)
      call stiffness_at_rest(s, found, limit)
      if (limit == status_ok .and. .not. all(ieee_is_finite(found))) limit = status_material_limit
      if (limit /= status_ok) found = 0
      call release(environment)
      matrix = found
      if (limit == status_ok) then
         code = accept(status)
      else
         code = report(status, place, limit)
      end if
   end function stiffness

   !> The handle behind a pointer, and that it has a layer i (from 0).
   function receive_layer(place, section, i, handle, status) result(code)
      character(len=*), intent(in) :: place
      type(c_ptr), intent(in) :: section
      integer(c_int32_t), intent(in) :: i
      type(handle_t), pointer, intent(out) :: handle
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      type(section_t), pointer :: s
      nullify (handle)
      code = receive_section(place, section, s, status)
      if (code /= status_ok) return
      handle => handle_of(section)
      if (i < 0 .or. i >= size(s%layers)) then
         code = refuse(status, place, 'layer is #, expected 0 to one less than the number of layers', i)
      end if
   end function receive_layer

   !> Fill the caller's structure as far as it reaches, but for its size; what this library does not know becomes 0.
   function hand_out(place, what, own, known, least, pointer, status) result(code)
      character(len=*), intent(in) :: place
      character(len=*), intent(in) :: what !< name of the argument
      type(c_ptr), intent(in) :: own !< the structure as this library knows it
      integer(c_int64_t), intent(in) :: known !< its size
      integer(c_int64_t), intent(in) :: least !< that of the shortest that there ever was
      type(c_ptr), intent(in) :: pointer
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      integer(c_int64_t), pointer :: given
      integer(c_int8_t), pointer :: to(:), from(:)
      integer(c_int64_t) :: n
      if (.not. c_associated(pointer)) then
         code = refuse(status, place, what//' is NULL')
         return
      end if
      call c_f_pointer(pointer, given)
      n = given
      if (n < 0 .or. n > no_size) then
         code = refuse(status, place, what//'->size is not set, expected the sizeof of the structure')
      else if (n < least .or. modulo(n, 8_c_int64_t) /= 0) then
         code = refuse(status, place, what//'->size is #, expected the sizeof of the structure', int(n, c_int32_t))
      else
         call c_f_pointer(pointer, to, [n])
         call c_f_pointer(own, from, [known])
         to(9:min(n, known)) = from(9:min(n, known))
         to(known + 1:) = 0
         code = accept(status)
      end if
   end function hand_out
end module finshell_capi_query
