#pragma once
/// What several graphs of one run say about the same conditions.

#include "protocols/theory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace consort {

/// Findings of several graphs about the same condition become the worst one: refused only if all are.
class MergedFindings {
 public:
  void add(std::vector<Finding> findings, Round from) {
    for (Finding& finding : findings) {
      const auto same = std::find_if(out_.begin(), out_.end(), [&](const Entry& e) { return e.finding.condition == finding.condition; });
      if (same == out_.end()) {
        const std::size_t refusals = finding.verdict == Rating::refused ? 1 : 0;
        out_.push_back({std::move(finding), from, refusals});
      } else
        merge(*same, std::move(finding), from);
    }
    ++graphs_;
  }
  std::vector<Finding> take() {
    std::vector<Finding> out;
    for (auto& [finding, from, refusals] : out_) {
      const bool failed = finding.verdict == Rating::fails || finding.verdict == Rating::refused;
      if (finding.verdict == Rating::refused && refusals < graphs_) finding.verdict = Rating::fails;
      if (graphs_ > 1) finding.evidence = fmt::format("{} round {}: {}", failed ? "first in" : "from", from, finding.evidence);
      out.push_back(std::move(finding));
    }
    return out;
  }

 private:
  struct Entry {
    Finding finding;
    Round from;
    std::size_t refusals;
  };
  static int rank(Rating verdict) { return verdict == Rating::refused ? 2 : verdict == Rating::fails ? 1 : 0; }
  static void merge(Entry& kept, Finding finding, Round from) {
    if (finding.verdict == Rating::refused) ++kept.refusals;
    // The worst counts; of several good ones, the last graph's, which the run ends with.
    if (rank(finding.verdict) < rank(kept.finding.verdict) ||
        (rank(finding.verdict) > 0 && rank(finding.verdict) == rank(kept.finding.verdict)))
      return;
    kept.finding = std::move(finding);
    kept.from = from;
  }
  std::vector<Entry> out_;
  std::size_t graphs_ = 0;
};

}  // namespace consort
