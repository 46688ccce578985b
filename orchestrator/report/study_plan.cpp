#include "orchestrator/report/study_plan.hpp"

#include "core/build.hpp"
#include "core/errors.hpp"
#include "orchestrator/report/cell_result.hpp"
#include "orchestrator/report/kept_results.hpp"

#include <fmt/format.h>

#include <charconv>

namespace consort {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const Setting& setting) {
  return {{"key", setting.key},     {"value", setting.value},
          {"label", setting.label}, {"number", setting.number ? Json(*setting.number) : Json()},
          {"line", setting.line},   {"column", setting.column}};
}

Setting setting_of(const Json& json) {
  Setting setting{json.at("key"), json.at("value"), json.at("label"), {}, json.at("line"), json.at("column")};
  if (json.at("number").is_number()) setting.number = json["number"].get<double>();
  return setting;
}

Json settings_json(const std::vector<Setting>& settings) {
  Json all = Json::array();
  for (const Setting& setting : settings) all.push_back(to_json(setting));
  return all;
}

std::vector<Setting> settings_of(const Json& json) {
  std::vector<Setting> all;
  for (const Json& one : json) all.push_back(setting_of(one));
  return all;
}

template <class Value>
Json optional_json(const std::optional<Value>& value) {
  return value ? Json(*value) : Json();
}
template <class Value>
void take(const Json& json, std::optional<Value>& into) {
  if (!json.is_null()) into = json.get<Value>();
}

Json to_json(const StudyAsked& asked) {
  const ScriptOverrides& o = asked.overrides;
  return {{"directory", asked.directory.string()},
          {"set", asked.sets},
          {"zip", asked.zipped},
          {"full", asked.full},
          {"force", asked.force},
          {"mode", o.mode ? Json(static_cast<int>(*o.mode)) : Json()},
          {"seed", optional_json(o.seed)},
          {"rounds", optional_json(o.rounds)},
          {"runs", optional_json(o.runs)},
          {"agents_per_process", optional_json(o.agents_per_process)},
          {"settings", settings_json(o.settings)}};
}

StudyAsked asked_of(const Json& json) {
  StudyAsked asked;
  asked.directory = json.at("directory").get<std::string>();
  asked.sets = json.at("set").get<std::vector<std::string>>();
  asked.zipped = json.at("zip");
  asked.full = json.at("full");
  asked.force = json.at("force");
  ScriptOverrides& o = asked.overrides;
  if (!json.at("mode").is_null()) o.mode = static_cast<Mode>(json["mode"].get<int>());
  take(json.at("seed"), o.seed);
  take(json.at("rounds"), o.rounds);
  take(json.at("runs"), o.runs);
  take(json.at("agents_per_process"), o.agents_per_process);
  o.settings = settings_of(json.at("settings"));
  return asked;
}

Json to_json(const PlannedCell& planned, std::size_t number) {
  return {{"cell", number},
          {"name", planned.cell.label()},
          {"protocols", planned.protocols},
          {"seed", planned.seed.value},
          {"runs", planned.runs},
          {"agents", planned.agents},
          {"hash", hex(planned.hash)},
          {"settings", settings_json(planned.cell.settings)}};
}

PlannedCell planned_of(const Json& json) {
  PlannedCell planned{{settings_of(json.at("settings"))},
                      json.at("protocols"),
                      Seed{json.at("seed").get<std::uint64_t>()},
                      json.at("runs"),
                      json.at("agents"),
                      0};
  const std::string text = json.at("hash");
  std::from_chars(text.data(), text.data() + text.size(), planned.hash, 16);
  return planned;
}

StudyPlan plan_of(const Json& json) {
  StudyPlan plan;
  plan.experiment = json.at("experiment");
  plan.description = json.at("description");
  plan.program = json.at("program");
  plan.mode = static_cast<Mode>(json.at("mode").get<int>());
  plan.dt = json.at("dt");
  plan.keys = json.at("keys").get<std::vector<std::string>>();
  plan.metrics = json.at("metrics").get<std::vector<std::string>>();
  for (const Json& one : json.at("criteria")) plan.criteria.push_back({one.at(0), one.at(1), one.at(2)});
  plan.asked = asked_of(json.at("asked"));
  for (const Json& one : json.at("cells")) plan.cells.push_back(planned_of(one));
  return plan;
}

}  // namespace

std::uint64_t cell_hash(const Experiment& experiment) {
  const std::string titles = experiment.protocols.front().title();
  return Purpose(version_text("consort") + '\n' + titles + '\n' + experiment.resolved_text).hash;
}

PlannedCell planned(const Cell& cell, const Experiment& experiment) {
  PlannedCell planned{cell, {}, experiment.seed, experiment.runs, experiment.agents, cell_hash(experiment)};
  for (const ProtocolChoice& choice : experiment.protocols) planned.protocols.push_back(choice.title());
  return planned;
}

Json to_json(const StudyPlan& plan) {
  Json json{{"experiment", plan.experiment},
            {"description", plan.description},
            {"program", plan.program},
            {"mode", static_cast<int>(plan.mode)},
            {"dt", plan.dt},
            {"keys", plan.keys},
            {"metrics", plan.metrics},
            {"criteria", Json::array()},
            {"asked", to_json(plan.asked)},
            {"cells", Json::array()}};
  for (const auto& one : plan.criteria) json["criteria"].push_back({one.text, one.line, one.column});
  for (const PlannedCell& cell : plan.cells) json["cells"].push_back(to_json(cell, json["cells"].size() + 1));
  return json;
}

StudyPlan plan_in(const std::filesystem::path& folder) {
  const auto file = folder / "plan.json";
  const Json json = json_in(file);
  if (json.is_null()) throw ConfigError(fmt::format("{}: holds no plan.json; allowed: the folder of a study", folder.string()));
  try {
    return plan_of(json);
  } catch (const Json::exception& error) {
    throw ConfigError(fmt::format("{}: is no plan of this consort ({}); allowed: what `consort run` left", file.string(), error.what()));
  }
}

std::filesystem::path cell_folder(const std::filesystem::path& folder, std::size_t cell) {
  return folder / "cells" / fmt::format("{:04}", cell + 1);
}

}  // namespace consort
