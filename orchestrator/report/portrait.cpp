#include "orchestrator/report/portrait.hpp"

#include "core/counted.hpp"
#include "models/registry.hpp"
#include "orchestrator/run/link_words.hpp"
#include "orchestrator/run/placement.hpp"
#include "protocols/registry.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace consort {
namespace {

constexpr std::size_t kLabelWidth = 11, kMostDrawn = 24;

// Text is broken for reading: as wide as the terminal, but not wider than 100 characters.
std::size_t text_width(const TextStyle& style) { return std::clamp<std::size_t>(style.width, 60, 100); }

std::string fact(const std::string& label, const std::string& text, const TextStyle& style) {
  std::string out;
  const auto lines = wrapped(text, text_width(style) - kLabelWidth - 4);
  for (std::size_t i = 0; i < lines.size(); ++i) out += fmt::format("  {:<{}}  {}\n", i == 0 ? label : "", kLabelWidth, lines[i]);
  return out;
}

std::string link_text(const LinkModel& links) {
  std::string text = words_of(links.standard);
  if (!links.overrides.empty()) text += fmt::format(", {}", counted(links.overrides.size(), "exception"));
  return text;
}

std::string plant_text(const PlantSpec& plant) {
  std::string text = fmt::format("{}: {}", plant.model, find_plant(plant.model).summary);
  constexpr std::array kSensing{"agents sense their own part", "agents sense their own part and their in-neighbours'",
                                "agents sense others relative to themselves"};
  text += fmt::format("; {}", kSensing[static_cast<std::size_t>(plant.sensing)]);
  if (!plant.couplings.empty()) text += fmt::format("; {}", counted(plant.couplings.size(), "coupling"));
  if (!plant.disturbances.empty()) text += fmt::format("; {}", counted(plant.disturbances.size(), "disturbance"));
  return text;
}

std::string stop_text(const Experiment& experiment) {
  std::string text = fmt::format("after {} {}", grouped(experiment.rounds), noun(experiment.rounds, "round"));
  const bool estimates = std::any_of(experiment.protocols.begin(), experiment.protocols.end(),
                                     [](const ProtocolChoice& choice) { return find_protocol(choice.name).truth != Truth::none; });
  if (experiment.convergence)
    text += fmt::format(", or when the {} is at most {:g} for {}", estimates ? "error" : "disagreement", experiment.convergence->within,
                        counted(experiment.convergence->for_rounds, "round"));
  return text + fmt::format("; deadline {:g} s", experiment.deadline);
}

std::string facts(const Experiment& experiment, const TextStyle& style) {
  const std::size_t processes = processes_of(experiment).size();
  std::string out;
  out += fact("mode",
              experiment.mode == Mode::simulate
                  ? "simulate, no processes"
                  : fmt::format("lockstep, {}{}", counted(processes, "agent process"), experiment.plant ? " and the plant's" : ""),
              style);
  out += fact("agents", fmt::format("{}", experiment.agents), style);
  for (const ProtocolChoice& choice : experiment.protocols) {
    if (!choice.first()) continue;
    const ProtocolEntry& entry = find_protocol(choice.name);
    out += fact("protocol", fmt::format("{}: {}", choice.name, entry.summary), style);
    out += fact("", fmt::format("{}", entry.source), style);
    out += fact("", fmt::format("assumes: {}", entry.assumptions), style);
  }
  out += fact("topology", experiment.topology_text, style);
  out += fact("links", link_text(experiment.links), style);
  for (const ProtocolChoice& choice : experiment.protocols)
    if (choice.variant && choice.name == experiment.protocols.front().name)
      out += fact("", choice.variant->label + ": " + link_text(choice.variant->links), style);
  if (experiment.plant) out += fact("plant", plant_text(*experiment.plant), style);
  for (const ProcessEvent& event : process_events(experiment))
    out += fact("event", fmt::format("round {}: {} agent {}", event.round, event.kind, event.agent.value), style);
  constexpr std::size_t kShownEdges = 4;
  for (const LinkEvent& event : experiment.link_events)
    out += fact("event", fmt::format("round {}: {} {}", event.round, event.heal ? "heal" : "cut", words_of(event, kShownEdges)), style);
  for (const LinkModel::Change& change : experiment.links.changes)
    out += fact("event", fmt::format("round {}: {}", change.since, words_of(change)), style);
  if (experiment.plant)
    for (const Disturbance& disturbance : experiment.plant->disturbances)
      if (disturbance.first > 0)
        out += fact("event", fmt::format("round {}: degrades the {}", disturbance.first, words_of_degradation(disturbance)), style);
  out += fact("ends", stop_text(experiment), style);
  out += fact("seed",
              experiment.runs > 1
                  ? fmt::format("{} to {}, {} runs", experiment.seed.value, experiment.seed.value + experiment.runs - 1, experiment.runs)
                  : fmt::format("{}", experiment.seed.value),
              style);
  const Round interval = experiment.report_interval();
  out += fact("record", interval == 1 ? "every round" : fmt::format("every {} rounds", interval), style);
  for (std::size_t i = 0; i < experiment.criteria.size(); ++i) out += fact(i == 0 ? "criteria" : "", experiment.criteria[i], style);
  return out;
}

std::string findings_text(const std::vector<Finding>& findings, const TextStyle& style) {
  std::string out = "\n  " + toned("What theory says", Tone::strong, style) + "\n";
  for (const Finding& finding : findings) {
    // What refuses a run is marked as what fails is.
    const bool holds = finding.verdict == Rating::holds, note = finding.verdict == Rating::note || finding.verdict == Rating::left_out;
    const std::string mark = style.unicode ? (holds ? "✓" : note ? "·" : "✗") : (holds ? "+" : note ? "-" : "!");
    const std::string head = finding.condition + (finding.evidence.empty() ? "" : ": " + finding.evidence);
    const auto lines = wrapped(head, text_width(style) - 4);
    for (std::size_t i = 0; i < lines.size(); ++i)
      out += fmt::format("  {} {}\n", i == 0 ? toned(mark, holds ? Tone::good : note ? Tone::plain : Tone::bad, style) : " ", lines[i]);
    if (finding.consequence.empty()) continue;
    for (const auto& line : wrapped(finding.consequence, text_width(style) - 6)) out += "      " + toned(line, Tone::faint, style) + "\n";
  }
  return out;
}

}  // namespace

std::string picture(const Experiment& experiment, const TextStyle& style) {
  const std::size_t n = experiment.agents;
  if (n > kMostDrawn) return "";
  const Schedule schedule = experiment.schedule(experiment.seed);
  const auto now = schedule.at(0);
  const auto ever = schedule.support(experiment.rounds);
  const char* here = style.unicode ? "●" : "#";
  const char* later = style.unicode ? "○" : "o";
  const char* never = style.unicode ? "·" : ".";
  std::string out = fmt::format("\n  {}: row i receives from the columns with {}", toned("Who hears whom", Tone::strong, style), here);
  out += *ever == *now ? "\n" : fmt::format(" in round 0,\n  with {} in another round\n", later);
  out += "       ";
  for (std::size_t j = 1; j <= n; ++j) out += fmt::format("{:>3}", j);
  out += "\n";
  for (std::size_t i = 1; i <= n; ++i) {
    out += fmt::format("  {:>5}", i);
    for (std::size_t j = 1; j <= n; ++j) {
      if (i == n && j == n) break;  // nothing but the empty diagonal is left
      const Edge edge{agent_at(j - 1), agent_at(i - 1)};
      out += fmt::format("  {}", i == j ? " " : now->has(edge) ? here : ever->has(edge) ? later : never);
    }
    out += "\n";
  }
  return out;
}

std::string portrait(const Experiment& experiment, const std::vector<Finding>& findings, const TextStyle& style) {
  std::string out = fmt::format("\n  {}\n", toned(experiment.name, Tone::strong, style));
  if (!experiment.description.empty()) {
    std::string description = experiment.description;
    std::replace(description.begin(), description.end(), '\n', ' ');
    for (const auto& line : wrapped(description, text_width(style) - 2)) out += fmt::format("  {}\n", toned(line, Tone::faint, style));
  }
  return out + "\n" + facts(experiment, style) + picture(experiment, style) + findings_text(findings, style);
}

}  // namespace consort
