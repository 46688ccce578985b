#pragma once
/// Events of the experiment as they come up in the reports: told alike by every driver.

#include "orchestrator/run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

namespace consort {

/// Tells the observer of cuts and heals as their rounds come up, between the reports.
class EventTeller {
 public:
  EventTeller(const Experiment& experiment, const Job& job, RunObserver& observer)
      : job_(job), observer_(observer), events_(experiment.link_events) {
    std::stable_sort(events_.begin(), events_.end(), [](const LinkEvent& a, const LinkEvent& b) { return a.round < b.round; });
  }
  void report(const RoundReport& report) {
    // A report of round k shows what rounds before k did, so what takes effect from round k on is told after it.
    for (; next_ < events_.size() && events_[next_].round < report.k; ++next_) tell(events_[next_]);
    observer_.report(job_, report);
  }

 private:
  void tell(const LinkEvent& event) {
    std::string text;
    for (const Edge edge : event.edges) text += fmt::format("{}{} -> {}", text.empty() ? "" : ", ", edge.from.value, edge.to.value);
    observer_.event(job_, event.round, event.heal ? "heal" : "cut", text);
  }

  const Job& job_;
  RunObserver& observer_;
  std::vector<LinkEvent> events_;
  std::size_t next_ = 0;
};

}  // namespace consort
