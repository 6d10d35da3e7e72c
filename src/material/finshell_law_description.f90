!> finshell_law of finshell.h, read with suspicion: a law that somebody else describes.
module finshell_law_description
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_pointer, c_f_procpointer, c_funptr, c_int32_t, &
      c_int64_t, c_null_char, c_ptr, c_sizeof
   use finshell_c_text, only: text_from
   use finshell_error, only: error_t, raise, text_of
   use finshell_kinds, only: wp
   use finshell_outside_law, only: description_t, kind_incompressible, kind_plane, kind_solid, most_states
   use finshell_parameter, only: lower, parameter_t
   use finshell_status, only: status_invalid_argument
   implicit none
   private
   public :: c_law_t, c_parameter_t, read_description

   integer, parameter :: name_size = 32, meaning_size = 128 !< as in finshell.h
   integer, parameter :: most_parameters = 200
   integer(c_int64_t), parameter :: no_size = 4096 !< whatever is larger was not set

   !> finshell_parameter of the header.
   type, bind(c) :: c_parameter_t
      character(kind=c_char) :: name(name_size)
      character(kind=c_char) :: meaning(meaning_size)
      real(c_double) :: default_value
      real(c_double) :: example
      integer(c_int32_t) :: required
      integer(c_int32_t) :: padding
   end type c_parameter_t

   !> finshell_law of the header.
   type, bind(c) :: c_law_t
      integer(c_int64_t) :: size
      type(c_ptr) :: name
      integer(c_int32_t) :: kind
      integer(c_int32_t) :: isotropic
      integer(c_int32_t) :: states
      integer(c_int32_t) :: parameters
      type(c_ptr) :: parameter
      type(c_funptr) :: evaluate
      type(c_funptr) :: stretch
      type(c_ptr) :: data
   end type c_law_t

contains

   !> The law that a pointer points to, or what is wrong with it.
   subroutine read_description(pointer, description, error)
      type(c_ptr), intent(in) :: pointer !< to a finshell_law
      type(description_t), intent(out) :: description
      type(error_t), allocatable, intent(inout) :: error
      integer(c_int64_t), pointer :: size
      type(c_law_t), pointer :: law
      character(len=:), allocatable :: place

      if (.not. c_associated(pointer)) then
         call raise(error, status_invalid_argument, 'law is NULL')
         return
      end if
      call c_f_pointer(pointer, size)
      call c_f_pointer(pointer, law)
      if (size < c_sizeof(law) .or. size > no_size) then
         call raise(error, status_invalid_argument, 'law->size is not set, expected sizeof(finshell_law)')
      else if (size > c_sizeof(law)) then
         call raise(error, status_invalid_argument, 'law->size is '//text_of(int(size))//', with members that this library '// &
                    'does not know: finshell.h is newer than the library')
      end if
      if (allocated(error)) return
      description%name = text_from(law%name)
      place = 'law '''//description%name//''': '
      if (len(description%name) == 0 .or. len(description%name) > name_size - 1) then
         call raise(error, status_invalid_argument, 'the name of a law has '//text_of(len(description%name))// &
                    ' characters, expected 1 to '//text_of(name_size - 1))
      else if (law%kind < kind_plane .or. law%kind > kind_incompressible) then
         call raise(error, status_invalid_argument, place//'kind is '//text_of(int(law%kind))// &
                    ', expected 1 (plane), 2 (solid) or 3 (incompressible)')
      else if (law%states < 0 .or. law%states > most_states) then
         call raise(error, status_invalid_argument, place//'states is '//text_of(int(law%states))//', expected 0 to '// &
                    text_of(most_states))
      else if (law%parameters < 0 .or. law%parameters > most_parameters) then
         call raise(error, status_invalid_argument, place//'parameters is '//text_of(int(law%parameters))//', expected 0 to '// &
                    text_of(most_parameters))
      else if (law%parameters > 0 .and. .not. c_associated(law%parameter)) then
         call raise(error, status_invalid_argument, place//'parameter is NULL, expected an array of '// &
                    text_of(int(law%parameters)))
      else if (.not. c_associated(law%evaluate)) then
         call raise(error, status_invalid_argument, place//'evaluate is NULL')
      else if (c_associated(law%stretch) .and. law%kind /= kind_plane) then
         call raise(error, status_invalid_argument, place//'stretch is for laws in the plane only; in space the thickness '// &
                    'follows from the law: expected NULL')
      end if
      if (allocated(error)) return
      description%kind = law%kind
      description%isotropic = law%isotropic /= 0
      description%states = law%states
      description%data = law%data
      call c_f_procpointer(law%evaluate, description%evaluate)
      if (c_associated(law%stretch)) call c_f_procpointer(law%stretch, description%stretch)
      call read_parameters(place, law, description%parameters, error)
   end subroutine read_description

   subroutine read_parameters(place, law, parameters, error)
      character(len=*), intent(in) :: place
      type(c_law_t), intent(in) :: law
      type(parameter_t), allocatable, intent(out) :: parameters(:)
      type(error_t), allocatable, intent(inout) :: error
      type(c_parameter_t), pointer :: given(:)
      integer :: i
      allocate (parameters(law%parameters))
      if (law%parameters == 0) return
      call c_f_pointer(law%parameter, given, [law%parameters])
      do i = 1, law%parameters
         parameters(i)%name = lower(text_in(given(i)%name))
         parameters(i)%meaning = text_in(given(i)%meaning)
         parameters(i)%required = given(i)%required /= 0
         parameters(i)%default = real(given(i)%default_value, wp)
         parameters(i)%example = real(given(i)%example, wp)
         if (parameters(i)%name == '') then
            call raise(error, status_invalid_argument, place//'parameter '//text_of(i - 1)//' (from 0) has no name')
         else if (any(parameters(:i - 1)%name == parameters(i)%name)) then
            call raise(error, status_invalid_argument, place//'parameter '''//trim(parameters(i)%name)//''' is there twice')
         end if
         if (allocated(error)) return
      end do
   end subroutine read_parameters

   !> What stands in an array of characters before its end.
   pure function text_in(characters) result(text)
      character(kind=c_char), intent(in) :: characters(:)
      character(len=size(characters)) :: text
      integer :: i
      text = ''
      do i = 1, size(characters)
         if (characters(i) == c_null_char) return
         text(i:i) = characters(i)
      end do
   end function text_in
end module finshell_law_description
