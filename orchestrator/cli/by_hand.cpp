#include "orchestrator/cli/by_hand.hpp"

#include "core/counted.hpp"
#include "core/id_list.hpp"
#include "orchestrator/run/placement.hpp"

#include <fmt/format.h>

#include <string_view>

namespace consort {
namespace {

constexpr double kWaitByHand = 60.0;  // s, as the line to enter says it: what consort-agent takes without being told

// As one word of a shell's line.
std::string shell_word(const std::string& text) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.:/@%+=,";
  if (text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? "'\\''" : std::string(1, c);
  return word + "'";
}

}  // namespace

std::vector<std::string> commands_by_hand(const Experiment& experiment, const RunOptions& options) {
  constexpr std::size_t kMost = 20;
  std::vector<std::string> lines;
  const std::string common = fmt::format("--run {} --domain {} --interface {} --wait {:g}", shell_word(options.run_name), options.domain,
                                         options.interface, kWaitByHand);
  const std::string key = fmt::format("{}={}", kRunKeyVariable, shell_word(options.key));
  if (options.external_plant) lines.push_back(fmt::format("waiting for the plant: {} consort-plant {}", key, common));
  if (options.external.empty()) return lines;
  std::size_t processes = 0;
  std::string others;
  for (const ProcessPlan& process : processes_of(experiment)) {
    if (!options.by_hand(process.agents)) continue;
    std::vector<std::uint32_t> ids;
    for (const AgentId agent : process.agents) ids.push_back(agent.value);
    const std::string text = to_text(ids);
    if (++processes <= kMost)
      lines.push_back(fmt::format("waiting for {} {}: {} consort-agent --ids {} {}", noun(ids.size(), "agent"), text, key, text, common));
    else
      others += (others.empty() ? "" : ", ") + ("--ids " + text);
  }
  if (!others.empty()) lines.push_back(fmt::format("waiting for {} more, likewise: {}", processes - kMost, others));
  return lines;
}

}  // namespace consort
