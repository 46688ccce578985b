#include "orchestrator/script/yaml.hpp"

#include "core/counted.hpp"
#include "core/number_text.hpp"
#include "orchestrator/script/wording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace consort::script {

namespace {
constexpr std::size_t kMostTold = 50;      // mistakes of a file, at once
constexpr std::size_t kMostKept = 10'000;  // the others are counted
constexpr std::size_t kMostShown = 100;    // bytes of what stands in it
}  // namespace

void Mistakes::add(const YAML::Mark& mark, const std::string& text) {
  add(file_, mark.is_null() ? 1 : static_cast<std::size_t>(mark.line) + 1, mark.is_null() ? 1 : static_cast<std::size_t>(mark.column) + 1,
      text);
}

namespace {

// The parser takes a value that is not there for the next thing in the text. It is missed in the last line before that has something,
// where the line of `mark` has nothing before it and no null of its own.
YAML::Mark place_of_nothing(std::string_view text, YAML::Mark mark) {
  const auto at = std::min(static_cast<std::size_t>(std::max(0, mark.pos)), text.size());
  const auto is_null = [&](std::string_view word) { return text.substr(at).starts_with(word); };
  std::size_t line = at == 0 ? 0 : text.rfind('\n', at - 1) + 1;
  if (is_null("~") || is_null("null") || is_null("Null") || is_null("NULL")) return mark;
  const auto first = [&](std::size_t begin, std::size_t end) { return std::min(text.find_first_not_of(" \t", begin), end); };
  if (first(line, at) < at) return mark;
  while (line > 0) {
    const std::size_t end = line - 1;
    line = end == 0 ? 0 : text.rfind('\n', end - 1) + 1;
    --mark.line;
    const std::size_t begin = first(line, end);
    if (begin == end || text[begin] == '#') continue;
    mark.column = static_cast<int>(begin - line);
    mark.pos = static_cast<int>(begin);
    return mark;
  }
  return mark;
}

}  // namespace

void Mistakes::add(const YAML::Node& node, const std::string& text) {
  const bool nothing = node.IsDefined() && node.IsNull() && !node.Mark().is_null();
  add(nothing ? place_of_nothing(text_, node.Mark()) : node.Mark(), text);
}

void Mistakes::add(const std::string& file, std::size_t line, std::size_t column, const std::string& text) {
  if (found_.size() < kMostKept)
    found_.push_back({file, line, column, text});
  else
    ++not_kept_;
}

void Mistakes::raise() const {
  if (found_.empty()) return;
  auto sorted = found_;
  std::stable_sort(sorted.begin(), sorted.end(), [this](const Entry& a, const Entry& b) {
    return std::tuple(a.file != file_, a.file, a.line, a.column) < std::tuple(b.file != file_, b.file, b.line, b.column);
  });
  std::string text;
  const std::size_t told = std::min(sorted.size(), kMostTold);
  for (const auto& entry : std::span(sorted).first(told)) {
    if (!text.empty()) text += '\n';
    text += fmt::format("{}:{}:{}: {}", entry.file, entry.line, entry.column, entry.text);
  }
  if (told < count()) text += fmt::format("\n... and {} more", count() - told);
  throw PlacedError(text);
}

std::optional<std::size_t> first_byte_not_utf8(std::string_view text) {
  const auto byte = [&](std::size_t at) { return at < text.size() ? static_cast<unsigned char>(text[at]) : 0u; };
  for (std::size_t at = 0; at < text.size();) {
    const unsigned lead = byte(at);
    const std::size_t more = lead < 0x80                   ? 0
                             : lead >= 0xc2 && lead < 0xe0 ? 1
                             : lead >= 0xe0 && lead < 0xf0 ? 2
                             : lead >= 0xf0 && lead < 0xf5 ? 3
                                                           : 4;
    if (more == 4) return at;
    for (std::size_t i = 1; i <= more; ++i)
      if (byte(at + i) < 0x80 || byte(at + i) > 0xbf) return at;
    const unsigned second = byte(at + 1);
    const bool overlong = (lead == 0xe0 && second < 0xa0) || (lead == 0xf0 && second < 0x90);
    const bool outside = (lead == 0xed && second > 0x9f) || (lead == 0xf4 && second > 0x8f);  // surrogates; beyond U+10FFFF
    if (overlong || outside) return at;
    at += more + 1;
  }
  return std::nullopt;
}

std::string describe(const YAML::Node& node) {
  switch (node.Type()) {
    case YAML::NodeType::Scalar:
      if (node.Scalar().empty()) return "empty text";
      return plain_number(node) || plain_switch(node) ? shown(node.Scalar()) : fmt::format("text '{}'", shown(node.Scalar()));
    case YAML::NodeType::Sequence:
      return node.size() == 0 ? "an empty list" : fmt::format("a list of {}", node.size());
    case YAML::NodeType::Map:
      return "a mapping";
    default:
      return "nothing";
  }
}

std::string shown(std::string_view text) {
  const auto begins_character = [text](std::size_t at) { return (static_cast<unsigned char>(text[at]) & 0xc0u) != 0x80u; };
  std::size_t end = std::min(text.size(), kMostShown);
  while (end > 0 && end < text.size() && !begins_character(end)) --end;
  std::string out;
  const bool utf8 = !first_byte_not_utf8(text.substr(0, end));
  for (const char c : text.substr(0, end)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f || (byte >= 0x80 && !utf8))
      out += fmt::format("\\x{:02x}", byte);
    else
      out += c;
  }
  return end == text.size() ? out : out + fmt::format("... ({} bytes)", text.size());
}

namespace {

// "!" is yaml-cpp's tag of a quoted scalar.
bool plain(const YAML::Node& node) { return node.IsDefined() && node.IsScalar() && node.Tag() != "!"; }

}  // namespace

