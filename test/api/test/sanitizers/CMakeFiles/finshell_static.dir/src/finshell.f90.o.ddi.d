/work/main/src/finshell.f90:
