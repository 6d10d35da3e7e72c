# The kernel, compiled for several levels of x86-64, made into one set of objects with one set of names.
#
#   cmake -D FOLDER=... -D LEVELS=1;3;4 -D ARCHIVES=a;b;c -D LINKER=ld -D NM=nm -D OBJCOPY=objcopy -P merge.cmake
#
# Writes into FOLDER, for each level L, kernel_L.o, in which the procedure NAME is called NAME__L; and functions.inc, a line
# FUNCTION(number, NAME) for each procedure, from which dispatch.c makes the procedures that others call. Data of the first
# level (tables of type-bound procedures, initial values) keep their names: programs refer to them.

function(run)
  execute_process(COMMAND ${ARGN} OUTPUT_VARIABLE output COMMAND_ERROR_IS_FATAL ANY)
  set(output "${output}" PARENT_SCOPE)
endfunction()

# Defined global symbols of an object whose type (nm) matches.
function(symbols variable object types)
  run(${NM} --defined-only --extern-only ${object})
  string(REGEX MATCHALL "[^\n]+" lines "${output}")
  list(FILTER lines INCLUDE REGEX " [${types}] ")
  list(TRANSFORM lines REPLACE ".* " "")
  list(SORT lines)
  set(${variable} ${lines} PARENT_SCOPE)
endfunction()

list(GET LEVELS 0 first)
foreach(level archive IN ZIP_LISTS LEVELS ARCHIVES)
  set(object ${FOLDER}/kernel_${level}.o)
  run(${LINKER} -r --whole-archive ${archive} -o ${object})
  symbols(functions ${object} TW)
  if(level STREQUAL first)
    set(names ${functions})
    set(renamed ${functions})
  else()
    symbols(renamed ${object} A-BD-Z)
    if(NOT functions STREQUAL names)
      message(FATAL_ERROR "level ${level} of the kernel has other procedures than level ${first}")
    endif()
  endif()
  list(TRANSFORM renamed REPLACE "(.+)" "\\1 \\1__${level}")
  list(JOIN renamed "\n" map)
  file(WRITE ${FOLDER}/names_${level}.txt "${map}\n")
  run(${OBJCOPY} --redefine-syms=${FOLDER}/names_${level}.txt ${object})
endforeach()

set(text "")
set(number 0)
foreach(name IN LISTS names)
  string(APPEND text "FUNCTION(${number}, ${name})\n")
  math(EXPR number "${number} + 1")
endforeach()
file(WRITE ${FOLDER}/functions.inc "${text}")
