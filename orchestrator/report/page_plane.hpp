#pragma once
/// The plane of a run's page: where the agents are, and where they are believed to be, as frames over time.

#include "core/trace.hpp"
#include "orchestrator/report/recorded_run.hpp"

#include <nlohmann/json.hpp>

#include <span>
#include <utility>
#include <vector>

namespace consort {

/// Of a run whose plant has a position of two coordinates, or, without a plant, whose estimates have; up to 100 agents.
class PagePlane {
 public:
  /// `truth`: what the estimates are of.
  PagePlane(const RecordedRun& run, Truth truth);
  /// One report after the other: time (s), numbers of all agents.
  void add(double time, std::span<const double> all);
  /// {truth, everybody, frames: [{time, truth: [[x, y]], seen: [[[x, y]]]}]}, about 120 frames of those that were added; null: no plane.
  [[nodiscard]] nlohmann::ordered_json finish();

 private:
  [[nodiscard]] nlohmann::ordered_json point(std::span<const double> all, std::size_t agent, std::size_t x, std::size_t y) const;

  const RecordedRun& run_;
  Truth truth_;
  std::vector<std::size_t> position_;                           // columns of x and y; empty: no plane
  std::vector<std::pair<std::size_t, std::size_t>> estimates_;  // columns of those that an agent estimates
  std::size_t report_ = 0;
  std::vector<nlohmann::ordered_json> frames_;
};

}  // namespace consort
