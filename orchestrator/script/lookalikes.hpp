#pragma once
/// Characters that look like those YAML wants, and are none: a no-break space, a full-width colon, a curly quotation mark.

#include "orchestrator/script/yaml.hpp"

#include <optional>
#include <string_view>

namespace consort::script {

struct Lookalike {
  std::string_view bytes, name, allowed;
};

/// The one that `text` begins with; nullptr: none.
const Lookalike* lookalike_at(std::string_view text);
bool any_lookalike(std::string_view text);
/// Adds the first of them from `mark` on that stands outside a comment.
void report_lookalike(std::string_view text, const YAML::Mark& mark, Mistakes& mistakes);
/// Adds what no experiment file holds: bytes that are not UTF-8, and control characters (of which YAML takes one for the end of the text).
bool report_bytes(std::string_view text, Mistakes& mistakes);

YAML::Mark mark_at(std::size_t line, std::size_t column);         ///< counted from 0, in bytes, as yaml-cpp does
YAML::Mark mark_of(std::string_view text, std::size_t position);  ///< of a byte

}  // namespace consort::script
