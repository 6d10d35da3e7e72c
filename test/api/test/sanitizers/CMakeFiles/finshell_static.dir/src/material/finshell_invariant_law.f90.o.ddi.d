/work/main/src/material/finshell_invariant_law.f90:
