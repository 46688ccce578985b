#include "orchestrator/script/plant.hpp"

#include "models/physics.hpp"
#include "models/registry.hpp"
#include "orchestrator/script/numbers.hpp"
#include "orchestrator/script/sensing.hpp"
#include "orchestrator/script/wording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace consort::script {
namespace {

constexpr std::uint64_t kMostHeldRounds = 1'000'000'000;

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
    if (const auto disturbances = section.find("disturbances"); present(disturbances)) read_disturbances(disturbances);
    experiment_.plant = std::move(plant_);
  }

  void degrade(const YAML::Node& node, const std::string& what, Round first) {
    places_.emplace(fmt::format("plant.disturbances[{}]", experiment_.plant->disturbances.size()), node.Mark());
    const Section section(mistakes_, node, what, "/definitions/degradation");
    if (!section.is_map()) return;
    Disturbance out{Disturbance::On::measurement, Disturbance::Gaussian{{}, false}, 1, {}};
    out.first = first;
    const auto one = section.find("agent"), several = section.find("agents");
    if (present(one) == present(several))
      mistakes_.add(node, fmt::format("{}: found {}; allowed: exactly one of 'agent' and 'agents'", what,
                                      present(one) ? "both 'agent' and 'agents'" : "neither 'agent' nor 'agents'"));
    else if (present(several))
      out.agents = read_agents(mistakes_, several, section.path("agents"), experiment_.agents);
    else if (const auto id = read_whole(mistakes_, one, section.path("agent"), 1, experiment_.agents))
      out.agents = {AgentId{static_cast<std::uint32_t>(*id)}};
    if (read_signal(section, what, out)) experiment_.plant->disturbances.push_back(std::move(out));
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

  // --- disturbances ---------------------------------------------------------------------------------------------------------

  void read_disturbances(const YAML::Node& node) {
    if (!node.IsSequence()) {
      mistakes_.add(node,
                    fmt::format("plant.disturbances: found {}; allowed: a list such as [{{on: measurement, gaussian: {{deviation: 0.1}}}}]",
                                describe(node)));
      return;
    }
    for (std::size_t i = 0; i < node.size(); ++i) {
      const std::string what = fmt::format("plant.disturbances[{}]", i);
      places_.emplace(what, node[i].Mark());
      const Section section(mistakes_, node[i], what, "/definitions/disturbance");
      if (!section.is_map()) continue;
      Disturbance out{Disturbance::On::measurement, Disturbance::Gaussian{{}, false}, 1, {}};
      static const std::array<std::string, 3> kPlaces{"state", "input", "measurement"};
      if (const auto on = section.required("on"); present(on))
        if (const auto choice = read_choice(mistakes_, on, section.path("on"), kPlaces)) out.on = static_cast<Disturbance::On>(*choice);
      if (const auto agents = section.find("agents"); present(agents))
        out.agents = read_agents(mistakes_, agents, section.path("agents"), experiment_.agents);
      if (read_signal(section, what, out)) plant_.disturbances.push_back(std::move(out));
    }
  }

  /// What is added and how long it is held; false: nothing that could be.
  bool read_signal(const Section& section, const std::string& what, Disturbance& out) {
    if (const auto hold = section.find("hold"); present(hold)) {
      if (const auto seconds = read_duration(mistakes_, hold, section.path("hold"))) {
        const double rounds = std::round(*seconds / experiment_.dt);
        if (rounds < 1.0 || rounds > static_cast<double>(kMostHeldRounds))
          mistakes_.add(hold, fmt::format("{}: found {}; allowed: at least a round, dt = {} s", section.path("hold"), describe(hold),
                                          number_text(experiment_.dt)));
        else
          out.hold_rounds = static_cast<Round>(rounds);
      }
    }
    std::vector<std::string> found;
    for (const char* kind : {"gaussian", "uniform", "sinusoid", "constant"})
      if (present(section.find(kind))) found.emplace_back(kind);
    if (found.size() != 1) {
      mistakes_.add(section.node(),
                    fmt::format("{}: found {}; allowed: exactly one of gaussian, uniform, sinusoid, constant", what, listed(found)));
      return false;
    }
    const YAML::Node signal = section.find(found[0]);
    const std::string place = section.path(found[0]);
    if (found[0] == "gaussian") read_gaussian(signal, place, out);
    if (found[0] == "uniform") read_uniform(signal, place, out);
    if (found[0] == "sinusoid") read_sinusoid(signal, place, out);
    if (found[0] == "constant") {
      auto value = read_per_agent(mistakes_, signal, place, directory_, experiment_.agents);
      if (value) out.signal = Disturbance::Constant{std::move(*value)};
    }
    return true;
  }

  void read_gaussian(const YAML::Node& node, const std::string& what, Disturbance& out) {
    const Section section(mistakes_, node, what, "/definitions/disturbance/properties/gaussian");
    std::vector<std::string> found;
    for (const char* key : {"deviation", "covariance", "intensity"})
      if (present(section.find(key))) found.emplace_back(key);
    if (found.size() != 1) {
      mistakes_.add(node, fmt::format("{}: found {}; allowed: exactly one of deviation, covariance, intensity", what, listed(found)));
      return;
    }
    const YAML::Node value = section.find(found[0]);
    auto matrix = read_matrix(mistakes_, value, section.path(found[0]));
    if (!matrix) return;
    if (found[0] == "deviation") {
      if (matrix->cols() != 1 || (matrix->array() < 0.0).any()) {
        mistakes_.add(value, fmt::format("{}: found {}; allowed: a standard deviation, or one per component, not negative",
                                         section.path(found[0]), describe(value)));
        return;
      }
      matrix = matrix->array().square().matrix();
    }
    try {
      static_cast<void>(expand_covariance(*matrix, matrix->rows(), section.path(found[0])));
      out.signal = Disturbance::Gaussian{*matrix, found[0] == "intensity"};
    } catch (const ConfigError& error) {
      mistakes_.add(value, error.what());
    }
  }

  void read_uniform(const YAML::Node& node, const std::string& what, Disturbance& out) {
    const Section section(mistakes_, node, what, "/definitions/disturbance/properties/uniform");
    const YAML::Node bound = section.required("bound");
    if (!present(bound)) return;
    const auto value = read_matrix(mistakes_, bound, section.path("bound"));
    if (value && (value->array() < 0.0).any())
      mistakes_.add(bound, fmt::format("{}: found {}; allowed: not negative", section.path("bound"), describe(bound)));
    if (value) out.signal = Disturbance::Uniform{*value};
  }

  void read_sinusoid(const YAML::Node& node, const std::string& what, Disturbance& out) {
    const Section section(mistakes_, node, what, "/definitions/disturbance/properties/sinusoid");
    Disturbance::Sinusoid signal{{PerAgent::Same{Matrix::Ones(1, 1)}}, 1.0, {PerAgent::Same{Matrix::Zero(1, 1)}}};
    const auto per_agent = [&](const char* key, PerAgent& to) {
      if (const auto part = section.find(key); present(part))
        if (auto value = read_per_agent(mistakes_, part, section.path(key), directory_, experiment_.agents)) to = std::move(*value);
    };
    if (present(section.required("amplitude"))) per_agent("amplitude", signal.amplitude);
    per_agent("phase", signal.phase);
    if (const auto frequency = section.required("frequency"); present(frequency))
      signal.frequency = read_number(mistakes_, frequency, section.path("frequency")).value_or(1.0);
    out.signal = std::move(signal);
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

void read_degradation(Mistakes& mistakes, const YAML::Node& node, const std::string& what, Round first,
                      const std::filesystem::path& directory, Experiment& experiment, Places& places) {
  if (experiment.plant)
    PlantReader(mistakes, directory, experiment, places).degrade(node, what, first);
  else if (mistakes.none())
    mistakes.add(node, what + ": found no plant in the experiment; allowed: with a plant, whose sensors can degrade");
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
