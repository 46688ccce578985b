#include "orchestrator/script/links.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"
#include "orchestrator/script/resolved.hpp"
#include "orchestrator/script/topology.hpp"
#include "orchestrator/script/wording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace consort::script {

namespace {

using Patch = std::vector<std::function<void(LinkSpec&)>>;

constexpr Range kRoundsOfDelay{0.0, static_cast<double>(kLongestDelay), false};

// Reads the keys of one link into what they change.
class LinkReader {
 public:
  LinkReader(Mistakes& mistakes, Seconds dt, const Section& section, std::string what)
      : mistakes_(mistakes), dt_(dt), section_(section), what_(std::move(what)) {}

  Patch read() && {
    const std::size_t before = mistakes_.count();
    const auto with = [this](const char* key, auto take) {
      if (const auto node = section_.find(key); present(node)) take(node, section_.path(key));
    };
    with("loss", [this](const auto& node, const std::string& what) { read_loss(node, what); });
    if (present(section_.find("delay")) && present(section_.find("delay_rounds")))
      mistakes_.add(section_.find("delay"), section_.path("delay") + ": found both 'delay' and 'delay_rounds'; allowed: one of them");
    with("delay", [this](const auto& node, const std::string& what) { read_delay(node, what, true); });
    with("delay_rounds", [this](const auto& node, const std::string& what) { read_delay(node, what, false); });
    with("duplication", [this](const auto& node, const std::string& what) {
      if (const auto p = read_number(mistakes_, node, what, kProbability)) change([p = *p](LinkSpec& link) { link.duplication = p; });
    });
    with("reordering", [this](const auto& node, const std::string& what) { read_reordering(node, what); });
    with("noise_covariance", [this](const auto& node, const std::string& what) { read_noise(node, what); });
    with("quantisation", [this](const auto& node, const std::string& what) { read_quantisation(node, what); });
    if (mistakes_.count() == before) {
      LinkSpec tried;
      for (const auto& apply : patch_) apply(tried);
      if (const auto found = objection(tried)) mistakes_.add(section_.node(), what_ + ": found " + *found);
    }
    return std::move(patch_);
  }

 private:
  void change(std::function<void(LinkSpec&)> apply) { patch_.push_back(std::move(apply)); }

  static bool none(const YAML::Node& node) { return node.IsScalar() && node.Scalar() == "none"; }

  double probability(const Section& section, const char* key, std::optional<double> otherwise = std::nullopt) {
    const auto node = otherwise ? section.find(key) : section.required(key);
    return present(node) ? read_number(mistakes_, node, section.path(key), kProbability).value_or(0.0) : otherwise.value_or(0.0);
  }

  void read_loss(const YAML::Node& node, const std::string& what) {
    LinkSpec read;
    if (node.IsMap()) {
      const Section loss(mistakes_, node, what, "/definitions/loss/oneOf/1");
      if (present(loss.find("bernoulli"))) read.loss_probability = probability(loss, "bernoulli");
      if (const auto bursts = loss.find("gilbert_elliott"); present(bursts)) {
        const Section part(mistakes_, bursts, loss.path("gilbert_elliott"), "/definitions/gilbert_elliott");
        if (!part.is_map()) return;
        read.bursts = BurstLoss{probability(part, "p_good_to_bad"), probability(part, "p_bad_to_good"),
                                probability(part, "loss_in_good", 0.0), probability(part, "loss_in_bad", 1.0)};
      }
      if (const auto distance = loss.find("distance"); present(distance)) {
        const Section part(mistakes_, distance, loss.path("distance"), "/definitions/distance_loss");
        if (!part.is_map()) return;
        read.distance = DistanceLoss{distance_in(part, "safe"), distance_in(part, "lost")};
      }
    } else {
      read.loss_probability = read_number(mistakes_, node, what, kProbability).value_or(0.0);
    }
    change([read](LinkSpec& link) {
      link.loss_probability = read.loss_probability;
      link.bursts = read.bursts;
      link.distance = read.distance;
    });
  }

  double distance_in(const Section& section, const char* key) {
    const auto node = section.required(key);
    return present(node) ? read_number(mistakes_, node, section.path(key), {0.0, kUnbounded, false}).value_or(0.0) : 0.0;
  }

  /// A delay in rounds, not rounded: a time (`timed`) or a number of rounds.
  double rounds_in(const YAML::Node& node, const std::string& what, bool timed) {
    if (!timed) return read_number(mistakes_, node, what, kRoundsOfDelay).value_or(0.0);
    if (const auto number = plain_number(node); number && *number == 0.0) return 0.0;
    const double rounds = read_duration(mistakes_, node, what).value_or(0.0) / dt_;
    if (!kRoundsOfDelay.holds(rounds))
      mistakes_.add(node, fmt::format("{}: found {}, {} rounds of dt = {} s; allowed: up to {} rounds", what, describe(node),
                                      number_text(rounds), number_text(dt_), kLongestDelay));
    return rounds;
  }

  /// The same in whole rounds: a time is rounded up, a number of rounds is whole.
  Round whole_rounds_in(const YAML::Node& node, const std::string& what, bool timed) {
    if (!timed) return static_cast<Round>(read_whole(mistakes_, node, what, 0, kLongestDelay).value_or(0));
    const double rounds = rounds_in(node, what, timed);
    return kRoundsOfDelay.holds(rounds) ? static_cast<Round>(first_round_from(rounds)) : 0;
  }

  void read_delay(const YAML::Node& node, const std::string& what, bool timed) {
    Round least = 0;
    Jitter jitter;
    if (!node.IsMap()) {
      least = whole_rounds_in(node, what, timed);
    } else {
      const char* pointer = timed ? "/definitions/delay/oneOf/2" : "/definitions/delay_rounds/oneOf/1";
      const Section section(mistakes_, node, what, pointer);
      if (node.size() != 1) {
        mistakes_.add(node,
                      fmt::format("{}: found {}; allowed: exactly one of uniform, exponential, normal", what, counted(node.size(), "key")));
        return;
      }
      if (const auto part = section.find("uniform"); present(part)) read_uniform(part, section.path("uniform"), timed, least, jitter);
      if (const auto part = section.find("exponential"); present(part)) {
        const Section keys(mistakes_, part, section.path("exponential"), std::string(pointer) + "/properties/exponential");
        if (const auto shortest = keys.find("shortest"); present(shortest)) least = whole_rounds_in(shortest, keys.path("shortest"), timed);
        jitter.kind = Jitter::Kind::exponential;
        if (const auto mean = keys.required("mean"); present(mean)) jitter.mean = rounds_in(mean, keys.path("mean"), timed);
      }
      if (const auto part = section.find("normal"); present(part)) {
        const Section keys(mistakes_, part, section.path("normal"), std::string(pointer) + "/properties/normal");
        jitter.kind = Jitter::Kind::normal;
        if (const auto mean = keys.required("mean"); present(mean)) jitter.mean = rounds_in(mean, keys.path("mean"), timed);
        if (const auto spread = keys.required("deviation"); present(spread))
          jitter.spread = rounds_in(spread, keys.path("deviation"), timed);
      }
    }
    change([least, jitter](LinkSpec& link) {
      link.delay_rounds = least;
      link.jitter = jitter;
    });
  }

  void read_uniform(const YAML::Node& node, const std::string& what, bool timed, Round& least, Jitter& jitter) {
    if (!node.IsSequence() || node.size() != 2) {
      mistakes_.add(node, fmt::format("{}: found {}; allowed: [shortest, longest]", what, describe(node)));
      return;
    }
    least = whole_rounds_in(node[0], what + "[0]", timed);
    const Round most = whole_rounds_in(node[1], what + "[1]", timed);
    if (most < least) {
      mistakes_.add(node, fmt::format("{}: found {} to {} rounds; allowed: ascending", what, least, most));
      return;
    }
    jitter = {Jitter::Kind::uniform, 0.0, static_cast<double>(most - least)};
  }

  void read_reordering(const YAML::Node& node, const std::string& what) {
    if (none(node)) return change([](LinkSpec& link) { link.reordering.reset(); });
    const Section section(mistakes_, node, what, "/definitions/reordering/oneOf/1");
    if (!section.is_map()) return;
    Reordering read{probability(section, "probability"), 1};
    if (const auto later = section.find("later_rounds"); present(later))
      read.later_rounds = static_cast<Round>(read_whole(mistakes_, later, section.path("later_rounds"), 1, kLongestDelay).value_or(1));
    change([read](LinkSpec& link) { link.reordering = read; });
  }

