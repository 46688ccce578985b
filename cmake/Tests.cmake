include(GoogleTest)
# Tests are compiled faster than they could run faster: a third of the time of a build is theirs.
set(TEST_OPTIONS $<$<CONFIG:Release>:-O1> $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized;-Wno-stringop-overflow>)  # false at -O1
if(CONSORT_SANITIZE)
  list(APPEND TEST_OPTIONS -O0)
  set(OPTIMISED_TARGETS consort_rounds consort_protocols consort_models consort_core)
  list(TRANSFORM OPTIMISED_TARGETS REPLACE "(.+)" "$<TARGET_FILE:\\1>" OUTPUT_VARIABLE OPTIMISED)
endif()

# The tests of a room that the filter takes, in so many parts; each part is one test of CTest.
function(consort_sanitized_tests name filter parts alone)
  foreach(part RANGE 1 ${parts})
    math(EXPR index "${part} - 1")
    add_test(NAME ${name}_${part} COMMAND ${room}_tests --gtest_brief=1)
    set_tests_properties(${name}_${part} PROPERTIES TIMEOUT 3600 LABELS ${room} RUN_SERIAL ${alone}
                         ENVIRONMENT "GTEST_FILTER=${filter};GTEST_TOTAL_SHARDS=${parts};GTEST_SHARD_INDEX=${index}")
  endforeach()
endfunction()

function(consort_tests room)
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/tests/${room}/*_test.cpp)
  if(sources)
    add_executable(${room}_tests ${sources})
    target_compile_options(${room}_tests PRIVATE ${TEST_OPTIONS})
    target_precompile_headers(${room}_tests REUSE_FROM precompiled_tests)
    target_link_libraries(${room}_tests PRIVATE ${ARGN} test_tree GTest::gtest GTest::gtest_main)
    set(alone FALSE)
    if(room MATCHES "^(system|swarm|docs|page)$")
      add_dependencies(${room}_tests consort consort-agent consort-plant)
      set(alone TRUE)
    endif()
    if(CONSORT_SANITIZE)
      target_compile_definitions(${room}_tests PRIVATE CONSORT_SANITIZE)
      # Of a template that test and library share, the linker keeps the first copy: the library's, which is optimised.
      list(JOIN OPTIMISED " " libraries)
      target_link_options(${room}_tests PRIVATE "SHELL:-Wl,--whole-archive ${libraries} -Wl,--no-whole-archive")
      target_link_libraries(${room}_tests PRIVATE $<LINK_ONLY:fmt::fmt>)   # which they use
      add_dependencies(${room}_tests ${OPTIMISED_TARGETS})
      # A program takes two seconds to start, so a room is one test, or a few where it is long: both cores have work to the end.
      set(parts 1)
      if(room MATCHES "^(orchestrator|protocols|papers)$")
        set(parts 4)
      endif()
      if(room STREQUAL system)
        consort_sanitized_tests(system_patient "*Conformance*:*Patient*" 4 FALSE)
        consort_sanitized_tests(system "-*Conformance*:*Patient*" 1 TRUE)
      else()
        consort_sanitized_tests(${room} * ${parts} ${alone})
      endif()
    else()
      # Whatever starts processes has the machine for itself, as its leases and deadlines are about the run, not about its neighbours in
      # CTest; but for those (Conformance, Patient...) that wait for what they look for as long as it takes.
      set(discovery NO_PRETTY_VALUES DISCOVERY_TIMEOUT 120 PROPERTIES TIMEOUT 600 LABELS ${room})
      gtest_discover_tests(${room}_tests TEST_FILTER *Conformance*:*Patient* ${discovery})
      gtest_discover_tests(${room}_tests TEST_FILTER -*Conformance*:*Patient* ${discovery} RUN_SERIAL ${alone})
    endif()
  endif()
endfunction()
