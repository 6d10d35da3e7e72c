/work/main/src/material/finshell_compressible_neo_hookean.f90:
