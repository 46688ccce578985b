#include "orchestrator/script/criterion_text.hpp"

#include "core/errors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace consort {
namespace {

using Comparison = Criterion::Comparison;

constexpr std::string_view kCriterion = "a comparison over metric names, such as 'abs(bias) < 1e-6'; and, or, not join several";

struct Symbol {
  std::string_view text;
  Comparison comparison;
};
// The longer first, so that <= is not read as <.
constexpr std::array kComparisons{Symbol{"<=", Comparison::at_most}, Symbol{">=", Comparison::at_least}, Symbol{"==", Comparison::equal},
                                  Symbol{"!=", Comparison::unequal}, Symbol{"<", Comparison::less},      Symbol{">", Comparison::greater}};

bool continues_character(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; }  // of UTF-8

// A message is one line, and does not end where the text has a NUL.
std::string printable(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  return text;
}

}  // namespace

std::size_t CriterionText::column(std::size_t at) const {
  const auto begin = text_.begin(), end = begin + static_cast<std::ptrdiff_t>(at);
  return 1 + static_cast<std::size_t>(std::count_if(begin, end, [](char c) { return !continues_character(c); }));
}

void CriterionText::refuse(std::size_t at, const std::string& why) const {
  throw ConfigError(printable(fmt::format("criterion: found '{}' (column {}: {}); allowed: {}", text_, column(at), why, kCriterion)));
}

void CriterionText::unexpected(std::string_view wanted) const {
  if (at_ >= text_.size()) refuse(at_, fmt::format("it ends where {} is missing", wanted));
  const char c = text_[at_];
  if (c == ',') refuse(at_, "',' stands between the arguments of a call only; 'and' joins comparisons, a decimal point is '.'");
  if (c == '=') refuse(at_, "'=' assigns; '==' compares, and so do '<=' and '>='");
  if (c == '&' || c == '|') refuse(at_, fmt::format("found a single '{0}'; '{0}{0}' joins comparisons", c));
  std::size_t end = at_ + 1;
  while (end < text_.size() && (begins_name(c) ? continues_name(text_[end]) : continues_character(text_[end]))) ++end;
  refuse(at_, fmt::format("found '{}' in the place of {}", text_.substr(at_, end - at_), wanted));
}

void CriterionText::skip_space() {
  while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos) ++at_;
}

std::string_view CriterionText::word() const {
  std::size_t end = at_;
  if (end < text_.size() && begins_name(text_[end]))
    while (end < text_.size() && continues_name(text_[end])) ++end;
  return std::string_view(text_).substr(at_, end - at_);
}

bool CriterionText::accept(std::string_view symbol) {
  skip_space();
  if (!std::string_view(text_).substr(at_).starts_with(symbol)) return false;
  at_ += symbol.size();
  return true;
}

bool CriterionText::accept_word(std::string_view wanted) {
  skip_space();
  if (word() != wanted) return false;
  at_ += wanted.size();
  return true;
}

bool CriterionText::accept_not() {
  skip_space();
  const bool differs = std::string_view(text_).substr(at_).starts_with("!=");
  return accept_word("not") || (!differs && accept("!"));
}

std::optional<Criterion::Comparison> CriterionText::accept_comparison() {
  for (const Symbol& symbol : kComparisons)
    if (accept(symbol.text)) return symbol.comparison;
  return std::nullopt;
}

}  // namespace consort
