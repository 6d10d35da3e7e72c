#----------------------------------------------------------------
# Generated CMake target import file for configuration "None".
#----------------------------------------------------------------

# Commands may need to know the format version.
set(CMAKE_IMPORT_FILE_VERSION 1)

# Import target "finshell::finshell" for configuration "None"
set_property(TARGET finshell::finshell APPEND PROPERTY IMPORTED_CONFIGURATIONS NONE)
set_target_properties(finshell::finshell PROPERTIES
  IMPORTED_LOCATION_NONE "${_IMPORT_PREFIX}/lib/libfinshell.so.1.0.1.0"
  IMPORTED_SONAME_NONE "libfinshell.so.1"
  )

list(APPEND _cmake_import_check_targets finshell::finshell )
list(APPEND _cmake_import_check_files_for_finshell::finshell "${_IMPORT_PREFIX}/lib/libfinshell.so.1.0.1.0" )

# Import target "finshell::finshell_static" for configuration "None"
set_property(TARGET finshell::finshell_static APPEND PROPERTY IMPORTED_CONFIGURATIONS NONE)
set_target_properties(finshell::finshell_static PROPERTIES
  IMPORTED_LINK_INTERFACE_LANGUAGES_NONE "Fortran"
  IMPORTED_LOCATION_NONE "${_IMPORT_PREFIX}/lib/libfinshell.a"
  )

list(APPEND _cmake_import_check_targets finshell::finshell_static )
list(APPEND _cmake_import_check_files_for_finshell::finshell_static "${_IMPORT_PREFIX}/lib/libfinshell.a" )

# Commands beyond this point should not need to know the version.
set(CMAKE_IMPORT_FILE_VERSION)
