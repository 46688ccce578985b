#include "rounds/agent_maker.hpp"

#include <algorithm>

namespace consort {

AgentMaker::AgentMaker(const Experiment& experiment, const ProtocolEntry& entry, const ProtocolChoice& choice, Seed run_seed)
    : experiment_(experiment), choice_(choice), seed_(run_seed), entry_(entry) {
  if (!experiment.plant) return;
  physics_.emplace(plant_task(experiment, run_seed));
  for (std::size_t i = 0; i < experiment.agents; ++i) largest_control_ = std::max(largest_control_, physics_->control_size(agent_at(i)));
}

std::unique_ptr<Protocol> AgentMaker::make(AgentId agent) const {
  const Values initial = experiment_.initial_of(agent, seed_);
  const Values parameters = experiment_.parameters_of(choice_, agent);
  if (!physics_) return make_protocol(entry_, parameters, Setup{agent, experiment_.agents, experiment_.dt, initial}, std::nullopt);
  const Values model = physics_->knowledge(agent);
  const Setup setup{agent,
                    experiment_.agents,
                    experiment_.dt,
                    initial,
                    model,
                    physics_->measurement_size(agent),
                    physics_->state_layout().size(),
                    largest_control_};
  return make_protocol(entry_, parameters, setup, physics_->control_size(agent));
}

Trace AgentMaker::empty_trace(const Protocol& first) const {
  Trace trace;
  trace.agents = experiment_.agents;
  trace.estimate_layout = first.estimate_layout();
  trace.dimension = trace.estimate_layout.size();
  trace.recorded_layout = recorded_part(first.recorded_layout(), experiment_.recording.state);
  trace.recorded_dimension = trace.recorded_layout.size();
  if (physics_) trace.state_layout = physics_->state_layout();
  trace.state_dimension = trace.state_layout.size();
  trace.truth = entry_.truth;
  trace.agrees_on_states = physics_ && entry_.agrees_on_states();
  return trace;
}

}  // namespace consort
