# Three Debian packages of one build, made by CPack (make package). What Debian wants otherwise than an installation under a prefix has it
# is in components of its own, which `cmake --install` leaves out.
set(CONSORT_MAINTAINER "Consort maintainers <maintainers@consort.invalid>" CACHE STRING "Who the Debian packages say made them")
set(debian ${CMAKE_BINARY_DIR}/debian)
configure_file(deploy/debian/copyright.in ${debian}/copyright @ONLY)
configure_file(deploy/debian/changelog.in ${debian}/changelog @ONLY)
foreach(package consort libconsort-dev python3-consort)
  set(component debian-${package})
  install(CODE "execute_process(COMMAND gzip -9nkf ${debian}/changelog COMMAND_ERROR_IS_FATAL ANY)"
          COMPONENT ${component} EXCLUDE_FROM_ALL)
  install(FILES ${debian}/copyright ${debian}/changelog.gz DESTINATION share/doc/${package} COMPONENT ${component} EXCLUDE_FROM_ALL)
endforeach()
install(DIRECTORY ${INSTALL_MADE}/zsh/ DESTINATION share/zsh/vendor-completions COMPONENT debian-consort EXCLUDE_FROM_ALL)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME consort)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_COMPONENTS_ALL programs debian-consort development debian-libconsort-dev python debian-python3-consort)
foreach(pair programs:main debian-consort:main development:library debian-libconsort-dev:library python:python
             debian-python3-consort:python)
  string(REGEX MATCH "(.+):(.+)" pair ${pair})
  string(TOUPPER ${CMAKE_MATCH_1} component)
  set(CPACK_COMPONENT_${component}_GROUP ${CMAKE_MATCH_2})
endforeach()
set(CPACK_DEBIAN_PACKAGE_MAINTAINER ${CONSORT_MAINTAINER})
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_MAIN_PACKAGE_NAME consort)
set(CPACK_DEBIAN_MAIN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_MAIN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_MAIN_PACKAGE_DEPENDS liblapacke)   # loaded when it is needed: core/math/schur.cpp
set(CPACK_DEBIAN_MAIN_PACKAGE_SUGGESTS "python3-consort, openssh-client, xdg-utils")
set(CPACK_DEBIAN_MAIN_DESCRIPTION "distributed consensus as real processes that talk over DDS
Every agent of a consensus, control or estimation algorithm is a process of
its own; agents find each other over DDS and exchange messages along a
topology that may switch in every round, over links that lose, delay and
disturb them. One YAML file says all of it; the exit code says whether the
criteria in it held, and a simulation gives the same numbers, bit for bit.")

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libconsort-dev)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_DEPENDS "libeigen3-dev, libfmt-dev, librandom123-dev, liblapacke")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SUGGESTS consort)
set(CPACK_DEBIAN_LIBRARY_DESCRIPTION "distributed consensus: headers to write protocols with, and simulate()
The headers that a protocol or a plant model of Consort is written with, and
the libraries that simulate an experiment with them, for CMake
(find_package(Consort): Consort::protocol, Consort::simulate) and pkg-config.")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-consort)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "consort (= ${PROJECT_VERSION}), python3:any, python3-numpy, python3-pandas")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "python3-matplotlib, python3-networkx")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/deploy/debian/postinst ${PROJECT_SOURCE_DIR}/deploy/debian/prerm)
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "distributed consensus: runs and their results as pandas DataFrames
Starts runs of Consort from Python, with other values than the file's, and
reads what they left: estimates, metrics and graphs, to compute with and plot.")
include(CPack)
