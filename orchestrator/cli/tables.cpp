#include "orchestrator/cli/tables.hpp"

#include "models/registry.hpp"
#include "orchestrator/cli/link_schema.hpp"
#include "orchestrator/report/terminal.hpp"
#include "orchestrator/script/topology.hpp"
#include "protocols/metrics.hpp"
#include "protocols/registry.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>

namespace consort {
namespace {

constexpr std::size_t kWidth = 120;

using Json = nlohmann::ordered_json;

// --- Markdown -------------------------------------------------------------------------------------------------------------

// `<agent>` is no tag, and `*` no emphasis.
std::string plain(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '<' || c == '*') out += '\\';
    out += c;
  }
  return out;
}

std::string with_capital(std::string text) {
  if (!text.empty()) text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  return text;
}

std::string point(const std::string& text) {
  std::string out;
  for (const std::string& line : wrapped(text, kWidth - 2)) out += (out.empty() ? "- " : "  ") + line + "\n";
  return out;
}

std::string given(std::string_view kind, std::span<const ValueDoc> docs) {
  std::string out;
  for (const ValueDoc& doc : docs) {
    const std::string standard = doc.fallback.empty() ? "required" : "default " + plain(doc.fallback);
    out += point(fmt::format("{} `{}`: {}; {} ({})", kind, doc.name, plain(doc.meaning), plain(doc.shape), standard));
  }
  return out;
}

std::string told(std::string_view kind, std::span<const ValueDoc> docs) {
  std::string out;
  for (const ValueDoc& doc : docs) out += point(fmt::format("{} `{}`: {}; {}", kind, doc.name, plain(doc.meaning), plain(doc.shape)));
  return out;
}

std::string heading(std::string_view name, std::string_view summary) {
  std::string out = fmt::format("### `{}`\n\n", name);
  for (const std::string& line : wrapped(with_capital(plain(summary)) + ".", kWidth)) out += line + "\n";
  return out + "\n";
}

std::string text_of(const ProtocolEntry& entry) {
  std::string out = heading(entry.name, entry.summary) + point("Source: " + plain(entry.source) + ".") +
                    point("Assumes: " + plain(entry.assumptions) + ".") + given("parameter", entry.parameters) +
                    given("initial", entry.initial) + told("estimate", entry.estimate) + told("recorded", entry.recorded);
  std::string metrics;
  for (const MetricEntry& metric : entry.metrics) metrics += fmt::format("{}`{}`", metrics.empty() ? "" : ", ", metric.name);
  return metrics.empty() ? out : out + point("metrics " + metrics);
}

std::string text_of(const PlantEntry& entry) {
  return heading(entry.name, entry.summary) + given("parameter", entry.parameters) + given("initial", entry.initial) +
         given("coupling", entry.couplings);
}

template <class Table>
std::string sections(const Table& table) {
  std::string out;
  for (const auto& entry : table) out += (out.empty() ? "" : "\n") + text_of(entry);
  return out;
}

// --- the schema -----------------------------------------------------------------------------------------------------------

std::string sentence(const ValueDoc& doc) { return fmt::format("{}. Default: {}.", with_capital(std::string(doc.meaning)), doc.fallback); }

// Definitions of the words of choices, and (`properties`) where each parameter's definition is found: `number` where it is no choice.
void add_parameters(std::span<const ValueDoc> docs, const Json& number, Json& definitions, Json& properties) {
  for (const ValueDoc& doc : docs) {
    const std::string name(doc.name);
    const std::vector<std::string> words = choices_of(doc);
    if (words.empty()) {
      if (!properties.contains(name)) properties[name] = number;
      continue;
    }
    properties[name] = {{"$ref", "#/definitions/words_of_" + name}};
    std::string title = with_capital(name);
    std::replace(title.begin(), title.end(), '_', ' ');
    definitions["words_of_" + name] = {
        {"title", title}, {"description", sentence(doc)}, {"enum", words}, {"default", doc.fallback}, {"examples", {words.back()}}};
  }
}

template <class Table>
Json names_of(const Table& table, std::string_view what) {
  Json names = Json::array();
  for (const auto& entry : table) names.push_back(entry.name);
  return {{"title", fmt::format("{} name", what == "protocols" ? "Protocol" : "Model")},
          {"description", fmt::format("As in `consort list {}`.", what)},
          {"anyOf", {{{"enum", names}}, {{"type", "string"}}}},
          {"examples", {names.front()}}};
}

// What an editor shows of one value, and which it accepts: a number, a word or a switch is told by `number`.
Json hover_of(const ValueDoc& doc, const Json& number) {
  Json out{{"title", doc.name}};
  const std::string standard = doc.fallback.empty() ? "Required." : fmt::format("Default: {}.", doc.fallback);
  out["description"] = fmt::format("{} ({}). {}", with_capital(std::string(doc.meaning)), doc.shape, standard);
  const std::vector<std::string> words = choices_of(doc);
  const Json standard_value = Json::parse(doc.fallback, nullptr, false);
  if (words.empty())
    out["allOf"] = Json::array({number});
  else
    out["enum"] = words;
  if (!words.empty())
    out["examples"] = Json::array({words.back()});
  else if (doc.shape == kSwitch)
    out["examples"] = Json::array({true});
  else
    out["examples"] = Json::array({standard_value.is_number() ? standard_value : Json(1)});
  return out;
}

