#include "protocols/sensor_network/metrics.hpp"

#include "core/math/controllability.hpp"
#include "core/math/decompositions.hpp"
#include "core/math/riccati.hpp"
#include "core/math/schur.hpp"
#include "models/physics.hpp"

#include <limits>

namespace consort {
namespace {

constexpr Eigen::Index kLargestError = 400;  // numbers in the errors of all agents: a Lyapunov equation costs its cube
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// A and every agent's C of the plant that all agents share.
struct Dynamics {
  Matrix A;
  std::vector<Matrix> C;
};
std::optional<Dynamics> shared_dynamics(const Experiment& experiment) {
  if (!experiment.plant) return std::nullopt;
  const Physics physics(plant_task(experiment, experiment.seed));
  if (!physics.shared()) return std::nullopt;
  Dynamics out;
  for (std::size_t i = 0; i < experiment.agents; ++i) {
    const Values known = physics.knowledge(agent_at(i));
    out.A = *known.find("A");
    out.C.push_back(known.has("C") ? *known.find("C") : Matrix(0, out.A.cols()));
  }
  return out;
}

// By agent: the largest of everybody who reaches it, itself included.
std::vector<Vector> flooded(std::vector<Vector> values, const Graph& graph) {
  for (std::size_t round = 1; round < values.size(); ++round) {
    const std::vector<Vector> sent = values;
    for (std::size_t i = 0; i < values.size(); ++i)
      for (const Neighbour& j : graph.in_neighbours(agent_at(i))) values[i] = values[i].cwiseMax(sent[index_of(j.id)]);
  }
  return values;
}

std::string component(const std::string& name, Eigen::Index c) { return name + "[" + std::to_string(c) + "]"; }

// The network in the last round of the run.
std::optional<ExaminedNetwork> final_network(const Experiment& experiment, Seed seed, const ProtocolChoice& choice) {
  const Round last = experiment.rounds > 0 ? experiment.rounds - 1 : 0;
  return examined_network(experiment, choice, *experiment.schedule(seed).at(last), last);
}

// Of the errors of all agents; NaN where there is none, because they do not decay.
Vector variances(const ExaminedNetwork& examined) {
  const Matrix A_tot = error_matrix(examined.network);
  if (!(spectral_abscissa(A_tot) < 0.0)) return Vector::Constant(A_tot.rows(), kNone);
  return error_covariance(examined.network).diagonal();
}

}  // namespace

std::optional<ExaminedNetwork> examined_network(const Experiment& experiment, const ProtocolChoice& choice, const Graph& graph, Round k) {
  const auto dynamics = shared_dynamics(experiment);
  if (!dynamics || dynamics->A.rows() * static_cast<Eigen::Index>(experiment.agents) > kLargestError) return std::nullopt;
  ExaminedNetwork out;
  for (std::size_t i = 0; i < experiment.agents; ++i)
    if (experiment.presence_of(agent_at(i)).holds(k)) out.agents.push_back(agent_at(i));
  if (out.agents.empty()) return std::nullopt;
  const Matrix& A = dynamics->A;
  out.groups = state_groups(A);
  out.network.A = A;
  out.network.graph = part_of(graph, out.agents);
  std::vector<Vector> bounds;
  for (const AgentId agent : out.agents) {
    const Values own = experiment.parameters_of(choice, agent);
    const Matrix& C = dynamics->C[index_of(agent)];
    const Matrix Q = own.covariance("Q", A.rows(), 1.0, true);
    const Matrix R = C.rows() == 0 ? Matrix(0, 0) : own.covariance("R", C.rows(), 1.0, true);
    if (out.network.Omega.size() == 0) out.network.Omega = Q;
    out.agreed = sensor_tuning(agent, own, A, out.groups.size(), experiment.agents);
    out.observers.push_back(local_observer(agent, A, out.groups, C, Q, R));
    bounds.push_back(inverse_alpha_bounds(out.observers.back(), A, out.groups, experiment.agents, out.agreed.balance));
    out.network.C.push_back(C);
    out.network.Xi.push_back(R);
    out.network.G.push_back(out.observers.back().G);
  }
  bounds = flooded(std::move(bounds), out.network.graph);
  for (std::size_t i = 0; i < out.agents.size(); ++i) {
    out.alpha.push_back(out.agreed.alpha.size() > 0 ? out.agreed.alpha : alpha_of(bounds[i], out.agreed.beta));
    out.network.F.push_back(consensus_gain(out.observers[i], out.groups, out.agreed.gamma, out.alpha[i].cwiseInverse()));
  }
  return out;
}

Matrix centralised_covariance(const ExaminedNetwork& examined) {
  const SensorNetwork& network = examined.network;
  Eigen::Index p = 0;
  for (const Matrix& C : network.C) p += C.rows();
  Matrix C(p, network.A.cols()), Xi = Matrix::Zero(p, p);
  Eigen::Index at = 0;
  for (std::size_t i = 0; i < network.C.size(); ++i) {
    const Eigen::Index rows = network.C[i].rows();
    C.middleRows(at, rows) = network.C[i];
    Xi.block(at, at, rows, rows) = network.Xi[i];
    at += rows;
  }
  if (p == 0 || !detectable(network.A, C)) return Matrix::Constant(network.A.rows(), network.A.cols(), kNone);
  return filter_riccati(network.A, C, network.Omega, Xi).P;
}

void covariance(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace&, Metrics& out) {
  const auto examined = final_network(experiment, seed, choice);
  if (!examined) return;
  const Vector diagonal = variances(*examined);
  const Eigen::Index n = examined->network.A.rows();
  for (std::size_t i = 0; i < examined->agents.size(); ++i)
    for (Eigen::Index c = 0; c < n; ++c)
      out[component(of_agent("covariance", examined->agents[i]), c)] = diagonal[static_cast<Eigen::Index>(i) * n + c];
}

void covariance_trace(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace&, Metrics& out) {
  if (const auto examined = final_network(experiment, seed, choice)) out["covariance_trace"] = variances(*examined).sum();
}

void covariance_trace_sampled(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace&, Metrics& out) {
  const auto examined = final_network(experiment, seed, choice);
  if (!examined) return;
  const bool stable = spectral_radius(sampled_error_matrix(examined->network, experiment.dt)) < 1.0;
  out["covariance_trace_sampled"] = stable ? sampled_error_covariance(examined->network, experiment.dt).trace() : kNone;
}

void covariance_trace_observed(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace&, Metrics& out) {
  const auto examined = final_network(experiment, seed, choice);
  if (!examined) return;
  const Vector diagonal = variances(*examined);
  double sum = 0.0;
  for (std::size_t i = 0; i < examined->agents.size(); ++i)
    for (const Eigen::Index c : examined->observers[i].observable)
      sum += diagonal[static_cast<Eigen::Index>(i) * examined->network.A.rows() + c];
  out["covariance_trace_observed"] = sum;
}

void local_covariance(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace&, Metrics& out) {
  const auto examined = final_network(experiment, seed, choice);
  if (!examined) return;
  for (std::size_t i = 0; i < examined->agents.size(); ++i) {
    const auto& [observes, observable, M_inverse, G, decay] = examined->observers[i];
    for (std::size_t c = 0; c < observable.size(); ++c)
      out[component(of_agent("local_covariance", examined->agents[i]), observable[c])] =
          M_inverse(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(c));
  }
}

void local_covariance_trace(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace&, Metrics& out) {
  const auto examined = final_network(experiment, seed, choice);
  if (!examined) return;
  double sum = 0.0;
  for (const LocalObserver& observer : examined->observers) sum += observer.M_inverse.trace();
  out["local_covariance_trace"] = sum;
}

void kalman_covariance(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace&, Metrics& out) {
  const auto examined = final_network(experiment, seed, choice);
  if (!examined) return;
  const Matrix P = centralised_covariance(*examined);
  for (Eigen::Index c = 0; c < P.rows(); ++c) out[component("kalman_covariance", c)] = P(c, c);
}

void gain_norm(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace&, Metrics& out) {
  const auto examined = final_network(experiment, seed, choice);
  if (!examined) return;
  for (std::size_t i = 0; i < examined->agents.size(); ++i)
    out[of_agent("gain_norm", examined->agents[i])] = spectral_norm(examined->observers[i].G);
}

void consensus_norm(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace&, Metrics& out) {
  const auto examined = final_network(experiment, seed, choice);
  if (!examined) return;
  for (std::size_t i = 0; i < examined->agents.size(); ++i)
    out[of_agent("consensus_norm", examined->agents[i])] = examined->agreed.gamma * spectral_norm(examined->observers[i].M_inverse);
}

void error_abscissa(const Experiment& experiment, Seed seed, const ProtocolChoice& choice, const Trace&, Metrics& out) {
  if (const auto examined = final_network(experiment, seed, choice))
    out["error_abscissa"] = spectral_abscissa(error_matrix(examined->network));
}

void error_variance(const Experiment&, Seed, const ProtocolChoice&, const Trace& trace, Metrics& out) {
  if (trace.state_dimension == 0) return;
  const auto n = static_cast<Eigen::Index>(trace.state_dimension);
  double total = 0.0;
  for (std::size_t i = 0; i < trace.agents; ++i) {
    const AgentId agent = agent_at(i);
    Vector sum = Vector::Zero(n);
    double reports = 0.0;
    for (std::size_t r = 0; r < trace.rounds.size(); ++r) {
      const std::span<const double> estimate = trace.at(r, agent), truth = trace.state_at(r, agent);
      if (trace.rounds[r] < trace.last_round / 2 || is_absent(estimate[0])) continue;
      sum += (Eigen::Map<const Vector>(estimate.data(), n) - Eigen::Map<const Vector>(truth.data(), n)).cwiseAbs2();
      reports += 1.0;
    }
    if (reports == 0.0) continue;
    for (Eigen::Index c = 0; c < n; ++c) out[component(of_agent("error_variance", agent), c)] = sum[c] / reports;
    total += sum.sum() / reports;
  }
  out["error_variance"] = total;
}

namespace {

std::optional<ExaminedNetwork> final_network(const PlannedRun& run) {
  return final_network(run.experiment, run.experiment.seed, run.choice);
}

void components(std::string_view name, Eigen::Index size, MetricNames& out) {
  for (Eigen::Index c = 0; c < size; ++c) out.insert(component(std::string(name), c));
}

}  // namespace

void network_name(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (final_network(run)) out.emplace(name);
}

void agent_names(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (const auto examined = final_network(run))
    for (const AgentId agent : examined->agents) out.insert(of_agent(name, agent));
}

void state_names(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (const auto examined = final_network(run)) components(name, examined->network.A.rows(), out);
}

void agent_state_names(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (const auto examined = final_network(run))
    for (const AgentId agent : examined->agents) components(of_agent(name, agent), examined->network.A.rows(), out);
}

void local_covariance_names(std::string_view name, const PlannedRun& run, MetricNames& out) {
  const auto examined = final_network(run);
  for (std::size_t i = 0; examined && i < examined->agents.size(); ++i)
    for (const Eigen::Index c : examined->observers[i].observable) out.insert(component(of_agent(name, examined->agents[i]), c));
}

void error_variance_names(std::string_view name, const PlannedRun& run, MetricNames& out) {
  if (run.trace.state_dimension == 0) return;
  out.emplace(name);
  for (std::size_t i = 0; i < run.trace.agents; ++i)
    if (run.there_late(agent_at(i))) components(of_agent(name, agent_at(i)), static_cast<Eigen::Index>(run.trace.state_dimension), out);
}

}  // namespace consort
