#pragma once
/// Topology as a function of the round: switching is nothing but a different graph in a later round.

#include "core/graph.hpp"

#include <memory>
#include <mutex>
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

/// From round `round` on, these edges are cut (or healed). Later entries win.
struct LinkEvent {
  Round round = 0;
  std::vector<Edge> edges;
  bool heal = false;
};

/// The topology of every round, a pure function of (specification, seed, round). Safe to ask from several threads.
class Schedule {
 public:
  using Spec = std::variant<FixedSchedule, RandomPairs, RandomLinks>;
  Schedule(std::size_t agents, Spec spec, std::vector<LinkEvent> events, Seed seed);

  /// Rounds [first, last] share one graph object.
  struct Segment {
    Round first = 0, last = 0;
    std::shared_ptr<const Graph> graph;
  };
  /// The segment that holds round k. Equal neighbouring segments are merged where that costs nothing (a constant topology is one segment).
  [[nodiscard]] Segment segment(Round k) const;
  [[nodiscard]] std::shared_ptr<const Graph> at(Round k) const { return segment(k).graph; }

  /// Every edge that can ever be present in rounds [0, rounds). For random specifications: the support, not the sample.
  [[nodiscard]] Graph support(Round rounds) const;
  /// Union of the graphs of rounds [first, first + window).
  [[nodiscard]] Graph union_over(Round first, Round window) const;
  [[nodiscard]] std::size_t agents() const { return agents_; }
  [[nodiscard]] bool constant() const;

 private:
  std::size_t agents_;
  Spec spec_;
  std::vector<LinkEvent> events_;
  Seed seed_;
  // Implementation adds a lazily grown, mutex-guarded cache for the random dwell (segment s is drawn from stream (random_pairs, s)).
};

}  // namespace consort
