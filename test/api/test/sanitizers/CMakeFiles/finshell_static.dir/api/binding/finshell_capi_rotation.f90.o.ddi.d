/work/main/api/binding/finshell_capi_rotation.f90:
