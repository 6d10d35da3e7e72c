/work/main/src/element/finshell_element.f90:
