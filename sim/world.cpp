#include "sim/world.hpp"

#include "agent/registry.hpp"
#include "core/mailbox.hpp"

#include <algorithm>
#include <string>

namespace consort {
namespace {

/// All agents of one run, side by side in memory.
class World {
 public:
  World(const Experiment& experiment, const ProtocolChoice& choice, Seed seed);
  void advance(Round k);  ///< from the beginning of round k to the beginning of round k + 1
  [[nodiscard]] RoundReport report(Round k);
  [[nodiscard]] Trace empty_trace() const;
  [[nodiscard]] std::vector<LinkTotals> links() const;

 private:
  void note_estimate(std::size_t i);

  Seconds dt_;
  Schedule schedule_;
  Schedule::Segment segment_;
  std::vector<std::unique_ptr<Protocol>> protocols_;
  std::vector<Mailbox> mailboxes_;
  std::size_t message_size_ = 0, dimension_ = 0;
  std::vector<double> payloads_;   // n x message_size_
  std::vector<double> estimates_;  // n x dimension_
  std::vector<HistoryHash> histories_;
  std::vector<std::uint64_t> hashes_;
  std::vector<AgentCounters> counters_;
};

World::World(const Experiment& experiment, const ProtocolChoice& choice, Seed seed)
    : dt_(experiment.dt), schedule_(experiment.schedule(seed)), segment_(schedule_.segment(0)) {
  const ProtocolEntry& entry = find_protocol(choice.name);
  const std::size_t n = experiment.agents;
  check(n >= 1, "a world has agents");
  const Graph support = schedule_.support(experiment.rounds);
  for (std::size_t i = 0; i < n; ++i) {
    const AgentId self = agent_at(i);
    const Values initial = experiment.initial_of(self, seed);
    protocols_.push_back(entry.make(experiment.parameters_of(choice, self), Setup{self, n, dt_, initial}));
    const Layout& layout = protocols_.back()->message_layout();
    if (layout != protocols_.front()->message_layout())
      throw ConfigError("agent " + std::to_string(self.value) +
                        ": its state has another dimension than that of agent 1; allowed: one dimension for all");
    std::vector<AgentId> senders;
    for (const Neighbour& neighbour : support.in_neighbours(self)) senders.push_back(neighbour.id);
    constexpr Round kNobodyRunsAhead = 1;
    mailboxes_.emplace_back(self, std::move(senders), layout, experiment.links, seed, kNobodyRunsAhead);
  }
  message_size_ = protocols_.front()->message_layout().size();
  dimension_ = protocols_.front()->estimate_layout().size();
  payloads_.resize(n * message_size_);
  estimates_.resize(n * dimension_);
  histories_.resize(n);
  hashes_.resize(n);
  counters_.resize(n);
  for (std::size_t i = 0; i < n; ++i) note_estimate(i);
}

void World::note_estimate(std::size_t i) {
  const std::span<double> estimate(estimates_.data() + i * dimension_, dimension_);
  protocols_[i]->estimate(estimate);
  histories_[i].extend(estimate);
}

void World::advance(Round k) {
  if (k > segment_.last) segment_ = schedule_.segment(k);
  const Graph& graph = *segment_.graph;
  const std::size_t n = protocols_.size();
  for (std::size_t i = 0; i < n; ++i) {
    const AgentId self = agent_at(i);
    const Sense sense{k, dt_, graph.in_neighbours(self), graph.out_degree(self), {}, self};
    protocols_[i]->emit(sense, std::span(payloads_.data() + i * message_size_, message_size_));
    counters_[i].sent += sense.out_degree;
  }
  const auto payload_of = [this](std::size_t j) { return std::span<const double>(payloads_.data() + j * message_size_, message_size_); };
  for (std::size_t i = 0; i < n; ++i) {
    const AgentId self = agent_at(i);
    const Sense sense{k, dt_, graph.in_neighbours(self), graph.out_degree(self), {}, self};
    protocols_[i]->absorb(sense, mailboxes_[i].take_from(k, sense.in_neighbours, payload_of));
    note_estimate(i);
  }
}

RoundReport World::report(Round k) {
  for (std::size_t i = 0; i < protocols_.size(); ++i) {
    const LinkCounters links = mailboxes_[i].counters();
    counters_[i].delivered = links.delivered;
    counters_[i].lost = links.lost;
    hashes_[i] = histories_[i].value();
  }
  return {k, estimates_, hashes_, counters_};
}

Trace World::empty_trace() const {
  Trace trace;
  trace.agents = protocols_.size();
  trace.dimension = dimension_;
  trace.estimate_layout = protocols_.front()->estimate_layout();
  return trace;
}

std::vector<LinkTotals> World::links() const {
  std::vector<LinkTotals> links;
  for (std::size_t i = 0; i < mailboxes_.size(); ++i) {
    for (const AgentId from : mailboxes_[i].senders()) {
      const LinkCounters counters = mailboxes_[i].counters(from);
      if (counters.delivered + counters.lost > 0) links.push_back({{from, agent_at(i)}, counters.delivered, counters.lost});
    }
  }
  std::sort(links.begin(), links.end());
  return links;
}

}  // namespace

Trace simulate(const Experiment& experiment, const ProtocolChoice& protocol, Seed run_seed, const ReportSink& sink) {
  World world(experiment, protocol, run_seed);
  Trace trace = world.empty_trace();
  StopRule stop(experiment.rounds, experiment.convergence);
  const Round interval = experiment.report_interval();
  for (Round k = 0;; ++k) {
    if (k % interval == 0 || k == experiment.rounds) {
      const RoundReport report = world.report(k);
      trace.add(report);
      const bool over = stop.ends(report, trace.agents, trace.dimension);
      const bool wanted = !sink || sink(report);
      if (over || !wanted) break;
    }
    world.advance(k);
  }
  trace.converged = stop.converged();
  trace.links = world.links();
  return trace;
}

}  // namespace consort
