#pragma once
/// Vocabulary shared by every room: identities, rounds, edges, matrices.

#include <Eigen/Dense>

#include <bit>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>

namespace consort {

using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;
using Seconds = double;       ///< model time and durations, s
using Round = std::uint32_t;  ///< communication round k = 0, 1, ...
inline constexpr Round kNever = std::numeric_limits<Round>::max();

/// An identity that cannot be mixed up with a number or with another kind of identity.
template <class Tag>
struct Id {
  std::uint32_t value = 0;
  auto operator<=>(const Id&) const = default;
};

/// Agents are numbered 1..n, as in the publications.
using AgentId = Id<struct AgentTag>;

/// Position of an agent in arrays that hold one entry per agent.
constexpr std::size_t index_of(AgentId agent) { return agent.value - 1; }
constexpr AgentId agent_at(std::size_t index) { return AgentId{static_cast<std::uint32_t>(index + 1)}; }

/// Stands for every number of an agent that is not there: a NaN that no computation makes.
inline constexpr double kAbsent = std::bit_cast<double>(std::uint64_t{0x7ff8'0000'ab5e'0000});
inline bool is_absent(double value) { return std::bit_cast<std::uint64_t>(value) == std::bit_cast<std::uint64_t>(kAbsent); }

/// A directed link: `to` receives what `from` sends (g_{to,from} = 1).
struct Edge {
  AgentId from, to;
  auto operator<=>(const Edge&) const = default;
};

}  // namespace consort

template <class Tag>
struct std::hash<consort::Id<Tag>> {
  std::size_t operator()(consort::Id<Tag> id) const noexcept { return std::hash<std::uint32_t>{}(id.value); }
};
