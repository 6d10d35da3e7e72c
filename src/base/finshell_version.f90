!> The version of finshell, for programs, result files and the C interface. The build files state it too; a test compares them.
module finshell_version
   implicit none
   private
   character(len=*), parameter, public :: version = '0.1.0'
   integer, parameter, public :: version_number = 100 !< major, minor and patch, two digits each
end module finshell_version
