#include "orchestrator/script/resolved.hpp"

#include "core/number_text.hpp"
#include "models/registry.hpp"
#include "orchestrator/script/edges.hpp"
#include "orchestrator/script/links.hpp"
#include "orchestrator/script/numbers.hpp"
#include "orchestrator/script/script.hpp"
#include "protocols/registry.hpp"

#include <array>
#include <sstream>

namespace consort::script {

namespace {

using YAML::Node;

Node node_of(const Matrix& value) {
  if (value.size() == 1 && value.cols() == 1) return Node(number_text(value(0, 0)));
  Node out(YAML::NodeType::Sequence);
  for (Eigen::Index i = 0; i < value.rows(); ++i) {
    if (value.cols() == 1) {
      out.push_back(number_text(value(i, 0)));
      continue;
    }
    Node row(YAML::NodeType::Sequence);
    for (Eigen::Index j = 0; j < value.cols(); ++j) row.push_back(number_text(value(i, j)));
    out.push_back(row);
  }
  return out;
}

Node node_of(const Values& values) {
  Node out(YAML::NodeType::Map);
  for (const auto& [name, value] : values.entries()) out[name] = node_of(value);
  return out;
}

// Parameters; those that are choices as their words.
void put_parameters(Node& out, const Values& values, std::span<const ValueDoc> docs) {
  for (const auto& [name, value] : values.entries()) {
    const ValueDoc* doc = doc_of(docs, name);
    const auto words = doc == nullptr ? std::vector<std::string>{} : choices_of(*doc);
    out[name] = words.empty() ? node_of(value) : Node(words.at(static_cast<std::size_t>(value(0, 0))));
  }
}

Node pair_of(double first, double second) {
  Node out(YAML::NodeType::Sequence);
  out.push_back(number_text(first));
  out.push_back(number_text(second));
  return out;
}

Node node_of(const PerAgent::Same& same) {
  Node out(YAML::NodeType::Map);
  out["all"] = node_of(same.value);
  return out;
}
Node node_of(const PerAgent::List& list) {
  Node out(YAML::NodeType::Sequence);
  for (const auto& value : list.values) out.push_back(node_of(value));
  return out;
}
Node node_of(const PerAgent::Linspace& linspace) {
  Node out(YAML::NodeType::Map);
  out["linspace"] = pair_of(linspace.first, linspace.last);
  out["dimension"] = linspace.dimension;
  return out;
}
Node node_of(const PerAgent::Uniform& uniform) {
  Node out(YAML::NodeType::Map);
  out["uniform"] = pair_of(uniform.low, uniform.high);
  out["dimension"] = uniform.dimension;
  return out;
}

Node node_of(const PerAgent& values) {
  return std::visit([](const auto& source) { return node_of(source); }, values.source);
}

Node agents_of(const Experiment& experiment) {
  Node out(YAML::NodeType::Map);
  out["count"] = experiment.agents;
  for (const auto& choice : experiment.protocols) {
    if (!choice.first()) continue;
    Node protocol(YAML::NodeType::Map);
    protocol["name"] = choice.name;
    put_parameters(protocol, choice.parameters, find_protocol(choice.name).parameters);
    out["protocols"].push_back(protocol);
  }
  for (const auto& [name, values] : experiment.initial) out["initial"][name] = node_of(values);
  for (const auto& [agent, override] : experiment.overrides) {
    Node entry(YAML::NodeType::Map);
    if (!override.initial.entries().empty()) entry["initial"] = node_of(override.initial);
    if (!override.parameters.entries().empty()) {
      Node parameters(YAML::NodeType::Map);
      put_parameters(parameters, override.parameters, find_protocol(experiment.protocols.front().name).parameters);
      entry["parameters"] = parameters;
    }
    out["overrides"][std::to_string(agent.value)] = entry;
  }
  return out;
}

Node signal_of(const Disturbance::Gaussian& signal) {
  Node out(YAML::NodeType::Map);
  out["gaussian"][signal.intensity ? "intensity" : "covariance"] = node_of(signal.covariance);
  return out;
}
Node signal_of(const Disturbance::Uniform& signal) {
  Node out(YAML::NodeType::Map);
  out["uniform"]["bound"] = node_of(signal.bound);
  return out;
}
Node signal_of(const Disturbance::Sinusoid& signal) {
  Node out(YAML::NodeType::Map);
  out["sinusoid"]["amplitude"] = node_of(signal.amplitude);
  out["sinusoid"]["frequency"] = number_text(signal.frequency);
  out["sinusoid"]["phase"] = node_of(signal.phase);
  return out;
}
Node signal_of(const Disturbance::Constant& signal) {
  Node out(YAML::NodeType::Map);
  out["constant"] = node_of(signal.value);
  return out;
}

Node disturbance_of(const Disturbance& disturbance, Seconds dt) {
  Node out = std::visit([](const auto& signal) { return signal_of(signal); }, disturbance.signal);
  constexpr std::array kPlaces{"state", "input", "measurement"};
  out["on"] = kPlaces[static_cast<std::size_t>(disturbance.on)];
  out["hold"] = number_text(static_cast<double>(disturbance.hold_rounds) * dt);
  for (const AgentId agent : disturbance.agents) out["agents"].push_back(agent.value);
  return out;
}

Node plant_of(const PlantSpec& plant, Seconds dt) {
  Node out(YAML::NodeType::Map);
  out["model"]["name"] = plant.model;
  const std::span<const ValueDoc> docs = find_plant(plant.model).parameters;
  Node model = out["model"];
  put_parameters(model, plant.parameters, docs);
  for (const auto& [name, values] : plant.initial) out["initial"][name] = node_of(values);
  for (const PlantSpec::Coupling& coupling : plant.couplings) {
    Node entry = node_of(coupling.values);
    entry["edge"] = edge_text(coupling.edge);
    out["couplings"].push_back(entry);
  }
  if (plant.sensing == PlantSpec::Sensing::relative) {
    out["sensing"] = Node(YAML::NodeType::Map);
    for (const auto& [agent, measured] : plant.relative)
      for (const AgentId other : measured) out["sensing"]["relative"][std::to_string(agent.value)].push_back(other.value);
    for (const AgentId agent : plant.absolute) out["sensing"]["absolute"].push_back(agent.value);
  } else {
    out["sensing"] = plant.sensing == PlantSpec::Sensing::own ? "own" : "neighbours";
  }
  for (const auto& [agent, override] : plant.overrides) {
    Node entry(YAML::NodeType::Map);
    if (!override.initial.entries().empty()) entry["initial"] = node_of(override.initial);
    if (!override.parameters.entries().empty()) {
      Node parameters(YAML::NodeType::Map);
      put_parameters(parameters, override.parameters, docs);
      entry["parameters"] = parameters;
    }
    out["overrides"][std::to_string(agent.value)] = entry;
  }
  for (const Disturbance& disturbance : plant.disturbances)
    if (disturbance.first == 0) out["disturbances"].push_back(disturbance_of(disturbance, dt));
  return out;
}

Node transport_of(const Transport& transport) {
  Node out(YAML::NodeType::Map);
  out["loss"] = number_text(transport.loss);
  out["reliability"] = transport.reliable ? "reliable" : "best_effort";
  out["history"] = transport.history;
  if (transport.lifespan) out["lifespan"] = number_text(*transport.lifespan);
  if (transport.dds_deadline) out["deadline"] = number_text(*transport.dds_deadline);
  out["liveliness"] = number_text(transport.liveliness_lease);
  out["silence"] = number_text(transport.silence);
  return out;
}

Node presence_event(const char* kind, AgentId agent, Round round) {
  Node out(YAML::NodeType::Map);
  out["round"] = round;
  out[kind] = agent.value;
  return out;
}

Node links_of(const LinkModel& links) {
  Node out(YAML::NodeType::Map);
  put_link(out, links.standard);
  for (const auto& [edge, link] : links.overrides) {
    Node entry(YAML::NodeType::Map);
    entry["edge"] = edge_text(edge);
    put_link(entry, link);
    out["overrides"].push_back(entry);
  }
  return out;
}

Node event_of(const LinkEvent& event) {
  Node out(YAML::NodeType::Map);
  out["round"] = event.round;
  Node what = out[event.heal ? "heal" : "cut"];
  if (event.everything) what = "all";
  for (const Edge edge : event.edges) what.push_back(edge_text(edge));
  for (const auto& group : event.groups) {
    Node members(YAML::NodeType::Sequence);
    for (const AgentId agent : group) members.push_back(agent.value);
    what["groups"].push_back(members);
  }
  return out;
}

Node event_of(const LinkModel::Change& change) {
  Node out(YAML::NodeType::Map), link(YAML::NodeType::Map);
  if (change.edge) link["edge"] = edge_text(*change.edge);
  put_link(link, change.spec);
  out["round"] = change.since;
  out["set_link"] = link;
  return out;
}

Node degradation_of(const Disturbance& disturbance, Seconds dt) {
  Node out(YAML::NodeType::Map);
  out["round"] = disturbance.first;
  out["degrade"] = disturbance_of(disturbance, dt);
  out["degrade"].remove("on");
  return out;
}

Node list_of(const std::vector<std::string>& texts) {
  Node out(YAML::NodeType::Sequence);
  for (const auto& text : texts) out.push_back(text);
  return out;
}

// Lists of plain numbers and edges on one line, as people write them.
void style(Node node) {
  bool leaves = true;
  if (node.IsMap()) {
    for (auto entry : node) style(entry.second);
    return;
  }
  if (!node.IsSequence()) return;
  for (auto entry : node) {
    style(entry);
    leaves = leaves && entry.IsScalar();
  }
  if (leaves) node.SetStyle(YAML::EmitterStyle::Flow);
}

}  // namespace

YAML::Node matrix_node(const Matrix& value) { return node_of(value); }

std::string resolved(const Experiment& experiment, const YAML::Node& topology, const std::vector<Host>& hosts) {
  Node out(YAML::NodeType::Map);
  out["format"] = kFileFormat;
  out["experiment"] = experiment.name;
  out["mode"] = std::string(name_of(experiment.mode));
  out["seed"] = experiment.seed.value;
  out["runs"] = experiment.runs;
  out["rounds"] = experiment.rounds;
  out["dt"] = number_text(experiment.dt);
  out["agents"] = agents_of(experiment);
  out["topology"] = topology;
  out["links"] = links_of(experiment.links);
  if (!experiment.sweep_text.empty()) out["sweep"] = YAML::Load(experiment.sweep_text);
  if (experiment.plant) out["plant"] = plant_of(*experiment.plant, experiment.dt);
  for (const auto& event : experiment.link_events) out["events"].push_back(event_of(event));
  for (const LinkModel::Change& change : experiment.links.changes) out["events"].push_back(event_of(change));
  if (experiment.plant)
    for (const Disturbance& disturbance : experiment.plant->disturbances)
      if (disturbance.first > 0) out["events"].push_back(degradation_of(disturbance, experiment.dt));
  for (const ProcessEvent& event : process_events(experiment))
    out["events"].push_back(presence_event(event.kind, event.agent, event.round));
  out["transport"] = transport_of(experiment.transport);
  out["placement"]["agents_per_process"] = experiment.agents_per_process;
  if (!hosts.empty()) out["hosts"] = hosts_node(hosts);
  if (experiment.convergence) {
    const bool estimates = std::any_of(experiment.protocols.begin(), experiment.protocols.end(),
                                       [](const ProtocolChoice& choice) { return find_protocol(choice.name).truth != Truth::none; });
    out["stop"]["converged"][estimates ? "error" : "disagreement"] = number_text(experiment.convergence->within);
    out["stop"]["converged"]["for_rounds"] = experiment.convergence->for_rounds;
  }
  out["on_agent_loss"] = experiment.on_agent_loss == AgentLoss::abort ? "abort" : "continue";
  out["stop"]["deadline"] = number_text(experiment.deadline);
  if (experiment.report_every) out["telemetry"]["every"] = *experiment.report_every;
  if (experiment.recording.state) out["record"]["state"] = *experiment.recording.state;
  if (experiment.recording.graphs) out["record"]["graphs"] = *experiment.recording.graphs;
  out["discovery"] = experiment.discovery == Discovery::multicast    ? "multicast"
                     : experiment.discovery == Discovery::neighbours ? "neighbours"
                                                                     : "auto";
  if (!experiment.metrics.empty()) out["metrics"] = list_of(experiment.metrics);
  if (!experiment.criteria.empty()) out["criteria"] = list_of(experiment.criteria);
  style(out);

  std::string text;
  std::istringstream description(experiment.description);
  for (std::string line; std::getline(description, line);) text += line.empty() ? "#\n" : "# " + line + "\n";
  YAML::Emitter emitter;
  emitter << out;
  return text + emitter.c_str() + "\n";
}

}  // namespace consort::script
