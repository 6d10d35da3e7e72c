/work/main/src/base/finshell_error.f90:
