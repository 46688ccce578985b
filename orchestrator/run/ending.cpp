#include "orchestrator/run/ending.hpp"

#include "core/counted.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace consort {
namespace {

using Absence = AgentEnd::Absence;

constexpr std::size_t kGroupsTold = 6;

std::string agents_of(const std::vector<std::uint32_t>& ids) { return noun(ids.size(), "agent") + " " + listed(ids); }

bool is_missing(const AgentEnd& end) { return (end.absence == Absence::none || end.absence == Absence::left) && end.reached < end.asked; }

AgentEnd by_plan(const Experiment& experiment, AgentId agent, Round last) {
  AgentEnd end{agent};
  const Attendance presence = experiment.presence_of(agent);
  Round ended = 0;
  for (const Attendance& stay : presence.stays()) {
    if (stay.from > experiment.rounds) continue;
    end.asked = std::min(stay.until, experiment.rounds);
    if (stay.from > last) {
      end.absence = Absence::awaited;
      continue;
    }
    ended = stay.until;
    end.reached = std::min(stay.until, last);
  }
  if (end.asked == 0) end.absence = Absence::awaited;
  if (end.absence == Absence::none && ended <= last) end.absence = killed_in(experiment, agent, ended) ? Absence::killed : Absence::left;
  return end;
}

}  // namespace

bool killed_in(const Experiment& experiment, AgentId agent, Round round) {
  return std::any_of(experiment.faults.begin(), experiment.faults.end(),
                     [&](const Fault& fault) { return fault.kind == Fault::Kind::kill && fault.agent == agent && fault.round == round; });
}

std::string_view name_of(Ending ending) {
  constexpr std::array<std::string_view, 7> kNames{"last_round", "stop_rule", "nobody_left", "out_of_time",
                                                   "deadline",   "signal",    "failure"};
  return kNames.at(static_cast<std::size_t>(ending));
}

std::string_view name_of(AgentEnd::Absence absence) {
  constexpr std::array<std::string_view, 5> kNames{"none", "awaited", "left", "killed", "given_up"};
  return kNames.at(static_cast<std::size_t>(absence));
}

std::vector<AgentEnd> agents_by_plan(const Experiment& experiment, Round last) {
  std::vector<AgentEnd> agents;
  for (std::size_t i = 0; i < experiment.agents; ++i) agents.push_back(by_plan(experiment, agent_at(i), last));
  return agents;
}

void merge(std::vector<AgentEnd>& all, const std::vector<AgentEnd>& run) {
  if (all.empty()) {
    all = run;
    return;
  }
  for (std::size_t i = 0; i < std::min(all.size(), run.size()); ++i) {
    all[i].reached = std::min(all[i].reached, run[i].reached);
    all[i].absence = std::max(all[i].absence, run[i].absence);
    all[i].slept += run[i].slept;
  }
}

Completeness completeness(const RunEnd& end, Round reached, Round asked) {
  if (is_complete(end.ending)) return {};
  Completeness result{.complete = false};
  std::vector<std::string> culprits;
  if (end.plant && *end.plant < asked) {
    result.missing.push_back(0);
    culprits.push_back(fmt::format("the plant reached round {} of {}", *end.plant, asked));
  }
  std::vector<AgentEnd> missing;
  std::copy_if(end.agents.begin(), end.agents.end(), std::back_inserter(missing), is_missing);
  for (const AgentEnd& agent : missing) result.missing.push_back(agent.agent.value);
  for (const auto& [ids, one] : alike(missing)) {
    if (culprits.size() == kGroupsTold) {
      culprits.emplace_back("and others");
      break;
    }
    culprits.push_back(fmt::format("{} reached round {} of {}", agents_of(ids), one.reached, one.asked));
  }
  const char* why = end.ending == Ending::deadline ? "the deadline passed"
                    : end.ending == Ending::signal ? "a signal ended the run"
                                                   : "the run failed";
  result.words = end.ending == Ending::out_of_time ? "the time of the run was over before everybody had reported the last round"
                                                   : fmt::format("{} in round {} of {}", why, reached, asked);
  if (!culprits.empty()) result.words += fmt::format("; {}", fmt::join(culprits, ", "));
  return result;
}

std::string listed(const std::vector<std::uint32_t>& ids) {
  std::string text;
  for (std::size_t i = 0; i < ids.size();) {
    std::size_t last = i;
    while (last + 1 < ids.size() && ids[last + 1] == ids[last] + 1) ++last;
    if (!text.empty()) text += ", ";
    text += fmt::format("{}", ids[i]);
    if (last > i) text += fmt::format("-{}", ids[last]);
    i = last + 1;
  }
  return text;
}

std::vector<std::pair<std::vector<std::uint32_t>, AgentEnd>> alike(const std::vector<AgentEnd>& agents) {
  std::vector<std::pair<std::vector<std::uint32_t>, AgentEnd>> groups;
  for (const AgentEnd& end : agents) {
    const auto same = std::find_if(groups.begin(), groups.end(), [&](const auto& group) {
      const AgentEnd& one = group.second;
      return one.reached == end.reached && one.asked == end.asked && one.absence == end.absence && one.slept == end.slept;
    });
    if (same == groups.end())
      groups.push_back({{end.agent.value}, end});
    else
      same->first.push_back(end.agent.value);
  }
  return groups;
}

std::vector<std::string> told(const std::vector<AgentEnd>& agents) {
  std::vector<std::string> lines;
  for (const auto& [ids, end] : alike(agents)) {
    std::string what;
    if (end.absence == Absence::awaited)
      what = "had not joined by the end, as planned";
    else if (end.absence == Absence::left)
      what = fmt::format("left in round {}, as planned", end.asked);
    else if (end.absence == Absence::killed)
      what = fmt::format("killed in round {}, as planned", end.asked);
    else if (end.absence == Absence::given_up)
      what = fmt::format("died and {} given up after round {}", ids.size() == 1 ? "was" : "were", end.reached);
    if (end.slept > 0) what += fmt::format("{}slept through {}", what.empty() ? "" : "; ", counted(end.slept, "round"));
    if (what.empty()) continue;
    if (lines.size() == kGroupsTold) {
      lines.emplace_back("more agents were absent or slept: see \"agents\" in summary.json");
      break;
    }
    lines.push_back(fmt::format("{}: {}", agents_of(ids), what));
  }
  return lines;
}

}  // namespace consort
