#pragma once
/// The closest known word to one that was not recognised, for error messages.

#include <algorithm>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

namespace consort {

/// Levenshtein distance: the least number of inserted, removed or replaced characters.
inline std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0u : 1u)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

/// The word of `known` with the smallest edit distance (the first of equals); empty if nothing is known.
template <class Words>
std::string nearest(std::string_view word, const Words& known) {
  std::string best;
  std::size_t best_distance = static_cast<std::size_t>(-1);
  for (const auto& candidate : known) {
    const std::size_t distance = edit_distance(word, candidate);
    if (distance < best_distance) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

/// "unknown <what> '<word>'; allowed: a, b, c; nearest: b".
template <class Words>
std::string unknown_word(std::string_view what, std::string_view word, const Words& known) {
  std::string text = "unknown " + std::string(what) + " '" + std::string(word) + "'; allowed:";
  const char* separator = " ";
  for (const auto& candidate : known) {
    text += separator + std::string(candidate);
    separator = ", ";
  }
  if (std::empty(known)) return text + " none";
  return text + "; nearest: " + nearest(word, known);
}

}  // namespace consort
