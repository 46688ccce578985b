#pragma once
/// How far a run is, on standard error: one live line on a terminal, plain lines now and then elsewhere.

#include "orchestrator/report/terminal.hpp"
#include "orchestrator/run/run.hpp"

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace consort {

class Progress {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Write = std::function<void(std::string_view)>;
  using Clock = std::function<Time()>;

  /// `experiment` must outlive this. On a terminal at most ten updates a second, elsewhere at most one line a second.
  Progress(const Experiment& experiment, TextStyle style, Write write, Clock clock = std::chrono::steady_clock::now);

  void launching(std::size_t found, std::size_t ready, std::size_t total);
  void run_begins(const Job& job, const Trace& outline);
  void report(const Job& job, const RoundReport& report);
  void note(std::string_view text);  ///< a line of its own that stays
  void finish();                     ///< removes the live line

 private:
  [[nodiscard]] bool due(Time now) const;
  void show(Time now, const std::string& live, const std::string& plain);
  [[nodiscard]] std::string live_text(const std::string& before, Round k, const std::string& after) const;

  const Experiment& experiment_;
  TextStyle style_;
  Write write_;
  Clock clock_;
  std::optional<Time> shown_;
  bool live_line_ = false;
  Trace agreement_;  // knows what of a report the agents are to agree on; holds none
  // Rounds per second: over the time since the last line, whatever jobs the rounds belong to.
  std::uint64_t rounds_before_ = 0, rounds_at_mark_ = 0;
  Round last_round_ = 0;
  std::optional<Time> mark_;
};

}  // namespace consort
