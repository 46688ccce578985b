#include "orchestrator/report/cell_result.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>

namespace consort {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) {
  if (std::isinf(value)) return value > 0 ? "inf" : "-inf";
  return std::isnan(value) ? Json() : Json(value);
}

double number_of(const Json& json) {
  if (json.is_string()) return json == "inf" ? std::numeric_limits<double>::infinity() : -std::numeric_limits<double>::infinity();
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

std::uint64_t word_of(const Json& json) {
  const auto& text = json.get_ref<const std::string&>();
  std::uint64_t word = 0;
  std::from_chars(text.data(), text.data() + text.size(), word, 16);
  return word;
}

Json to_json(const CellRun& run) {
  Json metrics = Json::object();
  for (const auto& [name, value] : run.metrics) metrics[name] = number(value);
  Json json{{"protocol", run.protocol},
            {"seed", run.seed.value},
            {"agents", run.agents},
            {"rounds", run.rounds},
            {"converged", run.converged},
            {"messages", {run.totals.sent, run.totals.delivered, run.totals.lost}},
            {"trace_hash", hex(run.trace_hash)},
            {"seconds", run.seconds},
            {"metrics", std::move(metrics)}};
  if (const auto& d = run.diverged) json["diverged"] = {d->of_error, d->from_round, d->to_round, number(d->from), number(d->to)};
  return json;
}

CellRun run_of(const Json& json) {
  CellRun run;
  run.protocol = json.at("protocol").get<std::string>();
  run.seed = Seed{json.at("seed").get<std::uint64_t>()};
  run.agents = json.at("agents").get<std::size_t>();
  run.rounds = json.at("rounds").get<Round>();
  run.converged = json.at("converged").get<bool>();
  const Json& messages = json.at("messages");
  run.totals = {messages.at(0).get<std::uint64_t>(), messages.at(1).get<std::uint64_t>(), messages.at(2).get<std::uint64_t>()};
  run.trace_hash = word_of(json.at("trace_hash"));
  run.seconds = json.at("seconds").get<double>();
  for (const auto& [name, value] : json.at("metrics").items()) run.metrics[name] = number_of(value);
  if (json.contains("diverged")) {
    const Json& d = json["diverged"];
    run.diverged = Divergence{d.at(0).get<bool>(), d.at(1).get<Round>(), d.at(2).get<Round>(), number_of(d.at(3)), number_of(d.at(4))};
  }
  return run;
}

Json numbers(const std::vector<double>& values) {
  Json out = Json::array();
  for (const double value : values) out.push_back(number(value));
  return out;
}

std::vector<double> numbers_of(const Json& json) {
  std::vector<double> out;
  for (const Json& one : json) out.push_back(number_of(one));
  return out;
}

}  // namespace

std::string hex(std::uint64_t word) { return fmt::format("{:016x}", word); }

nlohmann::ordered_json to_json(const CellResult& result) {
  Json json{{"hash", hex(result.hash)}, {"exit", static_cast<int>(result.exit)}, {"runs", Json::array()}};
  if (!result.error.empty()) json["error"] = result.error;
  for (const CellRun& run : result.runs) json["runs"].push_back(to_json(run));
  for (const CellCurve& curve : result.curves)
    json["curves"].push_back({{"protocol", curve.protocol},
                              {"of_error", curve.of_error},
                              {"rounds", curve.rounds},
                              {"low", numbers(curve.low)},
                              {"median", numbers(curve.median)},
                              {"high", numbers(curve.high)}});
  return json;
}

std::optional<CellResult> cell_result_of(const nlohmann::ordered_json& json) {
  try {
    CellResult result;
    result.hash = word_of(json.at("hash"));
    result.exit = static_cast<Exit>(json.at("exit").get<int>());
    result.error = json.value("error", "");
    for (const Json& run : json.at("runs")) result.runs.push_back(run_of(run));
    for (const Json& curve : json.value("curves", Json::array()))
      result.curves.push_back({curve.at("protocol"), curve.at("of_error"), curve.at("rounds").get<std::vector<Round>>(),
                               numbers_of(curve.at("low")), numbers_of(curve.at("median")), numbers_of(curve.at("high"))});
    return result;
  } catch (const Json::exception&) {
    return std::nullopt;
  }
}

}  // namespace consort
