#pragma once
/// What theory says of an experiment before anything starts.

#include "core/experiment.hpp"

#include <string>
#include <vector>

namespace consort {

enum class Rating {
  holds,
  fails,    ///< worth a warning
  refused,  ///< fails, and without it the run makes no sense: it is not started, unless the user insists
  note,
  left_out  ///< not examined: it would have taken longer than was allowed
};

struct Finding {
  Rating verdict = Rating::note;
  std::string condition;    ///< e.g. "strongly connected in every round"
  std::string evidence;     ///< e.g. "30 of 30 distinct graphs", or the first round where it fails
  std::string consequence;  ///< e.g. "MDKC converges to the centralised estimate (Alighanbari, How 2006, Theorem 7)"
};

/// How much an examination may take, in operations that are estimated from sizes before anything is computed: what is examined depends on
/// the experiment alone, never on the clock.
class Effort {
 public:
  static Effort of_run() { return {1e9, 2e6}; }        ///< a tenth of a second or two: somebody waits for the run to begin
  static Effort of_validate() { return {2e10, 1e8}; }  ///< some seconds
  Effort(double operations, double graph_work) : left_(operations), graph_work_(graph_work) {}

  /// True, and they are spent, if so many are left.
  bool affords(double operations) {
    if (!(operations <= left_)) return false;
    left_ -= operations;
    return true;
  }
  [[nodiscard]] double left() const { return left_; }
  /// Agents and edges that graph searches may look at in all.
  [[nodiscard]] double graph_work() const { return graph_work_; }

 private:
  double left_, graph_work_;
};

/// What the experiment's graphs are, whether what each of its protocols asks for holds, and what follows. Only its own protocols are
/// spoken of: the condition of a finding about one begins with its name.
std::vector<Finding> examine(const Experiment& experiment, Effort effort = Effort::of_validate());

}  // namespace consort
