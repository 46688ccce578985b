#include "orchestrator/findings.hpp"

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
  constexpr std::array kWords{"holds", "fails", "refused", "note"};
  auto out = nlohmann::ordered_json::array();
  for (const Finding& finding : findings)
    out.push_back({{"verdict", kWords[static_cast<std::size_t>(finding.verdict)]},
                   {"condition", finding.condition},
                   {"evidence", finding.evidence},
                   {"consequence", finding.consequence}});
  return out;
}

std::string told(const std::vector<Finding>& findings) {
  std::size_t hold = 0;
  std::string broken;
  for (const Finding& finding : findings) {
    if (finding.verdict == Rating::holds) ++hold;
    if (finding.verdict == Rating::fails || finding.verdict == Rating::refused) broken += "; does not hold: " + in_words(finding);
  }
  return fmt::format("theory: {} condition{} hold{}{}", hold, hold == 1 ? "" : "s", hold == 1 ? "s" : "", broken);
}

void refuse_unsound(const std::vector<Finding>& findings) {
  std::string text;
  for (const Finding& finding : findings)
    if (finding.verdict == Rating::refused) text += fmt::format("\n  {}: {}", in_words(finding), finding.consequence);
  if (!text.empty()) throw ConfigError("theory refuses this experiment (`--force` runs it anyway):" + text);
}

}  // namespace consort
