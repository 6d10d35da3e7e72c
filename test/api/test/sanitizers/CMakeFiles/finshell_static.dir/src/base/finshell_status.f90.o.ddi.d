/work/main/src/base/finshell_status.f90:
