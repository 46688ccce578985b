#include "orchestrator/report/findings.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"

#include <fmt/format.h>

#include <array>

namespace consort {
namespace {

std::string in_words(const Finding& finding) {
  return finding.evidence.empty() ? finding.condition : fmt::format("{} ({})", finding.condition, finding.evidence);
}

}  // namespace

nlohmann::ordered_json to_json(const std::vector<Finding>& findings) {
  constexpr std::array kWords{"holds", "fails", "refused", "note", "left_out"};
  auto out = nlohmann::ordered_json::array();
  for (const Finding& finding : findings)
    out.push_back({{"verdict", kWords[static_cast<std::size_t>(finding.verdict)]},
                   {"condition", finding.condition},
                   {"evidence", finding.evidence},
                   {"consequence", finding.consequence}});
  return out;
}

std::vector<std::string> told(const std::vector<Finding>& findings, bool count, const TextStyle& style) {
  std::vector<std::string> lines;
  std::size_t hold = 0;
  std::string left_out;
  for (const Finding& finding : findings) {
    if (finding.verdict == Rating::holds) ++hold;
    if (finding.verdict == Rating::left_out) left_out += (left_out.empty() ? "" : "; ") + in_words(finding);
    if (finding.verdict == Rating::fails || finding.verdict == Rating::refused)
      lines.push_back(fmt::format("{} {}: {}", toned(style.unicode ? "✗" : "!", Tone::bad, style), in_words(finding), finding.consequence));
  }
  if (count) lines.insert(lines.begin(), fmt::format("theory: {} hold{}", counted(hold, "condition"), hold == 1 ? "s" : ""));
  if (!left_out.empty())
    lines.push_back(fmt::format("theory: not examined, so that the run begins soon: {} (`consort validate` takes longer)", left_out));
  return lines;
}

void refuse_unsound(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& finding : findings)
    if (finding.verdict == Rating::refused) text += fmt::format("\n  {}: {}", in_words(finding), finding.consequence);
  if (!text.empty()) throw ConfigError("theory refuses this experiment (`--force` runs it anyway):" + text);
}

}  // namespace consort
