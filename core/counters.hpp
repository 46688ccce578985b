#pragma once
/// What became of messages, counted: of one agent, and of one link by the link model and by the network itself. Each names its numbers
/// once, in the order of the wire and of the record.

#include "core/types.hpp"

#include <compare>
#include <cstdint>
#include <tuple>

namespace consort {

/// Adds number by number.
template <class Counters>
Counters& add_counters(Counters& sum, const Counters& other) {
  std::apply([&](auto&... into) { std::apply([&](const auto&... from) { ((into += from), ...); }, Counters::fields(other)); },
             Counters::fields(sum));
  return sum;
}

/// Cumulative over rounds < k, as one agent has seen them.
struct AgentCounters {
  std::uint64_t sent = 0;       ///< messages emitted, one per out-neighbour and round
  std::uint64_t delivered = 0;  ///< messages given to the algorithm
  std::uint64_t lost = 0;       ///< messages the link model dropped
  static auto fields(auto& c) { return std::tie(c.sent, c.delivered, c.lost); }
  AgentCounters& operator+=(const AgentCounters& other) { return add_counters(*this, other); }
};

/// What the link model did to one link's messages. Once nothing is under way, emitted + duplicated = delivered + lost + superseded.
struct LinkCounters {
  std::uint64_t delivered = 0, lost = 0;
  std::uint64_t duplicated = 0;  ///< second copies made
  std::uint64_t reordered = 0;   ///< arrived in a later round than a newer message of the same sender
  std::uint64_t superseded = 0;  ///< arrived in one round with the same or a newer message of the same sender, so not handed on
  static auto fields(auto& c) { return std::tie(c.delivered, c.lost, c.duplicated, c.reordered, c.superseded); }
  LinkCounters& operator+=(const LinkCounters& other) { return add_counters(*this, other); }
  auto operator<=>(const LinkCounters&) const = default;
};

/// What the network itself did to the messages of one link (mode realtime), by their round numbers. What the link model dropped has been
/// received first.
struct NetworkCounters {
  std::uint64_t sent = 0;        ///< rounds in which the receiver had the sender as an in-neighbour
  std::uint64_t received = 0;    ///< while it could be used
  std::uint64_t lost = 0;        ///< never came
  std::uint64_t late = 0;        ///< came when it could not be used any more
  std::uint64_t duplicated = 0;  ///< came again
  std::uint64_t reordered = 0;   ///< came after a later one
  static auto fields(auto& c) { return std::tie(c.sent, c.received, c.lost, c.late, c.duplicated, c.reordered); }
  NetworkCounters& operator+=(const NetworkCounters& other) { return add_counters(*this, other); }
  auto operator<=>(const NetworkCounters&) const = default;
};

/// Of one link, over the rounds its receiver ran.
template <class Counters>
struct OfLink {
  Edge edge;
  Counters counters;
  auto operator<=>(const OfLink&) const = default;
};
using LinkTotals = OfLink<LinkCounters>;
using NetworkTotals = OfLink<NetworkCounters>;

}  // namespace consort
