# What was compiled once is taken from ccache, also in another checkout: paths in this one count as relative to it, and precompiled headers
# are taken for what they are made of.
find_program(CCACHE ccache)
if(CCACHE)
  set(launcher ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1
               CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime ${CCACHE})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${launcher})
  set(CMAKE_C_COMPILER_LAUNCHER ${launcher})
  if(CMAKE_CXX_COMPILER_ID STREQUAL Clang)
    set(CMAKE_DISABLE_PRECOMPILE_HEADERS ON)   # clang's hold the path of their checkout
  endif()
endif()
