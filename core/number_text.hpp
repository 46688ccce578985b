#pragma once
/// Numbers as users read and write them: decimal, whole, with nothing around them; what does not fit into the type is none.

#include <array>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
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

/// The shortest text that is read as this number again: 1e-09, 0.1, inf.
inline std::string number_text(double value) {
  std::array<char, 32> buffer{};
  return {buffer.data(), std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr};
}

/// "; did you mean 1000?" for "1e3": a whole number, but not written digit by digit. Else nothing.
inline std::string written_out(std::string_view text) {
  constexpr double kExact = 9007199254740992.0;  // 2^53: up to there a double holds every whole number
  const auto value = parse_number<double>(text);
  const bool whole = value && *value >= 0.0 && *value <= kExact && *value == static_cast<double>(static_cast<std::uint64_t>(*value));
  if (!whole || parse_number<std::uint64_t>(text)) return {};
  return "; did you mean " + std::to_string(static_cast<std::uint64_t>(*value)) + "?";
}

}  // namespace consort
