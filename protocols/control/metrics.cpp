#include "protocols/control/metrics.hpp"

#include "core/plant_task.hpp"
#include "protocols/control/minimum_energy.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

namespace consort {
namespace {

constexpr std::size_t kLargestDecay = 20;  // agents; a thousand products of matrices of twice that size

// The network that theory speaks of, if this run is one.
struct Network {
  std::vector<MinimumEnergyWeights> weights;
  MinimumEnergyNetwork theory;
};
std::optional<Network> network_of(const Experiment& experiment, Seed seed, const ProtocolChoice& choice) {
  const auto graph = lasting_graph(experiment, seed);
  if (!graph) return std::nullopt;
  Network network;
  for (std::size_t i = 0; i < experiment.agents; ++i) {
    network.weights.push_back(minimum_energy_weights(experiment.parameters_of(choice, agent_at(i))));
    if (!network.weights.back().stationary) return std::nullopt;
  }
  network.theory = minimum_energy_network(*graph, network.weights);
  return network;
}

std::optional<Network> network_of(const PlannedRun& run) { return network_of(run.experiment, run.experiment.seed, run.choice); }

// [x; e] of one report, component `c` of every agent.
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

// Bounds of what disturbs measurements and states; nothing if something is not bounded.
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

void minimum_energy_value(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace& trace, Metrics& out) {
  const auto network = network_of(experiment, seed, choice);
  if (!network) return;
  Vector value(static_cast<Eigen::Index>(trace.state_dimension));
  for (std::size_t c = 0; c < trace.state_dimension; ++c)
    value[static_cast<Eigen::Index>(c)] = network->theory.left.dot(state_and_error(trace, 0, c));
  put(out, "predicted_value", value);
}
void minimum_energy_value_names(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (network_of(run)) put_names(out, name, run.trace.state_dimension);
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

void agreement_deviation_name(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (run.trace.state_dimension == 1 && network_of(run)) out.emplace(name);
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

void agreement_deviation_bound_name(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (run.trace.state_dimension != 1 || run.trace.agents < 2 || run.trace.agents > kLargestDecay) return;
  if (network_of(run) && disturbances_of(run.experiment, run.experiment.seed)) out.emplace(name);
}

}  // namespace consort
