#pragma once
/// Events of the experiment as they come up in the reports: told alike by every driver.

#include "orchestrator/run/link_words.hpp"
#include "orchestrator/run/run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

namespace consort {

/// Tells the observer of cuts, heals, joins and leaves as their rounds come up, between the reports.
class EventTeller {
 public:
  EventTeller(const Experiment& experiment, const Job& job, RunObserver& observer) : job_(job), observer_(observer) {
    for (const LinkEvent& event : experiment.link_events) {
      events_.push_back({event.round, event.heal ? "heal" : "cut", words_of(event)});
    }
    for (const LinkModel::Change& change : experiment.links_of(experiment.protocols.at(job.protocol)).changes)
      events_.push_back({change.since, "set_link", words_of(change)});
    if (experiment.plant)
      for (const Disturbance& disturbance : experiment.plant->disturbances)
        if (disturbance.first > 0) events_.push_back({disturbance.first, "degrade", words_of_degradation(disturbance)});
    for (const ProcessEvent& event : process_events(experiment))
      events_.push_back({event.round, event.kind, fmt::format("agent {}", event.agent.value)});
    std::stable_sort(events_.begin(), events_.end(), [](const Event& a, const Event& b) { return a.round < b.round; });
  }
  void report(const RoundReport& report) {
    // A report of round k shows what rounds before k did, so what takes effect from round k on is told after it.
    tell_before(report.k);
    observer_.report(job_, report);
  }
  /// What takes effect in the last round is told where it is what ends the run.
  void rest(Round last) { tell_before(last + 1); }

 private:
  void tell_before(Round k) {
    for (; next_ < events_.size() && events_[next_].round < k; ++next_)
      observer_.event(job_, events_[next_].round, events_[next_].kind, events_[next_].text);
  }
  struct Event {
    Round round;
    const char* kind;
    std::string text;
  };

  const Job& job_;
  RunObserver& observer_;
  std::vector<Event> events_;
  std::size_t next_ = 0;
};

}  // namespace consort
