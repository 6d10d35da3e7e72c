# Which sources of the kernel are compiled a second time, for single elements, and how their modules are called then.
#
# Blocks of `lanes` elements side by side are what is fast; a call for one element would fill a block with copies of it. So
# everything that knows `lanes` is copied with the names of its modules changed to finshell_narrow_*; the copy of finshell_kinds
# says lanes = 1. Only finshell_single is not copied but changed: it uses the narrow modules. Sections and laws are shared.
#
# Included: narrow_kernel(variable source...) sets the list of sources with the narrow ones. As a script: writes them.
#   cmake -D "SOURCES=.../finshell_a.f90;..." -D "OUTPUTS=.../finshell_narrow_a.f90;..." -D "MODULES=a;..." -P narrow.cmake

function(narrow_kernel variable)
  set(folder ${CMAKE_BINARY_DIR}/narrow)
  set(narrow ${ARGN})
  list(FILTER narrow INCLUDE REGEX
    "/(base/finshell_kinds|section/[a-z0-9_]+|element/[a-z0-9_]+|batch/finshell_(block|chunk|membrane_chunk|single))\\.[fF]90$")
  list(FILTER narrow EXCLUDE REGEX "/finshell_(section|laminate)\\.f90$")
  # Loops over the four rows of a register shall become vector instructions, those over three be unrolled whatever they contain.
  set(narrow_options --param=max-completely-peel-times=3 --param=max-completely-peeled-insns=500 -finline-limit=1000)
  set(modules)
  set(outputs)
  foreach(source IN LISTS narrow)
    cmake_path(GET source FILENAME file)
    cmake_path(GET source STEM name)
    if(NOT name STREQUAL finshell_single)
      string(REPLACE finshell_ "" module ${name})
      list(APPEND modules ${module})
      string(REPLACE finshell_ finshell_narrow_ file ${file})
    endif()
    set(output ${folder}/${file})
    list(APPEND outputs ${output})
    # names are longer, hence lines too
    set_source_files_properties(${output} PROPERTIES COMPILE_OPTIONS "-ffree-line-length-none;${narrow_options}")
    if(file MATCHES "\\.F90$")
      set_source_files_properties(${output} PROPERTIES COMPILE_DEFINITIONS FINSHELL_NARROW)
    else()
      set_source_files_properties(${output} PROPERTIES Fortran_PREPROCESS OFF)
    endif()
  endforeach()
  add_custom_command(OUTPUT ${outputs}
    COMMAND ${CMAKE_COMMAND} -D "SOURCES=${narrow}" -D "OUTPUTS=${outputs}" -D "MODULES=${modules}"
      -P ${CMAKE_CURRENT_FUNCTION_LIST_FILE}
    DEPENDS ${narrow} ${CMAKE_CURRENT_FUNCTION_LIST_FILE} VERBATIM)
  set(sources ${ARGN} ${outputs})
  list(FILTER sources EXCLUDE REGEX "/src/batch/finshell_single\\.f90$")
  set(${variable} ${sources} PARENT_SCOPE)
endfunction()

if(CMAKE_SCRIPT_MODE_FILE STREQUAL CMAKE_CURRENT_LIST_FILE)
  list(JOIN MODULES "|" names)
  foreach(source output IN ZIP_LISTS SOURCES OUTPUTS)
    file(READ ${source} text)
    string(REGEX REPLACE "(use|module) finshell_(${names})([^a-z0-9_])" "\\1 finshell_narrow_\\2\\3" text "${text}")
    file(CONFIGURE OUTPUT ${output} CONTENT "${text}" @ONLY)
  endforeach()
endif()
