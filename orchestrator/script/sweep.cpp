#include "orchestrator/script/sweep.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/study.hpp"

#include <fmt/format.h>

namespace consort::script {

void read_sweep(Mistakes& mistakes, const YAML::Node& node, const YAML::Node& links, const LinkChanges& changes, Experiment& experiment) {
  constexpr std::string_view kLinks = "links.";
  const std::string key = node.IsMap() && node.size() == 1 && node.begin()->first.IsScalar() ? node.begin()->first.Scalar() : "";
  check(key.starts_with(kLinks), "anything else is a study, of which one cell is read");
  const std::string what = "sweep." + key;
  const auto values = swept_values(mistakes, node.begin()->second, what, key, 2);
  if (values.empty()) return;
  std::vector<ProtocolChoice::Variant> variants;
  for (const SweptValue& swept : values) {
    Mistakes trial(what);
    Experiment tried;
    tried.dt = experiment.dt;
    tried.agents = experiment.agents;
    read_links(trial, with_value(links, key.substr(kLinks.size()), swept.value), tried);
    try {
      trial.raise();
    } catch (const ConfigError& error) {
      mistakes.add(swept.value, error.what());
    }
    changes.apply(tried.links);
    variants.push_back({variants.size(), swept.label, std::move(tried.links), number_in(swept.value)});
  }
  std::vector<ProtocolChoice> expanded;
  for (const ProtocolChoice& choice : experiment.protocols)
    for (const auto& variant : variants) expanded.push_back({choice.name, choice.parameters, variant});
  experiment.protocols = std::move(expanded);
  experiment.sweep_text = YAML::Dump(node);
  experiment.sweep_key = key;
}

}  // namespace consort::script
