/work/main/src/element/finshell_reference.f90:
