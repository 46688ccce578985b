#include "orchestrator/run/link_words.hpp"

#include "core/counted.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace consort {

namespace {

std::string covariance_text(const Matrix& covariance) {
  if (covariance.size() == 1) return fmt::format("{:g}", covariance(0, 0));
  return fmt::format("{} of {} x {}", covariance.cols() == 1 ? "diagonal" : "matrix", covariance.rows(), covariance.rows());
}

std::string delay_text(const LinkSpec& link) {
  const Jitter& jitter = link.jitter;
  switch (jitter.kind) {
    case Jitter::Kind::none:
      return fmt::format("delay {}", counted(link.delay_rounds, "round"));
    case Jitter::Kind::uniform:
      return fmt::format("delay {} to {:g} rounds", link.delay_rounds, link.delay_rounds + jitter.spread);
    case Jitter::Kind::exponential:
      return fmt::format("delay {} + exponential({:g}) rounds", link.delay_rounds, jitter.mean);
    case Jitter::Kind::normal:
      return fmt::format("delay normal({:g}, {:g}) rounds", jitter.mean, jitter.spread);
  }
  return {};
}

}  // namespace

std::string words_of(const LinkSpec& link) {
  std::string text;
  const auto add = [&text](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
  if (link.loss_probability > 0.0) add(fmt::format("loss {:g}", link.loss_probability));
  if (link.bursts)
    add(fmt::format("loss {:.3g} in bursts of {:.3g} {} (Gilbert-Elliott)", link.bursts->mean_loss(), link.bursts->mean_burst(),
                    noun(link.bursts->mean_burst(), "message")));
  if (link.distance) add(fmt::format("loss growing from distance {:g} to {:g}", link.distance->safe, link.distance->lost));
  if (link.delay_rounds > 0 || link.jitter.kind != Jitter::Kind::none) add(delay_text(link));
  if (link.duplication > 0.0) add(fmt::format("duplication {:g}", link.duplication));
  if (link.reordering)
    add(fmt::format("reordering {:g} by {}", link.reordering->probability, counted(link.reordering->later_rounds, "round")));
  if (link.noise_covariance.size() > 0) add("noise covariance " + covariance_text(link.noise_covariance));
  if (link.quantiser)
    add(fmt::format("{} over [{:g}, {:g}]", counted(link.quantiser->bits, "bit"), link.quantiser->low, link.quantiser->high));
  return text.empty() ? "ideal" : text;
}

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
