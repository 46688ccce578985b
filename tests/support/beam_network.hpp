#pragma once
/// The clamped beam of Knotek's thesis, section 3.6, as sensors, noises and graph of its example.

#include "models/beam_modes.hpp"
#include "protocols/sensor_network/design.hpp"
#include "protocols/sensor_network/errors.hpp"

#include <vector>

namespace consort::beam {

/// The thesis' frequencies with its damping 1e-5 M + 1e-6 K.
inline Matrix dynamics() {
  const Vector omega{{89, 221, 409, 651}};
  const Vector damping = 1e-5 + 1e-6 * omega.array().square();
  return modal_dynamics(omega, damping);
}

/// C of agents 1 to 6, entries that Assumption 8 calls zero set to zero; agents 5 and 6 have no sensor.
inline std::vector<Matrix> sensors() {
  std::vector<Matrix> C{Matrix{{.2034645, 0, .1596524, 0, .1078220, 0, .0593079, 0}}, Matrix{{.5167411, 0, 0, 0, -.0937838, 0, 0, 0}},
                        Matrix{{.4781017, 0, -.1368728, 0, 0, 0, .0626472, 0}}, Matrix{{.3097591, 0, -.1966885, 0, .0886445, 0, 0, 0}}};
  C.resize(6, Matrix(0, 8));
  return C;
}

inline Matrix process_noise() { return Matrix(1e-4 * Vector{{6, 10, 10, 6, 18, 14, 8, 8}}.asDiagonal()); }
inline std::vector<double> sensor_noises() { return {2e-6, 5e-6, 3e-6, .1e-6}; }

inline std::vector<Edge> edges() {
  std::vector<Edge> out;
  for (const auto& [from, to] :
       std::vector<std::pair<std::uint32_t, std::uint32_t>>{{1, 2}, {2, 3}, {3, 1}, {3, 4}, {4, 1}, {3, 5}, {2, 6}})
    out.push_back({AgentId{from}, AgentId{to}});
  return out;
}

/// What differs between the thesis' cases.
struct Case {
  double Xi44 = .1e-6;
  double gamma = 1e4;
  bool link_4_1 = true;
  double Omega_scale = 1.0;
};

struct Designed {
  SensorNetwork network;
  std::vector<LocalObserver> observers;
};

inline Designed designed(const Case& given = {}) {
  Designed out;
  out.network.A = dynamics();
  out.network.Omega = given.Omega_scale * process_noise();
  out.network.C = sensors();
  std::vector<Edge> links = edges();
  if (!given.link_4_1) std::erase(links, Edge{AgentId{4}, AgentId{1}});
  out.network.graph = Graph(6, links);
  const StateGroups groups = state_groups(out.network.A);
  for (std::size_t i = 0; i < 6; ++i) {
    const Matrix& C = out.network.C[i];
    Matrix Xi(C.rows(), C.rows());
    if (i < 4) Xi(0, 0) = i == 3 ? given.Xi44 : sensor_noises()[i];
    out.network.Xi.push_back(Xi);
    out.observers.push_back(local_observer(agent_at(i), out.network.A, groups, C, out.network.Omega, Xi));
    out.network.G.push_back(out.observers.back().G);
    out.network.F.push_back(consensus_gain(out.observers.back(), groups, given.gamma, Vector::Ones(4)));
  }
  return out;
}

}  // namespace consort::beam
