#pragma once
/// Lists of agent ids as a person writes them: 7, 1-25 or 1,4,9-12.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace consort {

/// The ids, ascending, each once. None is below `least`. Throws ConfigError that begins with `option`.
std::vector<std::uint32_t> parse_ids(const std::string& option, const std::string& text, std::uint32_t least = 1);

/// The shortest list of ids that are ascending.
std::string to_text(std::span<const std::uint32_t> ids);

}  // namespace consort
