#pragma once
/// Metrics of a network of observers (protocol sensor_network_observer): what theory says of its errors, Knotek, thesis, section 3.6.3, and
/// what came of it.
///
/// The theoretical ones are about the graph of the last round and those present in it, with Q of agent 1 as the plant's noise and each R as
/// that of the sensor; NaN where the errors do not decay; absent for more than 400 numbers in the errors of all agents together.

#include "core/metrics/metrics.hpp"
#include "protocols/sensor_network/design.hpp"
#include "protocols/sensor_network/errors.hpp"

#include <array>
#include <optional>

namespace consort {

/// The network that an experiment is about, in one round: agents without a number in `network` are absent.
struct ExaminedNetwork {
  std::vector<AgentId> agents;  ///< those present, in the order of everything below
  StateGroups groups;
  std::vector<LocalObserver> observers;
  std::vector<Vector> alpha;  ///< by agent, of every group
  SensorTuning agreed;
  SensorNetwork network;
};

/// The network in round `k`. Nothing for plants that are not linear and shared, and networks too large.
/// Throws ConfigError where an agent would refuse its values.
std::optional<ExaminedNetwork> examined_network(const Experiment& experiment, const ProtocolChoice& choice, const Graph& graph, Round k);

/// The stationary error covariance of one filter with the sensors of all; NaN where these do not see what does not decay.
Matrix centralised_covariance(const ExaminedNetwork& examined);

// Theoretical; components c are those of the plant's state.
void covariance(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);        ///< <name>.<agent>[c]: P, (3.73)
void covariance_trace(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);  ///< trace P
void covariance_trace_sampled(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);   ///< with steps of dt
void covariance_trace_observed(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);  ///< sum of trace P_ii,oo
void local_covariance(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);           ///< <name>.<agent>[c]: M_i^-1
void local_covariance_trace(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);     ///< sum over the agents
void kalman_covariance(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);          ///< <name>[c]
void gain_norm(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);                  ///< <name>.<agent>: ||G_i||_2
void consensus_norm(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);             ///< <name>.<agent>: ||F_io||_2
void error_abscissa(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);             ///< of the error matrix, 1/s

/// Mean square of the estimation error over the reported rounds of the second half of the run: error_variance.<agent>[c], and the sum of
/// all, error_variance.
void error_variance(const Experiment&, Seed, const ProtocolChoice&, const Trace&, Metrics& out);

// Their names: of the whole network; by agent; by component of the plant's state; by both.
void network_name(std::string_view name, const PlannedRun&, MetricNames& out);
void agent_names(std::string_view name, const PlannedRun&, MetricNames& out);
void state_names(std::string_view name, const PlannedRun&, MetricNames& out);
void agent_state_names(std::string_view name, const PlannedRun&, MetricNames& out);
void local_covariance_names(std::string_view name, const PlannedRun&, MetricNames& out);
void error_variance_names(std::string_view name, const PlannedRun&, MetricNames& out);

inline constexpr std::array kNetworkMetrics{
    MetricEntry{"covariance", "sensor network: variances of each agent's stationary error, P of Knotek, thesis, (3.73)", covariance,
                agent_state_names},
    MetricEntry{"covariance_trace", "sensor network: trace of that P, over all agents", covariance_trace, network_name},
    MetricEntry{"covariance_trace_sampled", "sensor network: the same with steps of dt", covariance_trace_sampled, network_name},
    MetricEntry{"covariance_trace_observed", "sensor network: that of the state groups each agent sees itself", covariance_trace_observed,
                network_name},
    MetricEntry{"local_covariance", "sensor network: variances of each sensor's own Kalman filter (3.29)", local_covariance,
                local_covariance_names},
    MetricEntry{"local_covariance_trace", "sensor network: their sum", local_covariance_trace, network_name},
    MetricEntry{"kalman_covariance", "sensor network: variances of one Kalman filter with all sensors", kalman_covariance, state_names},
    MetricEntry{"gain_norm", "sensor network: 2-norm of each agent's observer gain G_i", gain_norm, agent_names},
    MetricEntry{"consensus_norm", "sensor network: 2-norm of gamma M_i^-1, each agent's consensus gain on what it sees", consensus_norm,
                agent_names},
    MetricEntry{"error_abscissa", "sensor network: largest real part of an eigenvalue of the error matrix, 1/s", error_abscissa,
                network_name},
    MetricEntry{"error_variance", "sensor network: mean square of each agent's estimation error, second half of the run, and their sum",
                error_variance, error_variance_names}};

}  // namespace consort
