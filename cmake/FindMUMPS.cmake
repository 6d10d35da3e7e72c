# Finds the sequential MUMPS in double and in single precision, as packaged by Debian (libmumps-seq-dev).
#
# Imported targets: MUMPS::MUMPS; MUMPS::MPI, where the one for many processes is there, too (libmumps-dev). Both have the same headers,
# in MUMPS_INCLUDE_DIR (only one source reads them).

find_path(MUMPS_INCLUDE_DIR NAMES dmumps_c.h PATH_SUFFIXES mumps_seq MUMPS)
find_library(MUMPS_LIBRARY NAMES dmumps_seq)
find_library(MUMPS_SINGLE_LIBRARY NAMES smumps_seq)
mark_as_advanced(MUMPS_INCLUDE_DIR MUMPS_LIBRARY MUMPS_SINGLE_LIBRARY)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(MUMPS REQUIRED_VARS MUMPS_LIBRARY MUMPS_SINGLE_LIBRARY MUMPS_INCLUDE_DIR)
if(MUMPS_FOUND AND NOT TARGET MUMPS::MUMPS)
  add_library(MUMPS::MUMPS UNKNOWN IMPORTED)
  set_target_properties(MUMPS::MUMPS PROPERTIES IMPORTED_LOCATION "${MUMPS_LIBRARY}" INTERFACE_LINK_LIBRARIES "${MUMPS_SINGLE_LIBRARY}")
endif()

find_library(MUMPS_MPI_LIBRARY NAMES dmumps)
find_library(MUMPS_MPI_SINGLE_LIBRARY NAMES smumps)
mark_as_advanced(MUMPS_MPI_LIBRARY MUMPS_MPI_SINGLE_LIBRARY)
if(MUMPS_FOUND AND MUMPS_MPI_LIBRARY AND MUMPS_MPI_SINGLE_LIBRARY AND NOT TARGET MUMPS::MPI)
  add_library(MUMPS::MPI UNKNOWN IMPORTED)
  set_target_properties(MUMPS::MPI PROPERTIES IMPORTED_LOCATION "${MUMPS_MPI_LIBRARY}" INTERFACE_LINK_LIBRARIES "${MUMPS_MPI_SINGLE_LIBRARY}")
endif()