  void read_noise(const YAML::Node& node, const std::string& what) {
    auto covariance = read_matrix(mistakes_, node, what);
    if (!covariance) return;
    try {
      Values values;
      values.set("noise_covariance", *covariance);
      static_cast<void>(values.covariance("noise_covariance", covariance->rows()));  // for its objections
      if (covariance->isZero(0.0)) covariance->resize(0, 0);
      change([read = *covariance](LinkSpec& link) { link.noise_covariance = read; });
    } catch (const ConfigError& error) {
      mistakes_.add(node, fmt::format("{}: {}", what, error.what()));
    }
  }

  void read_quantisation(const YAML::Node& node, const std::string& what) {
    if (none(node)) return change([](LinkSpec& link) { link.quantiser.reset(); });
    const Section section(mistakes_, node, what, "/definitions/quantisation/oneOf/1");
    if (!section.is_map()) return;
    Quantiser read;
    if (const auto bits = section.required("bits"); present(bits))
      read.bits = static_cast<std::uint32_t>(read_whole(mistakes_, bits, section.path("bits"), 1, 32).value_or(1));
    const auto range = section.required("range");
    if (!present(range)) return;
    const auto low = range.IsSequence() && range.size() == 2 ? plain_number(range[0]) : std::nullopt;
    const auto high = low ? plain_number(range[1]) : std::nullopt;
    if (!high || !(*low < *high)) {
      mistakes_.add(range,
                    fmt::format("{}: found {}; allowed: [low, high], two numbers, ascending", section.path("range"), describe(range)));
      return;
    }
    read.low = *low;
    read.high = *high;
    change([read](LinkSpec& link) { link.quantiser = read; });
  }

  Mistakes& mistakes_;
  Seconds dt_;
  const Section& section_;
  std::string what_;
  Patch patch_;
};

void change_by(const Patch& patch, LinkSpec& link) {
  for (const auto& change : patch) change(link);
}

}  // namespace

void read_links(Mistakes& mistakes, const YAML::Node& node, Experiment& experiment) {
  const Section section(mistakes, node, "links", "/definitions/links");
  if (!section.is_map()) return;
  LinkModel& links = experiment.links;
  change_by(LinkReader(mistakes, experiment.dt, section, "links").read(), links.standard);
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
    change_by(LinkReader(mistakes, experiment.dt, entry, what).read(), link);
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
  Entry entry{round, {}, LinkReader(mistakes, experiment.dt, section, what).read()};
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

YAML::Node loss_of(const LinkSpec& link) {
  if (!link.bursts && !link.distance) return number(link.loss_probability);
  YAML::Node out(YAML::NodeType::Map);
  if (link.loss_probability > 0.0) out["bernoulli"] = number(link.loss_probability);
  if (link.bursts) {
    YAML::Node part = out["gilbert_elliott"];
    part["p_good_to_bad"] = number(link.bursts->good_to_bad);
    part["p_bad_to_good"] = number(link.bursts->bad_to_good);
    part["loss_in_good"] = number(link.bursts->loss_in_good);
    part["loss_in_bad"] = number(link.bursts->loss_in_bad);
  }
  if (link.distance) {
    out["distance"]["safe"] = number(link.distance->safe);
    out["distance"]["lost"] = number(link.distance->lost);
  }
  return out;
}

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

}  // namespace

void put_link(YAML::Node& out, const LinkSpec& link) {
  out["loss"] = loss_of(link);
  out["delay_rounds"] = delay_of(link);
  out["duplication"] = number(link.duplication);
  if (link.reordering) {
    out["reordering"]["probability"] = number(link.reordering->probability);
    out["reordering"]["later_rounds"] = link.reordering->later_rounds;
  } else {
    out["reordering"] = "none";
  }
  out["noise_covariance"] = link.noise_covariance.size() > 0 ? matrix_node(link.noise_covariance) : number(0.0);
  if (link.quantiser) {
    out["quantisation"]["bits"] = link.quantiser->bits;
    out["quantisation"]["range"].push_back(number(link.quantiser->low));
    out["quantisation"]["range"].push_back(number(link.quantiser->high));
  } else {
    out["quantisation"] = "none";
  }
}

}  // namespace consort::script
