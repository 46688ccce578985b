#include "orchestrator/results.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>

namespace consort {
namespace {

/// A name that is safe as a folder's: everything unusual becomes an underscore.
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

/// Means and sample standard deviations over the runs, of every metric that all of them have.
void summarise(const std::vector<Metrics>& runs, Metrics& mean, Metrics& deviation) {
  if (runs.empty()) return;
  const auto count = static_cast<double>(runs.size());
  for (const auto& [name, first] : runs.front()) {
    double sum = 0.0, squares = 0.0;
    const auto everywhere = [&name = name](const Metrics& run) { return run.contains(name); };
    if (!std::all_of(runs.begin(), runs.end(), everywhere)) continue;
    for (const Metrics& run : runs) sum += run.at(name);
    const double average = sum / count;
    for (const Metrics& run : runs) squares += (run.at(name) - average) * (run.at(name) - average);
    mean[name] = runs.size() == 1 ? first : average;
    deviation[name] = runs.size() == 1 ? 0.0 : std::sqrt(squares / (count - 1.0));
  }
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
  std::ofstream out(unfinished, std::ios::binary);
  out << text;
  out.close();
  std::error_code failure;
  if (out) std::filesystem::rename(unfinished, file, failure);
  if (!out || failure) throw RunError(fmt::format("cannot write {}: {}", file.string(), std::strerror(errno)));
}

Results::Results(const Experiment& experiment, std::filesystem::path output) : experiment_(experiment), output_(std::move(output)) {
  for (const ProtocolChoice& choice : experiment.protocols) {
    protocols_.emplace_back();
    protocols_.back().result.name = choice.title();
  }
  if (experiment_.metrics.empty()) return;
  for (const char* shown : {"consensus_value", "centralised_value", "bias", "disagreement", "error", "rounds_to_convergence"}) {
    if (std::find(experiment_.metrics.begin(), experiment_.metrics.end(), shown) == experiment_.metrics.end())
      experiment_.metrics.emplace_back(shown);
  }
}

void Results::add(const JobOutcome& outcome) {
  PerProtocol& protocol = protocols_.at(outcome.job.protocol);
  ProtocolResult& result = protocol.result;
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
  if (!trace.rounds.empty())
    protocol.metrics.push_back(compute_metrics(experiment_, outcome.job.seed, experiment_.protocols[outcome.job.protocol], trace));
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
  summary.trace_hash = hash_.value();
  summary.startup_seconds = times.startup_seconds;
  summary.exit = exit;
  summary.error = error;
  summary.refused = refused_;
  std::uint64_t rounds = 0;
  double seconds = 0.0;
  for (const PerProtocol& protocol : protocols_) {
    ProtocolResult result = protocol.result;
    summarise(protocol.metrics, result.mean, result.deviation);
    const std::string prefix = protocols_.size() > 1 ? result.name + "." : "";
    for (const auto& [name, value] : result.mean) {
      summary.metrics[prefix + name] = value;
      if (experiment_.runs > 1) summary.metrics[prefix + name + ".std"] = result.deviation.at(name);
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
  if (error.empty()) {
    summary.criteria = judge(experiment_.criteria, summary.metrics);
    const bool all = std::all_of(summary.criteria.begin(), summary.criteria.end(), [](const auto& criterion) { return criterion.met; });
    if (!all) summary.exit = Exit::criterion_not_met;
  }
  return summary;
}

std::string to_json(const Summary& summary) {
  nlohmann::ordered_json json;
  json["experiment"] = summary.experiment;
  json["passed"] = summary.passed();
  json["exit"] = static_cast<int>(summary.exit);
  if (!summary.error.empty()) json["error"] = summary.error;
  json["mode"] = std::string(name_of(summary.mode));
  json["seed"] = summary.seed.value;
  json["runs"] = summary.runs;
  json["rounds"] = summary.rounds;
  json["trace_hash"] = fmt::format("{:016x}", summary.trace_hash);
  json["criteria"] = nlohmann::ordered_json::array();
  for (const CriterionResult& criterion : summary.criteria)
    json["criteria"].push_back({{"text", criterion.text}, {"met", criterion.met}, {"value", criterion.value}});
  json["metrics"] = nlohmann::ordered_json::object();
  for (const auto& [name, value] : summary.metrics) json["metrics"][name] = value;
  json["performance"] = {{"startup_seconds", summary.startup_seconds},
                         {"rounds_per_second", summary.rounds_per_second},
                         {"messages_sent", summary.totals.sent},
                         {"messages_delivered", summary.totals.delivered},
                         {"messages_lost", summary.totals.lost}};
  json["rejected"] = {{"samples", samples_of(summary.refused)}, {"by", nlohmann::ordered_json::array()}};
  for (const Refusal& refusal : summary.refused) {
    nlohmann::ordered_json entry{{"topic", refusal.topic},
                                 {"reason", refusal.reason == Refusal::Reason::stranger ? "stranger" : "bound"},
                                 {"participant", refusal.writer},
                                 {"process", refusal.who},
                                 {"samples", refusal.samples}};
    if (!refusal.field.empty()) entry["field"] = refusal.field;
    json["rejected"]["by"].push_back(std::move(entry));
  }
  json["output"] = summary.output.string();
  // What a file name or an error text may hold that is not UTF-8 must not cost the summary.
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace consort
