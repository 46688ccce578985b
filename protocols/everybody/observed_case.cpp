#include "protocols/everybody/observed_case.hpp"

#include "core/errors.hpp"
#include "protocols/everybody/acyclic_graph.hpp"

#include <algorithm>
#include <cmath>

namespace consort {
namespace {

std::string suffix(AgentId j) { return "_" + std::to_string(j.value); }

std::vector<AgentId> agents_there(const Experiment& experiment, Round k) {
  std::vector<AgentId> out;
  for (std::size_t i = 0; i < experiment.agents; ++i)
    if (experiment.presence_of(agent_at(i)).holds(k)) out.push_back(agent_at(i));
  return out;
}

// Place of an agent among the members; their number if it is not one.
std::size_t place_of(const std::vector<AgentId>& members, AgentId j) {
  const auto it = std::lower_bound(members.begin(), members.end(), j);
  return it != members.end() && *it == j ? static_cast<std::size_t>(it - members.begin()) : members.size();
}

// Lets the members' own algorithm decide, on ideal communication.
void settle_sensing(const Experiment& experiment, const ProtocolChoice& choice, const std::vector<Values>& knowledge, ObservedCase& out) {
  const std::size_t m = out.members.size();
  std::vector<AcyclicSensing> agents;
  std::vector<std::vector<char>> measures(m, std::vector<char>(m, 0));
  for (std::size_t i = 0; i < m; ++i) {
    const AgentId self = out.members[i];
    const Values& known = knowledge[index_of(self)];
    const double id = experiment.parameters_of(choice, self).scalar("id", static_cast<double>(self.value));
    agents.emplace_back(agent_at(i), m, id, known.has("absolute"), 0);
    if (!known.has("relative")) continue;
    for (const double j : known.vector("relative")) {
      const std::size_t other = place_of(out.members, AgentId{static_cast<std::uint32_t>(j)});
      if (other < m) measures[i][other] = 1;
    }
  }
  const Graph everybody = complete(m);
  for (Round k = 0; k <= 2 * m + 1; ++k) {
    std::vector<AcyclicSensing::Says> said;
    for (const AcyclicSensing& agent : agents) said.push_back(agent.says());
    for (std::size_t i = 0; i < m; ++i) {
      std::vector<AcyclicSensing::Told> heard;
      for (const Neighbour& j : everybody.in_neighbours(agent_at(i)))
        heard.push_back({j.id, said[index_of(j.id)], measures[index_of(j.id)][i] != 0});
      agents[i].absorb(k, everybody.in_neighbours(agent_at(i)), measures[i], heard);
    }
  }
  for (std::size_t i = 0; i < m; ++i) {
    check(agents[i].done(), "DAGC ends within twice as many rounds as there are agents");
    out.layers.push_back(agents[i].layer());
    for (std::size_t j = 0; j < m; ++j)
      if (agents[i].use(agent_at(j)) == AcyclicSensing::Use::mine) out.uses.push_back({out.members[j], out.members[i]});
  }
}

// C and F of one agent that localises: minus its output against each of `from` and, if it has one, against the origin.
void localise(const Matrix& C, const Matrix& F, const std::vector<std::size_t>& from, bool absolute, ObservedAgent& agent) {
  const Eigen::Index p = C.rows(), n = C.cols();
  const auto channels = static_cast<Eigen::Index>(from.size()) + (absolute ? 1 : 0);
  agent.C = (-C).replicate(channels, 1);
  agent.F = F.replicate(1, channels).eval();  // F may be agent.F
  if (channels == 0) {
    agent.C.resize(0, n);
    agent.F.resize(n, 0);
  }
  for (std::size_t s = 0; s < from.size(); ++s) {
    Matrix C_il = Matrix::Zero(channels * p, n);
    C_il.middleRows(static_cast<Eigen::Index>(s) * p, p) = C;
    agent.C_from[agent_at(from[s])] = C_il;
  }
}

}  // namespace

ObservedCase observed_case(ObserverTask task, const Experiment& experiment, const ProtocolChoice& choice,
                           const std::vector<Values>& knowledge, const Graph& communication, Round k) {
  ObservedCase out;
  out.members = agents_there(experiment, k);
  out.system.communication = part_of(communication, out.members);
  const bool localises = task == ObserverTask::localise;
  if (task != ObserverTask::observe) settle_sensing(experiment, choice, knowledge, out);
  if (task == ObserverTask::settle) return out;
  for (std::size_t i = 0; i < out.members.size(); ++i) {
    const AgentId self = out.members[i];
    const std::string who = "protocol " + choice.name + ": agent " + std::to_string(self.value);
    const Values& known = knowledge[index_of(self)];
    const Values parameters = experiment.parameters_of(choice, self);
    const Matrix* A = known.find("A");
    const Matrix* B = known.find("B");
    const Matrix* C = known.find("C");
    if (A == nullptr || B == nullptr || C == nullptr)
      throw ConfigError(who + " does not know its dynamics and outputs; allowed: a linear plant model (A, B, C)");
    ObservedAgent agent{*A, *B, *C, observer_gain(parameters, A->rows(), C->rows(), who)};
    for (std::size_t l = 0; l < out.members.size(); ++l) {
      if (const Matrix* A_l = known.find("A" + suffix(out.members[l]))) agent.A_from[agent_at(l)] = *A_l;
      if (const Matrix* C_l = known.find("C" + suffix(out.members[l])); C_l != nullptr && !localises) agent.C_from[agent_at(l)] = *C_l;
    }
    if (localises) {
      std::vector<std::size_t> from;
      for (const Edge& edge : out.uses)
        if (edge.to == self) from.push_back(place_of(out.members, edge.from));
      localise(*C, agent.F, from, known.has("absolute"), agent);
    }
    out.mu.push_back(coupling_gain(parameters, experiment.agents, *A, who));
    out.inputs.push_back(input_law(parameters, B->cols(), who));
    out.inputs_known = out.inputs_known && inputs_known(parameters);
    if (i == 0) {
      out.system.weights = consensus_weights(parameters);
      out.system.scheme = sampled_scheme(parameters);
    }
    out.system.agents.push_back(std::move(agent));
  }
  out.system.mu = *std::min_element(out.mu.begin(), out.mu.end());
  return out;
}

}  // namespace consort
