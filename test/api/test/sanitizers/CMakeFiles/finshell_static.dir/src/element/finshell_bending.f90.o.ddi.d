/work/main/src/element/finshell_bending.f90:
