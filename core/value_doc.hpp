#pragma once
/// What there is to say about one named value: `list`, `validate` and the experiment file's reader use it.

#include "core/errors.hpp"
#include "core/nearest.hpp"
#include "core/values.hpp"

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace consort {

/// The shape of a switch: the file gives 0, 1, false or true.
inline constexpr std::string_view kSwitch = "0 or 1";

/// Documents one parameter or initial value. A shape "one of a, b, c" is a choice: the file gives the word, the value is its number 0, 1,
/// ...
struct ValueDoc {
  std::string_view name;
  std::string_view shape;     ///< e.g. "scalar", "vector n", "covariance n x n (scalar, diagonal or matrix)", "one of a, b"
  std::string_view fallback;  ///< default as text; empty: required
  std::string_view meaning;   ///< one line with unit and symbol
};

/// The words of a choice; empty for any other shape.
inline std::vector<std::string> choices_of(const ValueDoc& doc) {
  constexpr std::string_view kChoice = "one of ";
  std::vector<std::string> words;
  if (!doc.shape.starts_with(kChoice)) return words;
  std::string_view rest = doc.shape.substr(kChoice.size());
  while (true) {
    const std::size_t comma = rest.find(", ");
    words.emplace_back(rest.substr(0, comma));
    if (comma == std::string_view::npos) return words;
    rest.remove_prefix(comma + 2);
  }
}

/// `given`, and for what is missing the default that its document states, where that is a number or a word of a choice.
Values with_defaults(Values given, std::span<const ValueDoc> docs);

/// Throws ConfigError on a value that no line of `docs` names; `whose` begins the text ("protocol x: unknown parameter ...").
inline void require_known(std::string_view whose, std::string_view kind, const Values& values, std::span<const ValueDoc> docs) {
  std::vector<std::string_view> known;
  for (const ValueDoc& doc : docs) known.push_back(doc.name);
  for (const Values::Entry& entry : values.entries()) {
    bool found = false;
    for (const std::string_view name : known) found = found || entry.name == name;
    if (!found) throw ConfigError(std::string(whose) + ": " + unknown_word(kind, entry.name, known));
  }
}

}  // namespace consort
