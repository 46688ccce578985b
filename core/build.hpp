#pragma once
/// Of what these programs are built: told by `--version`, and kept beside results.

#include <string>
#include <string_view>

namespace consort {

struct BuildFacts {
  std::string_view version, commit, type, compiler, cyclone, eigen;
};
extern const BuildFacts kBuild;  ///< made by CMake at every build

/// "consort 0.1.0 (commit 0123456789ab, Release, GNU 12.2.0), Cyclone DDS 0.10.2, Eigen 3.4.0".
inline std::string version_text(std::string_view program) {
  std::string text(program);
  text.append(" ").append(kBuild.version).append(" (commit ").append(kBuild.commit).append(", ").append(kBuild.type);
  text.append(", ").append(kBuild.compiler).append("), Cyclone DDS ").append(kBuild.cyclone).append(", Eigen ").append(kBuild.eigen);
  return text;
}

}  // namespace consort
