#include "tests/support/tree.hpp"

namespace consort {

const char* const kSourceDir = CONSORT_SOURCE_DIR;
const char* const kBinDir = CONSORT_BIN_DIR;

}  // namespace consort
