/work/main/src/element/finshell_drilling.f90:
