#include "orchestrator/run/link_words.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace consort {

std::string words_of(const LinkEvent& event, std::size_t shown) {
  if (event.everything) return "all";
  std::string text;
  for (std::size_t i = 0; i < std::min(event.edges.size(), shown); ++i)
    text += fmt::format("{}{} -> {}", i == 0 ? "" : ", ", event.edges[i].from.value, event.edges[i].to.value);
  if (event.edges.size() > shown) text += fmt::format(" and {} more", event.edges.size() - shown);
  for (const auto& group : event.groups) {
    text += text.empty() ? "groups {" : " | {";
    for (std::size_t i = 0; i < group.size(); ++i) text += fmt::format("{}{}", i == 0 ? "" : ", ", group[i].value);
    text += "}";
  }
  return text;
}

std::string words_of(const LinkModel::Change& change) {
  const std::string which = change.edge ? fmt::format("{} -> {}", change.edge->from.value, change.edge->to.value)
                                        : std::string("all links without a rule of their own");
  return which + ": " + words_of(change.spec);
}

std::string words_of_degradation(const Disturbance& disturbance) {
  std::string text;
  for (const AgentId agent : disturbance.agents) text += fmt::format("{}{}", text.empty() ? "sensor of agent " : ", ", agent.value);
  return text.empty() ? "the sensors of all agents" : text;
}

}  // namespace consort
