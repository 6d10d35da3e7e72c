/work/main/src/element/finshell_lift.f90:
