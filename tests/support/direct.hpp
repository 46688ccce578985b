#pragma once
/// Runs a protocol's pure functions over a graph without drivers, mailboxes or links: the shortest way from equation to number.

#include "core/network/graph.hpp"
#include "protocols/adapter.hpp"

#include <functional>
#include <vector>

namespace consort::direct {

/// Initial states of n agents from scalars x and P.
template <class P>
std::vector<typename P::State> states(const typename P::Params& params, const std::vector<double>& x,
                                      const std::vector<double>& covariance) {
  std::vector<typename P::State> result;
  for (std::size_t i = 0; i < x.size(); ++i) {
    Values initial;
    initial.set("x", x[i]);
    initial.set("P", covariance[i]);
    result.push_back(P::init(params, Setup{agent_at(i), x.size(), 1.0, initial}));
  }
  return result;
}

template <class P>
struct Conditions {
  Round k = 0;
  Seconds dt = 1.0;
  bool with_self = false;  ///< every agent's own message is in its inbox too, as a sum that includes j = i would have it
  std::function<void(typename P::Message&)> disturb = {};  ///< applied to each message on its way
};

/// One round of all agents.
template <class P>
std::vector<typename P::State> advance(const typename P::Params& params, const std::vector<typename P::State>& states, const Graph& graph,
                                       const Conditions<P>& conditions = {}) {
  const auto& [k, dt, with_self, disturb] = conditions;
  std::vector<typename P::Message> messages;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const Sense sense{k, dt, graph.in_neighbours(agent_at(i)), graph.out_degree(agent_at(i)), {}, agent_at(i)};
    messages.push_back(P::message(params, states[i], sense));
  }
  std::vector<typename P::State> next;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const AgentId self = agent_at(i);
    std::vector<Heard<typename P::Message>> inbox;
    for (const Neighbour& j : graph.in_neighbours(self)) inbox.push_back({j.id, k, j.weight, messages[index_of(j.id)]});
    if (with_self) inbox.push_back({self, k, 1.0, messages[i]});
    if (disturb)
      for (auto& heard : inbox) disturb(heard.message);
    next.push_back(P::transition(params, states[i], Sense{k, dt, graph.in_neighbours(self), graph.out_degree(self), {}, self}, inbox));
  }
  return next;
}

/// A symmetric positive definite n x n matrix with eigenvalues in [0.1, 0.1 + n], drawn from `stream`.
inline Matrix random_spd(Stream& stream, Eigen::Index n) {
  const Matrix a = Matrix::NullaryExpr(n, n, [&] { return stream.uniform(-1.0, 1.0); });
  const Matrix spd = a * a.transpose() + 0.1 * Matrix::Identity(n, n);
  return 0.5 * (spd + spd.transpose());
}

inline Vector random_vector(Stream& stream, Eigen::Index n) {
  return Vector::NullaryExpr(n, [&] { return stream.uniform(-10.0, 10.0); });
}

/// A directed graph on n agents: a ring, so that everybody listens and is heard, and every other edge with probability one half.
inline Graph random_strong_graph(Stream& stream, std::size_t n) {
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      if (i != j && (j == (i + 1) % n || stream.uniform() < 0.5)) edges.push_back({agent_at(i), agent_at(j)});
  return Graph(n, std::span<const Edge>(edges));
}

}  // namespace consort::direct
