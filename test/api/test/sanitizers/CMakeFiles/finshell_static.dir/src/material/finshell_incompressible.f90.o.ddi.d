/work/main/src/material/finshell_incompressible.f90:
