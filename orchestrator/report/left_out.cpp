#include "orchestrator/report/left_out.hpp"

#include "core/counted.hpp"
#include "rounds/simulate.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace consort {

std::vector<std::string> left_out_of_record(const Experiment& experiment) {
  std::vector<std::string> lines;
  if (experiment.recording.state) return lines;
  std::vector<std::string> seen;
  for (const ProtocolChoice& choice : experiment.protocols) {
    if (std::find(seen.begin(), seen.end(), choice.name) != seen.end()) continue;  // the values of a sweep
    seen.push_back(choice.name);
    // Layouts do not depend on the agent, so agent 1 stands for all.
    const Layout all = AgentMaker(experiment, choice, experiment.seed).make(agent_at(0))->recorded_layout();
    const std::size_t kept = recorded_part(all, experiment.recording.state).fields.size();
    std::string names;
    std::size_t numbers = 0;
    for (std::size_t i = kept; i < all.fields.size(); ++i) {
      names += (names.empty() ? "" : ", ") + all.fields[i].name;
      numbers += all.fields[i].size();
    }
    if (numbers > 0)
      lines.push_back(fmt::format("not in the record: {} of {}, {} of each agent; `record: {{state: true}}` in the experiment records them",
                                  names, choice.name, counted(numbers, "number")));
  }
  return lines;
}

}  // namespace consort
