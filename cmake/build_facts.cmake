# Writes OUTPUT, a definition of kBuild (core/build.hpp), if it has changed: the commit is asked for at every build, and files are compiled
# for it only after a commit. Without git, or outside a checkout, the commit is "unknown".
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty --abbrev=12 --exclude=*
                OUTPUT_VARIABLE commit OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
if(failed OR commit STREQUAL "")
  set(commit unknown)
endif()
file(CONFIGURE OUTPUT ${OUTPUT} @ONLY CONTENT [[
#include "core/build.hpp"

namespace consort {

const BuildFacts kBuild{CONSORT_VERSION, "@commit@", "@TYPE@", "@COMPILER@", "@CYCLONE@", "@EIGEN@"};

}  // namespace consort
]])
