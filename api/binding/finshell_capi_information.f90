!> C interface: versions, messages, the list of material laws. See finshell.h for what the functions promise.
module finshell_capi_information
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_int32_t, c_loc, c_null_char, c_ptr
   use finshell_c_text, only: store_text, text_from
   use finshell_capi_common, only: accept, c_status_t, refuse
   use finshell_cpu, only: cpu_level
   use finshell_environment, only: environment_t, hold, release
   use finshell_registry, only: material_names, material_parameters, parameter_t
   use finshell_status, only: status_text
   use finshell_version, only: version, version_number
   implicit none
   private
   public :: version_text, number_of_version, abi, processor, message, material_count, material_name, parameter_count
   public :: parameter_information, c_parameter_t

   integer(c_int32_t), parameter :: abi_number = 2 !< FINSHELL_ABI of the header, SOVERSION of the library
   integer, parameter :: name_size = 32, meaning_size = 128

   !> finshell_parameter of the header.
   type, bind(c) :: c_parameter_t
      character(kind=c_char) :: name(name_size)
      character(kind=c_char) :: meaning(meaning_size)
      real(c_double) :: default_value
      real(c_double) :: example
      integer(c_int32_t) :: required
      integer(c_int32_t) :: padding
   end type c_parameter_t

   character(kind=c_char, len=len(version) + 1), target :: version_buffer = version//c_null_char

contains

   function version_text() result(text) bind(c, name='finshell_version_text')
      type(c_ptr) :: text
      text = c_loc(version_buffer)
   end function version_text

   function number_of_version() result(number) bind(c, name='finshell_version_number')
      integer(c_int32_t) :: number
      number = version_number
   end function number_of_version

   function abi() result(number) bind(c, name='finshell_abi')
      integer(c_int32_t) :: number
      number = abi_number
   end function abi

   function processor() result(level) bind(c, name='finshell_cpu_level')
      integer(c_int32_t) :: level
      level = cpu_level()
   end function processor

   function message(code, buffer, size) result(length) bind(c, name='finshell_message')
      integer(c_int32_t), value :: code, size
      ! allow(C072)
      character(kind=c_char), intent(inout), optional :: buffer(*)
      integer(c_int32_t) :: length
      type(environment_t) :: environment
      ! the first critical section of a process starts the OpenMP library, which computes
      call hold(environment)
!$omp critical (finshell_texts)
      length = len(status_text(code))
      if (present(buffer) .and. size > 0) call store_text(status_text(code), size, buffer)
!$omp end critical (finshell_texts)
      call release(environment)
   end function message

   function material_count() result(n) bind(c, name='finshell_material_count')
      integer(c_int32_t) :: n
      n = size(material_names())
   end function material_count

   function material_name(i, buffer, size, status) result(code) bind(c, name='finshell_material_name')
      integer(c_int32_t), value :: i, size
      ! allow(C072)
      character(kind=c_char), intent(inout), optional :: buffer(*)
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_material_name'
      if (i < 0 .or. i >= material_count()) then
         code = refuse(status, place, 'i is #, expected 0 to one less than the number of laws', i)
      else if (.not. present(buffer) .or. size < 1) then
         code = refuse(status, place, 'buffer is NULL or has no size')
      else
         associate (names => material_names())
            call store_text(names(i + 1), size, buffer)
         end associate
         code = accept(status)
      end if
   end function material_name

   function parameter_count(material, status) result(n) bind(c, name='finshell_material_parameter_count')
      type(c_ptr), value :: material
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: n
      type(environment_t) :: environment
      n = accept(status)
      call hold(environment)
!$omp critical (finshell_texts)
      n = size(material_parameters(text_from(material)))
      if (n == 0) n = refuse(status, 'finshell_material_parameter_count', 'unknown material law '''//text_from(material)//'''')
!$omp end critical (finshell_texts)
      call release(environment)
   end function parameter_count

   function parameter_information(material, i, information, status) result(code) bind(c, name='finshell_material_parameter')
      type(c_ptr), value :: material
      integer(c_int32_t), value :: i
      type(c_parameter_t), intent(out), optional :: information
      type(c_status_t), intent(out), optional :: status
      integer(c_int32_t) :: code
      character(len=*), parameter :: place = 'finshell_material_parameter'
      type(parameter_t), allocatable :: parameters(:)
      type(environment_t) :: environment
      call hold(environment)
!$omp critical (finshell_texts)
      parameters = material_parameters(text_from(material))
      if (.not. c_associated(material) .or. size(parameters) == 0) then
         code = refuse(status, place, 'unknown material law '''//text_from(material)//'''')
      else if (i < 0 .or. i >= size(parameters)) then
         code = refuse(status, place, 'i is #, expected 0 to one less than the number of parameters', i)
      else if (.not. present(information)) then
         code = refuse(status, place, 'information is NULL')
      else
         associate (parameter => parameters(i + 1))
            call store_text(parameter%name, name_size, information%name)
            call store_text(parameter%meaning, meaning_size, information%meaning)
            information%default_value = parameter%default
            information%example = parameter%example
            information%required = merge(1, 0, parameter%required)
            information%padding = 0
         end associate
         code = accept(status)
      end if
!$omp end critical (finshell_texts)
      call release(environment)
   end function parameter_information
end module finshell_capi_information
