file(READ ${FILE} content)
if(content)
  message(FATAL_ERROR "link closure:\n${content}")
endif()
