#pragma once
/// Ends of error messages: what is allowed, and the word the user probably meant.

#include "core/nearest.hpp"

#include <algorithm>
#include <cctype>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace consort {

/// "; did you mean 'x'?", or nothing if no candidate is close (more than a third of the word would change, and more than two letters).
/// Upper and lower case count as the same letter.
inline std::string did_you_mean(std::string_view word, std::span<const std::string> candidates) {
  const auto lower = [](std::string_view text) {
    std::string out(text);
    for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return out;
  };
  std::vector<std::string> lowered;
  for (const auto& candidate : candidates) lowered.push_back(lower(candidate));
  const std::string match = nearest(lower(word), lowered);
  if (match.empty()) return {};
  const std::size_t distance = edit_distance(lower(word), match);
  // A two-letter word is within two edits of every other one, so something of the word must remain.
  if (distance > std::max<std::size_t>(2, word.size() / 3) || distance >= std::max(word.size(), match.size())) return {};
  const auto index = static_cast<std::size_t>(std::find(lowered.begin(), lowered.end(), match) - lowered.begin());
  return "; did you mean '" + candidates[index] + "'?";
}

/// "a, b, c", or "nothing" for an empty list.
inline std::string listed(std::span<const std::string> words) {
  std::string out;
  for (const auto& word : words) out += (out.empty() ? "" : ", ") + word;
  return out.empty() ? "nothing" : out;
}

}  // namespace consort
