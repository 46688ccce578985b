#include "core/plant_task.hpp"

#include "core/errors.hpp"

#include <algorithm>

namespace consort {
namespace {

// The disturbance as agent `agent` of `agents` meets it.
class SignalOf {
 public:
  SignalOf(AgentId agent, std::size_t agents, Seed seed, std::uint32_t number) : agent_(agent), agents_(agents), seed_(seed) {
    out_.number = number;
  }
  Signal operator()(const Disturbance& disturbance) && {
    out_.on = disturbance.on;
    out_.hold_rounds = disturbance.hold_rounds;
    out_.first = disturbance.first;
    std::visit([this](const auto& signal) { take(signal); }, disturbance.signal);
    return std::move(out_);
  }

 private:
  Matrix number(const PerAgent& source, std::string_view name) const { return source.of(agent_, agents_, name, seed_); }
  void take(const Disturbance::Gaussian& signal) {
    out_.kind = signal.intensity ? Signal::Kind::intensity : Signal::Kind::gaussian;
    out_.amplitude = signal.covariance;
  }
  void take(const Disturbance::Uniform& signal) {
    out_.kind = Signal::Kind::uniform;
    out_.amplitude = signal.bound;
  }
  void take(const Disturbance::Sinusoid& signal) {
    out_.kind = Signal::Kind::sinusoid;
    out_.amplitude = number(signal.amplitude, "amplitude");
    out_.phase = number(signal.phase, "phase");
    out_.frequency = signal.frequency;
  }
  void take(const Disturbance::Constant& signal) {
    out_.kind = Signal::Kind::constant;
    out_.amplitude = number(signal.value, "value");
  }

  AgentId agent_;
  std::size_t agents_;
  Seed seed_;
  Signal out_;
};

}  // namespace

PlantTask plant_task(const Experiment& experiment, Seed run_seed) {
  check(experiment.plant.has_value(), "a plant task needs an experiment with a plant");
  const PlantSpec& plant = *experiment.plant;
  PlantTask task{plant.model, run_seed, experiment.dt, {}};
  auto support = std::make_shared<const Graph>();
  const bool asks_distances = experiment.links.asks_distances() ||
                              std::any_of(experiment.protocols.begin(), experiment.protocols.end(),
                                          [&](const ProtocolChoice& choice) { return experiment.links_of(choice).asks_distances(); });
  if (plant.sensing == PlantSpec::Sensing::neighbours || asks_distances) support = experiment.schedule(run_seed).support(experiment.rounds);
  for (std::size_t i = 0; i < experiment.agents; ++i) {
    const AgentId agent = agent_at(i);
    PlantPart part{plant.parameters_of(agent),
                   plant.initial_of(agent, experiment.agents, run_seed),
                   experiment.sensed_by(agent, *support),
                   plant.sensing == PlantSpec::Sensing::relative,
                   std::binary_search(plant.absolute.begin(), plant.absolute.end(), agent),
                   experiment.presence_of(agent),
                   {},
                   {}};
    for (std::size_t d = 0; d < plant.disturbances.size(); ++d) {
      const Disturbance& disturbance = plant.disturbances[d];
      const auto& whom = disturbance.agents;
      if (whom.empty() || std::binary_search(whom.begin(), whom.end(), agent))
        part.signals.push_back(SignalOf(agent, experiment.agents, run_seed, static_cast<std::uint32_t>(d))(disturbance));
    }
    if (asks_distances)
      for (const Neighbour& neighbour : support->in_neighbours(agent)) part.distances.push_back(neighbour.id);
    task.parts.push_back(std::move(part));
  }
  return task;
}

}  // namespace consort
