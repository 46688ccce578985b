#pragma once
/// The record of a run: SQLite in WAL mode, so that a crash loses nothing committed. Writing happens on a thread of its own, in batches.

#include "orchestrator/report/results.hpp"

#include <filesystem>
#include <memory>
#include <string>

namespace consort {

class Record {
 public:
  /// Creates `file` (must not exist), the record of `experiment`, which must outlive it. Throws RunError with SQLite's words and the path.
  Record(const std::filesystem::path& file, const Experiment& experiment);
  ~Record();  ///< drains and closes
  Record(const Record&) = delete;
  Record& operator=(const Record&) = delete;

  void begin_run(const Job& job, const Trace& outline);
  void add(const Job& job, const RoundReport& report);
  void event(const Job& job, Round round, const std::string& kind, const std::string& text);
  void end_run(const JobOutcome& outcome, const Metrics& metrics = {});
  void conclude(const Summary& summary);  ///< what came of all runs
  /// How far what was handed over is on the disk, for a person.
  [[nodiscard]] std::string saved() const;
  void flush();  ///< returns when everything handed over so far is committed; throws RunError if writing failed

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace consort