Json name_of(const std::string& title, const std::string& description, const char* keyword, const Json& names, std::string_view example) {
  return {{"title", title}, {"description", description}, {keyword, names}, {"examples", {example}}};
}

// One form per entry of the table, told apart by its name; whatever has another name comes from a plug-in and has its own parameters.
template <class Table>
Json by_name(const Table& table, const Json& number) {
  Json forms = Json::array(), names = Json::array();
  for (const auto& entry : table) {
    const std::string summary = with_capital(std::string(entry.summary)) + ".";
    Json properties{{"name", name_of(std::string(entry.name), summary, "const", entry.name, entry.name)}};
    for (const ValueDoc& doc : entry.parameters) properties[std::string(doc.name)] = hover_of(doc, number);
    forms.push_back({{"title", entry.name}, {"description", summary}, {"properties", properties}, {"additionalProperties", false}});
    names.push_back(entry.name);
  }
  const Json other = name_of("of a plug-in", "A name that no table of Consort's own has.", "not", {{"enum", names}}, "mine");
  forms.push_back({{"title", "of a plug-in"}, {"properties", {{"name", other}}}, {"additionalProperties", number}});
  return {{"oneOf", forms}};
}

// A name, or a mapping with it and parameters.
Json choice_of(const char* title, const char* description, const Json& name, const Json& parameters) {
  const Json mapping{{"type", "object"}, {"required", {"name"}}, {"properties", {{"name", name}}}, {"allOf", {parameters}}};
  return {{"title", title}, {"description", description}, {"oneOf", {name, mapping}}};
}

Json reference(const char* definition) { return {{"$ref", fmt::format("#/definitions/{}", definition)}}; }

}  // namespace

std::vector<std::string> names_in(std::string_view list) {
  std::vector<std::string> names;
  const auto add = [&names](const auto& table) {
    for (const auto& entry : table) names.emplace_back(entry.name);
  };
  if (list == "protocols") add(protocol_table());
  if (list == "plants") add(plant_table());
  if (list == "topologies") add(topology_table());
  if (list == "metrics") add(metric_table());
  return names;
}

std::string markdown_of(std::string_view what) {
  if (what == "protocols") return sections(protocol_table());
  if (what == "plants") return sections(plant_table());
  std::string out;
  if (what == "topologies")
    for (const TopologyEntry& entry : topology_table())
      out += point(fmt::format("`{}`: {}: `{}`", entry.name, plain(entry.summary), entry.form));
  else
    for (const MetricEntry& entry : metric_table()) out += point(fmt::format("`{}`: {}", entry.name, plain(entry.summary)));
  return out;
}

std::string schema_of_tables() {
  const Json number = reference("parameter"), number_of_model = reference("value");
  Json words = Json::object(), of_protocols = Json::object(), of_models = Json::object();
  for (const ProtocolEntry& entry : protocol_table()) add_parameters(entry.parameters, number, words, of_protocols);
  for (const PlantEntry& entry : plant_table()) add_parameters(entry.parameters, number_of_model, words, of_models);
  Json definitions;
  definitions["protocol"] = choice_of(
      "Protocol", "The algorithm every agent runs: its name, or a mapping with its name and parameters (`consort list protocols`).",
      reference("protocol_name"), reference("protocol_by_name"));
  definitions["protocol_by_name"] = by_name(protocol_table(), number);
  definitions["protocol_name"] = names_of(protocol_table(), "protocols");
  definitions["model"] =
      choice_of("Model", "How the plant moves: a model's name, or a mapping with its name and parameters (`consort list plants`).",
                reference("plant_name"), reference("model_by_name"));
  definitions["model_by_name"] = by_name(plant_table(), number_of_model);
  definitions["plant_name"] = names_of(plant_table(), "plants");
  definitions["protocol"]["examples"] = definitions["protocol_name"]["examples"];
  definitions["model"]["examples"] = definitions["plant_name"]["examples"];
  Json of_both = of_models;
  of_both.update(of_protocols);
  definitions["parameters"] = {{"title", "Parameters"},
                               {"description", "Name and value of the protocol's or the model's parameters."},
                               {"type", "object"},
                               {"properties", of_both},
                               {"additionalProperties", number},
                               {"examples", Json::array({{{"Q", 0.2}}})}};
  definitions.update(words);
  definitions.update(link_definitions());
  std::string out;
  for (const auto& [name, definition] : definitions.items()) {
    std::string text = Json(name).dump() + ": " + definition.dump(2);
    for (std::size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at + 1)) text.insert(at + 1, 4, ' ');
    out += "    " + text + ",\n";
  }
  return out;
}

}  // namespace consort
