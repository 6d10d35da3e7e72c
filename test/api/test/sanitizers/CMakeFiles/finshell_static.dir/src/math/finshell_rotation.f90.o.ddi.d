/work/main/src/math/finshell_rotation.f90:
