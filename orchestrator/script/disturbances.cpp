#include "orchestrator/script/disturbances.hpp"

#include "core/number_text.hpp"
#include "core/values.hpp"
#include "orchestrator/script/numbers.hpp"
#include "orchestrator/script/sensing.hpp"
#include "orchestrator/script/wording.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace consort::script {
namespace {

constexpr std::uint64_t kMostHeldRounds = 1'000'000'000;

class DisturbanceReader {
 public:
  DisturbanceReader(Mistakes& mistakes, const std::filesystem::path& directory, const Experiment& experiment, Places& places)
      : mistakes_(mistakes), directory_(directory), experiment_(experiment), places_(places) {}

  void read_list(const YAML::Node& node, std::vector<Disturbance>& all) {
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
      if (read_signal(section, what, out)) all.push_back(std::move(out));
    }
  }

  void read_degradation(const YAML::Node& node, const std::string& what, Round first, std::vector<Disturbance>& all) {
    places_.emplace(fmt::format("plant.disturbances[{}]", all.size()), node.Mark());
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
    if (read_signal(section, what, out)) all.push_back(std::move(out));
  }

 private:
  // What is added and how long it is held; false: nothing that could be.
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
  const Experiment& experiment_;
  Places& places_;
};

}  // namespace

void read_disturbances(Mistakes& mistakes, const YAML::Node& node, const std::filesystem::path& directory, const Experiment& experiment,
                       Places& places, std::vector<Disturbance>& all) {
  DisturbanceReader(mistakes, directory, experiment, places).read_list(node, all);
}

void read_degradation(Mistakes& mistakes, const YAML::Node& node, const std::string& what, Round first,
                      const std::filesystem::path& directory, Experiment& experiment, Places& places) {
  if (experiment.plant)
    DisturbanceReader(mistakes, directory, experiment, places).read_degradation(node, what, first, experiment.plant->disturbances);
  else if (mistakes.none())
    mistakes.add(node, what + ": found no plant in the experiment; allowed: with a plant, whose sensors can degrade");
}

}  // namespace consort::script
