#include "orchestrator/script/sweep.hpp"

#include "core/errors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace consort::script {

namespace {

// A value of a sweep and what it is called in the names of metrics.
struct SweptValue {
  std::string label;
  YAML::Node value;
};

constexpr std::size_t kLongestLabel = 64, kMostSwept = 1000;

bool fits_metric(const std::string& label) {
  return !label.empty() && label.size() <= kLongestLabel && std::all_of(label.begin(), label.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.';
  });
}

std::vector<SweptValue> swept_values(Mistakes& mistakes, const YAML::Node& node, const std::string& what, const std::string& key) {
  std::vector<SweptValue> out;
  std::set<std::string> labels;
  const auto add = [&](const YAML::Node& place, std::string label, const YAML::Node& value) {
    if (!fits_metric(label) || !labels.insert(label).second)
      mistakes.add(place, fmt::format("{}: found the name '{}'{}; allowed: up to {} letters, digits and '_', each name once", what,
                                      shown(label), fits_metric(label) ? " a second time" : "", kLongestLabel));
    out.push_back({std::move(label), value});
  };
  const std::string last = key.substr(key.rfind('.') + 1);
  if (node.IsSequence()) {
    for (std::size_t i = 0; i < node.size(); ++i) {
      const bool plain = node[i].IsScalar() && fits_metric(node[i].Scalar());
      add(node[i], last + "_" + (plain ? node[i].Scalar() : std::to_string(i + 1)), node[i]);
    }
  } else if (node.IsMap()) {
    for (const auto& entry : node) add(entry.first, entry.first.Scalar(), entry.second);
  }
  if (out.size() < 2 || out.size() > kMostSwept)
    mistakes.add(node, fmt::format("{}: found {}; allowed: two values or more (at most {}), as a list or as a mapping from names to values",
                                   what, describe(node), kMostSwept));
  return out;
}

// A value as a number: plain, in s where it is a duration, or the only thing in a mapping ({bernoulli: 0.1}).
std::optional<double> number_in(const YAML::Node& value) {
  if (value.IsMap() && value.size() == 1) return number_in(value.begin()->second);
  if (const auto number = plain_number(value)) return number;
  Mistakes trial("");
  const auto seconds = read_duration(trial, value, "");
  return trial.none() ? seconds : std::nullopt;
}

// The links section with another value at `path` (keys below `links`).
YAML::Node with_value(const YAML::Node& links, const std::string& path, const YAML::Node& value) {
  YAML::Node out = present(links) && links.IsMap() ? YAML::Clone(links) : YAML::Node(YAML::NodeType::Map);
  if (path == "delay" || path == "delay_rounds") {
    out.remove("delay");
    out.remove("delay_rounds");
  }
  YAML::Node at = out;
  std::string rest = path;
  for (std::size_t dot = rest.find('.'); dot != std::string::npos; dot = rest.find('.')) {
    const std::string key = rest.substr(0, dot);
    if (!at[key].IsDefined() || !at[key].IsMap()) at[key] = YAML::Node(YAML::NodeType::Map);
    at.reset(at[key]);
    rest.erase(0, dot + 1);
  }
  at[rest] = YAML::Clone(value);
  return out;
}

}  // namespace

void read_sweep(Mistakes& mistakes, const YAML::Node& node, const YAML::Node& links, const LinkChanges& changes, Experiment& experiment) {
  constexpr std::string_view kLinks = "links.";
  const std::string key = node.IsMap() && node.size() == 1 && node.begin()->first.IsScalar() ? node.begin()->first.Scalar() : "";
  if (!key.starts_with(kLinks)) {
    mistakes.add(node, fmt::format("sweep: found {}; allowed: one key below links and its values, such as {{links.loss: [0, 0.1, 0.2]}}",
                                   key.empty() ? describe(node) : "'" + key + "'"));
    return;
  }
  const std::string what = "sweep." + key;
  const auto values = swept_values(mistakes, node.begin()->second, what, key);
  if (values.size() > kMostSwept) return;
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
