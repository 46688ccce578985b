#include "orchestrator/report/results.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <limits>
#include <utility>

namespace consort {
namespace {

// By protocol: the seeds, and for every metric its value in each of those runs.
nlohmann::ordered_json per_run(const Summary& summary) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const ProtocolResult& result : summary.protocols) {
    nlohmann::ordered_json seeds = nlohmann::ordered_json::array(), metrics = nlohmann::ordered_json::object();
    for (const RunMetrics& run : result.per_run) seeds.push_back(run.seed.value);
    for (const auto& [name, mean] : result.mean) {
      for (const RunMetrics& run : result.per_run) {
        const auto found = run.metrics.find(name);
        metrics[name].push_back(found == run.metrics.end() ? std::numeric_limits<double>::quiet_NaN() : found->second);
      }
    }
    out.push_back({{"protocol", result.name}, {"seeds", std::move(seeds)}, {"metrics", std::move(metrics)}});
  }
  return out;
}

// The runs that drew apart, with the numbers.
nlohmann::ordered_json diverged(const Summary& summary) {
  auto runs = nlohmann::ordered_json::array();
  for (const ProtocolResult& result : summary.protocols)
    for (const RunMetrics& run : result.per_run)
      if (run.diverged)
        runs.push_back({{"protocol", result.name},
                        {"seed", run.seed.value},
                        {"of", run.diverged->of_error ? "error" : "disagreement"},
                        {"from_round", run.diverged->from_round},
                        {"from", run.diverged->from},
                        {"to_round", run.diverged->to_round},
                        {"to", run.diverged->to}});
  return runs;
}

}  // namespace

std::string to_json(const Summary& summary) {
  nlohmann::ordered_json json;
  json["experiment"] = summary.experiment;
  json["passed"] = summary.passed();
  json["exit"] = static_cast<int>(summary.exit);
  if (!summary.error.empty()) json["error"] = summary.error;
  json["complete"] = summary.complete;
  json["ending"] = std::string(name_of(summary.ending));
  if (!summary.complete) {
    json["incomplete"] = summary.incomplete;
    json["missing"] = summary.missing;
  }
  json["mode"] = std::string(name_of(summary.mode));
  json["seed"] = summary.seed.value;
  json["runs"] = summary.runs;
  json["rounds"] = summary.rounds;
  if (summary.trace_hash) json["trace_hash"] = fmt::format("{:016x}", *summary.trace_hash);
  json["criteria"] = nlohmann::ordered_json::array();
  for (const CriterionResult& criterion : summary.criteria) {
    nlohmann::ordered_json met;  // null: a run that is not complete meets nothing
    if (summary.complete) met = criterion.met;
    json["criteria"].push_back({{"text", criterion.text}, {"met", met}, {"value", criterion.value}, {"metrics", criterion.metrics}});
    if (!criterion.undefined.empty()) json["criteria"].back()["undefined"] = criterion.undefined;
  }
  json["metrics"] = nlohmann::ordered_json::object();
  for (const auto& [name, value] : summary.metrics) json["metrics"][name] = value;
  if (summary.runs > 1) json["per_run"] = per_run(summary);
  json["diverged"] = diverged(summary);
  auto& performance = json["performance"] = nlohmann::ordered_json::object();
  if (summary.startup_seconds) performance["startup_seconds"] = *summary.startup_seconds;
  performance["rounds_per_second"] = summary.rounds_per_second;
  performance["messages_sent"] = summary.totals.sent;
  performance["messages_delivered"] = summary.totals.delivered;
  performance["messages_lost"] = summary.totals.lost;
  json["agents"] = nlohmann::ordered_json::array();
  for (const auto& [ids, end] : alike(summary.ends)) {
    nlohmann::ordered_json entry{{"ids", listed(ids)}, {"reached", end.reached}, {"asked", end.asked}};
    if (end.absence != AgentEnd::Absence::none) entry["absence"] = std::string(name_of(end.absence));
    if (summary.mode == Mode::realtime) entry["slept"] = end.slept;
    json["agents"].push_back(std::move(entry));
  }
  json["rejected"] = {{"samples", samples_of(summary.refused)}, {"by", nlohmann::ordered_json::array()}};
  for (const Refusal& refusal : summary.refused) {
    nlohmann::ordered_json entry{{"topic", refusal.topic},
                                 {"reason", word(refusal.reason)},
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
