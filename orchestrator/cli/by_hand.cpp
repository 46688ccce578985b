#include "orchestrator/cli/by_hand.hpp"

#include "core/counted.hpp"
#include "core/id_list.hpp"
#include "orchestrator/run/commands.hpp"
#include "orchestrator/run/processes.hpp"
#include "orchestrator/run/spread.hpp"

#include <fmt/format.h>

namespace consort {

std::vector<std::string> commands_by_hand(const Experiment& experiment, const RunOptions& options, const Placement& placement,
                                          const Wiring& wiring) {
  constexpr std::size_t kMost = 20;  // where all lines are alike but for the ids
  std::vector<std::string> lines;
  const Processes processes(experiment, placement, options);
  const std::string key = shell_word(options.key);
  std::size_t agents = 0;
  std::string others;
  if (experiment.plant && processes[placement.processes.size()].external)
    lines.push_back("waiting for the plant: " + line_by_hand(options, placement, wiring, placement.processes.size(), key));
  for (std::size_t p = 0; p < placement.processes.size(); ++p) {
    const ProcessState& process = processes[p];
    if (!process.external) continue;
    std::vector<std::uint32_t> ids;
    for (const AgentId agent : process.agents) ids.push_back(agent.value);
    const std::string text = to_text(ids);
    const std::string where = process.host == kHere ? "" : " on " + options.hosts[process.host].name;
    if (++agents <= kMost || wiring.neighbours)
      lines.push_back(
          fmt::format("waiting for {} {}{}: {}", noun(ids.size(), "agent"), text, where, line_by_hand(options, placement, wiring, p, key)));
    else
      others += (others.empty() ? "" : ", ") + ("--ids " + text);
  }
  if (!others.empty()) lines.push_back(fmt::format("waiting for {} more, likewise: {}", agents - kMost, others));
  return lines;
}

}  // namespace consort