std::optional<double> finite_number(std::string_view text) {
  const auto value = parse_number<double>(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<double> plain_number(const YAML::Node& node) { return plain(node) ? finite_number(node.Scalar()) : std::nullopt; }

std::optional<bool> plain_switch(const YAML::Node& node) {
  if (!plain(node)) return std::nullopt;
  if (node.Scalar() == "true") return true;
  if (node.Scalar() == "false") return false;
  return std::nullopt;
}

std::optional<std::uint64_t> whole_number(const YAML::Node& node) {
  return plain(node) ? parse_number<std::uint64_t>(node.Scalar()) : std::nullopt;
}

std::string Range::text() const {
  const bool below = std::isfinite(low), above = std::isfinite(high);
  if (below && above) return fmt::format("a number {} {} to {}", low_open ? "above" : "from", number_text(low), number_text(high));
  if (below) return fmt::format("a number {} {}", low_open ? "above" : "from", number_text(low)) + (low_open ? "" : " up");
  return "a finite number";
}

std::optional<double> read_number(Mistakes& mistakes, const YAML::Node& node, const std::string& what, Range range) {
  const auto value = plain_number(node);
  if (value && range.holds(*value)) return value;
  mistakes.add(node, fmt::format("{}: found {}; allowed: {}", what, describe(node), range.text()));
  return std::nullopt;
}

std::optional<std::uint64_t> read_whole(Mistakes& mistakes, const YAML::Node& node, const std::string& what, std::uint64_t low,
                                        std::uint64_t high) {
  const auto value = whole_number(node);
  if (value && *value >= low && *value <= high) return value;
  mistakes.add(node, fmt::format("{}: found {}; allowed: a whole number from {} to {}{}", what, describe(node), low, high,
                                 plain(node) ? written_out(node.Scalar()) : ""));
  return std::nullopt;
}

std::optional<std::string> read_text(Mistakes& mistakes, const YAML::Node& node, const std::string& what) {
  const bool quotes = plain_number(node) || plain_switch(node);
  if (node.IsScalar() && !node.Scalar().empty() && !quotes) return node.Scalar();
  mistakes.add(node, fmt::format("{}: found {}; allowed: text{}", what, describe(node), quotes ? ", in quotes" : ""));
  return std::nullopt;
}

std::optional<std::size_t> read_choice(Mistakes& mistakes, const YAML::Node& node, const std::string& what,
                                       std::span<const std::string> choices) {
  if (node.IsScalar()) {
    const auto it = std::find(choices.begin(), choices.end(), node.Scalar());
    if (it != choices.end()) return static_cast<std::size_t>(it - choices.begin());
  }
  mistakes.add(node, fmt::format("{}: found {}; allowed: {}{}", what, describe(node), listed(choices),
                                 node.IsScalar() ? did_you_mean(node.Scalar(), choices) : ""));
  return std::nullopt;
}

namespace {

std::optional<double> read_entry(Mistakes& mistakes, const YAML::Node& node, const std::string& what, bool switches) {
  if (switches)
    if (const auto on = plain_switch(node)) return *on ? 1.0 : 0.0;
  if (const auto value = plain_number(node)) return value;
  mistakes.add(node, fmt::format("{}: found {}; allowed: a finite number{}", what, describe(node), switches ? ", true or false" : ""));
  return std::nullopt;
}

std::optional<Matrix> read_rows(Mistakes& mistakes, const YAML::Node& node, const std::string& what) {
  const std::size_t columns = node[0].IsSequence() ? node[0].size() : 0;
  Matrix out(static_cast<Eigen::Index>(node.size()), static_cast<Eigen::Index>(columns));
  bool good = true;
  for (std::size_t i = 0; i < node.size(); ++i) {
    const YAML::Node row = node[i];
    if (!row.IsSequence() || row.size() != columns || columns == 0) {
      mistakes.add(row, fmt::format("{}: found {} as row {}; allowed: a matrix, rows of equal length ({} as in row 1)", what, describe(row),
                                    i + 1, counted(columns, "number")));
      return std::nullopt;
    }
    for (std::size_t j = 0; j < columns; ++j) {
      const auto entry = read_entry(mistakes, row[j], what, false);
      if (entry) out(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = *entry;
      good = good && entry;
    }
  }
  return good ? std::optional(out) : std::nullopt;
}

}  // namespace

std::optional<Matrix> read_matrix(Mistakes& mistakes, const YAML::Node& node, const std::string& what, bool switches) {
  mistakes.at(node.Mark());
  if (!node.IsSequence()) {
    if (!node.IsScalar()) {
      mistakes.add(node, fmt::format("{}: found {}; allowed: a number, a list of numbers or a list of rows", what, describe(node)));
      return std::nullopt;
    }
    const auto value = read_entry(mistakes, node, what, switches);
    return value ? std::optional<Matrix>(Matrix::Constant(1, 1, *value)) : std::nullopt;
  }
  if (node.size() == 0) {
    mistakes.add(node, fmt::format("{}: found an empty list; allowed: a number, a list of numbers or a list of rows", what));
    return std::nullopt;
  }
  if (std::any_of(node.begin(), node.end(), [](const YAML::Node& entry) { return entry.IsSequence(); }))
    return read_rows(mistakes, node, what);
  Matrix out(static_cast<Eigen::Index>(node.size()), 1);
  bool good = true;
  for (std::size_t i = 0; i < node.size(); ++i) {
    const auto entry = read_entry(mistakes, node[i], what, false);
    if (entry) out(static_cast<Eigen::Index>(i), 0) = *entry;
    good = good && entry;
  }
  return good ? std::optional(out) : std::nullopt;
}

std::optional<Seconds> read_duration(Mistakes& mistakes, const YAML::Node& node, const std::string& what, bool zero) {
  const std::string_view allowed = zero ? "a number of seconds from 0 up, or a text such as '60 s', '500 ms', '2 min'"
                                        : "a number of seconds above 0, or a text such as '60 s', '500 ms', '2 min'";
  double factor = 1.0;
  std::optional<double> value;
  if (node.IsScalar()) {
    std::string_view text = node.Scalar();
    const auto trim = [&text] {
      while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
      while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    };
    trim();
    for (const auto& [unit, seconds] : {std::pair<std::string_view, double>{"ms", 1e-3}, {"min", 60.0}, {"s", 1.0}}) {
      if (!text.ends_with(unit)) continue;
      text.remove_suffix(unit.size());
      factor = seconds;
      break;
    }
    trim();
    value = parse_number<double>(text);
  }
  if (value && (*value > 0.0 || (zero && *value == 0.0)) && std::isfinite(*value * factor)) return *value * factor;
  mistakes.add(node, fmt::format("{}: found {}; allowed: {}", what, describe(node), allowed));
  return std::nullopt;
}

double first_round_from(double rounds) {
  const double nearest = std::round(rounds);
  return std::abs(rounds - nearest) <= 1e-9 * std::max(nearest, 1.0) ? nearest : std::ceil(rounds);
}

}  // namespace consort::script
