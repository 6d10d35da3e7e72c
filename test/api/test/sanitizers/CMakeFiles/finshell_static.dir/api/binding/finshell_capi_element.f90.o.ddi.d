/work/main/api/binding/finshell_capi_element.f90:
