/work/main/src/material/finshell_mooney_rivlin.f90:
