#include "protocols/everybody/sensing_theory.hpp"

#include "core/counted.hpp"
#include "core/math/shapes.hpp"

#include <fmt/format.h>

#include <map>

namespace consort {

void ask_sensing_is_communicated(const TheoryCase& of, const std::vector<Values>& knowledge, Findings& out) {
  const auto support = of.experiment.schedule(of.experiment.seed).support(of.experiment.rounds);
  const std::string condition = "sensing edges are communication edges in both directions";
  for (std::size_t i = 0; i < knowledge.size(); ++i) {
    if (!knowledge[i].has("relative")) continue;
    for (const double number : knowledge[i].vector("relative")) {
      const AgentId self = agent_at(i), j{static_cast<std::uint32_t>(number)};
      for (const Edge edge : {Edge{self, j}, Edge{j, self}}) {
        if (support->has(edge)) continue;
        out.add(Rating::refused, condition,
                fmt::format("agent {} measures agent {}, but the edge {} -> {} is missing", word(self), word(j), word(edge.from),
                            word(edge.to)),
                "the two cannot settle who uses the measurement, nor hand it over (Algorithm 1: G_o is part of G_c)");
        return;
      }
    }
  }
  out.add(Rating::holds, condition, "for every agent that is measured", "both ends of an edge learn who uses it");
}

void ask_unique_ids(const TheoryCase& of, Findings& out) {
  std::map<double, AgentId> owners;
  for (std::size_t i = 0; i < of.experiment.agents; ++i) {
    const double id = of.parameters(agent_at(i)).scalar("id", static_cast<double>(i + 1));
    const auto [it, fresh] = owners.emplace(id, agent_at(i));
    if (fresh) continue;
    out.add(Rating::fails, "ids are unique", fmt::format("agents {} and {} have the id {}", word(it->second), i + 1, text_of(id)),
            "two of one layer that measure each other cannot settle who uses the measurement (Algorithm 1)");
    return;
  }
  out.add(Rating::holds, "ids are unique", counted(of.experiment.agents, "agent"), "ties between layers are settled");
}

}  // namespace consort
