#pragma once
/// Ends of error messages: what is allowed, and the word the user probably meant.

#include <algorithm>
#include <cctype>
#include <numeric>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace consort {

/// The least number of inserted, removed, replaced or swapped neighbouring characters between `a` and each beginning of `b`, by its length
/// (optimal string alignment).
inline std::vector<std::size_t> edit_distances(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before, above(b.size() + 1), row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before = std::exchange(above, row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + (a[i - 1] == b[j - 1] ? 0u : 1u)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row;
}

/// The least of edit_distances, to the best of what `candidate` or one of its parts (behind '_', '-' or '.') begins with: klman is one off
/// kalman_consensus.
inline std::size_t beginning_distance(std::string_view word, std::string_view candidate) {
  std::size_t best = static_cast<std::size_t>(-1);
  for (std::size_t at = 0; at < candidate.size();) {
    const auto distances = edit_distances(word, candidate.substr(at));
    best = std::min(best, *std::min_element(distances.begin(), distances.end()));
    const std::size_t end = candidate.find_first_of("_-.", at);
    at = end == std::string_view::npos ? candidate.size() : end + 1;
  }
  return best;
}

/// How far `word` is from meaning `candidate`: by all of it, or, if it has three letters of which three quarters fit, by a beginning, which
/// counts as one more.
inline std::size_t word_distance(std::string_view word, std::string_view candidate) {
  const std::size_t whole = edit_distances(word, candidate).back();
  if (word.size() < 3 || whole <= 1) return whole;
  const std::size_t beginning = beginning_distance(word, candidate);
  return beginning <= word.size() / 4 ? std::min(whole, beginning + 1) : whole;
}

/// "; did you mean 'x'?", or nothing if no candidate is close (more than a third of the word would change, and more than two letters).
/// Upper and lower case count as the same letter.
inline std::string did_you_mean(std::string_view word, std::span<const std::string> candidates) {
  constexpr std::size_t kLongest = 100;  // nobody mistypes more
  if (word.size() > kLongest) return {};
  const auto lower = [](std::string_view text) {
    std::string out(text);
    for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return out;
  };
  const std::string* match = nullptr;
  std::size_t distance = 0;
  for (const std::string& candidate : candidates) {
    const std::size_t found = word_distance(lower(word), lower(candidate));
    if (match != nullptr && found >= distance) continue;
    match = &candidate;
    distance = found;
  }
  // A two-letter word is within two edits of every other one, so something of the word must remain.
  if (match == nullptr || distance > std::max<std::size_t>(2, word.size() / 3) || distance >= std::max(word.size(), match->size()))
    return {};
  return "; did you mean '" + *match + "'?";
}

/// "a, b, c", or "nothing" for an empty list.
inline std::string listed(std::span<const std::string> words) {
  std::string out;
  for (const auto& word : words) out += (out.empty() ? "" : ", ") + word;
  return out.empty() ? "nothing" : out;
}

}  // namespace consort
