/work/main/src/element/finshell_vector_rotation.f90:
