#include "orchestrator/cli/scribe.hpp"

#include "core/counted.hpp"
#include "io/standard_streams.hpp"
#include "orchestrator/report/terminal.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <utility>

namespace consort {

Scribe::Scribe(const Experiment& experiment, const std::filesystem::path& output, bool quiet)
    : experiment_(experiment), record_(std::in_place, output / "record.sqlite", experiment), results_(experiment, output) {
  if (!quiet) progress_.emplace(experiment, style_of(STDERR_FILENO), streams::tell);
}

void Scribe::launching(std::size_t found, std::size_t ready, std::size_t total) {
  if (progress_) progress_->launching(found, ready, total);
}

void Scribe::run_begins(const Job& job, const Trace& outline) {
  if (job.number == 0) times_.startup_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  record_->begin_run(job, outline);
  for (const std::string& text : std::exchange(remarks_, {})) record_->event(job, 0, "remark", text);
  if (progress_) progress_->run_begins(job, outline);
}

void Scribe::report(const Job& job, const RoundReport& report) {
  round_ = report.k;
  record_->add(job, report);
  if (progress_) progress_->report(job, report);
}

void Scribe::event(const Job& job, Round round, const std::string& kind, const std::string& text) {
  record_->event(job, round, kind, text);
  if (progress_) progress_->note(fmt::format("{} in round {}: {}", kind, round, text));
}

void Scribe::run_ends(const JobOutcome& outcome) {
  const Metrics metrics = results_.add(outcome);  // first: the record may not take it
  record_metrics(outcome, metrics);
}

void Scribe::remark(const std::string& text) {
  note(text);
  remarks_.push_back(text);
}

void Scribe::note(const std::string& text) {
  if (progress_) progress_->note(text);
}

void Scribe::close() {
  if (progress_) progress_->finish();
  record_->flush();
}

void Scribe::conclude(const Summary& summary) {
  if (!record_) return;
  record_->conclude(summary);
  record_->flush();
  record_.reset();
}

std::string Scribe::abandon() {
  std::string lost;
  if (progress_) progress_->finish();
  try {
    if (record_) record_->flush();
  } catch (const std::exception&) {
    lost = fmt::format("the record holds {}; what came after it, up to round {}, is not saved", record_->saved(), round_);
  }
  return lost;
}

void Scribe::record_metrics(const JobOutcome& outcome, const Metrics& metrics) {
  const Trace& trace = outcome.trace;
  const Completeness ended = completeness(outcome.end, trace.last_round, experiment_.rounds);
  if (!ended.complete) record_->event(outcome.job, trace.last_round, "incomplete", ended.words);
  for (const AgentEnd& agent : outcome.end.agents)
    if (agent.slept > 0)
      record_->event(outcome.job, trace.last_round, "slept", fmt::format("agent {}: {}", agent.agent.value, counted(agent.slept, "round")));
  record_->end_run(outcome, metrics);
}

}  // namespace consort
