#include "orchestrator/script/links.hpp"

#include "core/number_text.hpp"
#include "orchestrator/script/edges.hpp"
#include "orchestrator/script/link_reader.hpp"
#include "orchestrator/script/resolved.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

namespace consort::script {

void read_links(Mistakes& mistakes, const YAML::Node& node, Experiment& experiment) {
  const Section section(mistakes, node, "links", "/definitions/links");
  if (!section.is_map()) return;
  LinkModel& links = experiment.links;
  change_by(read_link(mistakes, experiment.dt, section, "links"), links.standard);
  const auto overrides = section.find("overrides");
  if (!present(overrides)) return;
  if (!overrides.IsSequence()) {
    mistakes.add(overrides, fmt::format("links.overrides: found {}; allowed: a list such as [{{edge: 3 -> 7, delay_rounds: 2}}]",
                                        describe(overrides)));
    return;
  }
  for (std::size_t i = 0; i < overrides.size(); ++i) {
    const std::string what = fmt::format("links.overrides[{}]", i);
    const Section entry(mistakes, overrides[i], what, "/definitions/link_override");
    if (!entry.is_map()) continue;
    LinkSpec link = links.standard;
    change_by(read_link(mistakes, experiment.dt, entry, what), link);
    const auto one = entry.find("edge"), several = entry.find("edges");
    if (present(one) == present(several)) {
      mistakes.add(overrides[i], fmt::format("{}: found {}; allowed: exactly one of 'edge' and 'edges'", what,
                                             present(one) ? "both 'edge' and 'edges'" : "neither 'edge' nor 'edges'"));
      continue;
    }
    const auto edges = present(one) ? read_edge(mistakes, one, what + ".edge", experiment.agents)
                                    : read_edges(mistakes, several, what + ".edges", experiment.agents);
    for (const Edge edge : edges)
      if (!links.overrides.emplace(edge, link).second)
        mistakes.add(overrides[i], fmt::format("{}: found the edge {} in a second entry; allowed: each edge once", what, edge_text(edge)));
  }
}

void LinkChanges::read(Mistakes& mistakes, const YAML::Node& node, const std::string& what, Round round, const Experiment& experiment) {
  const Section section(mistakes, node, what, "/definitions/link_override");
  if (!section.is_map()) return;
  Entry entry{round, {}, read_link(mistakes, experiment.dt, section, what)};
  const auto one = section.find("edge"), several = section.find("edges");
  if (present(one) && present(several))
    mistakes.add(node, what + ": found both 'edge' and 'edges'; allowed: one of them, or neither for all links");
  if (present(one)) entry.edges = read_edge(mistakes, one, section.path("edge"), experiment.agents);
  if (present(several)) entry.edges = read_edges(mistakes, several, section.path("edges"), experiment.agents);
  if (entry.patch.empty()) mistakes.add(node, what + ": found nothing that changes; allowed: at least one of loss, delay_rounds, ...");
  entries_.push_back(std::move(entry));
}

void LinkChanges::apply(LinkModel& links) const {
  auto ascending = entries_;
  std::stable_sort(ascending.begin(), ascending.end(), [](const Entry& a, const Entry& b) { return a.round < b.round; });
  LinkSpec standard = links.standard;
  std::map<Edge, LinkSpec> own = links.overrides;
  std::map<std::pair<Round, std::optional<Edge>>, LinkSpec> changes;  // of one round and edge, the last counts
  for (const Entry& entry : ascending) {
    const auto put = [&](std::optional<Edge> edge, LinkSpec& link) {
      change_by(entry.patch, link);
      changes[{entry.round, edge}] = link;
    };
    if (entry.edges.empty()) {
      put(std::nullopt, standard);
      for (auto& [edge, link] : own) put(edge, link);
    }
    for (const Edge edge : entry.edges) put(edge, own.emplace(edge, standard).first->second);
  }
  for (const auto& [key, link] : changes) links.changes.push_back({key.first, key.second, link});
}

LinkEvent read_link_event(Mistakes& mistakes, const YAML::Node& node, const std::string& what, Round round, bool heal, std::size_t agents) {
  LinkEvent event{round, {}, heal};
  if (heal && node.IsScalar() && node.Scalar() == "all") {
    event.everything = true;
    return event;
  }
  if (!node.IsMap()) {
    event.edges = read_edges(mistakes, node, what, agents);
    return event;
  }
  const Section section(mistakes, node, what, "/definitions/groups");
  const auto groups = section.required("groups");
  if (!present(groups)) return event;
  std::set<AgentId> seen;
  for (std::size_t g = 0; groups.IsSequence() && g < groups.size(); ++g) {
    const YAML::Node group = groups[g];
    auto& members = event.groups.emplace_back();
    for (std::size_t m = 0; group.IsSequence() && m < group.size(); ++m) {
      const auto id = whole_number(group[m]);
      const bool known = id && *id >= 1 && *id <= agents;
      if (!known || !seen.insert(AgentId{static_cast<std::uint32_t>(*id)}).second) {
        mistakes.add(group[m], fmt::format("{}: found {}{}; allowed: agents from 1 to {}, each in one group", section.path("groups"),
                                           describe(group[m]), known ? " a second time" : "", agents));
        return event;
      }
      members.push_back(AgentId{static_cast<std::uint32_t>(*id)});
    }
  }
  const bool empty = std::any_of(event.groups.begin(), event.groups.end(), [](const auto& group) { return group.empty(); });
  if (event.groups.size() < 2 || empty)
    mistakes.add(groups, fmt::format("{}: found {}; allowed: two groups or more, each a list of agents, such as [[1, 2], [3]]",
                                     section.path("groups"), describe(groups)));
  return event;
}

namespace {

YAML::Node number(double value) { return YAML::Node(number_text(value)); }

YAML::Node delay_of(const LinkSpec& link) {
  YAML::Node out(YAML::NodeType::Map);
  switch (link.jitter.kind) {
    case Jitter::Kind::none:
      return YAML::Node(link.delay_rounds);
    case Jitter::Kind::uniform:
      out["uniform"].push_back(link.delay_rounds);
      out["uniform"].push_back(number(static_cast<double>(link.delay_rounds) + link.jitter.spread));
      return out;
    case Jitter::Kind::exponential:
      out["exponential"]["shortest"] = link.delay_rounds;
      out["exponential"]["mean"] = number(link.jitter.mean);
      return out;
    case Jitter::Kind::normal:
      out["normal"]["mean"] = number(link.jitter.mean);
      out["normal"]["deviation"] = number(link.jitter.spread);
      return out;
  }
  return out;
}

YAML::Node node_of(double value) { return number(value); }
YAML::Node node_of(const Matrix& matrix) { return matrix.size() > 0 ? matrix_node(matrix) : number(0.0); }
template <class Effect>
YAML::Node node_of(const std::optional<Effect>& effect) {
  if (!effect) return YAML::Node("none");
  YAML::Node out(YAML::NodeType::Map);
  Effect::fields([&](const LinkKey& key, auto first, auto... second) {
    const auto written = [&](auto member) { return number(static_cast<double>((*effect).*member)); };
    const std::string name(key.name);
    if constexpr (sizeof...(second) == 0)
      out[name] = written(first);
    else
      for (const YAML::Node& each : {written(first), written(second)...}) out[name].push_back(each);
  });
  return out;
}

}  // namespace

void put_link(YAML::Node& out, const LinkSpec& link) {
  const Values effects = values_of(link);
  YAML::Node loss(YAML::NodeType::Map);
  out["loss"] = number(link.loss_probability);
  LinkSpec::fields([&](const LinkKey& key, auto member) {
    const std::string name(key.name);
    if constexpr (std::is_same_v<decltype(member), Round LinkSpec::*>)
      out[name] = delay_of(link);
    else if constexpr (!std::is_same_v<decltype(member), Jitter LinkSpec::*>)
      if (!key.of_loss || effects.has(name)) (key.of_loss ? loss : out)[name] = node_of(link.*member);
  });
  if (loss.size() > 1 || (loss.size() == 1 && link.loss_probability == 0.0)) out["loss"] = loss;
}

}  // namespace consort::script
