/// Every parameter of every protocol and model, and every word documented for one, goes through the file as it is documented.

#include "core/errors.hpp"
#include "models/registry.hpp"
#include "orchestrator/script/script.hpp"
#include "protocols/registry.hpp"
#include "protocols/theory.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <functional>
#include <map>
#include <regex>

namespace consort {
namespace {

const std::filesystem::path kExperiments = std::filesystem::path(kSourceDir) / "experiments";

/// The shipped experiments, read.
const std::map<std::string, YAML::Node>& shipped() {
  static const auto all = [] {
    std::map<std::string, YAML::Node> out;
    for (const auto& entry : std::filesystem::directory_iterator(kExperiments))
      if (entry.path().extension() == ".yaml") out[entry.path().filename().string()] = YAML::LoadFile(entry.path().string());
    return out;
  }();
  return all;
}

/// A name, or a mapping with one: as a mapping.
YAML::Node as_map(const YAML::Node& choice) {
  if (choice.IsMap()) return choice;
  YAML::Node out(YAML::NodeType::Map);
  out["name"] = choice.Scalar();
  return out;
}

/// Shipped experiments with the protocol, or the model, of that name: shortened to it alone.
std::vector<YAML::Node> with_protocol(std::string_view name) {
  std::vector<YAML::Node> out;
  for (const auto& [file, original] : shipped()) {
    YAML::Node experiment = YAML::Clone(original);
    YAML::Node agents = experiment["agents"];
    std::vector<YAML::Node> choices;
    if (agents["protocol"]) choices.push_back(agents["protocol"]);
    for (const auto& choice : agents["protocols"]) choices.push_back(choice);
    for (const YAML::Node& choice : choices) {
      const YAML::Node map = as_map(choice);
      if (map["name"].Scalar() != name) continue;
      agents.remove("protocols");
      agents["protocol"] = map;
      for (const char* key : {"criteria", "metrics", "sweep", "stop"}) experiment.remove(key);
      out.push_back(experiment);
    }
  }
  if (!out.empty()) return out;
  for (const auto& [file, original] : shipped()) {  // no shipped experiment has it: in the place of another protocol that senses alike
    const YAML::Node sensing = original["plant"] ? original["plant"]["sensing"] : YAML::Node(YAML::NodeType::Undefined);
    if (!sensing || !sensing.IsMap()) continue;
    YAML::Node experiment = YAML::Clone(original);
    YAML::Node agents = experiment["agents"];
    for (const char* key : {"protocols", "initial", "overrides"}) agents.remove(key);
    agents["protocol"] = as_map(YAML::Node(std::string(name)));
    for (const char* key : {"criteria", "metrics", "sweep", "stop"}) experiment.remove(key);
    out.push_back(experiment);
  }
  return out;
}
std::vector<YAML::Node> with_model(std::string_view name) {
  std::vector<YAML::Node> out;
  for (const auto& [file, original] : shipped()) {
    if (!original["plant"] || as_map(original["plant"]["model"])["name"].Scalar() != name) continue;
    YAML::Node experiment = YAML::Clone(original);
    experiment["plant"]["model"] = as_map(experiment["plant"]["model"]);
    for (const char* key : {"criteria", "metrics", "sweep", "stop"}) experiment.remove(key);
    out.push_back(experiment);
  }
  return out;
}

struct Table {
  std::string name;
  std::span<const ValueDoc> parameters;
  std::vector<YAML::Node> experiments;
  std::function<YAML::Node(YAML::Node)> place;             ///< where its parameters stand in the file
  std::function<const Values&(const Experiment&)> parsed;  ///< and in the experiment
};

std::vector<Table> tables() {
  std::vector<Table> out;
  for (const ProtocolEntry& entry : protocol_table())
    out.push_back({std::string(entry.name), entry.parameters, with_protocol(entry.name),
                   [](YAML::Node e) { return e["agents"]["protocol"]; },
                   [](const Experiment& e) -> const Values& { return e.protocols.front().parameters; }});
  for (const PlantEntry& entry : plant_table())
    out.push_back({std::string(entry.name), entry.parameters, with_model(entry.name), [](YAML::Node e) { return e["plant"]["model"]; },
                   [](const Experiment& e) -> const Values& { return e.plant->parameters; }});
  return out;
}

/// Sets another choice to one of its words, or leaves out another parameter, or both: what a value may ask for.
std::vector<std::function<void(YAML::Node)>> accommodations(const Table& table, const YAML::Node& given, const std::string& parameter) {
  std::vector<std::pair<std::string, std::string>> chosen{{"", ""}};
  for (const ValueDoc& doc : table.parameters)
    if (doc.name != parameter)
      for (const std::string& word : choices_of(doc)) chosen.emplace_back(doc.name, word);
  std::vector<std::string> dispensable{""};
  for (const auto& entry : given)
    if (entry.first.Scalar() != "name" && entry.first.Scalar() != parameter) dispensable.push_back(entry.first.Scalar());
  std::vector<std::function<void(YAML::Node)>> out;
  for (const auto& [name, word] : chosen)
    for (const std::string& without : dispensable)
      out.emplace_back([name = name, word = word, without](YAML::Node place) {
        if (!name.empty()) place[name] = word;
        place.remove(without);
      });
  return out;
}

/// What the parameter is read as in the first of the experiments that may give it this value; nothing if none may. `told`: why the last
/// one refused.
std::optional<double> accepted(const Table& table, const std::string& parameter, const std::string& value, std::string& told) {
  for (const YAML::Node& original : table.experiments) {
    for (const auto& accommodate : accommodations(table, table.place(original), parameter)) {
      YAML::Node experiment = YAML::Clone(original);
      YAML::Node place = table.place(experiment);
      accommodate(place);
      place[parameter] = YAML::Load(value);
      try {
        const Experiment read = parse_experiment(YAML::Dump(experiment), "e.yaml", kExperiments);
        const Experiment again = parse_experiment(read.resolved_text, "resolved.yaml", kExperiments);
        const Matrix& found = *table.parsed(read).find(parameter);
        EXPECT_EQ(*table.parsed(again).find(parameter), found) << table.name << " " << parameter << " resolved";
        return found(0, 0);
      } catch (const ConfigError& error) {
        told = error.what();
      }
    }
  }
  return std::nullopt;
}

/// What a file may say for it: a choice's words, a switch's values, the documented default, what shipped files have.
std::vector<std::string> sayings(const Table& table, const ValueDoc& doc) {
  auto words = choices_of(doc);
  if (!words.empty()) return words;
  if (doc.shape == kSwitch) return {"0", "1", "true", "false"};
  const std::string fallback(doc.fallback);
  double number = 0.0;
  const auto [end, error] = std::from_chars(fallback.data(), fallback.data() + fallback.size(), number);
  if (error == std::errc{} && end == fallback.data() + fallback.size()) return {fallback};
  for (const YAML::Node& experiment : table.experiments)
    if (const YAML::Node given = table.place(experiment)[std::string(doc.name)]) return {YAML::Dump(given)};
  if (!doc.shape.starts_with("matrix")) return {"1"};
  // One column, one row or an identity that fits.
  std::string told, column, row;
  for (int n = 1; n <= 8; ++n) {
    column += (n > 1 ? ", " : "") + std::string("[1]");
    row += (n > 1 ? ", " : "") + std::string("1");
    std::string identity;
    for (int i = 0; i < n; ++i) {
      identity += i > 0 ? ", [" : "[";
      for (int j = 0; j < n; ++j) identity += std::string(j > 0 ? ", " : "") + (i == j ? "1" : "0");
      identity += "]";
    }
    for (const std::string& matrix : {"[" + column + "]", "[[" + row + "]]", "[" + identity + "]"})
      if (accepted(table, std::string(doc.name), matrix, told)) return {matrix};
  }
  return {"[[1]]"};
}

/// Why the file is refused, nothing if it is not. Numbers that mathematics refuses while theory is asked are no refusal.
std::string refusal_of(const YAML::Node& file) {
  try {
    static_cast<void>(examine(parse_experiment(YAML::Dump(file), "e.yaml", kExperiments), Effort(1e5, 1e4)));
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

TEST(ScriptWords, NumbersBeyondReasonAreRefusedWithPlaceAndName) {
  std::size_t refused = 0;
  for (const Table& table : tables()) {
    ASSERT_FALSE(table.experiments.empty()) << table.name;
    std::vector<YAML::Node> files;
    for (const char* value : {"1e300", "1e-300", "1e308"}) {
      for (const ValueDoc& doc : table.parameters) {
        if (!choices_of(doc).empty()) continue;
        files.push_back(YAML::Clone(table.experiments.front()));
        table.place(files.back())[std::string(doc.name)] = value;
      }
      files.push_back(YAML::Clone(table.experiments.front()));
      files.back().remove("duration");
      files.back().remove("events");
      files.back()["dt"] = value;
    }
    for (const YAML::Node& file : files) {
      const std::string why = refusal_of(file);
      if (why.empty()) continue;
      ++refused;
      EXPECT_TRUE(std::regex_search(why, std::regex("^e.yaml:[0-9]+:[0-9]+: "))) << why;
      // dt may be too much for the protocol that a model's experiment has.
      EXPECT_TRUE(why.find("agents: agent ") != std::string::npos || why.find(table.name) != std::string::npos ||
                  why.find("plant") != std::string::npos)
          << why;
    }
  }
  EXPECT_GT(refused, 50U);
}

TEST(ScriptWords, EveryParameterAndEveryDocumentedWordIsReadFromAFile) {
  std::size_t words = 0;
  for (const Table& table : tables()) {
    if (table.parameters.empty()) continue;
    ASSERT_FALSE(table.experiments.empty()) << table.name << ": no shipped experiment has it";
    for (const ValueDoc& doc : table.parameters) {
      const std::string parameter(doc.name);
      const auto choices = choices_of(doc);
      for (const std::string& saying : sayings(table, doc)) {
        std::string told;
        const auto read = accepted(table, parameter, saying, told);
        EXPECT_TRUE(read.has_value()) << table.name << ": {" << parameter << ": " << saying << "}: " << told;
        if (choices.empty()) continue;
        const auto index = std::find(choices.begin(), choices.end(), saying) - choices.begin();
        EXPECT_EQ(read.value_or(-1.0), static_cast<double>(index)) << table.name << " " << parameter << ": " << saying;
        ++words;
      }
      if (choices.empty()) continue;
      std::string told;
      EXPECT_FALSE(accepted(table, parameter, "no_such_word", told).has_value());
      EXPECT_NE(told.find(choices.back()), std::string::npos) << "the words are named: " << told;
    }
  }
  EXPECT_GE(words, 20U);
}

TEST(ScriptWords, WordsAreReadForOneAgentToo) {
  const auto read = [](const std::string& plant, const std::string& protocol) {
    return parse_experiment("experiment: e\nagents: {count: 2, protocol: continuous_kalman_consensus, initial: {x: 0}, overrides: {2: {" +
                                protocol + "}}}\ntopology: ring\n" + plant,
                            "e.yaml", ".");
  };
  const Experiment e = read("", "parameters: {method: euler, self_term: true}");
  EXPECT_EQ(e.overrides.at(AgentId{2}).parameters.scalar("method"), 1.0);
  EXPECT_EQ(e.overrides.at(AgentId{2}).parameters.scalar("self_term"), 1.0);
  YAML::Node beam = with_model("beam").front();
  for (int agent = 1; agent <= beam["agents"]["count"].as<int>(); ++agent)
    beam["plant"]["overrides"][std::to_string(agent)]["parameters"]["reduction"] = "finite_elements";
  const Experiment whole = parse_experiment(YAML::Dump(beam), "e.yaml", kExperiments);
  EXPECT_EQ(whole.plant->overrides.at(AgentId{1}).parameters.scalar("reduction"), 1.0);
  EXPECT_NE(whole.resolved_text.find("reduction: finite_elements"), std::string::npos);
}

TEST(Schema, ListsTheNamesAndTheWordsOfTheTables) {
  const auto schema = nlohmann::json::parse(experiment_schema());
  const auto& definitions = schema["definitions"];
  std::vector<std::string> protocols, plants;
  for (const ProtocolEntry& entry : protocol_table()) protocols.emplace_back(entry.name);
  for (const PlantEntry& entry : plant_table()) plants.emplace_back(entry.name);
  EXPECT_EQ(definitions["protocol_name"]["anyOf"][0]["enum"], protocols);
  EXPECT_EQ(definitions["plant_name"]["anyOf"][0]["enum"], plants);

  // Of an exception for one agent, which does not say what it is of.
  const auto expect_words = [&](const nlohmann::json& properties, const ValueDoc& doc, std::string_view whose) {
    const std::string name(doc.name);
    ASSERT_TRUE(properties.contains(name)) << whose << ": the schema does not list the words of " << name;
    const std::string pointer = properties[name].at("$ref").get<std::string>().substr(1);
    const auto& listed = schema.at(nlohmann::json::json_pointer(pointer));
    EXPECT_EQ(listed["enum"], choices_of(doc)) << whose << " " << name;
    EXPECT_EQ(listed["default"], std::string(doc.fallback)) << whose << " " << name;
  };
  const auto expect_form = [](const nlohmann::json& form, std::string_view name, std::span<const ValueDoc> docs) {
    EXPECT_EQ(form["properties"]["name"]["const"], name);
    EXPECT_EQ(form["properties"].size(), docs.size() + 1) << name;
    for (const ValueDoc& doc : docs) {
      const auto& listed = form["properties"][std::string(doc.name)];
      const std::string text = listed["description"];
      EXPECT_NE(text.find(doc.fallback.empty() ? "Required" : std::string(doc.fallback)), std::string::npos) << name << " " << doc.name;
      if (!choices_of(doc).empty()) EXPECT_EQ(listed["enum"], choices_of(doc)) << name << " " << doc.name;
    }
  };
  const auto& overrides = definitions["parameters"]["properties"];
  const auto expect_table = [&](const nlohmann::json& forms, const auto& table) {
    std::size_t form = 0;
    for (const auto& entry : table) {
      expect_form(forms[form++], entry.name, entry.parameters);
      for (const ValueDoc& doc : entry.parameters)
        if (!choices_of(doc).empty()) expect_words(overrides, doc, entry.name);
    }
    EXPECT_EQ(forms.size(), form + 1);  // and that of plug-ins
  };
  expect_table(definitions["protocol_by_name"]["oneOf"], protocol_table());
  expect_table(definitions["model_by_name"]["oneOf"], plant_table());
}

}  // namespace
}  // namespace consort
