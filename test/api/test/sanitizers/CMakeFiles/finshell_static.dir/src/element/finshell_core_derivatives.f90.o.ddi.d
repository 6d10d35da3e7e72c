/work/main/src/element/finshell_core_derivatives.f90:
