/work/main/src/material/finshell_neo_hookean.f90:
