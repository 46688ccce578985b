#pragma once
/// Topology as a function of the round: switching is nothing but a different graph in a later round.

#include "core/network/graph.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <variant>
#include <vector>

namespace consort {

/// Graphs given outright, each for so many rounds; after the last: hold it, or start again (`periodic`).
struct FixedSchedule {
  struct Interval {
    std::shared_ptr<const Graph> graph;
    Round rounds = 1;
  };
  std::vector<Interval> intervals;
  bool periodic = false;
};
/// Random perfect matchings (one agent sits out if n is odd), each kept for a dwell drawn uniformly from [dwell_min, dwell_max].
struct RandomPairs {
  Round dwell_min = 1, dwell_max = 8;
};
/// In every round each edge of `base` is present with `probability`, independently.
struct RandomLinks {
  std::shared_ptr<const Graph> base;
  double probability = 0.5;
};

/// From round `round` on, these edges are cut (or healed), and all edges between agents of different groups. Later entries win.
struct LinkEvent {
  Round round = 0;
  std::vector<Edge> edges;
  bool heal = false;
  std::vector<std::vector<AgentId>> groups = {};
  bool everything = false;  ///< heal: whatever is cut
};

/// When an agent takes part: rounds [from, until), and again later if it comes back. Edges to and from an absent agent are absent.
struct Attendance {
  Round from = 0;
  Round until = std::numeric_limits<Round>::max();
  std::vector<Attendance> again = {};  ///< later stays, ascending, each after the one before; they have none themselves

  [[nodiscard]] bool holds(Round k) const {
    return (k >= from && k < until) || std::any_of(again.begin(), again.end(), [k](const Attendance& stay) { return stay.holds(k); });
  }
  /// All stays, one after the other.
  [[nodiscard]] std::vector<Attendance> stays() const {
    std::vector<Attendance> all{{from, until}};
    all.insert(all.end(), again.begin(), again.end());
    return all;
  }
  /// The first round from k on that is part of a stay; kNever if there is none.
  [[nodiscard]] Round next(Round k) const {
    if (holds(k)) return k;
    for (const Attendance& stay : stays())
      if (stay.from > k && stay.from < stay.until) return stay.from;
    return kNever;
  }
  /// Ends in round k what would go on, or begin, later.
  void cut(Round k) {
    std::erase_if(again, [k](const Attendance& stay) { return stay.from >= k; });
    Attendance& last = again.empty() ? *this : again.back();
    last.until = std::min(last.until, k);
  }
  bool operator==(const Attendance&) const = default;
};

/// The topology of every round, a pure function of (specification, seed, round). Safe to ask from several threads; copies share what they
/// have computed.
class Schedule {
 public:
  using Spec = std::variant<FixedSchedule, RandomPairs, RandomLinks>;
  /// Throws ConfigError on an empty list of intervals, an interval of no rounds, a graph with another number of agents, a dwell that is
  /// empty or upside down, a probability outside [0, 1], or an event that names an agent there is not.
  Schedule(std::size_t agents, Spec spec, std::vector<LinkEvent> events, Seed seed, const std::map<AgentId, Attendance>& presence = {});

  /// Rounds [first, last] share one graph object.
  struct Segment {
    Round first = 0, last = 0;
    std::shared_ptr<const Graph> graph;
  };
  /// The segment that holds round k. Equal neighbouring segments are merged where that costs nothing (a constant topology is one segment).
  [[nodiscard]] Segment segment(Round k) const;
  [[nodiscard]] std::shared_ptr<const Graph> at(Round k) const { return segment(k).graph; }

  /// Every edge that can ever be present in rounds [0, rounds). For random specifications: the support, not the sample. One graph object
  /// with segment() where it is the graph of those rounds.
  [[nodiscard]] std::shared_ptr<const Graph> support(Round rounds) const;
  /// Every round has its own draw of all edges that there may be.
  [[nodiscard]] bool draws_edges() const { return std::holds_alternative<RandomLinks>(spec_); }
  /// As many edges as support() has at most.
  [[nodiscard]] double most_edges() const;
  /// Union of the graphs of rounds [first, first + window); largest weights.
  [[nodiscard]] Graph union_over(Round first, Round window) const;
  [[nodiscard]] std::size_t agents() const { return agents_; }
  /// One graph for ever.
  [[nodiscard]] bool constant() const;

 private:
  /// From round `first` to the next epoch these edges are cut and these agents absent (both ascending).
  struct Epoch {
    Round first = 0;
    std::vector<Edge> cut;
    std::vector<AgentId> absent;
    [[nodiscard]] bool whole() const { return cut.empty() && absent.empty(); }
    [[nodiscard]] bool lacks(Edge edge) const;
  };
  /// Rounds in which the specification (without events) keeps one graph; `index` names that graph.
  struct Span {
    Round first = 0, last = 0;
    std::uint32_t index = 0;
  };
  struct Memory;

  void validate_spec() const;
  void simplify_spec();
  void build_epochs(std::vector<LinkEvent> events, const std::map<AgentId, Attendance>& presence);
  [[nodiscard]] std::size_t epoch_of(Round k) const;
  [[nodiscard]] Round last_of_epoch(std::size_t epoch) const;
  [[nodiscard]] Span span_of(const FixedSchedule& fixed, Round k) const;
  [[nodiscard]] Span span_of(const RandomPairs& pairs, Round k) const;
  [[nodiscard]] std::shared_ptr<const Graph> base_graph(std::uint32_t index) const;
  [[nodiscard]] std::shared_ptr<const Graph> graph_of(std::uint32_t index, std::size_t epoch) const;

  std::size_t agents_;
  Spec spec_;
  Seed seed_;
  std::vector<Epoch> epochs_;        // ascending, the first at round 0
  std::vector<std::uint64_t> ends_;  // fixed specification: first round after each interval, within one period
  std::shared_ptr<Memory> memory_;   // what has been drawn; guarded by its own mutex
};

}  // namespace consort
