#include "orchestrator/script/plant.hpp"

#include "models/physics.hpp"
#include "models/registry.hpp"
#include "orchestrator/script/disturbances.hpp"
#include "orchestrator/script/numbers.hpp"
#include "orchestrator/script/sensing.hpp"
#include "orchestrator/script/wording.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace consort::script {
namespace {

std::vector<std::string> names_of(std::span<const ValueDoc> docs) {
  std::vector<std::string> names;
  for (const ValueDoc& doc : docs) names.emplace_back(doc.name);
  return names;
}

class PlantReader {
 public:
  PlantReader(Mistakes& mistakes, const std::filesystem::path& directory, Experiment& experiment, Places& places)
      : mistakes_(mistakes), directory_(directory), experiment_(experiment), places_(places) {}

  void read(const YAML::Node& node) {
    const Section section(mistakes_, node, "plant", "/definitions/plant");
    if (!section.is_map()) return;
    const YAML::Node model = section.required("model");
    if (!present(model) || !read_model(model)) return;
    if (const auto initial = section.find("initial"); present(initial)) read_initial(initial);
    if (const auto overrides = section.find("overrides"); present(overrides)) read_overrides(overrides);
    if (const auto couplings = section.find("couplings"); present(couplings))
      read_couplings(mistakes_, couplings, experiment_.agents, *entry_, plant_);
    if (const auto sensing = section.find("sensing"); present(sensing)) read_sensing(mistakes_, sensing, experiment_.agents, plant_);
    if (const auto disturbances = section.find("disturbances"); present(disturbances))
      read_disturbances(mistakes_, disturbances, directory_, experiment_, places_, plant_.disturbances);
    experiment_.plant = std::move(plant_);
  }

 private:
  bool read_model(const YAML::Node& node) {
    std::vector<std::string> models;
    for (const PlantEntry& entry : plant_table()) models.emplace_back(entry.name);
    const YAML::Node name = node.IsMap() ? node["name"] : node;
    if (!name.IsDefined()) {
      mistakes_.add(node,
                    fmt::format("plant.model: found a mapping without a name; allowed: {{name: ..., parameters}}, with one of the names {}",
                                listed(models)));
      return false;
    }
    const auto index = read_choice(mistakes_, name, "plant.model", models);
    if (!index) return false;
    entry_ = &plant_table()[*index];
    plant_.model = entry_->name;
    if (!node.IsMap()) return true;
    std::vector<std::string> allowed{"name"};
    for (const ValueDoc& doc : entry_->parameters) allowed.emplace_back(doc.name);
    for (const auto& entry : node) {
      if (!known(mistakes_, entry.first, "plant.model " + plant_.model, allowed) || entry.first.Scalar() == "name") continue;
      const std::string parameter = entry.first.Scalar();
      places_.emplace("plant " + parameter, entry.second.Mark());
      if (const auto value = read_value(mistakes_, doc_of(entry_->parameters, parameter), entry.second, "plant.model." + parameter))
        plant_.parameters.set(parameter, *value);
    }
    return true;
  }

  void read_initial(const YAML::Node& node) {
    const auto names = names_of(entry_->initial);
    if (!node.IsMap()) {
      mistakes_.add(node, fmt::format("plant.initial: found {}; allowed: a mapping with the names {}", describe(node), listed(names)));
      return;
    }
    for (const auto& entry : node) {
      if (!known(mistakes_, entry.first, "plant.initial", names)) continue;
      const std::string name = entry.first.Scalar();
      places_.emplace("plant initial " + name, entry.second.Mark());
      auto values = read_per_agent(mistakes_, entry.second, "plant.initial." + name, directory_, experiment_.agents);
      if (values) plant_.initial.push_back({name, std::move(*values)});
    }
  }

  void read_overrides(const YAML::Node& node) {
    if (!node.IsMap()) {
      mistakes_.add(node, fmt::format("plant.overrides: found {}; allowed: a mapping from agent number to what differs", describe(node)));
      return;
    }
    for (const auto& entry : node) {
      const auto agent = read_agent(mistakes_, entry.first, "plant.overrides", experiment_.agents);
      if (!agent) continue;
      const std::string what = fmt::format("plant.overrides.{}", agent->value);
      const Section section(mistakes_, entry.second, what, "/definitions/override");
      read_values(section, "initial", entry_->initial, plant_.overrides[*agent].initial);
      read_values(section, "parameters", entry_->parameters, plant_.overrides[*agent].parameters);
    }
  }

  void read_values(const Section& section, const std::string& key, std::span<const ValueDoc> docs, Values& out) {
    const YAML::Node part = section.find(key);
    if (!present(part)) return;
    const auto names = names_of(docs);
    if (!part.IsMap()) {
      mistakes_.add(part,
                    fmt::format("{}: found {}; allowed: a mapping with the names {}", section.path(key), describe(part), listed(names)));
      return;
    }
    for (const auto& entry : part) {
      if (!known(mistakes_, entry.first, section.path(key), names)) continue;
      const std::string name = entry.first.Scalar();
      if (const auto value = read_value(mistakes_, doc_of(docs, name), entry.second, section.path(key) + "." + name)) out.set(name, *value);
    }
  }

  Mistakes& mistakes_;
  const std::filesystem::path& directory_;
  Experiment& experiment_;
  Places& places_;
  PlantSpec plant_;
  const PlantEntry* entry_ = nullptr;
};

}  // namespace

void read_plant(Mistakes& mistakes, const YAML::Node& node, const std::filesystem::path& directory, Experiment& experiment,
                Places& places) {
  PlantReader(mistakes, directory, experiment, places).read(node);
}

void try_plant(Mistakes& mistakes, const YAML::Mark& plant_mark, const Experiment& experiment, const Places& places) {
  if (!experiment.plant) return;
  try {
    static_cast<void>(Physics(plant_task(experiment, experiment.seed)));
  } catch (const std::runtime_error& error) {  // a mistake, or numbers that mathematics refuses
    const std::string text = error.what();
    YAML::Mark mark = plant_mark;
    for (const auto& [name, place] : places) {  // the longest name of the plant's that the text begins with or quotes
      const std::string word = name.starts_with("plant.") ? name : "'" + name.substr(name.find_last_of(' ') + 1) + "'";
      if (name.starts_with("plant") && text.find(word) != std::string::npos) mark = place;
    }
    mistakes.add(mark, text.starts_with("plant") ? text : "plant: " + text);
  }
}

}  // namespace consort::script
