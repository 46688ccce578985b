#pragma once
/// What the terminal can show, and text measured as it is shown.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace consort {

struct TextStyle {
  bool unicode = true;  ///< the locale's encoding is UTF-8
  bool colour = false;  ///< a terminal, and NO_COLOR is not set
  bool terminal = false;
  std::size_t width = 80;
};

/// Looks at the descriptor, the environment and the locale (call setlocale(LC_CTYPE, "") first).
TextStyle style_of(int descriptor);

enum class Tone { plain, strong, faint, good, bad };
std::string toned(std::string_view text, Tone tone, const TextStyle& style);

std::size_t shown_width(std::string_view text);                 ///< characters, not bytes
std::string clipped(std::string_view text, std::size_t width);  ///< at most `width` characters
/// Breaks at spaces so that no line is longer than `width` (a longer word stays whole).
std::vector<std::string> wrapped(std::string_view text, std::size_t width);
std::string grouped(std::uint64_t number);  ///< 1234567 -> 1,234,567

}  // namespace consort
