/work/main/src/math/finshell_quaternion.f90:
