/work/main/src/base/finshell_version.f90:
