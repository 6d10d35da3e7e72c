/work/main/src/element/finshell_core.f90:
