#include "io/standard_streams.hpp"
#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/tables.hpp"
#include "orchestrator/cli/verbs.hpp"

#include "models/registry.hpp"
#include "orchestrator/report/terminal.hpp"
#include "orchestrator/script/topology.hpp"
#include "orchestrator/script/wording.hpp"
#include "protocols/metrics.hpp"
#include "protocols/registry.hpp"

#include <fmt/format.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace consort {
namespace {

std::string paragraph(std::string_view text, std::size_t margin, const TextStyle& style) {
  std::string out;
  for (const auto& line : wrapped(text, std::clamp<std::size_t>(style.width, 60, 100) - margin))
    out += std::string(margin, ' ') + line + "\n";
  return out;
}

std::string values(const char* title, std::span<const ValueDoc> docs, const TextStyle& style) {
  std::string out;
  for (const ValueDoc& doc : docs) {
    const std::string standard = doc.fallback.empty() ? "required" : fmt::format("default {}", doc.fallback);
    out += paragraph(fmt::format("{} {}: {}; {} ({})", title, doc.name, doc.meaning, doc.shape, standard), 4, style);
  }
  return out;
}

// Values that a protocol gives.
std::string described(const char* title, std::span<const ValueDoc> docs, const TextStyle& style) {
  std::string out;
  for (const ValueDoc& doc : docs) out += paragraph(fmt::format("{} {}: {}; {}", title, doc.name, doc.meaning, doc.shape), 4, style);
  return out;
}

using Names = std::vector<std::string>;

// Does `entry` belong to what was asked for? Without names, all does.
bool wanted(const auto& entry, const Names& names) {
  return names.empty() || std::find(names.begin(), names.end(), entry.name) != names.end();
}

void list_protocols(const Names& names, const TextStyle& style) {
  for (const ProtocolEntry& entry : protocol_table()) {
    if (!wanted(entry, names)) continue;
    streams::put(fmt::format("{}\n{}", toned(entry.name, Tone::strong, style), paragraph(entry.summary, 4, style)));
    streams::put(fmt::format("{}{}", paragraph(fmt::format("source: {}", entry.source), 4, style),
                             paragraph(fmt::format("assumes: {}", entry.assumptions), 4, style)));
    streams::put(fmt::format("{}{}", values("parameter", entry.parameters, style), values("initial", entry.initial, style)));
    streams::put(fmt::format("{}{}\n", described("estimate", entry.estimate, style), described("recorded", entry.recorded, style)));
  }
}

void list_plants(const Names& names, const TextStyle& style) {
  for (const PlantEntry& entry : plant_table()) {
    if (!wanted(entry, names)) continue;
    streams::put(fmt::format("{}\n{}", toned(entry.name, Tone::strong, style), paragraph(entry.summary, 4, style)));
    streams::put(fmt::format("{}{}{}\n", values("parameter", entry.parameters, style), values("initial", entry.initial, style),
                             values("coupling", entry.couplings, style)));
  }
}

void list_topologies(const Names& names, const TextStyle& style) {
  for (const TopologyEntry& entry : topology_table())
    if (wanted(entry, names))
      streams::put(fmt::format("{}\n{}{}\n", toned(entry.name, Tone::strong, style), paragraph(entry.summary, 4, style),
                               paragraph(entry.form, 4, style)));
}

void list_metrics(const Names& names, const TextStyle& style) {
  for (const MetricEntry& entry : metric_table())
    if (wanted(entry, names))
      streams::put(fmt::format("{}\n{}\n", toned(entry.name, Tone::strong, style), paragraph(entry.summary, 4, style)));
}

/// Values that a protocol gives.
nlohmann::ordered_json described(std::span<const ValueDoc> docs) {
  auto out = nlohmann::ordered_json::array();
  for (const ValueDoc& doc : docs) out.push_back({{"name", doc.name}, {"meaning", doc.meaning}, {"shape", doc.shape}});
  return out;
}

nlohmann::ordered_json as_json(std::span<const ValueDoc> docs) {
  auto out = described(docs);
  for (std::size_t i = 0; i < docs.size(); ++i) {
    out[i]["required"] = docs[i].fallback.empty();
    if (!docs[i].fallback.empty()) out[i]["default"] = docs[i].fallback;
  }
  return out;
}

nlohmann::ordered_json as_json(const std::string& what, const Names& names) {
  auto out = nlohmann::ordered_json::array();
  if (what == "protocols")
    for (const ProtocolEntry& entry : protocol_table())
      if (wanted(entry, names))
        out.push_back({{"name", entry.name},
                       {"summary", entry.summary},
                       {"source", entry.source},
                       {"assumes", entry.assumptions},
                       {"parameters", as_json(entry.parameters)},
                       {"initial", as_json(entry.initial)},
                       {"estimate", described(entry.estimate)},
                       {"recorded", described(entry.recorded)}});
  if (what == "plants")
    for (const PlantEntry& entry : plant_table())
      if (wanted(entry, names))
        out.push_back({{"name", entry.name},
                       {"summary", entry.summary},
                       {"parameters", as_json(entry.parameters)},
                       {"initial", as_json(entry.initial)},
                       {"couplings", as_json(entry.couplings)}});
  if (what == "topologies")
    for (const TopologyEntry& entry : topology_table())
      if (wanted(entry, names)) out.push_back({{"name", entry.name}, {"summary", entry.summary}, {"form", entry.form}});
  if (what == "metrics")
    for (const MetricEntry& entry : metric_table())
      if (wanted(entry, names)) out.push_back({{"name", entry.name}, {"summary", entry.summary}});
  return out;
}

// What is wrong with `word` as the name of a list; who asks for one of its entries is told which list has it.
std::string a_list(const std::string& word) {
  const std::vector<std::string> lists{"protocols", "plants", "topologies", "metrics"};
  const std::string refusal = refusal_of(word, lists);
  if (refusal.empty() || refusal.find("did you mean") != std::string::npos) return refusal;
  for (const std::string& list : lists)
    if (const std::string match = did_you_mean(word, names_in(list)); !match.empty())
      return fmt::format("{}{} It is in `consort list {}`", refusal, match, list);
  return refusal;
}

class ListVerb : public Verb {
 public:
  explicit ListVerb(CLI::App& parent) : Verb(*parent.add_subcommand("list", "")) {
    document(app_,
             "list what an experiment may use\n"
             "protocols: each with its source, what it assumes, its parameters and initial values, what it estimates and what else is "
             "recorded. plants: the models agents can steer and measure, and how their parts act on each other. topologies: graph families "
             "and schedules, and how they are written. metrics: what can be measured and used in criteria.",
             {{"consort list protocols", "The algorithms."},
              {"consort list topologies ring", "One entry of a list."},
              {"consort list topologies | grep -A2 random", "Topologies that are drawn at random."}},
             {{"0", "listed"}, {"2", "there is no such list, or nothing of that name in it"}});
    app_.add_option("what", what_, "What to list.")
        ->required()
        ->type_name("protocols|plants|topologies|metrics")
        ->check(CLI::Validator(a_list, "{protocols,plants,topologies,metrics}"));
    app_.add_option("names", names_, "Only these. Default: all.")->type_name("NAME");
    add_output_flags("Print the list as JSON.", "Refused: a list is there to be printed.");
    app_.add_flag("--markdown", markdown_, "Print the list as the guide holds it.")->excludes("--json");
    app_.add_flag("--schema", schema_, "Print what the schema of the experiment file says of protocols and plants.")
        ->excludes("--json")
        ->excludes("--markdown");
  }

  Exit execute() override {
    const TextStyle style = style_of(STDOUT_FILENO);
    if (quiet_ && !json_) throw ConfigError("--quiet: found with list, which does nothing but print; allowed: with --json, or not at all");
    for (const std::string& name : names_) {
      if (markdown_ || schema_)
        throw ConfigError(fmt::format("NAME: found '{}' with a list as a file holds it; allowed: the whole list", name));
      if (const std::string refusal = refusal_of(name, names_in(what_)); !refusal.empty())
        throw ConfigError(fmt::format("{}: {}", what_, refusal));
    }
    if (json_)
      streams::put(fmt::format("{}\n", as_json(what_, names_).dump(2)));
    else if (schema_)
      streams::put(schema_of_tables());
    else if (markdown_)
      streams::put(markdown_of(what_));
    else if (what_ == "protocols")
      list_protocols(names_, style);
    else if (what_ == "plants")
      list_plants(names_, style);
    else if (what_ == "topologies")
      list_topologies(names_, style);
    else
      list_metrics(names_, style);
    return Exit::ok;
  }

 private:
  std::string what_;
  Names names_;
  bool markdown_ = false, schema_ = false;
};

}  // namespace

std::unique_ptr<Verb> make_list_verb(CLI::App& parent) { return std::make_unique<ListVerb>(parent); }

}  // namespace consort
