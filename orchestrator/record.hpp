#pragma once
/// The record of a run: SQLite in WAL mode, so that a crash loses nothing committed. Writing happens on a thread of its own, in batches.

#include "orchestrator/run.hpp"

#include <filesystem>
#include <memory>
#include <string>

namespace consort {

class Record {
 public:
  /// Creates `file` (must not exist). Throws RunError with SQLite's words and the path.
  explicit Record(const std::filesystem::path& file);
  ~Record();  ///< drains and closes
  Record(const Record&) = delete;
  Record& operator=(const Record&) = delete;

  void begin_run(const Job& job, const Experiment& experiment, const RunLayouts& layouts);
  void add(const Job& job, const RoundReport& report);
  void event(const Job& job, Round round, const std::string& kind, const std::string& text);
  void end_run(const JobOutcome& outcome);
  void flush();  ///< returns when everything handed over so far is committed; throws RunError if writing failed

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace consort
