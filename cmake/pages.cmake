# Manual page and completions of PROGRAM, into the folder PAGES.
file(MAKE_DIRECTORY ${PAGES})
set(ENV{ASAN_OPTIONS} detect_leaks=0) # it is not tested here
foreach(page IN ITEMS "man|finshell.1" "completion bash|finshell" "completion zsh|_finshell" "completion fish|finshell.fish")
  string(REGEX REPLACE ".*\\|" "" file "${page}")
  string(REGEX REPLACE "\\|.*" "" arguments "${page}")
  separate_arguments(arguments)
  execute_process(COMMAND ${PROGRAM} ${arguments} OUTPUT_FILE ${PAGES}/${file} COMMAND_ERROR_IS_FATAL ANY)
endforeach()
