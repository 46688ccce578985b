#include "orchestrator/report/results.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

namespace consort {
namespace {

// A name that is safe as a folder's: everything unusual becomes an underscore.
std::string folder_name(const std::string& name) {
  std::string result;
  for (const char c : name) {
    const bool usual = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' || c == '.';
    result += usual ? c : '_';
  }
  return result.empty() || result.front() == '.' ? "_" + result : result;
}

void make_parents(const std::filesystem::path& folder) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) throw RunError(fmt::format("cannot create the folder {}: {}", folder.string(), failure.message()));
}

}  // namespace

std::filesystem::path create_results_folder(const std::filesystem::path& base, const std::string& experiment, std::time_t now) {
  make_parents(base);
  const std::string name = fmt::format("{}-{:%Y%m%d-%H%M%S}", folder_name(experiment), fmt::localtime(now));
  for (int attempt = 1;; ++attempt) {
    const auto folder = base / (attempt == 1 ? name : fmt::format("{}-{}", name, attempt));
    // mkdir is the test and the claim in one step, so two runs that start together never share a folder.
    if (::mkdir(folder.c_str(), 0777) == 0) return folder;
    if (errno != EEXIST) throw RunError(fmt::format("cannot create the folder {}: {}", folder.string(), std::strerror(errno)));
  }
}

void claim_output_folder(const std::filesystem::path& folder) {
  std::error_code failure;
  const auto status = std::filesystem::status(folder, failure);
  if (std::filesystem::exists(status)) {
    if (!std::filesystem::is_directory(status))
      throw ConfigError(fmt::format("--output {}: is not a folder; allowed: a folder that is absent or empty", folder.string()));
    const bool empty = std::filesystem::is_empty(folder, failure);
    if (failure) throw ConfigError(fmt::format("--output {}: {}", folder.string(), failure.message()));
    if (!empty) throw ConfigError(fmt::format("--output {}: is not empty; results are never overwritten, choose another", folder.string()));
    return;
  }
  std::filesystem::create_directories(folder, failure);
  if (failure) throw ConfigError(fmt::format("--output {}: cannot be created: {}", folder.string(), failure.message()));
}

void write_file(const std::filesystem::path& file, const std::string& text) {
  const std::filesystem::path unfinished = file.string() + ".part";
  errno = 0;
  std::ofstream out(unfinished, std::ios::binary);
  out << text;
  out.close();
  std::error_code failure(out ? 0 : errno, std::generic_category());
  if (out) std::filesystem::rename(unfinished, file, failure);
  if (out && !failure) return;
  std::error_code ignored;
  std::filesystem::remove(unfinished, ignored);
  throw RunError(fmt::format("cannot write {}: {}", file.string(), failure.message()));
}

void summarise(ProtocolResult& result) {
  std::map<std::string, std::vector<double>> values;
  for (const RunMetrics& run : result.per_run) {
    for (const auto& [name, value] : run.metrics) {
      auto& known = values[name];
      if (!std::isnan(value)) known.push_back(value);
    }
  }
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [name, known] : values) {
    const auto count = static_cast<double>(known.size());
    double sum = 0.0, squares = 0.0;
    for (const double value : known) sum += value;
    const double mean = known.empty() ? kNone : known.size() == 1 ? known.front() : sum / count;
    for (const double value : known) squares += (value - mean) * (value - mean);
    result.mean[name] = mean;
    result.deviation[name] = known.size() < 2 ? kNone : std::sqrt(squares / (count - 1.0));
    result.share[name] = count / static_cast<double>(result.per_run.size());
  }
}

Results::Results(const Experiment& experiment, std::filesystem::path output) : experiment_(experiment), output_(std::move(output)) {
  for (const ProtocolChoice& choice : experiment.protocols) {
    protocols_.emplace_back();
    protocols_.back().name = choice.title();
  }
  if (experiment_.metrics.empty()) return;
  for (const char* shown : {"consensus_value", "centralised_value", "bias", "disagreement", "error", "rounds_to_convergence"}) {
    if (std::find(experiment_.metrics.begin(), experiment_.metrics.end(), shown) == experiment_.metrics.end())
      experiment_.metrics.emplace_back(shown);
  }
}

Metrics Results::add(const JobOutcome& outcome) {
  ProtocolResult& result = protocols_.at(outcome.job.protocol);
  const Trace& trace = outcome.trace;
  hash_.mix(trace.hash);
  result.fewest_rounds = result.runs == 0 ? trace.last_round : std::min(result.fewest_rounds, trace.last_round);
  result.most_rounds = std::max(result.most_rounds, trace.last_round);
  result.rounds += trace.last_round;
  result.converged += trace.converged ? 1 : 0;
  result.totals.sent += trace.totals.sent;
  result.totals.delivered += trace.totals.delivered;
  result.totals.lost += trace.totals.lost;
  result.seconds += outcome.seconds;
  ++result.runs;
  RunMetrics& run = result.per_run.emplace_back(RunMetrics{outcome.job.seed, {}});
  add_end(outcome);
  if (trace.rounds.empty()) return {};
  run.metrics = compute_metrics(experiment_, outcome.job.seed, experiment_.protocols[outcome.job.protocol], trace);
  run.diverged = divergence(experiment_, outcome.job.seed, experiment_.protocols[outcome.job.protocol], trace);
  return run.metrics;
}

void Results::add_end(const JobOutcome& outcome) {
  ++ended_;
  merge(ends_, outcome.end.agents);
  if (!completeness_.complete) return;
  ending_ = outcome.end.ending;
  completeness_ = completeness(outcome.end, outcome.trace.last_round, experiment_.rounds);
  if (!completeness_.complete && protocols_.size() * experiment_.runs > 1)
    completeness_.words += fmt::format("; in run {} of {}", ended_, protocols_.size() * experiment_.runs);
}

namespace {

// What ended a session between its runs, or before the first.
Ending ending_of(Exit exit) {
  if (exit == Exit::timed_out) return Ending::deadline;
  return exit == Exit::interrupted || exit == Exit::terminated ? Ending::signal : Ending::failure;
}

}  // namespace

// How far it came, and what follows for the criteria.
void Results::conclude(Summary& summary) const {
  const bool cut_short = summary.exit == Exit::timed_out || summary.exit == Exit::interrupted || summary.exit == Exit::terminated;
  const std::size_t asked = protocols_.size() * experiment_.runs;
  summary.ending = ending_;
  summary.missing = completeness_.missing;
  summary.incomplete = completeness_.words;
  summary.ends = ends_.empty() ? agents_by_plan(experiment_, 0) : ends_;
  summary.complete = completeness_.complete && ended_ == asked && !cut_short;
  if (!summary.complete && completeness_.complete) summary.ending = ending_of(summary.exit);
  if (!summary.complete && summary.incomplete.empty())
    summary.incomplete =
        asked == 1 ? std::string("the run did not come to its end") : fmt::format("{} of {} runs came to their end", ended_, asked);
  if (!summary.complete && summary.error.empty()) {
    summary.exit = Exit::run_failed;
    summary.error = summary.incomplete;
  }
  // Of a run that has failed, some metrics may not be known.
  std::vector<std::string> known;
  for (const std::string& criterion : experiment_.criteria) {
    const auto names = metrics_of(criterion);
    if (summary.error.empty() ||
        std::all_of(names.begin(), names.end(), [&](const std::string& name) { return summary.metrics.contains(name); }))
      known.push_back(criterion);
  }
  summary.criteria = judge(known, summary.metrics);
  const bool all = std::all_of(summary.criteria.begin(), summary.criteria.end(), [](const auto& criterion) { return criterion.met; });
  if (summary.error.empty() && !all) summary.exit = Exit::criterion_not_met;
}

std::uint64_t samples_of(const std::vector<Refusal>& refused) {
  std::uint64_t sum = 0;
  for (const Refusal& refusal : refused) sum += refusal.samples;
  return sum;
}

Summary Results::summary(const SessionTimes& times, Exit exit, const std::string& error) const {
  Summary summary;
  summary.experiment = experiment_.name;
  summary.output = output_;
  summary.mode = experiment_.mode;
  summary.seed = experiment_.seed;
  summary.agents = experiment_.agents;
  summary.runs = experiment_.runs;
  if (ended_ > 0) summary.trace_hash = hash_.value();
  if (times.startup_seconds > 0.0) summary.startup_seconds = times.startup_seconds;
  summary.exit = exit;
  summary.error = error;
  summary.refused = refused_;
  std::uint64_t rounds = 0;
  double seconds = 0.0;
  for (ProtocolResult result : protocols_) {
    summarise(result);
    const std::string prefix = protocols_.size() > 1 ? result.name + "." : "";
    for (const auto& [name, value] : result.mean) {
      summary.metrics[prefix + name] = value;
      if (experiment_.runs == 1) continue;
      summary.metrics[prefix + name + ".std"] = result.deviation.at(name);
      summary.metrics[prefix + name + ".share"] = result.share.at(name);
    }
    rounds += result.rounds;
    seconds += result.seconds;
    summary.rounds = std::max(summary.rounds, result.most_rounds);
    summary.totals.sent += result.totals.sent;
    summary.totals.delivered += result.totals.delivered;
    summary.totals.lost += result.totals.lost;
    summary.protocols.push_back(std::move(result));
  }
  summary.rounds_per_second = seconds > 0.0 ? static_cast<double>(rounds) / seconds : 0.0;
  conclude(summary);
  return summary;
}

}  // namespace consort
