#include "orchestrator/script/settings.hpp"

#include "core/counted.hpp"
#include "core/number_text.hpp"
#include "protocols/registry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace consort::script {
namespace {

void read_transport(Mistakes& mistakes, const Section& top, Experiment& experiment) {
  const auto node = top.find("transport");
  if (!present(node)) return;
  const Section section(mistakes, node, "transport", "/definitions/transport");
  Transport& out = experiment.transport;
  constexpr double kMostLoss = 0.9;
  static const std::array<std::string, 2> kReliabilities{"best_effort", "reliable"};
  if (const auto loss = section.find("loss"); present(loss))
    out.loss = read_number(mistakes, loss, "transport.loss", Range{0.0, kMostLoss}).value_or(0.0);
  if (const auto reliability = section.find("reliability"); present(reliability))
    out.reliable = read_choice(mistakes, reliability, "transport.reliability", kReliabilities).value_or(0) == 1;
  if (const auto history = section.find("history"); present(history))
    out.history = static_cast<std::uint32_t>(read_whole(mistakes, history, "transport.history", 1, 1000).value_or(1));
  const auto duration = [&](const char* key, auto& into) {
    if (const auto value = section.find(key); present(value))
      if (const auto seconds = read_duration(mistakes, value, section.path(key))) into = *seconds;
  };
  duration("lifespan", out.lifespan);
  duration("deadline", out.dds_deadline);
  duration("liveliness", out.liveliness_lease);
  duration("silence", out.silence);
  constexpr Seconds kLeast = 1.0, kMost = 3600.0;
  if (out.silence < kLeast || out.silence > kMost)
    mistakes.add(section.find("silence"), fmt::format("transport.silence: found {} s; allowed: 1 s to 3600 s", number_text(out.silence)));
}

void read_recording(Mistakes& mistakes, const YAML::Node& node, Experiment& out) {
  const Section section(mistakes, node, "record", "/definitions/record");
  const auto choice = [&](const char* key, std::optional<bool>& into) {
    const auto value = section.find(key);
    if (!present(value)) return;
    into = plain_switch(value);
    if (!into) mistakes.add(value, fmt::format("record.{}: found {}; allowed: true or false", key, describe(value)));
  };
  choice("state", out.recording.state);
  choice("graphs", out.recording.graphs);
}

void read_placement(Mistakes& mistakes, const Section& top, const ScriptOverrides& overrides, Experiment& out) {
  const std::uint64_t most = std::max<std::uint64_t>(out.agents, 1);
  if (const auto node = top.find("placement"); present(node)) {
    const Section section(mistakes, node, "placement", "/definitions/placement");
    if (const auto per = section.find("agents_per_process"); present(per))
      out.agents_per_process = read_whole(mistakes, per, "placement.agents_per_process", 1, most).value_or(1);
  }
  out.agents_per_process = overrides.agents_per_process.value_or(out.agents_per_process);
  if (out.agents_per_process < 1 || out.agents_per_process > most)
    throw ConfigError(fmt::format("--agents-per-process: found {}; allowed: a whole number from 1 to {}", out.agents_per_process, most));
}

void read_stop(Mistakes& mistakes, const YAML::Node& node, Experiment& out) {
  const Section section(mistakes, node, "stop", "/definitions/stop");
  if (const auto deadline = section.find("deadline"); present(deadline))
    out.deadline = read_duration(mistakes, deadline, "stop.deadline").value_or(out.deadline);
  const auto converged = section.find("converged");
  if (!present(converged)) return;
  const Section rule(mistakes, converged, "stop.converged", "/definitions/stop/properties/converged");
  if (!rule.is_map()) return;
  Convergence convergence;
  const bool estimates = std::any_of(out.protocols.begin(), out.protocols.end(),
                                     [](const ProtocolChoice& choice) { return find_protocol(choice.name).truth != Truth::none; });
  const std::string key = estimates ? "error" : "disagreement", other = estimates ? "disagreement" : "error";
  if (const auto o = rule.find(other); present(o))
    mistakes.add(o, fmt::format("stop.converged.{}: these agents {}; allowed: {}", other,
                                estimates ? "estimate a plant" : "agree with each other", key));
  if (const auto d = rule.required(key); present(d)) convergence.within = read_number(mistakes, d, rule.path(key), kPositive).value_or(1.0);
  if (const auto r = rule.find("for_rounds"); present(r))
    convergence.for_rounds = static_cast<Round>(read_whole(mistakes, r, rule.path("for_rounds"), 1, kMostRounds).value_or(1));
  out.convergence = convergence;
}

void read_telemetry(Mistakes& mistakes, const YAML::Node& node, Experiment& out) {
  const Section section(mistakes, node, "telemetry", "/definitions/telemetry");
  if (const auto every = section.find("every"); present(every))
    if (const auto value = read_whole(mistakes, every, "telemetry.every", 1, kMostRounds)) out.report_every = static_cast<Round>(*value);
}

}  // namespace

void read_settings(Mistakes& mistakes, const Section& top, const ScriptOverrides& overrides, Experiment& experiment) {
  read_placement(mistakes, top, overrides, experiment);
  read_transport(mistakes, top, experiment);
  if (const auto node = top.find("stop"); present(node)) read_stop(mistakes, node, experiment);
  if (const auto node = top.find("telemetry"); present(node)) read_telemetry(mistakes, node, experiment);
  if (const auto node = top.find("record"); present(node)) read_recording(mistakes, node, experiment);
  static const std::array<std::string, 3> kDiscoveries{"auto", "multicast", "neighbours"};
  static const std::array<std::string, 2> kLosses{"abort", "continue"};
  if (const auto node = top.find("on_agent_loss"); present(node))
    if (const auto choice = read_choice(mistakes, node, "on_agent_loss", kLosses))
      experiment.on_agent_loss = *choice == 0 ? AgentLoss::abort : AgentLoss::go_on;
  if (const auto node = top.find("discovery"); present(node))
    if (const auto choice = read_choice(mistakes, node, "discovery", kDiscoveries))
      experiment.discovery = std::array{Discovery::automatic, Discovery::multicast, Discovery::neighbours}[*choice];
}

std::optional<Round> whole_rounds(Mistakes& mistakes, const YAML::Node& node, const std::string& what, double rounds, Round least,
                                  Seconds dt) {
  if (rounds >= static_cast<double>(least) && rounds <= static_cast<double>(kMostRounds)) return static_cast<Round>(rounds);
  mistakes.add(node, fmt::format("{}: found {}, {} {} of dt = {} s; allowed: {} to {} rounds", what, describe(node), number_text(rounds),
                                 noun(rounds, "round"), number_text(dt), least, kMostRounds));
  return std::nullopt;
}

}  // namespace consort::script
