#pragma once
/// What a topology schedule does over the rounds of a run, counted round by round.

#include "core/schedule.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <vector>

namespace consort {

/// The graphs of rounds [0, rounds), one entry per segment that shares a graph.
struct Survey {
  Round rounds = 0;                         ///< rounds looked at
  bool complete = false;                    ///< these are all the rounds of the run
  std::vector<Schedule::Segment> segments;  ///< consecutive, clipped to the rounds looked at

  /// First round whose graph lacks a property, and how many rounds do.
  struct Failure {
    Round first = 0, count = 0;
  };
  /// Nothing if every round's graph has the property.
  [[nodiscard]] std::optional<Failure> failure(const std::function<bool(const Graph&)>& property) const;
  /// Smallest w such that over every w rounds on end the union of the graphs has a spanning tree. `broken_from` is the first round from
  /// which no union to the end of the rounds spans although w rounds, or much more than w, are left; then there is no w.
  struct Spanning {
    std::optional<Round> window;
    Round broken_from = 0;
  };
  [[nodiscard]] Spanning spanning() const;
  [[nodiscard]] bool constant() const { return segments.size() == 1; }
};

/// Looks at the first `rounds` rounds, or at as many as a few seconds allow.
Survey survey(const Schedule& schedule, Round rounds);

}  // namespace consort
