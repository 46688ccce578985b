#pragma once
/// Ends of error messages: what is allowed, and the word the user probably meant.

#include "core/nearest.hpp"

#include <span>
#include <string>
#include <string_view>

namespace consort {

/// "; did you mean 'x'?", or nothing if no candidate is close (more than a third of the word would change, and more than two letters).
inline std::string did_you_mean(std::string_view word, std::span<const std::string> candidates) {
  const std::string match = nearest(word, candidates);
  const std::size_t distance = edit_distance(word, match);
  // A two-letter word is within two edits of every other one, so something of the word must remain.
  const bool close = distance <= std::max<std::size_t>(2, word.size() / 3) && distance < std::max(word.size(), match.size());
  return !match.empty() && close ? "; did you mean '" + match + "'?" : std::string();
}

/// "a, b, c", or "nothing" for an empty list.
inline std::string listed(std::span<const std::string> words) {
  std::string out;
  for (const auto& word : words) out += (out.empty() ? "" : ", ") + word;
  return out.empty() ? "nothing" : out;
}

}  // namespace consort
