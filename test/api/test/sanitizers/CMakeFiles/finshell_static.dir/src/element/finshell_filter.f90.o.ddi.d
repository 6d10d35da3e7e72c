/work/main/src/element/finshell_filter.f90:
