// The JSON Schema of the experiment file: which keys it allows, and a whole document checked against it by valijson. The document
// goes through nlohmann JSON: the adapter for yaml-cpp in valijson 1.0 lacks the backward iteration its own validator needs.

#include "orchestrator/script/script.hpp"
#include "orchestrator/script/wording.hpp"
#include "orchestrator/script/yaml.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

#include <algorithm>
#include <charconv>
#include <limits>
#include <memory>

namespace consort::script {

namespace {

const nlohmann::ordered_json& schema_document() {
  static const auto document = nlohmann::ordered_json::parse(experiment_schema());
  return document;
}

const valijson::Schema& compiled_schema() {
  static const auto schema = [] {
    auto out = std::make_unique<valijson::Schema>();
    auto document = nlohmann::json::parse(experiment_schema());
    // Which protocol or model has which parameters is there for editors: the reader refuses the others itself, and names the nearest.
    for (const char* forms : {"protocol_by_name", "model_by_name"}) document["definitions"][forms] = nlohmann::json::object();
    valijson::SchemaParser(valijson::SchemaParser::kDraft7).populateSchema(valijson::adapters::NlohmannJsonAdapter(document), *out);
    return out;
  }();
  return *schema;
}

// Typed as the reader types it: quoted text is text, 010 is ten.
nlohmann::json json_of(const YAML::Node& node) {
  if (node.IsScalar()) {
    if (const auto on = plain_switch(node)) return *on;
    // valijson knows 64 bits with a sign; what is beyond its largest number is judged like that one.
    if (const auto whole = whole_number(node))
      return static_cast<std::int64_t>(std::min<std::uint64_t>(*whole, std::numeric_limits<std::int64_t>::max()));
    if (const auto number = plain_number(node)) return *number;
    return node.Scalar();
  }
  if (node.IsSequence()) {
    auto out = nlohmann::json::array();
    for (const auto& entry : node) out.push_back(json_of(entry));
    return out;
  }
  if (node.IsMap()) {
    auto out = nlohmann::json::object();
    for (const auto& entry : node) out[entry.first.Scalar()] = json_of(entry.second);
    return out;
  }
  return nullptr;
}

// valijson names a place as <root>, [key], [0], ...; yaml-cpp nodes must be `reset`, since assignment would change the document.
YAML::Node node_at(const YAML::Node& document, const std::vector<std::string>& context) {
  YAML::Node at = document;
  for (const auto& step : context) {
    if (step.size() < 2 || step.front() != '[') continue;
    const std::string key = step.substr(1, step.size() - 2);
    const YAML::Node& parent = at;
    if (parent.IsSequence()) {
      std::size_t index = 0;
      std::from_chars(key.data(), key.data() + key.size(), index);
      if (index >= parent.size()) break;
      at.reset(parent[index]);
    } else {
      const YAML::Node child = parent.IsMap() ? parent[key] : YAML::Node(YAML::NodeType::Undefined);
      if (!child.IsDefined()) break;
      at.reset(child);
    }
  }
  return at;
}

std::string dotted(const std::vector<std::string>& context) {
  std::string out;
  for (const auto& step : context) {
    if (step.size() < 2 || step.front() != '[') continue;
    out += (out.empty() ? "" : ".") + step.substr(1, step.size() - 2);
  }
  return out.empty() ? "the experiment" : out;
}

}  // namespace

std::vector<std::string> schema_keys(std::string_view pointer) {
  const auto& at = schema_document().at(nlohmann::ordered_json::json_pointer(std::string(pointer)));
  std::vector<std::string> out;
  for (const auto& [key, ignored] : at.at("properties").items()) out.push_back(key);
  return out;
}

void check_against_schema(const YAML::Node& document, Mistakes& mistakes) {
  valijson::Validator validator;
  valijson::ValidationResults results;
  const auto json = json_of(document);
  if (validator.validate(compiled_schema(), valijson::adapters::NlohmannJsonAdapter(json), &results)) return;
  // An error is repeated for every mapping around it; the innermost says it.
  const auto within = [](const std::vector<std::string>& outer, const std::vector<std::string>& inner) {
    return outer.size() < inner.size() && std::equal(outer.begin(), outer.end(), inner.begin());
  };
  for (const auto& error : results) {
    if (std::any_of(results.begin(), results.end(), [&](const auto& other) { return within(error.context, other.context); })) continue;
    const YAML::Node at = node_at(document, error.context);
    mistakes.add(at, fmt::format("{}: found {}; the schema says: {}", dotted(error.context), describe(at), error.description));
  }
}

}  // namespace consort::script
