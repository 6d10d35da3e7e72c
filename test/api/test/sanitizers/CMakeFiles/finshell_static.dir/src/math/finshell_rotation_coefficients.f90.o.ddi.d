/work/main/src/math/finshell_rotation_coefficients.f90:
