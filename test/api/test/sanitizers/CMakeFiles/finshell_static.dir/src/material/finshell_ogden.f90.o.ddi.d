/work/main/src/material/finshell_ogden.f90:
