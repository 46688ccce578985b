# What `cmake --install` puts where (GNU directories), what `make uninstall` takes away again, and what others build against. Nothing here
# is compiled: the programs and the libraries of the pure rooms are those of the build. docs/guide/installing.md
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(INSTALL_SHARE ${CMAKE_INSTALL_DATADIR}/consort)
set(INSTALL_CMAKE ${CMAKE_INSTALL_LIBDIR}/cmake/Consort)
set(INSTALL_PYTHON lib/python3/dist-packages)
set(INSTALL_MADE ${CMAKE_BINARY_DIR}/install)   # what is generated from the programs while installing

# First of all: which folders there are not yet, so that they can be removed again.
set(INSTALL_FOLDERS ${CMAKE_INSTALL_BINDIR} ${INSTALL_CMAKE} ${CMAKE_INSTALL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_INCLUDEDIR}/consort
    ${INSTALL_SHARE} ${CMAKE_INSTALL_DOCDIR} ${CMAKE_INSTALL_MANDIR}/man1 ${INSTALL_PYTHON}/consort
    ${CMAKE_INSTALL_DATADIR}/bash-completion/completions ${CMAKE_INSTALL_DATADIR}/zsh/site-functions
    ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
configure_file(cmake/install/before.cmake.in ${CMAKE_BINARY_DIR}/install-before.cmake @ONLY)
configure_file(cmake/install/uninstall.cmake.in ${CMAKE_BINARY_DIR}/uninstall.cmake @ONLY)
install(SCRIPT ${CMAKE_BINARY_DIR}/install-before.cmake ALL_COMPONENTS)
add_custom_target(uninstall COMMAND ${CMAKE_COMMAND} -P ${CMAKE_BINARY_DIR}/uninstall.cmake USES_TERMINAL)

# --- the programs, and what they are used with --------------------------------------------------------------------------
install(TARGETS consort consort-agent consort-plant RUNTIME COMPONENT programs)
install(CODE "execute_process(COMMAND ${PROJECT_SOURCE_DIR}/deploy/manual.sh ${CMAKE_BINARY_DIR}/bin ${INSTALL_MADE} ${PROJECT_VERSION}
                              COMMAND_ERROR_IS_FATAL ANY)" COMPONENT programs)
install(DIRECTORY ${INSTALL_MADE}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT programs)
install(DIRECTORY ${INSTALL_MADE}/bash/ DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT programs)
install(DIRECTORY ${INSTALL_MADE}/fish/ DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT programs)
install(DIRECTORY ${INSTALL_MADE}/zsh/ DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions COMPONENT zsh)   # Debian has it elsewhere
install(DIRECTORY experiments DESTINATION ${INSTALL_SHARE} COMPONENT programs FILES_MATCHING PATTERN *.yaml PATTERN *.csv PATTERN *.json)
install(FILES idl/consort.idl DESTINATION ${INSTALL_SHARE}/idl COMPONENT programs)
install(DIRECTORY examples/listener examples/listener-fastdds DESTINATION ${INSTALL_SHARE}/examples COMPONENT programs)
install(FILES README.md CONTRIBUTING.md CITATION.cff SECURITY.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT programs)
install(FILES CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT plain)   # Debian has it as changelog.gz
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT programs
        FILES_MATCHING PATTERN *.md PATTERN *.svg PATTERN *.png PATTERN *.bib)
install(DIRECTORY python/consort DESTINATION ${INSTALL_PYTHON} COMPONENT python FILES_MATCHING PATTERN *.py)

# --- for who writes a protocol, or calls simulate() -----------------------------------------------------------------------
# Headers name each other from the root of the project: "core/values.hpp" lies in include/consort.
foreach(room core models protocols rounds)
  install(DIRECTORY ${room} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/consort COMPONENT development FILES_MATCHING PATTERN *.hpp)
endforeach()
add_library(consort_protocol INTERFACE)   # headers alone: enough for a protocol that somebody else loads or links
target_compile_features(consort_protocol INTERFACE cxx_std_20)
target_compile_options(consort_protocol INTERFACE -ffp-contract=off)   # as in Compiler.cmake: the same bits in every mode
target_link_libraries(consort_protocol INTERFACE Eigen3::Eigen)
add_library(consort_simulate INTERFACE)   # and simulate(), with every protocol and plant model that ships
target_link_libraries(consort_simulate INTERFACE consort_protocol consort_rounds)
set(INSTALL_LIBRARIES core models protocols rounds)
foreach(name IN LISTS INSTALL_LIBRARIES ITEMS protocol simulate)
  set_target_properties(consort_${name} PROPERTIES EXPORT_NAME ${name})
  install(TARGETS consort_${name} EXPORT consort-targets ARCHIVE COMPONENT development
          INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/consort)
endforeach()
install(EXPORT consort-targets NAMESPACE Consort:: FILE ConsortTargets.cmake DESTINATION ${INSTALL_CMAKE} COMPONENT development)
configure_package_config_file(cmake/install/ConsortConfig.cmake.in ${CMAKE_BINARY_DIR}/ConsortConfig.cmake
                              INSTALL_DESTINATION ${INSTALL_CMAKE})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/ConsortConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/ConsortConfig.cmake ${CMAKE_BINARY_DIR}/ConsortConfigVersion.cmake DESTINATION ${INSTALL_CMAKE}
        COMPONENT development)
file(RELATIVE_PATH INSTALL_PREFIX_FROM_PC /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
string(REGEX REPLACE "/$" "" INSTALL_PREFIX_FROM_PC "${INSTALL_PREFIX_FROM_PC}")
configure_file(cmake/install/consort.pc.in ${CMAKE_BINARY_DIR}/consort.pc @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/consort.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)

include(Packages)
