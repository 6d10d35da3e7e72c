/work/main/src/section/finshell_section.f90:
