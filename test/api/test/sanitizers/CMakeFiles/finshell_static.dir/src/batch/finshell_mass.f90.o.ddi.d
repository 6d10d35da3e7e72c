/work/main/src/batch/finshell_mass.f90:
