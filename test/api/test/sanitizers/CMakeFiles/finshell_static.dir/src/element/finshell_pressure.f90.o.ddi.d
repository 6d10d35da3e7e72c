/work/main/src/element/finshell_pressure.f90:
