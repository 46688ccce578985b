#pragma once
/// Where this checkout and its programs are. Defined in the one file that is compiled with these paths, so that what was compiled in
/// one checkout can be reused in another.

namespace consort {

extern const char* const kSourceDir;  // what README.md lies in
extern const char* const kBinDir;     // where consort, consort-agent and consort-plant are

}  // namespace consort
