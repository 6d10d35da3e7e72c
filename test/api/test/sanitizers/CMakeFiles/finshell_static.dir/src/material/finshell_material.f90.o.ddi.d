/work/main/src/material/finshell_material.f90:
