/work/main/src/element/finshell_core_strain.f90:
