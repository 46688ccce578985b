#include "protocols/theory_case.hpp"

#include "core/counted.hpp"
#include "core/math/shapes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace consort {

// --- eigenvalues ----------------------------------------------------------------------------------------------------------

const Spectra::Spectrum* Spectra::of(const Graph& graph) {
  const auto known = known_.find(&graph);
  if (known != known_.end()) return &known->second;
  const auto n = static_cast<double>(graph.agents());
  if (!effort_.affords(undirected(graph) ? symmetric_spectrum_cost(n) : spectrum_cost(n))) return nullptr;
  return &known_.emplace(&graph, laplacian_spectrum(graph)).first->second;
}

std::optional<Spectra::Spectrum> Spectra::without_zero(const Survey& survey) {
  Spectrum all;
  for (const std::size_t s : survey.distinct()) {
    const Spectrum* of_one = of(*survey.graphs[s]);
    if (of_one == nullptr) return std::nullopt;
    const auto zero =
        std::min_element(of_one->begin(), of_one->end(), [](const auto& a, const auto& b) { return std::abs(a) < std::abs(b); });
    for (auto it = of_one->begin(); it != of_one->end(); ++it)
      if (it != zero) all.push_back(*it);
  }
  return all;
}

// --- values --------------------------------------------------------------------------------------------------------------

Values TheoryCase::parameters(AgentId agent) const { return with_defaults(experiment.parameters_of(choice, agent), entry.parameters); }

Values TheoryCase::initial(AgentId agent) const { return with_defaults(experiment.initial_of(agent, experiment.seed), entry.initial); }

// --- findings -------------------------------------------------------------------------------------------------------------

void Findings::add(Rating verdict, std::string_view condition, std::string evidence, std::string consequence) {
  out_.push_back({verdict, fmt::format("{}: {}", protocol_, condition), std::move(evidence), std::move(consequence)});
}

void Findings::judge(bool holds, std::string_view condition, std::string evidence, std::string if_so, std::string if_not) {
  add(holds ? Rating::holds : Rating::fails, condition, std::move(evidence), holds ? std::move(if_so) : std::move(if_not));
}

void Findings::leave_out(std::string_view condition, std::string why) {
  add(Rating::left_out, condition, std::move(why), "not examined: it would take too long");
}

std::string evidence_of(const Survey& survey, const std::optional<Survey::Failure>& failure) {
  if (!failure)
    return survey.constant() ? "the constant graph" : survey.rounds == 1 ? "in its one round" : fmt::format("all {} rounds", survey.rounds);
  return survey.constant()
             ? "the constant graph is not"
             : fmt::format("not in {} of {}, first in round {}", failure->count, counted(survey.rounds, "round"), failure->first);
}

// --- links ----------------------------------------------------------------------------------------------------------------

bool any_link(const TheoryCase& of, const std::function<bool(const LinkSpec&)>& property) {
  bool found = false;
  for (const ProtocolChoice& choice : of.experiment.protocols)
    if (choice.name == of.choice.name)
      of.experiment.links_of(choice).for_each([&](const LinkSpec& spec) { found = found || property(spec); });
  return found;
}

std::string limits_of_prediction(const TheoryCase& of) {
  return any_link(of, [](const LinkSpec& link) { return !link.ideal(); }) ? " with ideal links" : "";
}

bool ask_no_loss(const TheoryCase& of, Findings& out, const std::string& if_not) {
  const bool holds = !any_link(of, [](const LinkSpec& link) { return link.loses(); });
  out.judge(holds, "no loss", holds ? "no link loses a message" : "links lose messages", "everything sent arrives", if_not);
  return holds;
}

bool ask_no_noise(const TheoryCase& of, Findings& out, const std::string& if_not) {
  const bool noisy = any_link(
      of, [](const LinkSpec& link) { return link.quantiser || (link.noise_covariance.size() > 0 && !link.noise_covariance.isZero(0.0)); });
  const bool disturbed = of.experiment.plant && !of.experiment.plant->disturbances.empty();
  out.judge(!noisy && !disturbed, "no noise",
            disturbed ? "the plant is disturbed"
            : noisy   ? "links disturb messages"
                      : "nothing disturbs the plant, its measurements or messages",
            "the theorem is about such runs", if_not);
  return !noisy && !disturbed;
}

