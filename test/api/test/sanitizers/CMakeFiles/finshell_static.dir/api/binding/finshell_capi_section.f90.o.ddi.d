/work/main/api/binding/finshell_capi_section.f90:
