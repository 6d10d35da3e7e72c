/work/main/src/math/finshell_gauss.f90:
