#include "orchestrator/script_resolved.hpp"

#include "orchestrator/script_topology.hpp"

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

Node agents_of(const Experiment& experiment) {
  Node out(YAML::NodeType::Map);
  out["count"] = experiment.agents;
  for (const auto& choice : experiment.protocols) {
    Node protocol(YAML::NodeType::Map);
    protocol["name"] = choice.name;
    for (const auto& [name, value] : choice.parameters.entries()) protocol[name] = node_of(value);
    out["protocols"].push_back(protocol);
  }
  for (const auto& [name, values] : experiment.initial)
    out["initial"][name] = std::visit([](const auto& source) { return node_of(source); }, values.source);
  for (const auto& [agent, override] : experiment.overrides) {
    Node entry(YAML::NodeType::Map);
    if (!override.initial.entries().empty()) entry["initial"] = node_of(override.initial);
    if (!override.parameters.entries().empty()) entry["parameters"] = node_of(override.parameters);
    out["overrides"][std::to_string(agent.value)] = entry;
  }
  return out;
}

void put_link(Node& out, const LinkSpec& link) {
  out["loss"] = number_text(link.loss_probability);
  out["delay_rounds"] = link.delay_rounds;
  if (link.noise_covariance.size() > 0) out["noise_covariance"] = node_of(link.noise_covariance);
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
  for (const Edge edge : event.edges) out[event.heal ? "heal" : "cut"].push_back(edge_text(edge));
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

std::string resolved(const Experiment& experiment, const YAML::Node& topology) {
  Node out(YAML::NodeType::Map);
  out["experiment"] = experiment.name;
  out["mode"] = experiment.mode == Mode::simulate ? "simulate" : "lockstep";
  out["seed"] = experiment.seed.value;
  out["runs"] = experiment.runs;
  out["rounds"] = experiment.rounds;
  out["dt"] = number_text(experiment.dt);
  out["agents"] = agents_of(experiment);
  out["topology"] = topology;
  out["links"] = links_of(experiment.links);
  for (const auto& event : experiment.link_events) out["events"].push_back(event_of(event));
  out["placement"]["agents_per_process"] = experiment.agents_per_process;
  if (experiment.convergence) {
    out["stop"]["converged"]["disagreement"] = number_text(experiment.convergence->disagreement);
    out["stop"]["converged"]["for_rounds"] = experiment.convergence->for_rounds;
  }
  out["stop"]["deadline"] = number_text(experiment.deadline);
  if (experiment.report_every) out["telemetry"]["every"] = *experiment.report_every;
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
