#include "protocols/everybody/metrics.hpp"

#include "core/math/decompositions.hpp"
#include "core/math/schur.hpp"
#include "models/physics.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace consort {
namespace {

constexpr Eigen::Index kMostComponents = 100;  // error components; a thousand products and spectra of that size

struct Size {
  double error = 0.0, truth = 0.0;
};
// |E| and the norm of the truth behind it in one report.
Size error_at(const Trace& trace, std::size_t report) {
  const std::size_t slot = trace.dimension / (trace.agents + 1);
  double error = 0.0, truth = 0.0;
  for (std::size_t i = 0; i < trace.agents; ++i) {
    const auto estimate = trace.at(report, agent_at(i));
    for (std::size_t j = 0; j <= trace.agents; ++j) {  // the last one is bar_i
      const auto state = trace.state_at(report, j < trace.agents ? agent_at(j) : agent_at(i));
      for (std::size_t c = 0; c < slot; ++c) {
        const double x = state[c], hat = estimate[j * slot + c];
        if (is_absent(x) || is_absent(hat)) continue;
        error += (hat - x) * (hat - x);
        truth += x * x;
      }
    }
  }
  return {std::sqrt(error), std::sqrt(truth)};
}

}  // namespace

void observer_error(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  const Size final = error_at(trace, trace.rounds.size() - 1);
  out["observer_error"] = final.error;
  out["observer_error_relative"] = final.error / final.truth;
}

void observer_error_peak(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  double largest = 0.0;
  for (std::size_t report = trace.rounds.size() / 2; report < trace.rounds.size(); ++report)
    largest = std::max(largest, error_at(trace, report).error);
  out["observer_error_peak"] = largest;
}

void observer_error_names(std::string_view name, const PlannedRun&, MetricNames& out) {
  out.emplace(name);
  out.insert(std::string(name) + "_relative");
}

namespace {

// The whole run as one system whose errors decay, where (19) speaks of it.
std::optional<ObservedCase> bounded_case(ObserverTask task, const Experiment& experiment, Seed seed, const ProtocolChoice& choice) {
  if (!experiment.presence.empty() || !experiment.plant) return std::nullopt;
  const Schedule schedule = experiment.schedule(seed);
  const Physics physics(plant_task(experiment, seed));
  if (!schedule.constant() || physics.shared()) return std::nullopt;
  std::vector<Values> knowledge;
  for (std::size_t i = 0; i < experiment.agents; ++i) {
    knowledge.push_back(physics.knowledge(agent_at(i)));
    for (const char* matrix : {"A", "B", "C"})
      if (!knowledge.back().has(matrix)) return std::nullopt;
  }
  ObservedCase observed = observed_case(task, experiment, choice, knowledge, *schedule.at(0), 0);
  if (observed.inputs_known || observed.system.error_size() > kMostComponents) return std::nullopt;
  if (!(spectral_abscissa(error_matrix(observed.system)) < 0.0)) return std::nullopt;
  return observed;
}

}  // namespace

template <ObserverTask task>
void observer_bound(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace&, Metrics& out) {
  const auto observed = bounded_case(task, experiment, seed, choice);
  const auto decay = observed ? error_decay(error_matrix(observed->system)) : std::nullopt;
  if (!decay) return;
  double input_norm = 0.0, ubar = 0.0;
  std::vector<double> amplitudes;
  for (std::size_t i = 0; i < observed->inputs.size(); ++i) {
    const Vector amplitude = observed->inputs[i].amplitude.cwiseAbs();
    input_norm = std::max(input_norm, spectral_norm(observed->system.agents[i].B));
    ubar = std::max(ubar, amplitude.size() > 0 ? amplitude.maxCoeff() : 0.0);
    amplitudes.insert(amplitudes.end(), amplitude.begin(), amplitude.end());
  }
  out["observer_bound"] = ultimate_bound(*decay, input_norm, ubar);
  const Vector all = Eigen::Map<const Vector>(amplitudes.data(), static_cast<Eigen::Index>(amplitudes.size()));
  out["observer_bound_stacked"] = ultimate_bound(*decay, spectral_norm(unknown_input_matrix(observed->system)), all.norm());
}

template <ObserverTask task>
void observer_bound_names(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (!bounded_case(task, run.experiment, run.experiment.seed, run.choice)) return;
  out.emplace(name);
  out.insert(std::string(name) + "_stacked");
}

template void observer_bound<ObserverTask::observe>(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics&);
template void observer_bound<ObserverTask::localise>(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics&);
template void observer_bound_names<ObserverTask::observe>(std::string_view, const PlannedRun&, MetricNames&);
template void observer_bound_names<ObserverTask::localise>(std::string_view, const PlannedRun&, MetricNames&);

}  // namespace consort
