#include "orchestrator/script/slips.hpp"

#include "core/counted.hpp"
#include "orchestrator/script/lookalikes.hpp"
#include "orchestrator/script/skeleton.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace consort::script {
namespace {

constexpr auto kNowhere = std::string_view::npos;

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = std::min(text.find_first_not_of(" \t"), text.size());
  const std::size_t end = text.find_last_not_of(" \t");
  return end == kNowhere ? std::string_view() : text.substr(begin, end + 1 - begin);
}

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-'; }

struct Slip {
  std::size_t column;  // in the text
  std::string text;
};

// What keeps `entry` ("rounds:50") from being a key and a value.
std::optional<Slip> entry_slip(std::string_view entry) {
  const std::size_t begin = entry.starts_with('"') || entry.starts_with('\'') ? 1 : 0;
  std::size_t end = begin;
  while (end < entry.size() && is_letter(entry[end])) ++end;
  if (end == begin || end == entry.size()) return std::nullopt;
  const std::string key(entry.substr(0, end + begin));
  const std::size_t sign = entry.find_first_not_of(' ', end + begin);
  if (sign == kNowhere) return std::nullopt;
  const bool equals = entry[sign] == '=', colon = entry[sign] == ':';
  const std::string value = shown(trimmed(entry.substr(sign + (equals || colon ? 1 : 0))));
  if (value.empty() || (!equals && !colon && sign == end + begin)) return std::nullopt;
  if (colon) return Slip{sign, fmt::format("found '{0}:{1}' without a space after the colon; allowed: '{0}: {1}'", key, value)};
  if (equals) return Slip{sign, fmt::format("found '=' after '{0}'; allowed: a colon and a space, '{0}: {1}'", key, value)};
  return Slip{0, fmt::format("found '{0} {1}', which has no colon; allowed: '{0}: {1}'", key, value)};
}

// A line that is not blank, as far as its indentation and its first key go.
struct Line {
  std::size_t number;
  std::string_view text;         // of the skeleton, without what is blank at its end
  std::size_t indent, key;       // columns of the first character, and of the first behind a list's dashes
  std::size_t colon = kNowhere;  // behind the key, outside brackets and quotes

  Line(std::size_t line, std::string_view skeleton) : number(line), text(skeleton.substr(0, skeleton.find_last_not_of(" \t") + 1)) {
    indent = key = text.find_first_not_of(" \t");
    while (text.substr(key).starts_with("- ")) key = text.find_first_not_of(' ', key + 1);
    for (std::size_t at = key; at < text.size() && text[at] != '[' && text[at] != '{'; ++at) {
      if (text[at] != ':' || (at + 1 < text.size() && text[at + 1] != ' ' && text[at + 1] != '\t')) continue;
      colon = at;
      return;
    }
  }

  [[nodiscard]] bool is_item() const { return indent < text.size() && text[indent] == '-' && (key > indent || text.size() == indent + 1); }
  [[nodiscard]] bool has_value() const {
    const std::string_view value = colon == kNowhere ? text.substr(key) : trimmed(text.substr(colon + 1));
    return !value.empty() && value.front() != '&' && value.front() != '!';
  }
};

class Structure {
 public:
  Structure(std::string_view text, const Skeleton& skeleton, std::size_t wrong) : text_(text) {
    for (std::size_t i = 0; i < skeleton.lines.size() && i <= wrong; ++i) {
      const SkeletonLine& line = skeleton.lines[i];
      if (!line.within_brackets && !trimmed(line.text).empty()) lines_.emplace_back(i, line.text);
    }
  }

  // Adds what is wrong in the last line, or in those before it.
  bool explain(const YAML::ParserException& error, Mistakes& mistakes) const {
    if (lines_.empty()) return false;
    return no_entry(mistakes) || too_deep(mistakes) || between(error, mistakes) || second_colon(error, mistakes);
  }

 private:
  [[nodiscard]] std::string original(const Line& line, std::size_t from) const {
    std::size_t begin = 0;
    for (std::size_t i = 0; i < line.number; ++i) begin = text_.find('\n', begin) + 1;
    return std::string(text_.substr(begin + from, line.text.size() - from));
  }

  // Lines before (or the last itself) that stand like a key's, and are none.
  bool no_entry(Mistakes& mistakes) const {
    const Line* found = nullptr;
    for (std::size_t i = lines_.size(); i-- > 0;) {
      const Line& line = lines_[i];
      const bool last = i + 1 == lines_.size();
      if (!last && (line.colon != kNowhere || line.key > lines_.back().key)) break;
      if (line.colon == kNowhere && !line.is_item() && entry_slip(original(line, line.key))) found = &line;
    }
    if (found == nullptr) return false;
    const Slip slip = *entry_slip(original(*found, found->key));
    mistakes.add(mark_at(found->number, found->key + slip.column), slip.text);
    return true;
  }

  // A line deeper than one before it that has its value already.
  bool too_deep(Mistakes& mistakes) const {
    if (lines_.size() < 2) return false;
    const Line &last = lines_.back(), &before = lines_[lines_.size() - 2];
    if (last.indent <= before.key || !before.has_value()) return false;
    mistakes.add(
        mark_at(last.number, last.indent),
        fmt::format(
            "found a line that is indented further than line {}, which has a value already; allowed: {} as there, or no value there",
            before.number + 1, counted(last.is_item() ? before.indent : before.key, "space")));
    return true;
  }

  // A line whose indentation lies between those of the lines it could belong with.
  bool between(const YAML::ParserException& error, Mistakes& mistakes) const {
    if (error.msg != YAML::ErrorMsg::END_OF_MAP && error.msg != YAML::ErrorMsg::END_OF_SEQ) return false;
    const Line& last = lines_.back();
    const Line* deeper = nullptr;
    std::size_t least = kNowhere;
    for (std::size_t i = lines_.size() - 1; i-- > 0;) {
      const Line& line = lines_[i];
      for (const std::size_t column : {line.key, line.indent}) {
        if (column >= least) continue;
        least = column;
        if (column == last.indent) return false;
        if (column < last.indent) return deeper != nullptr && say_between(mistakes, *deeper, line, column);
        deeper = &line;
      }
    }
    return false;
  }
  bool say_between(Mistakes& mistakes, const Line& deeper, const Line& outer, std::size_t column) const {
    const Line& last = lines_.back();
    mistakes.add(
        mark_at(last.number, last.indent),
        fmt::format("found an indentation of {}, which no line has that this one could belong with; allowed: {} as line {}, or {} as "
                    "line {}",
                    last.indent, deeper.indent, deeper.number + 1, column, outer.number + 1));
    return true;
  }

  bool second_colon(const YAML::ParserException& error, Mistakes& mistakes) const {
    const Line& last = lines_.back();
    if (error.msg != YAML::ErrorMsg::MAP_VALUE || last.colon == kNowhere || static_cast<std::size_t>(error.mark.column) <= last.colon)
      return false;
    mistakes.add(error.mark,
                 "found a second colon in the line; allowed: one key in a line, several in braces as {a: 1, b: 2}, and a text "
                 "with ': ' in quotes");
    return true;
  }

  std::string_view text_;
  std::vector<Line> lines_;
};

// A tab in the indentation of the line or of that before it.
bool explain_tab(const std::vector<SkeletonLine>& lines, std::size_t line, Mistakes& mistakes) {
  for (const std::size_t at : {line, line - 1}) {
    if (at >= lines.size()) continue;
    const std::size_t tab = lines[at].text.find('\t');
    if (tab >= lines[at].text.find_first_not_of(" \t-?")) continue;
    mistakes.add(mark_at(at, tab), "found a tab in the indentation; allowed: spaces");
    return true;
  }
  return false;
}

bool explain_lookalike(const std::vector<SkeletonLine>& lines, std::size_t last, Mistakes& mistakes) {
  for (std::size_t i = 0; i < lines.size() && i <= last; ++i) {
    const std::string_view text = lines[i].text;
    for (std::size_t at = 0; at < text.size(); ++at) {
      const Lookalike* found = lookalike_at(text.substr(at));
      if (found == nullptr) continue;
      mistakes.add(mark_at(i, at), fmt::format("found {}; allowed: {}", found->name, found->allowed));
      return true;
    }
  }
  return false;
}

// What the library's own words become where they are near the place.
std::string in_our_words(std::string_view text, const YAML::ParserException& error) {
  const auto at = static_cast<std::size_t>(std::max(0, error.mark.pos));
  const std::string_view rest = at < text.size() ? text.substr(at) : std::string_view();
  const std::string word = shown(rest.substr(0, rest.find_first_of(" \t\n,]}")));
  if (error.msg == YAML::ErrorMsg::UNKNOWN_TOKEN && !rest.empty())
    return fmt::format("found '{}' at the beginning of a text, where it means something to YAML; allowed: such a text in quotes",
                       rest.front());
  if (error.msg == YAML::ErrorMsg::UNKNOWN_ANCHOR)
    return fmt::format("found the alias '{}' of nothing before it; allowed: an alias of what is marked with '&' above", word);
  return "found text that is not YAML: " + error.msg + "; allowed: YAML 1.2";
}

void check_entry(const YAML::Node& key, Mistakes& mistakes) {
  const auto slip = entry_slip(key.Scalar());
  if (!slip || key.Tag() == "!") return;
  mistakes.add(mark_at(static_cast<std::size_t>(key.Mark().line), static_cast<std::size_t>(key.Mark().column) + slip->column), slip->text);
}

}  // namespace

void explain(std::string_view text, const YAML::ParserException& error, Mistakes& mistakes) {
  const Skeleton skeleton = skeleton_of(text);
  const auto line = static_cast<std::size_t>(std::max(0, error.mark.line));
  if (explain_lookalike(skeleton.lines, line, mistakes) || explain_tab(skeleton.lines, line, mistakes)) return;
  const auto& unbalanced = skeleton.unbalanced;
  if (unbalanced && static_cast<std::size_t>(unbalanced->mark.line) <= line) return mistakes.add(unbalanced->mark, unbalanced->text);
  if (Structure(text, skeleton, line).explain(error, mistakes)) return;
  mistakes.add(error.mark, in_our_words(text, error));
}

void check_keys(const YAML::Node& document, Mistakes& mistakes) {
  if (document.IsSequence())
    for (const auto& entry : document) check_keys(entry, mistakes);
  if (!document.IsMap()) return;
  for (const auto& entry : document) {
    if (entry.first.IsScalar() && entry.second.IsNull()) check_entry(entry.first, mistakes);
    check_keys(entry.second, mistakes);
  }
}

}  // namespace consort::script
