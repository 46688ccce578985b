#include "protocols/theory.hpp"

#include "core/counted.hpp"
#include "core/math/shapes.hpp"
#include "protocols/registry.hpp"
#include "protocols/theory_case.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace consort {
namespace {

// What is true of the graphs and links of an experiment, whatever its protocols make of it.
class Surroundings {
 public:
  Surroundings(const Experiment& experiment, const Survey& survey, std::vector<Finding>& out)
      : experiment_(experiment), survey_(survey), out_(out) {}

  void scope() {
    std::string evidence =
        fmt::format("{}: {} graphs in rounds 0 to {}", experiment_.topology_text, survey_.distinct().size(), survey_.rounds - 1);
    if (survey_.constant())
      evidence = fmt::format("{}: the same graph in rounds 0 to {}, {}", experiment_.topology_text, survey_.rounds - 1,
                             counted(survey_.segments.front().graph->edge_count(), "edge"));
    const bool random = !std::holds_alternative<FixedSchedule>(experiment_.topology);
    note("what was examined", evidence,
         random ? fmt::format("the topology is random: what follows is true of the rounds drawn with seed {}", experiment_.seed.value)
                : "what follows is exact for these rounds");
    if (!survey_.complete)
      out_.push_back({Rating::left_out, "the graphs of all rounds",
                      fmt::format("those of rounds {} to {}", survey_.rounds, experiment_.rounds - 1),
                      "not examined: it would take too long"});
  }

  void graphs() {
    const auto told = [this](const std::optional<Survey::Failure>& failure, const char* what) {
      if (!failure) return fmt::format("{} in every round", what);
      if (failure->count == survey_.rounds) return fmt::format("{} in no round", what);
      return fmt::format("{} in all but {} of {}, the first of them {}", what, failure->count, counted(survey_.rounds, "round"),
                         failure->first);
    };
    const auto spanning = survey_.spanning();
    const std::string tree = spanning.looked_until   ? "whether windows of rounds have a spanning tree was not found out"
                             : !spanning.window      ? fmt::format("no spanning tree from round {} on", spanning.broken_from)
                             : *spanning.window == 1 ? "a spanning tree in every round"
                                                     : fmt::format("a spanning tree over every {} rounds on end", *spanning.window);
    note("the graphs of the agents that are there",
         fmt::format("{}; {}; {}", told(survey_.failure(strongly_connected), "strongly connected"),
                     told(survey_.failure(balanced), "balanced"), tree),
         "balanced: in-degree = out-degree at every agent");
  }

  void connectivity(Spectra& spectra) {
    if (!survey_.constant() || survey_.graphs.front()->agents() < 2) return;
    const std::string condition = "algebraic connectivity";
    const auto others = spectra.without_zero(survey_);
    if (!others) {
      out_.push_back({Rating::left_out, condition, fmt::format("the Laplacian is of order {}", survey_.graphs.front()->agents()),
                      "not examined: it would take too long"});
      return;
    }
    const bool connected = has_spanning_tree(*survey_.graphs.front());
    note(condition, text_of(connected ? others->front().real() : 0.0),
         "smallest real part of the Laplacian's eigenvalues other than one zero: the larger, the faster the agreement");
  }

  void links() {
    if (any([](const LinkSpec& link) { return link.loses(); }))
      note("links lose messages", "a lost message is a missing edge in its round", "the graphs above are the scheduled ones");
    if (any([](const LinkSpec& link) { return link.noise_covariance.size() > 0 && !link.noise_covariance.isZero(0.0); }))
      note("links add noise", "noise covariance above 0", "nothing settles exactly: what is agreed on or estimated wanders with the noise");
    if (any([](const LinkSpec& link) { return link.quantiser.has_value(); }))
      note("links quantise", "numbers of a message are rounded to so many bits", "nothing comes closer than the rounding lets it");
    if (any([](const LinkSpec& link) { return link.delays() || link.duplication > 0.0; }))
      note("links delay messages", "delay, reordering or copies",
           "the conditions above are about messages of the same round and do not cover this");
    if (experiment_.links.overrides.empty()) return;
    const auto support = experiment_.schedule(experiment_.seed).support(experiment_.rounds);
    for (const auto& [edge, spec] : experiment_.links.overrides)
      if (!support->has(edge))
        note(fmt::format("link override on {} -> {}", edge.from.value, edge.to.value), "the topology never has this edge",
             "the override has no effect");
  }

 private:
  void note(std::string condition, std::string evidence, std::string consequence) {
    out_.push_back({Rating::note, std::move(condition), std::move(evidence), std::move(consequence)});
  }
  template <class Property>
  [[nodiscard]] bool any(Property property) const {
    bool found = false;
    for (const ProtocolChoice& choice : experiment_.protocols)
      experiment_.links_of(choice).for_each([&](const LinkSpec& spec) { found = found || property(spec); });
    return found;
  }

  const Experiment& experiment_;
  const Survey& survey_;
  std::vector<Finding>& out_;
};

}  // namespace

std::vector<Finding> examine(const Experiment& experiment, Effort effort) {
  std::vector<Finding> out;
  const Survey survey = consort::survey(experiment, effort.graph_work());
  if (const Graph& first = *survey.segments.front().graph; static_cast<double>(first.agents() + first.edge_count()) > effort.graph_work()) {
    out.push_back({Rating::left_out, "everything about the graphs",
                   fmt::format("{} in the first round", counted(first.edge_count(), "edge")), "not examined: it would take too long"});
    return out;
  }
  Spectra spectra(effort);
  Surroundings surroundings(experiment, survey, out);
  surroundings.scope();
  surroundings.graphs();
  for (const auto& choice : experiment.protocols) {
    const ProtocolEntry& entry = find_protocol(choice.name);
    if (!choice.first() || entry.examine == nullptr) continue;
    Findings findings(choice.name, out);
    try {
      entry.examine({experiment, choice, entry, survey, spectra, effort}, findings);
    } catch (const ConfigError& error) {
      findings.give_up(error.what());
    } catch (const RunError& error) {
      findings.give_up(error.what());
    }
  }
  surroundings.connectivity(spectra);
  surroundings.links();
  return out;
}

}  // namespace consort
