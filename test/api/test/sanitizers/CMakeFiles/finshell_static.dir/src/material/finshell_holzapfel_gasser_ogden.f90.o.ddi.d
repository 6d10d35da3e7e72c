/work/main/src/material/finshell_holzapfel_gasser_ogden.f90:
