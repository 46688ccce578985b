#pragma once
/// What a topology schedule does over the rounds of a run, counted round by round, among the agents that are there.

#include "core/experiment.hpp"
#include "core/network/schedule.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <vector>

namespace consort {

/// The graphs of rounds [0, rounds), one entry per segment that shares a graph.
struct Survey {
  using Members = std::vector<AgentId>;                 ///< ascending
  Round rounds = 0;                                     ///< rounds looked at
  bool complete = false;                                ///< these are all the rounds of the run
  double work = 0.0;                                    ///< agents and edges that spanning() may look at
  std::vector<Schedule::Segment> segments;              ///< consecutive, clipped to the rounds looked at; graphs of all agents
  std::vector<std::shared_ptr<const Members>> members;  ///< by segment: who is there; one object as long as they are the same
  std::vector<std::shared_ptr<const Graph>> graphs;     ///< by segment: the graph of those, renumbered in order; what follows is about it

  /// First round whose graph lacks a property, and how many rounds do.
  struct Failure {
    Round first = 0, count = 0;
  };
  /// Nothing if every round's graph has the property.
  [[nodiscard]] std::optional<Failure> failure(const std::function<bool(const Graph&)>& property) const;
  /// Smallest w such that over every w rounds on end, in which the same agents are there, the union of the graphs has a spanning tree.
  /// `broken_from` is the first round from which no union to the end of the rounds spans although w rounds, or much more than w, are
  /// left; then there is no w.
  /// `looked_until`: windows that begin later were not looked at, as it would have taken too long, or as not all rounds of the run were
  /// looked at and none of theirs has shown what a window takes.
  struct Spanning {
    std::optional<Round> window;
    Round broken_from = 0;
    std::optional<Round> looked_until = {};
  };
  [[nodiscard]] Spanning spanning() const;
  [[nodiscard]] bool constant() const { return segments.size() == 1; }
  /// The different graphs, each with the number of the first segment that has it.
  [[nodiscard]] std::vector<std::size_t> distinct() const;
};

/// Looks at the first `rounds` rounds of a schedule in which all agents are there throughout, or at as many as `work` allows: agents and
/// edges looked at in all. At least at the first segment.
Survey survey(const Schedule& schedule, Round rounds, double work);
/// The same of an experiment's own schedule, with the agents that are there.
Survey survey(const Experiment& experiment, double work);

}  // namespace consort
