#include "orchestrator/cli/cell.hpp"

#include "orchestrator/cli/signals.hpp"
#include "orchestrator/report/findings.hpp"
#include "orchestrator/report/page.hpp"
#include "orchestrator/report/record.hpp"
#include "orchestrator/report/results.hpp"
#include "orchestrator/report/study_plan.hpp"
#include "orchestrator/run/host.hpp"

#include <map>
#include <new>
#include <optional>

namespace consort {
namespace {

constexpr auto kReplace = nlohmann::ordered_json::error_handler_t::replace;

// Computes the metrics of each run, and keeps no more of it unless a record is asked for.
class CellScribe : public RunObserver {
 public:
  CellScribe(const Experiment& experiment, const CellOptions& options, CellResult& result)
      : experiment_(experiment), results_(experiment, options.folder), result_(result), curves_(options.curves) {
    if (options.full) record_.emplace(options.folder / "record.sqlite", experiment);
  }

  void launching(std::size_t, std::size_t, std::size_t) override {}
  void run_begins(const Job& job, const Trace& outline) override {
    if (record_) record_->begin_run(job, outline);
  }
  void report(const Job& job, const RoundReport& report) override {
    if (record_) record_->add(job, report);
  }
  void event(const Job& job, Round round, const std::string& kind, const std::string& text) override {
    if (record_) record_->event(job, round, kind, text);
  }
  void run_ends(const JobOutcome& outcome) override {
    const Trace& trace = outcome.trace;
    const ProtocolChoice& choice = experiment_.protocols[outcome.job.protocol];
    Metrics metrics = results_.add(outcome);
    if (curves_) of_protocol_[outcome.job.protocol].add(trace);
    if (record_) record_->end_run(outcome, metrics);
    result_.runs.push_back({choice.title(), outcome.job.seed, experiment_.agents, trace.last_round, trace.converged, trace.totals,
                            trace.hash, outcome.seconds, std::move(metrics),
                            trace.rounds.empty() ? std::nullopt : divergence(experiment_, outcome.job.seed, choice, trace)});
  }
  void refused(const std::vector<Refusal>& refusals) override { results_.set_refusals(refusals); }

  /// Ends record and curves.
  Summary summary(Exit exit, const std::string& error) {
    Summary summary = results_.summary({}, exit, error);
    if (record_) record_->conclude(summary);
    record_.reset();
    for (const auto& [protocol, curve] : of_protocol_) result_.curves.push_back(curve.curve(experiment_.protocols[protocol].title()));
    return summary;
  }

 private:
  const Experiment& experiment_;
  Results results_;
  CellResult& result_;
  bool curves_;
  std::map<std::size_t, CurveOverSeeds> of_protocol_;
  std::optional<Record> record_;
};

void fail(CellResult& result, Exit exit, const std::string& error) {
  result.exit = exit;
  result.error = error;
}

void run(const Experiment& experiment, const CellOptions& options, CellScribe& scribe, CellResult& result) {
  try {
    if (!options.force) refuse_unsound(examine(experiment, Effort::of_run()));
    if (experiment.mode == Mode::simulate)
      run_simulated(experiment, options.run, scribe);
    else
      run_processes(experiment, options.run, scribe);
  } catch (const ConfigError& error) {
    fail(result, Exit::bad_input, error.what());
  } catch (const TimeoutError& error) {
    fail(result, Exit::timed_out, error.what());
  } catch (const std::bad_alloc&) {
    fail(result, Exit::run_failed, "out of memory");
  } catch (const std::exception& error) {
    fail(result, Exit::run_failed, error.what());
  }
  if (const int signal = caught_signal().load(); signal != 0) fail(result, interrupted_exit(signal), "interrupted");
}

void keep(const Experiment& experiment, const CellOptions& options, const Summary& summary, const CellResult& result) {
  if (options.full) {
    write_file(options.folder / "experiment.yaml", experiment.resolved_text);
    write_file(options.folder / "host.json", host_facts(experiment, {}).dump(2, ' ', false, kReplace) + "\n");
    write_file(options.folder / "report.html", page_of({options.folder}));
  }
  auto json = nlohmann::ordered_json::parse(to_json(summary));
  json["cell"] = to_json(result);
  write_file(options.folder / "summary.json", json.dump(2, ' ', false, kReplace) + "\n");  // last: with it the cell is done
}

}  // namespace

CellResult run_cell(const Experiment& experiment, const CellOptions& options) {
  CellResult result;
  result.hash = cell_hash(experiment);
  const bool kept = !options.folder.empty();
  CellOptions own = options;
  if (kept) {
    std::filesystem::remove_all(options.folder);  // what somebody left who was killed, or failed
    std::filesystem::create_directories(options.folder / "logs");
    own.run.log_directory = options.folder / "logs";
    own.run.spill_directory = options.folder;
  }
  CellScribe scribe(experiment, own, result);
  run(experiment, own, scribe, result);
  const Summary summary = scribe.summary(result.exit, result.error);
  if (result.done() && !summary.complete) fail(result, Exit::run_failed, summary.incomplete);
  if (kept && caught_signal().load() == 0) keep(experiment, own, summary, result);
  return result;
}

}  // namespace consort
