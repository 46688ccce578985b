#pragma once
/// Hands what a run reports to the record, to the results and to the person who waits.

#include "core/errors.hpp"
#include "orchestrator/report/progress.hpp"
#include "orchestrator/report/record.hpp"
#include "orchestrator/report/results.hpp"
#include "orchestrator/run/run.hpp"

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace consort {

class Scribe : public RunObserver {
 public:
  Scribe(const Experiment& experiment, const std::filesystem::path& output, bool quiet);

  void launching(std::size_t found, std::size_t ready, std::size_t total) override;
  void run_begins(const Job& job, const Trace& outline) override;
  void report(const Job& job, const RoundReport& report) override;
  void event(const Job& job, Round round, const std::string& kind, const std::string& text) override;
  void run_ends(const JobOutcome& outcome) override;
  void refused(const std::vector<Refusal>& refusals) override { results_.set_refusals(refusals); }
  void remark(const std::string& text) override;

  /// A line for the person alone.
  void note(const std::string& text);
  [[nodiscard]] Round round() const { return round_; }
  void set_times(const SessionTimes& times) { times_ = times; }
  /// Everything so far is on the disk, and the live line is gone. Throws RunError if writing the record failed.
  void close();
  /// The record ends with what came of it. Throws RunError if writing it failed.
  void conclude(const Summary& summary);
  /// As close(), after a failure: what the job that failed had reached counts. What cannot be written any more must not hide why it failed:
  /// it is said in the text that is returned, which is empty if everything is on the disk.
  std::string abandon();
  [[nodiscard]] Summary summary(Exit exit, const std::string& error) const { return results_.summary(times_, exit, error); }

 private:
  void record_metrics(const JobOutcome& outcome, const Metrics& metrics);

  const Experiment& experiment_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  std::optional<Record> record_;
  Results results_;
  std::optional<Progress> progress_;
  std::vector<std::string> remarks_;  // from before the first job
  SessionTimes times_;
  Round round_ = 0;
};

}  // namespace consort
