#include "core/metrics_observer.hpp"

#include "core/math/decompositions.hpp"
#include "core/math/schur.hpp"
#include "core/observer_case.hpp"

#include <algorithm>
#include <cmath>

namespace consort {
namespace {

constexpr Eigen::Index kMostComponents = 100;  // error components; a thousand products and spectra of that size

bool estimates_everybody(const ProtocolChoice& choice) {
  return choice.name == "distributed_observer" || choice.name == "cooperative_localization";
}

struct Size {
  double error = 0.0, truth = 0.0;
};
/// |E| and the norm of the truth behind it in one report.
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

void observer_error(const Experiment&, Seed, const ProtocolChoice& choice, const Trace& trace, Metrics& out) {
  if (!estimates_everybody(choice)) return;
  const Size final = error_at(trace, trace.rounds.size() - 1);
  out["observer_error"] = final.error;
  out["observer_error_relative"] = final.error / final.truth;
}

void observer_error_peak(const Experiment&, Seed, const ProtocolChoice& choice, const Trace& trace, Metrics& out) {
  if (!estimates_everybody(choice)) return;
  double largest = 0.0;
  for (std::size_t report = trace.rounds.size() / 2; report < trace.rounds.size(); ++report)
    largest = std::max(largest, error_at(trace, report).error);
  out["observer_error_peak"] = largest;
}

void observer_bound(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace& trace, Metrics& out) {
  if (!estimates_everybody(choice) || !experiment.presence.empty()) return;
  const Schedule schedule = experiment.schedule(seed);
  const auto knowledge = known_matrices(experiment, seed);
  if (!schedule.constant() || knowledge.empty()) return;
  const ObservedCase observed = observed_case(experiment, choice, knowledge, *schedule.at(0), 0);
  if (observed.inputs_known || observed.system.error_size() > kMostComponents) return;
  const Matrix R = error_matrix(observed.system);
  if (trace.only_names) {
    if (spectral_abscissa(R) < 0.0) out["observer_bound"] = out["observer_bound_stacked"] = 0.0;
    return;
  }
  const auto decay = error_decay(R);
  if (!decay) return;
  double input_norm = 0.0, ubar = 0.0;
  std::vector<double> amplitudes;
  for (std::size_t i = 0; i < observed.inputs.size(); ++i) {
    const Vector amplitude = observed.inputs[i].amplitude.cwiseAbs();
    input_norm = std::max(input_norm, spectral_norm(observed.system.agents[i].B));
    ubar = std::max(ubar, amplitude.size() > 0 ? amplitude.maxCoeff() : 0.0);
    amplitudes.insert(amplitudes.end(), amplitude.begin(), amplitude.end());
  }
  out["observer_bound"] = ultimate_bound(*decay, input_norm, ubar);
  const Vector all = Eigen::Map<const Vector>(amplitudes.data(), static_cast<Eigen::Index>(amplitudes.size()));
  out["observer_bound_stacked"] = ultimate_bound(*decay, spectral_norm(unknown_input_matrix(observed.system)), all.norm());
}

}  // namespace consort
