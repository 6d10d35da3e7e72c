!> Laws of shared libraries. A library has one function, `finshell_law_1` (finshell_law.h: FINSHELL_LAWS makes it), which is asked
!> for a law by name; the number is that of the contract, so that a library made for another one is told apart.
!>
!> A law of a library has the name 'plugin:LIBRARY' or 'plugin:LIBRARY#NAME' wherever laws have names; 'plugin' and 'plugin#NAME',
!> for hosts whose names of materials have no room for it, are of the library that the environment variable FINSHELL_LAWS names.
!>
!> Libraries stay loaded as long as the program runs: sections point into them.
module finshell_plugin
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_procpointer, c_funptr, c_int, c_int32_t, c_null_char, c_ptr
   use finshell_c_text, only: text_from
   use finshell_error, only: error_t, raise
   use finshell_law_description, only: read_description
   use finshell_outside_law, only: description_t
   use finshell_parameter, only: lower
   use finshell_status, only: status_invalid_argument
   implicit none
   private
   public :: is_plugin, load_plugin, plugin_name

   character(len=*), parameter :: word = 'plugin', prefix = word//':'
   character(len=*), parameter :: variable = 'FINSHELL_LAWS'
   character(len=*), parameter :: entry_point = 'finshell_law_1'
   integer(c_int), parameter :: rtld_now = 2
   integer(c_int32_t), parameter :: message_size = 400

   interface
      function dlopen(path, flags) result(library) bind(c)
         import :: c_char, c_int, c_ptr
         character(kind=c_char), intent(in) :: path(*)
         integer(c_int), value :: flags
         type(c_ptr) :: library
      end function dlopen

      function dlsym(library, name) result(symbol) bind(c)
         import :: c_char, c_funptr, c_ptr
         type(c_ptr), value :: library
         character(kind=c_char), intent(in) :: name(*)
         type(c_funptr) :: symbol
      end function dlsym

      function dlerror() result(text) bind(c)
         import :: c_ptr
         type(c_ptr) :: text
      end function dlerror
   end interface

   abstract interface
      !> The entry point: a law by name, '' where none was given. NULL: there is none, and the message says why.
      function entry_interface(name, message, size) result(law) bind(c)
         import :: c_char, c_int32_t, c_ptr
         character(kind=c_char), intent(in) :: name(*)
         ! allow(C072)
         character(kind=c_char), intent(inout) :: message(*)
         integer(c_int32_t), value :: size
         type(c_ptr) :: law
      end function entry_interface
   end interface

contains

   !> The name of a law of a library.
   pure function plugin_name(library, name) result(text)
      character(len=*), intent(in) :: library
      character(len=*), intent(in) :: name !< of the law, may be blank
      character(len=:), allocatable :: text
      text = prefix//trim(library)
      if (name /= '') text = text//'#'//trim(name)
   end function plugin_name

   !> Whether this is the name of a law of a library.
   pure logical function is_plugin(name)
      character(len=*), intent(in) :: name
      character(len=len(name)) :: small
      small = lower(name)
      is_plugin = index(small, prefix) == 1 .or. small == word .or. index(small, word//'#') == 1
   end function is_plugin

   !> The law of this name, or what is wrong with it or its library.
   subroutine load_plugin(name, description, error)
      character(len=*), intent(in) :: name !< 'plugin:LIBRARY#NAME'
      type(description_t), intent(out) :: description
      type(error_t), allocatable, intent(inout) :: error
      procedure(entry_interface), pointer :: entry
      character(len=:), allocatable :: library, law, place, whole
      character(kind=c_char) :: message(message_size)
      type(c_ptr) :: handle, found
      type(c_funptr) :: symbol
      integer :: i, length

      whole = trim(adjustl(name))
      if (whole(:min(len(whole), len(prefix))) /= whole(:min(len(whole), len(word)))//':') then
         call get_environment_variable(variable, length=length)
         if (length == 0) then
            call raise(error, status_invalid_argument, 'the law '''//whole//''' is one of the library that the environment '// &
                       'variable '//variable//' names, and that is not set')
            return
         end if
         allocate (character(len=length) :: library)
         call get_environment_variable(variable, library)
         whole = prefix//library//whole(len(word) + 1:)
      end if
      library = whole(len(prefix) + 1:)
      law = ''
      i = index(library, '#', back=.true.)
      if (i > 0) then
         law = library(i + 1:)
         library = library(:i - 1)
      end if
      place = 'library of laws '''//library//''': '
      if (library == '') then
         call raise(error, status_invalid_argument, 'the law '''//whole//''' names no library, expected plugin:LIBRARY#NAME')
         return
      end if
      handle = dlopen(library//c_null_char, rtld_now)
      if (.not. c_associated(handle)) then
         call raise(error, status_invalid_argument, place//'it cannot be loaded: '//text_from(dlerror()))
         return
      end if
      symbol = dlsym(handle, entry_point//c_null_char)
      if (.not. c_associated(symbol)) then
         call raise(error, status_invalid_argument, place//'it has no function '//entry_point//': it holds no laws for '// &
                    'finshell, or laws for another version of the contract')
         return
      end if
      call c_f_procpointer(symbol, entry)
      message = c_null_char
      found = entry(law//c_null_char, message, message_size)
      if (.not. c_associated(found)) then
         library = ''
         do i = 1, size(message)
            if (message(i) == c_null_char) exit
            library = library//message(i)
         end do
         if (library == '') library = 'it has no law '''//law//''''
         call raise(error, status_invalid_argument, place//library)
         return
      end if
      call read_description(found, description, error)
      if (allocated(error)) error%message = place//error%message
   end subroutine load_plugin
end module finshell_plugin
