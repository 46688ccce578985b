#pragma once
/// When is a run over? Judged on reported rounds only, by the same code in every mode.

#include "core/trace.hpp"

#include <functional>
#include <optional>

namespace consort {

/// Disagreement (of estimators: error) at most `within` for `for_rounds` rounds on end (on the reported rounds).
struct Convergence {
  double within = 1e-3;
  Round for_rounds = 1;
};

/// Largest Euclidean distance between two agents' numbers; agents that are absent (kAbsent) are left out. Any other NaN makes it NaN.
double disagreement(std::span<const double> estimates, std::size_t agents, std::size_t dimension);

/// |estimate - state|^2; numbers that the part has not are left out, what is not estimated counts with the state itself.
double squared_error(std::span<const double> estimate, std::span<const double> state);

/// Estimators: the norm of all agents' errors, stacked. A part of the plant that an agent has no estimate of counts with its whole state;
/// agents that are absent, and their parts, are left out.
double estimation_error(const Trace& trace, const RoundReport& report);

/// How far one report is from what the run is for: the disagreement, or (`trace.truth`) the estimation error. Only what `trace` says of its
/// numbers is used.
double deviation(const Trace& trace, const RoundReport& report);

class StopRule {
 public:
  StopRule(Round rounds, std::optional<Convergence> convergence) : rounds_(rounds), convergence_(convergence) {}
  /// Feed reports in ascending order. True when this report ends the run.
  bool ends(Round k, const std::function<double()>& deviation);
  [[nodiscard]] bool converged() const { return converged_; }

 private:
  Round rounds_;
  std::optional<Convergence> convergence_;
  std::optional<Round> below_since_;
  bool converged_ = false;
};

}  // namespace consort
