/work/main/src/material/finshell_registry.f90:
