# --- what nearly every file includes, compiled once ---------------------------------------------------------------------
# consort_precompiled(TARGET LIBRARIES... HEADERS headers...): beyond the common headers, these
function(consort_precompiled target)
  cmake_parse_arguments(PARSE_ARGV 1 more "" "" HEADERS)
  foreach(language c cpp)
    file(CONFIGURE OUTPUT ${CMAKE_BINARY_DIR}/generated/${target}.${language} CONTENT "typedef int nothing;\n" @ONLY)
  endforeach()
  add_library(${target} OBJECT ${CMAKE_BINARY_DIR}/generated/${target}.cpp ${CMAKE_BINARY_DIR}/generated/${target}.c)
  target_link_libraries(${target} PRIVATE Eigen3::Eigen ${more_UNPARSED_ARGUMENTS})
  target_precompile_headers(${target} PRIVATE <stddef.h>)   # types generated from IDL are C, and CMake wants a header for that language too
  foreach(header Eigen/Dense algorithm functional map memory optional set span string variant vector ${more_HEADERS})
    target_precompile_headers(${target} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:<${header}$<ANGLE-R>>")
  endforeach()
endfunction()

# consort_room(FOLDER LIBRARIES... [PRECOMPILED target]): every .cpp of the folder and the folders in it, but programs' main.cpp,
# as library consort_FOLDER
function(consort_room folder)
  cmake_parse_arguments(PARSE_ARGV 1 room "" "PRECOMPILED" "")
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${folder}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
  add_library(consort_${folder} STATIC ${sources})
  if(NOT room_PRECOMPILED)
    set(room_PRECOMPILED precompiled)
  endif()
  target_precompile_headers(consort_${folder} REUSE_FROM ${room_PRECOMPILED})
  target_link_libraries(consort_${folder} PUBLIC ${room_UNPARSED_ARGUMENTS})
endfunction()

# Rooms of many small files are compiled several files at a time, which instantiates their common templates once: half of their time.
# Which files go together follows from their folder and their name alone, so a new file makes its own batch be compiled again and no other.
# CONSORT_BATCHES=OFF: one by one, for who works on them.
option(CONSORT_BATCHES "Compile the files of core and orchestrator in batches" ON)
function(consort_in_batches target)
  get_target_property(sources ${target} SOURCES)
  set(folders)
  foreach(source IN LISTS sources)
    cmake_path(GET source PARENT_PATH folder)
    list(APPEND folders "${folder}")
    list(APPEND "in_${folder}" "${source}")
  endforeach()
  list(REMOVE_DUPLICATES folders)
  foreach(folder IN LISTS folders)
    list(LENGTH "in_${folder}" count)
    set(batches 1)  # a power of two, so that it seldom changes; at most eight files in one, about
    math(EXPR most "8 * ${batches}")
    while(count GREATER most)
      math(EXPR batches "2 * ${batches}")
      math(EXPR most "8 * ${batches}")
    endwhile()
    foreach(source IN LISTS "in_${folder}")
      cmake_path(GET source FILENAME name)
      string(MD5 hash "${name}")
      string(SUBSTRING "${hash}" 0 6 hash)
      math(EXPR batch "0x${hash} % ${batches}")
      cmake_path(GET folder FILENAME room)
      set_source_files_properties("${source}" PROPERTIES UNITY_GROUP "${room}_${batch}")
    endforeach()
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${CONSORT_BATCHES} UNITY_BUILD_MODE GROUP)
  target_compile_options(${target} PRIVATE $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-subobject-linkage>)  # a batch is no header
endfunction()
