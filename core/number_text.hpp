#pragma once
/// Numbers as users write them: decimal, whole, with nothing around them; what does not fit into the type is none.

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace consort {

/// All of `text` as a number: "1e6" is a double and no whole number, "-1" nothing without a sign, "010" ten, "0x10" and "1 " nothing.
template <class Number>
std::optional<Number> parse_number(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace consort
