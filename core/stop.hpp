#pragma once
/// When is a run over? Judged on reported rounds only, by the same code in every mode.

#include "core/trace.hpp"

#include <optional>

namespace consort {

/// Disagreement at most `disagreement` for `for_rounds` rounds on end (on the reported rounds).
struct Convergence {
  double disagreement = 1e-3;
  Round for_rounds = 1;
};

/// Largest Euclidean distance between two agents' numbers; agents that are absent (kAbsent) are left out. Any other NaN makes it NaN.
double disagreement(std::span<const double> estimates, std::size_t agents, std::size_t dimension);

class StopRule {
 public:
  StopRule(Round rounds, std::optional<Convergence> convergence) : rounds_(rounds), convergence_(convergence) {}
  /// Feed reports in ascending order. True when this report ends the run.
  bool ends(Round k, std::span<const double> agreed, std::size_t agents, std::size_t dimension);
  [[nodiscard]] bool converged() const { return converged_; }

 private:
  Round rounds_;
  std::optional<Convergence> convergence_;
  std::optional<Round> below_since_;
  bool converged_ = false;
};

}  // namespace consort
