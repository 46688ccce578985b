#pragma once
/// The structure of a YAML text, line by line, without a parser: what remains to look at when a parser has given up.

#include "orchestrator/script/yaml.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace consort::script {

/// A line in which comments and literal blocks are blank, and all within quotes is q.
struct SkeletonLine {
  std::string text;
  bool within_brackets = false;  ///< it begins within brackets or quotes of a line before
};

/// Quotes or brackets that do not match: where, and what is said of it.
struct Unbalanced {
  YAML::Mark mark;
  std::string text;
};

/// What follows the first of `unbalanced` is not looked at.
struct Skeleton {
  std::vector<SkeletonLine> lines;
  std::optional<Unbalanced> unbalanced;
};
Skeleton skeleton_of(std::string_view text);

/// Does the line look like `key:` or `key: value`, a list's dashes before it or not?
bool begins_with_key(std::string_view line);

}  // namespace consort::script
