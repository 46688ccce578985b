#include "protocols/predicted_value.hpp"

namespace consort {
namespace {

constexpr std::size_t kMostAgents = 300;  // left null vectors cost their cube

}  // namespace

std::shared_ptr<const Graph> lasting_graph(const Experiment& experiment, Seed run_seed) {
  if (experiment.agents > kMostAgents) return nullptr;
  const Schedule schedule = experiment.schedule(run_seed);
  if (!schedule.constant() || !has_spanning_tree(*schedule.at(0))) return nullptr;
  return schedule.at(0);
}

void averaged_value(const Experiment& experiment, Seed seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  const auto graph = lasting_graph(experiment, seed);
  if (!graph) return;
  const Eigen::Map<const Matrix> start(trace.agreed_at(0).data(), static_cast<Eigen::Index>(trace.agreed_dimension()),
                                       static_cast<Eigen::Index>(trace.agents));
  put(out, "predicted_value", start * left_null_vector(*graph));
}

void averaged_value_names(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (lasting_graph(run.experiment, run.experiment.seed)) put_names(out, name, run.trace.agreed_dimension());
}

}  // namespace consort
