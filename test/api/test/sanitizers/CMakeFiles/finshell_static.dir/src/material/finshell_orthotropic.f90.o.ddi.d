/work/main/src/material/finshell_orthotropic.f90:
