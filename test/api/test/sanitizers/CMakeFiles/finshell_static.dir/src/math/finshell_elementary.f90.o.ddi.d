/work/main/src/math/finshell_elementary.f90:
