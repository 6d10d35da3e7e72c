# What a wheel holds (scikit-build-core sets the SKBUILD_ folders): the library and its header beside the Python modules, the
# program where programs of a Python are, its manual page and completions where prefixes have them.
set(package ${SKBUILD_PLATLIB_DIR}/finshell)
# A wheel knows no links: the library goes by the name that programs ask for.
install(FILES $<TARGET_FILE:finshell> DESTINATION ${package} RENAME $<TARGET_SONAME_FILE_NAME:finshell> COMPONENT wheel)
install(FILES api/finshell.h api/finshell_c.f90 DESTINATION ${package}/include COMPONENT wheel)
if(TARGET finshell_program)
  install(PROGRAMS $<TARGET_FILE:finshell_program> DESTINATION ${SKBUILD_SCRIPTS_DIR} COMPONENT wheel)
  install(FILES ${pages}/finshell.1 DESTINATION ${SKBUILD_DATA_DIR}/share/man/man1 COMPONENT wheel)
  install(FILES ${pages}/finshell DESTINATION ${SKBUILD_DATA_DIR}/share/bash-completion/completions COMPONENT wheel)
  install(FILES ${pages}/_finshell DESTINATION ${SKBUILD_DATA_DIR}/share/zsh/site-functions COMPONENT wheel)
  install(FILES ${pages}/finshell.fish DESTINATION ${SKBUILD_DATA_DIR}/share/fish/vendor_completions.d COMPONENT wheel)
endif()
