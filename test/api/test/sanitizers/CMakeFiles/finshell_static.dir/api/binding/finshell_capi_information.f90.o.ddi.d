/work/main/api/binding/finshell_capi_information.f90:
