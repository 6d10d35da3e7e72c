# Finds CHOLMOD and UMFPACK of SuiteSparse, which as packaged by Debian 12 brings neither CMake nor pkg-config files.
#
#   find_package(SuiteSparse REQUIRED COMPONENTS CHOLMOD UMFPACK)
#
# Imported targets: SuiteSparse::CHOLMOD, SuiteSparse::UMFPACK, without a folder of headers, which no source reads.

find_path(SuiteSparse_INCLUDE_DIR NAMES cholmod.h PATH_SUFFIXES suitesparse)
mark_as_advanced(SuiteSparse_INCLUDE_DIR)

function(finshell_suitesparse_target name)
  string(TOUPPER ${name} upper)
  find_library(SuiteSparse_${upper}_LIBRARY NAMES ${name})
  mark_as_advanced(SuiteSparse_${upper}_LIBRARY)
  if(SuiteSparse_${upper}_LIBRARY AND NOT TARGET SuiteSparse::${upper})
    add_library(SuiteSparse::${upper} UNKNOWN IMPORTED)
    set_target_properties(SuiteSparse::${upper} PROPERTIES IMPORTED_LOCATION "${SuiteSparse_${upper}_LIBRARY}")
    foreach(needed IN LISTS ARGN)
      if(TARGET SuiteSparse::${needed})
        set_property(TARGET SuiteSparse::${upper} APPEND PROPERTY INTERFACE_LINK_LIBRARIES SuiteSparse::${needed})
      endif()
    endforeach()
  endif()
  set(SuiteSparse_${upper}_FOUND FALSE PARENT_SCOPE)
  if(TARGET SuiteSparse::${upper} AND SuiteSparse_INCLUDE_DIR)
    set(SuiteSparse_${upper}_FOUND TRUE PARENT_SCOPE)
  endif()
endfunction()

finshell_suitesparse_target(suitesparseconfig)
foreach(ordering amd colamd camd ccolamd)
  finshell_suitesparse_target(${ordering} SUITESPARSECONFIG)
endforeach()
finshell_suitesparse_target(cholmod AMD COLAMD CAMD CCOLAMD SUITESPARSECONFIG)
finshell_suitesparse_target(umfpack CHOLMOD AMD SUITESPARSECONFIG)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(SuiteSparse REQUIRED_VARS SuiteSparse_INCLUDE_DIR HANDLE_COMPONENTS)
