# Of what the programs are built; its own library, so that a commit costs one small file and links.
set(BUILD_FACTS ${CMAKE_BINARY_DIR}/generated/build.cpp)
add_custom_target(build_facts BYPRODUCTS ${BUILD_FACTS}
  COMMAND ${CMAKE_COMMAND} -D SOURCE=${PROJECT_SOURCE_DIR} -D OUTPUT=${BUILD_FACTS} -D TYPE=${CMAKE_BUILD_TYPE}
          -D "COMPILER=${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}" -D CYCLONE=${CycloneDDS_VERSION}
          -D EIGEN=${EIGEN3_VERSION_STRING} -P ${PROJECT_SOURCE_DIR}/cmake/build_facts.cmake)
add_library(consort_build STATIC ${BUILD_FACTS})
add_dependencies(consort_build build_facts)
target_compile_definitions(consort_build PRIVATE CONSORT_VERSION="${PROJECT_VERSION}")

# The wire's number is that of the IDL without its comments: processes of two numbers do not understand each other.
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS idl/consort.idl)
file(READ idl/consort.idl WIRE)
string(REGEX REPLACE "//[^\n]*|[ \n]+" "" WIRE "${WIRE}")
string(SHA256 WIRE "${WIRE}")
string(SUBSTRING ${WIRE} 0 8 WIRE)
set(CARD_FACTS CONSORT_VERSION="${PROJECT_VERSION}" CONSORT_WIRE="${WIRE}" CONSORT_CYCLONE_VERSION="${CycloneDDS_VERSION}")