// --- graphs ---------------------------------------------------------------------------------------------------------------

constexpr std::string_view kWindows = "the union of the graphs over bounded windows has a spanning tree";

bool ask_spanning_windows(const TheoryCase& of, Findings& out, const std::string& if_so) {
  const auto spanning = of.survey.spanning();
  const auto window = spanning.window.value_or(0);
  if (spanning.looked_until) {
    out.leave_out(kWindows, fmt::format("{}, looked at up to round {}",
                                        window == 0 ? std::string("not within the rounds that were looked at")
                                                    : fmt::format("over every {} rounds on end", window),
                                        *spanning.looked_until));
    return true;
  }
  out.judge(spanning.window.has_value(), kWindows,
            window == 0   ? fmt::format("not from round {} on", spanning.broken_from)
            : window == 1 ? "in every single round"
                          : fmt::format("over every {} rounds on end", window),
            if_so, "agreement is not promised: some agents never hear, however indirectly, of others");
  return spanning.window.has_value();
}

bool ask_spanning_tree(const TheoryCase& of, Findings& out, const std::string& if_so) {
  const auto torn = of.survey.failure(has_spanning_tree);
  out.judge(!torn, "a spanning tree in every round", evidence_of(of.survey, torn), if_so,
            "agreement is not promised: some agents do not hear, however indirectly, of others");
  return !torn;
}

bool ask_strongly_connected(const TheoryCase& of, Findings& out, const std::string& if_so, const std::string& if_not) {
  const auto weak = of.survey.failure(strongly_connected);
  out.judge(!weak, "strongly connected in every round", evidence_of(of.survey, weak), if_so, if_not);
  return !weak;
}

// --- steps ----------------------------------------------------------------------------------------------------------------

void ask_short_step(const TheoryCase& of, Findings& out, const std::string& what, const SampledLoop& loop, const std::string& if_so,
                    const std::string& if_not) {
  constexpr double kRounding = 1e-12;
  const std::string condition = "dt is short enough for " + what;
  if (!of.effort.affords(loop.cost)) {
    out.leave_out(condition, "the sampled loop is too large for eigenvalues");
    return;
  }
  const double now = loop.radius(of.experiment.dt);
  std::string allowed = "the longest step was not searched for";
  std::optional<Seconds> bound;
  if (of.effort.affords(kStepQuestions * loop.cost)) {
    bound = largest_stable_step(loop.radius, loop.shortest);
    allowed = std::isinf(*bound) ? "any is" : "allowed below " + text_of(*bound);
  }
  out.judge(now < 1.0 - kRounding, condition,
            fmt::format("dt = {}, {}; spectral radius {}{}", text_of(of.experiment.dt), allowed, text_of(now), loop.where), if_so,
            if_not + ": " + step_remedy(of.experiment.dt, bound));
}

std::string step_remedy(Seconds dt, std::optional<Seconds> longest) {
  if (longest && !(*longest > 0.0)) return "no dt is short enough";
  // Beside 1, doubles do not show what so short a step does.
  if (longest && dt < 0.5 * *longest) return "dt is so short that a round changes nothing, take a longer one";
  return longest ? "take a shorter dt" : "take another dt, a shorter one unless it is very short already";
}

Seconds largest_stable_step(const std::function<double(Seconds)>& radius, Seconds shortest) {
  constexpr double kGrowth = 1.2, kFarthest = 1e6, kDigits = 1e-7;
  Seconds stable = shortest;
  if (!(radius(stable) < 1.0)) return 0.0;
  while (radius(stable * kGrowth) < 1.0) {
    stable *= kGrowth;
    if (stable > kFarthest * shortest) return std::numeric_limits<double>::infinity();
  }
  Seconds unstable = stable * kGrowth;
  while (unstable - stable > kDigits * stable) {
    const Seconds middle = 0.5 * (stable + unstable);
    (radius(middle) < 1.0 ? stable : unstable) = middle;
  }
  return stable;
}

}  // namespace consort
