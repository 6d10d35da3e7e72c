/work/main/src/material/finshell_exponential_fibre.f90:
