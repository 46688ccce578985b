#include "core/value_doc.hpp"

#include "core/number_text.hpp"

#include <algorithm>

namespace consort {

Values with_defaults(Values given, std::span<const ValueDoc> docs) {
  for (const ValueDoc& doc : docs) {
    if (given.has(doc.name)) continue;
    const std::vector<std::string> words = choices_of(doc);
    const auto word = std::find(words.begin(), words.end(), doc.fallback);
    if (word != words.end())
      given.set(doc.name, static_cast<double>(word - words.begin()));
    else if (const auto number = parse_number<double>(doc.fallback))
      given.set(doc.name, *number);
  }
  return given;
}

}  // namespace consort
