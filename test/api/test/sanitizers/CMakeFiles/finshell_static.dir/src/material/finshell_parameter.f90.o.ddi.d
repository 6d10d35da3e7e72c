/work/main/src/material/finshell_parameter.f90:
