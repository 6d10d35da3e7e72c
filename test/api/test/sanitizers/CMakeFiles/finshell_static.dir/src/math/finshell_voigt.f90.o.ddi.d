/work/main/src/math/finshell_voigt.f90:
