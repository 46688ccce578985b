# The page of a run travels in the binary: its own files, and dygraphs as Debian ships it.
find_file(DYGRAPH_SCRIPT_FILE dygraph.min.js PATHS /usr/share/javascript/dygraphs REQUIRED NO_DEFAULT_PATH)
find_file(DYGRAPH_CSS_FILE dygraph.min.css PATHS /usr/share/javascript/dygraphs REQUIRED NO_DEFAULT_PATH)
set(page ${PROJECT_SOURCE_DIR}/orchestrator/report/page)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${page}/page.html ${page}/page.css ${page}/page.js)
file(READ ${page}/page.html PAGE_HTML)
file(READ ${page}/page.css PAGE_CSS)
file(READ ${page}/page.js PAGE_SCRIPT)
file(READ ${DYGRAPH_SCRIPT_FILE} DYGRAPH_SCRIPT)
file(READ ${DYGRAPH_CSS_FILE} DYGRAPH_CSS)
foreach(text DYGRAPH_SCRIPT DYGRAPH_CSS)   # nobody has the map
  string(REGEX REPLACE "[^\n]*sourceMappingURL[^\n]*" "" ${text} "${${text}}")
endforeach()
configure_file(${PROJECT_SOURCE_DIR}/orchestrator/report/page_assets.cpp.in ${CMAKE_BINARY_DIR}/generated/page_assets.cpp @ONLY)
