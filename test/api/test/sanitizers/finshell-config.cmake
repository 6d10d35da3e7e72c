# The static library asks for OpenMP; a program in C uses the shared one, which brings everything.
get_property(finshell_languages GLOBAL PROPERTY ENABLED_LANGUAGES)
if(Fortran IN_LIST finshell_languages)
  include(CMakeFindDependencyMacro)
  find_dependency(OpenMP COMPONENTS Fortran)
endif()
include(${CMAKE_CURRENT_LIST_DIR}/finshell-targets.cmake)
