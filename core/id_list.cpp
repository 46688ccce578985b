#include "core/id_list.hpp"

#include "core/errors.hpp"

#include <cctype>
#include <set>

namespace consort {

std::vector<std::uint32_t> parse_ids(const std::string& option, const std::string& text, std::uint32_t least) {
  constexpr std::uint32_t kMost = 100'000;  // agents of a run
  constexpr std::size_t kDigits = 9;
  const auto refuse = [&](const std::string& why) { throw ConfigError(option + " " + text + ": " + why); };
  const std::string allowed =
      "allowed: ids from " + std::to_string(least) + " to " + std::to_string(kMost) + " such as 7, 1-25 or 1,4,9-12";
  std::size_t at = 0;
  const auto number = [&] {
    std::string digits;
    while (at < text.size() && std::isdigit(static_cast<unsigned char>(text[at]))) digits += text[at++];
    if (digits.empty())
      refuse((at < text.size() ? std::string("found '") + text[at] + "'" : std::string("it ends early")) + "; " + allowed);
    if (digits.size() > kDigits || std::stoul(digits) < least || std::stoul(digits) > kMost) refuse("found " + digits + "; " + allowed);
    return static_cast<std::uint32_t>(std::stoul(digits));
  };
  std::set<std::uint32_t> ids;
  while (true) {
    const std::uint32_t first = number();
    std::uint32_t last = first;
    if (at < text.size() && text[at] == '-') ++at, last = number();
    if (last < first) refuse("found the range " + std::to_string(first) + "-" + std::to_string(last) + "; allowed: the lower end first");
    for (std::uint32_t id = first; id <= last; ++id) ids.insert(id);
    if (at == text.size()) return {ids.begin(), ids.end()};
    if (text[at] != ',') refuse(std::string("found '") + text[at] + "'; " + allowed);
    ++at;
  }
}

std::string to_text(std::span<const std::uint32_t> ids) {
  std::string text;
  for (std::size_t i = 0; i < ids.size();) {
    std::size_t end = i + 1;
    while (end < ids.size() && ids[end] == ids[end - 1] + 1) ++end;
    text += (text.empty() ? "" : ",") + std::to_string(ids[i]);
    if (end - i > 1) text += "-" + std::to_string(ids[end - 1]);
    i = end;
  }
  return text;
}

}  // namespace consort
