CMakeFiles/finshell_static.dir/src/base/finshell_kinds.F90-pp.f90: \
 /work/main/src/base/finshell_kinds.F90
