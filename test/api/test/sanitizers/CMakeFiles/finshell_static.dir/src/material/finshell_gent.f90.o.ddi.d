/work/main/src/material/finshell_gent.f90:
