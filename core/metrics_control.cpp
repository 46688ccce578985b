#include "core/metrics_control.hpp"

#include "core/minimum_energy.hpp"
#include "core/plant_task.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

namespace consort {
namespace {

constexpr std::size_t kLargestPrediction = 300;  // agents; left null vectors cost their cube
constexpr std::size_t kLargestDecay = 20;        // agents; a thousand products of matrices of twice that size

/// The graph of the whole run if there is only one, everybody hears of somebody, and it is not too large.
std::shared_ptr<const Graph> lasting_graph(const Experiment& experiment, Seed seed) {
  if (experiment.agents > kLargestPrediction) return nullptr;
  const Schedule schedule = experiment.schedule(seed);
  if (!schedule.constant() || !has_spanning_tree(*schedule.at(0))) return nullptr;
  return schedule.at(0);
}

/// The network that theory speaks of, if this run is one.
struct Network {
  std::vector<MinimumEnergyWeights> weights;
  MinimumEnergyNetwork theory;
};
std::optional<Network> network_of(const Experiment& experiment, Seed seed, const ProtocolChoice& choice) {
  const auto graph = lasting_graph(experiment, seed);
  if (choice.name != "minimum_energy_consensus" || !graph) return std::nullopt;
  Network network;
  for (std::size_t i = 0; i < experiment.agents; ++i) {
    network.weights.push_back(minimum_energy_weights(experiment.parameters_of(choice, agent_at(i))));
    if (!network.weights.back().stationary) return std::nullopt;
  }
  network.theory = minimum_energy_network(*graph, network.weights);
  return network;
}

/// [x; e] of one report, component `c` of every agent.
Vector state_and_error(const Trace& trace, std::size_t report, std::size_t c) {
  const auto n = static_cast<Eigen::Index>(trace.agents);
  Vector out(2 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const AgentId agent = agent_at(static_cast<std::size_t>(i));
    out[i] = trace.state_at(report, agent)[c];
    out[n + i] = trace.at(report, agent)[c] - out[i];
  }
  return out;
}

/// One entry per component, named name[c]; a single component is just `name`.
/// Bounds of what disturbs measurements and states; nothing if something is not bounded.
struct Bounds {
  double measurement = 0.0, state = 0.0;
};
std::optional<Bounds> disturbances_of(const Experiment& experiment, Seed seed) {
  Bounds largest;
  for (const PlantPart& part : plant_task(experiment, seed).parts) {
    Bounds sum;
    for (const Signal& signal : part.signals) {
      if (signal.kind == Signal::Kind::gaussian || signal.kind == Signal::Kind::intensity) return std::nullopt;
      (signal.on == Disturbance::On::measurement ? sum.measurement : sum.state) += signal.amplitude.cwiseAbs().maxCoeff();
    }
    largest = {std::max(largest.measurement, sum.measurement), std::max(largest.state, sum.state)};
  }
  return largest;
}

std::size_t middle(const Trace& trace) { return trace.rounds.size() / 2; }

}  // namespace

void predicted_value(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace& trace, Metrics& out) {
  if (const auto network = network_of(experiment, seed, choice)) {
    Vector value(static_cast<Eigen::Index>(trace.state_dimension));
    for (std::size_t c = 0; c < trace.state_dimension; ++c)
      value[static_cast<Eigen::Index>(c)] = network->theory.left.dot(state_and_error(trace, 0, c));
    put(out, "predicted_value", value);
    return;
  }
  if (choice.name != "local_voting" && choice.name != "measured_consensus") return;
  const auto graph = lasting_graph(experiment, seed);
  if (!graph) return;
  const Eigen::Map<const Matrix> start(trace.agreed_at(0).data(), static_cast<Eigen::Index>(trace.agreed_dimension()),
                                       static_cast<Eigen::Index>(trace.agents));
  put(out, "predicted_value", start * left_null_vector(*graph));
}

void leader_error(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace& trace, Metrics& out) {
  if (!trace.agrees_on_states && choice.name != "local_voting") return;
  const Graph support = experiment.schedule(seed).support(experiment.rounds);
  std::optional<Eigen::Index> leader;
  for (std::size_t i = 0; i < trace.agents; ++i) {
    if (support.in_degree(agent_at(i)) > 0) continue;
    if (leader) return;
    leader = static_cast<Eigen::Index>(i);
  }
  if (!leader || trace.agents < 2) return;
  const Eigen::Map<const Matrix> end(trace.agreed_at(trace.rounds.size() - 1).data(), static_cast<Eigen::Index>(trace.agreed_dimension()),
                                     static_cast<Eigen::Index>(trace.agents));
  double largest = 0.0;
  for (Eigen::Index i = 0; i < end.cols(); ++i)
    if (!is_absent(end(0, i))) largest = std::max(largest, (end.col(i) - end.col(*leader)).norm());
  out["leader_error"] = largest;
}

void coherence(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  if (!trace.agrees_on_states) return;
  double sum = 0.0;
  for (std::size_t report = middle(trace); report < trace.rounds.size(); ++report) {
    const Eigen::Map<const Matrix> all(trace.agreed_at(report).data(), static_cast<Eigen::Index>(trace.agreed_dimension()),
                                       static_cast<Eigen::Index>(trace.agents));
    std::vector<Eigen::Index> present;
    for (Eigen::Index i = 0; i < all.cols(); ++i)
      if (!is_absent(all(0, i))) present.push_back(i);
    const Matrix states = all(Eigen::all, present);
    if (states.cols() > 0) sum += (states.colwise() - states.rowwise().mean()).squaredNorm();
  }
  out["coherence"] = sum / static_cast<double>(trace.rounds.size() - middle(trace));
}

void agreement_deviation(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace& trace, Metrics& out) {
  if (trace.state_dimension != 1) return;
  const auto network = network_of(experiment, seed, choice);
  if (!network) return;
  double largest = 0.0;
  for (std::size_t report = middle(trace); report < trace.rounds.size(); ++report)
    largest = std::max(largest, network->theory.deviation(state_and_error(trace, report, 0)).norm());
  out["agreement_deviation"] = largest;
}

void agreement_deviation_bound(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace& trace, Metrics& out) {
  if (trace.state_dimension != 1 || trace.agents < 2 || trace.agents > kLargestDecay) return;
  const auto network = network_of(experiment, seed, choice);
  const auto bounds = network ? disturbances_of(experiment, seed) : std::nullopt;
  if (!bounds) return;
  const auto [decay, overshoot] = decay_of(network->theory);
  const double a = decay, b = overshoot;  // a lambda does not capture what is bound
  const double start = network->theory.deviation(state_and_error(trace, 0, 0)).norm();
  const double push = disturbance_bound(network->theory, network->weights, bounds->measurement, bounds->state);
  // b |deviation(0)| e^(-a t) + (b phi_max / a) (1 - e^(-a t)): monotone, so it is largest at one end of the interval        (28)
  const auto at = [&](Round k) {
    const double left = std::exp(-a * experiment.dt * static_cast<double>(k));
    return b * start * left + b * push / a * (1.0 - left);
  };
  out["agreement_deviation_bound"] = std::max(at(trace.rounds[middle(trace)]), at(trace.rounds.back()));
}

}  // namespace consort
