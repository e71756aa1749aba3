# Writes OUT from IN with the commit of SOURCE, and a digest of what differs from it; touches OUT only when that changed.
# Run at each build.
find_package(Git QUIET)
set(COMMIT unknown)
if(GIT_FOUND)
  execute_process(COMMAND ${GIT_EXECUTABLE} rev-parse --short=10 HEAD WORKING_DIRECTORY ${SOURCE}
                  OUTPUT_VARIABLE head OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  if(NOT failed)
    set(COMMIT ${head})
    execute_process(COMMAND ${GIT_EXECUTABLE} diff HEAD -- server common cmake CMakeLists.txt
                    WORKING_DIRECTORY ${SOURCE} OUTPUT_VARIABLE difference ERROR_QUIET)
    if(difference)
      string(SHA1 digest "${difference}")
      string(SUBSTRING ${digest} 0 6 digest)
      set(COMMIT "${head}+${digest}")
    endif()
  endif()
endif()
configure_file(${IN} ${OUT} @ONLY)
