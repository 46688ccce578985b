#pragma once
/// The text of a criterion under reading: what stands at its place, and what is said of it where it does not belong.

#include "orchestrator/script/criterion.hpp"

#include <optional>
#include <string>
#include <string_view>

namespace consort {

inline bool is_digit(char c) { return c >= '0' && c <= '9'; }
inline bool begins_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
inline bool continues_name(char c) { return begins_name(c) || is_digit(c) || c == '.' || c == '[' || c == ']'; }

class CriterionText {
 public:
  explicit CriterionText(const std::string& text) : text_(text) {}

  [[nodiscard]] std::size_t column(std::size_t at) const;
  [[noreturn]] void refuse(std::size_t at, const std::string& why) const;
  /// Says what stands here instead of what belongs here.
  [[noreturn]] void unexpected(std::string_view wanted) const;

  void skip_space();
  [[nodiscard]] std::string_view word() const;
  /// Goes past `symbol` if it stands here; the others likewise.
  bool accept(std::string_view symbol);
  bool accept_word(std::string_view wanted);
  bool accept_not();
  std::optional<Criterion::Comparison> accept_comparison();

 protected:
  const std::string& text_;
  std::size_t at_ = 0;
};

}  // namespace consort
