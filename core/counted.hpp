#pragma once
/// Counts in words: 1 line, 2 lines; 1 process, 3 processes; 1 entry, 0 entries.

#include <cstdint>
#include <string>
#include <string_view>

namespace consort {

/// `one` ("line") as `count` of them are called.
template <class Number>
std::string noun(Number count, std::string_view one) {
  std::string word(one);
  if (count == Number{1} || word.empty()) return word;
  constexpr std::string_view kVowels = "aeiou";
  const char last = word.back(), before = word.size() > 1 ? word[word.size() - 2] : 'a';
  if (last == 'y' && kVowels.find(before) == std::string_view::npos) return word.replace(word.size() - 1, 1, "ies");
  return word + (last == 's' || last == 'x' || (last == 'h' && (before == 'c' || before == 's')) ? "es" : "s");
}

/// "1 line", "2 lines".
inline std::string counted(std::uint64_t count, std::string_view one) { return std::to_string(count) + " " + noun(count, one); }

}  // namespace consort
