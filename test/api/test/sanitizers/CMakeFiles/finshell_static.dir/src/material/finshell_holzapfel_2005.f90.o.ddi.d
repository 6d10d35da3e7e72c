/work/main/src/material/finshell_holzapfel_2005.f90:
