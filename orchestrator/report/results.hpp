#pragma once
/// What a run leaves for people and programs: the output folder, the figures, summary.json.

#include "core/errors.hpp"
#include "core/metrics/divergence.hpp"
#include "orchestrator/run/run.hpp"
#include "orchestrator/script/criteria.hpp"
#include "protocols/metrics.hpp"

#include <ctime>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace consort {

/// results/<experiment>-<YYYYmmdd-HHMMSS> below `base`, created; -2, -3, ... is appended rather than touching what is there.
/// Safe against other processes doing the same at the same time. Throws RunError naming the path.
std::filesystem::path create_results_folder(const std::filesystem::path& base, const std::string& experiment, std::time_t now);
/// Makes `folder` if it is absent. Throws ConfigError if it is something else or holds anything.
void claim_output_folder(const std::filesystem::path& folder);
/// Writes a whole file, first under another name, so that a reader sees all of it or nothing. Throws RunError naming the path.
void write_file(const std::filesystem::path& file, const std::string& text);

/// What one run came to. A metric that it does not have is absent or no number.
struct RunMetrics {
  Seed seed;
  Metrics metrics;
  std::optional<Divergence> diverged = {};
};

/// One protocol over the runs that ended.
struct ProtocolResult {
  std::string name;
  std::size_t runs = 0, converged = 0;
  Round fewest_rounds = 0, most_rounds = 0;
  std::uint64_t rounds = 0;         ///< sum over the runs
  AgentCounters totals;             ///< sum over the runs
  double seconds = 0.0;             ///< wall clock, sum over the runs
  std::vector<RunMetrics> per_run;  ///< in the order the runs ended
  Metrics mean;                     ///< over the runs that have the metric; NaN where none has
  Metrics deviation;                ///< sample standard deviation over those; NaN where fewer than two have it
  Metrics share;                    ///< of the runs that have it, 0 to 1
};

/// Mean, deviation and share of every metric that any run has. What a run does not have (it never converged, say) counts in the share
/// alone, so one such run does not cost the numbers of all others.
void summarise(ProtocolResult& result);

struct Summary {
  std::string experiment;
  std::filesystem::path output;
  Mode mode = Mode::lockstep;
  Seed seed;
  std::size_t agents = 0, runs = 1;  ///< runs asked for, per protocol
  std::vector<ProtocolResult> protocols;
  Metrics metrics;  ///< prefixed `<protocol>.` if there are several; `<metric>.std`, `<metric>.share` beside each mean if runs > 1
  std::vector<CriterionResult> criteria;
  Round rounds = 0;                         ///< the most rounds any run took
  std::optional<std::uint64_t> trace_hash;  ///< over the hashes of all runs, in order; nothing if none has reported anything
  std::optional<double> startup_seconds;    ///< nothing if none has begun
  double rounds_per_second = 0.0;
  AgentCounters totals;
  std::vector<Refusal> refused;        ///< samples that the processes left out
  bool complete = true;                ///< every run came to its end: see completeness()
  Ending ending = Ending::last_round;  ///< of the first run that is not complete, else of the last one
  std::string incomplete;              ///< why it is not complete
  std::vector<std::uint32_t> missing;  ///< agents that did not come as far as they were to; 0: the plant
  std::vector<AgentEnd> ends;          ///< by agent, over all runs that began
  Exit exit = Exit::ok;
  std::string error;  ///< empty: the run reached its end
  [[nodiscard]] bool passed() const { return exit == Exit::ok; }
};

/// Gathers the outcomes of a session's jobs.
class Results {
 public:
  Results(const Experiment& experiment, std::filesystem::path output);
  /// Computes the metrics, so the trace need not be kept, and gives those of this run; none if nothing was reported.
  Metrics add(const JobOutcome& outcome);
  void set_refusals(const std::vector<Refusal>& refused) { refused_ = refused; }
  /// What is known so far. With `error` empty the criteria decide between Exit::ok and Exit::criterion_not_met, if all runs are complete;
  /// else that is the failure.
  [[nodiscard]] Summary summary(const SessionTimes& times, Exit exit, const std::string& error) const;

 private:
  void add_end(const JobOutcome& outcome);
  void conclude(Summary& summary) const;

  Experiment experiment_;  // with the metrics of the final table added to those the user chose
  std::filesystem::path output_;
  std::vector<ProtocolResult> protocols_;
  std::vector<Refusal> refused_;
  std::vector<AgentEnd> ends_;
  Completeness completeness_;
  Ending ending_ = Ending::last_round;
  std::size_t ended_ = 0;  // runs
  HistoryHash hash_;
};

std::uint64_t samples_of(const std::vector<Refusal>& refused);

/// The text of summary.json, two spaces of indentation. What is not a number is null.
std::string to_json(const Summary& summary);

}  // namespace consort
