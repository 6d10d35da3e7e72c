/work/main/src/material/finshell_st_venant_kirchhoff.f90:
