#include "orchestrator/script/lookalikes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace consort::script {
namespace {

constexpr std::string_view kSpace = "a plain space", kBreak = "a plain end of line", kQuotes = "plain quotes, \" or '";
constexpr std::array kLookalikes{
    Lookalike{"\u00a0", "a no-break space (U+00A0)", kSpace},
    Lookalike{"\u2002", "an en space (U+2002)", kSpace},
    Lookalike{"\u2003", "an em space (U+2003)", kSpace},
    Lookalike{"\u2007", "a figure space (U+2007)", kSpace},
    Lookalike{"\u2009", "a thin space (U+2009)", kSpace},
    Lookalike{"\u200b", "a zero-width space (U+200B)", kSpace},
    Lookalike{"\u202f", "a narrow no-break space (U+202F)", kSpace},
    Lookalike{"\u3000", "an ideographic space (U+3000)", kSpace},
    Lookalike{"\ufeff", "a byte order mark (U+FEFF) within the text", "at its beginning only"},
    Lookalike{"\u0085", "a next-line character (U+0085)", kBreak},
    Lookalike{"\u2028", "a line separator (U+2028)", kBreak},
    Lookalike{"\u2029", "a paragraph separator (U+2029)", kBreak},
    Lookalike{"\u201c", "a curly quotation mark (U+201C)", kQuotes},
    Lookalike{"\u201d", "a curly quotation mark (U+201D)", kQuotes},
    Lookalike{"\u201e", "a low quotation mark (U+201E)", kQuotes},
    Lookalike{"\u2018", "a curly quotation mark (U+2018)", kQuotes},
    Lookalike{"\u2019", "a curly quotation mark (U+2019)", kQuotes},
    Lookalike{"\uff1a", "a full-width colon (U+FF1A)", "a plain colon and a space, ': '"},
    Lookalike{"\uff0c", "a full-width comma (U+FF0C)", "a plain comma, ','"},
    Lookalike{"\uff3b", "a full-width bracket (U+FF3B)", "a plain '['"},
    Lookalike{"\uff3d", "a full-width bracket (U+FF3D)", "a plain ']'"},
    Lookalike{"\uff5b", "a full-width brace (U+FF5B)", "a plain '{'"},
    Lookalike{"\uff5d", "a full-width brace (U+FF5D)", "a plain '}'"},
    Lookalike{"\u2212", "a minus sign (U+2212)", "a plain '-'"},
    Lookalike{"\u2013", "a dash (U+2013)", "a plain '-'"},
};

}  // namespace

const Lookalike* lookalike_at(std::string_view text) {
  if (text.empty() || static_cast<unsigned char>(text.front()) < 0x80) return nullptr;
  const auto it =
      std::find_if(kLookalikes.begin(), kLookalikes.end(), [text](const Lookalike& each) { return text.starts_with(each.bytes); });
  return it == kLookalikes.end() ? nullptr : &*it;
}

bool any_lookalike(std::string_view text) {
  for (; !text.empty(); text.remove_prefix(1))
    if (lookalike_at(text) != nullptr) return true;
  return false;
}

void report_lookalike(std::string_view text, const YAML::Mark& mark, Mistakes& mistakes) {
  bool comment = false;
  for (auto at = static_cast<std::size_t>(mark.pos); at < text.size(); ++at) {
    if (text[at] == '\n') comment = false;
    if (text[at] == '#' && (at == 0 || text[at - 1] == ' ' || text[at - 1] == '\t' || text[at - 1] == '\n')) comment = true;
    const Lookalike* found = comment ? nullptr : lookalike_at(text.substr(at));
    if (found == nullptr) continue;
    mistakes.add(mark_of(text, at), fmt::format("found {}; allowed: {}", found->name, found->allowed));
    return;
  }
}

bool report_bytes(std::string_view text, Mistakes& mistakes) {
  if (const auto at = first_byte_not_utf8(text)) {
    const bool wide = text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff");
    mistakes.add(mark_of(text, *at), fmt::format("found {}; allowed: text in UTF-8", wide ? "text in UTF-16" : "a byte that is not UTF-8"));
    return true;
  }
  const auto control = [](char c) { return (c >= 0 && c < ' ' && c != '\t' && c != '\n' && c != '\r') || c == '\x7f'; };
  const auto it = std::find_if(text.begin(), text.end(), control);
  if (it == text.end()) return false;
  mistakes.add(mark_of(text, static_cast<std::size_t>(it - text.begin())),
               fmt::format("found the control character U+{:04X}; allowed: text", static_cast<unsigned>(*it)));
  return true;
}

YAML::Mark mark_at(std::size_t line, std::size_t column) {
  YAML::Mark mark;
  mark.line = static_cast<int>(line);
  mark.column = static_cast<int>(column);
  return mark;
}

YAML::Mark mark_of(std::string_view text, std::size_t position) {
  const std::string_view before = text.substr(0, position);
  const auto lines = static_cast<std::size_t>(std::count(before.begin(), before.end(), '\n'));
  return mark_at(lines, position - (lines == 0 ? 0 : before.rfind('\n') + 1));
}

}  // namespace consort::script
