# Warnings, exact arithmetic, sanitizers, fuzzing.

# Bit-for-bit equality between the drivers rules out value-changing optimisation; contraction is off so that inlining cannot change a sum.
add_compile_options(-Wall -Wextra -Wpedantic -Wshadow -ffp-contract=off)
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # GCC 12 sees overlaps, and copies without an end, in every "text" + std::string (GCC bug 105651).
  add_compile_options(-Wno-restrict -Wno-stringop-overflow -Wno-array-bounds)
endif()
set(CONSORT_SANITIZE "" CACHE STRING "Sanitizers, as -fsanitize= takes them (see CMakePresets.json)")
if(CONSORT_SANITIZE)
  add_compile_options(-fsanitize=${CONSORT_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_compile_options(-fno-sanitize=pointer-overflow)  # Eigen adds an offset to the null pointer of an empty matrix
  add_link_options(-fsanitize=${CONSORT_SANITIZE})
endif()
option(CONSORT_FUZZ "Build the libFuzzer targets (clang only; see preset fuzz)" OFF)
if(CONSORT_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()
