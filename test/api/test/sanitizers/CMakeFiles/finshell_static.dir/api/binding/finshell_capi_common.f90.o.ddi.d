/work/main/api/binding/finshell_capi_common.f90:
