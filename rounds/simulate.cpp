#include "rounds/simulate.hpp"

#include "core/network/announcements.hpp"
#include "core/network/mailbox.hpp"
#include "rounds/last_round.hpp"

#include <algorithm>
#include <optional>
#include <string>

namespace consort {
namespace {

constexpr Round kNobodyRunsAhead = 1;  // of the agents here

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
  void note_states();
  void begin_presence(Round k);
  void come_back(std::size_t i, Round k);
  void tell(std::size_t i, Round k);
  void steer();
  [[nodiscard]] AgentCounters counters_of(std::size_t i) const;
  [[nodiscard]] bool present(std::size_t i, Round k) const { return presence_.empty() || presence_[i].holds(k); }
  [[nodiscard]] Sense sense_of(std::size_t i, Round k) const;
  [[nodiscard]] std::span<const Values* const> told_of(std::size_t i) const {
    return told_.empty() ? std::span<const Values* const>() : std::span<const Values* const>(told_[i]);
  }

  const Experiment& experiment_;
  const ProtocolChoice& choice_;
  AgentMaker maker_;
  Seed seed_;
  Seconds dt_;
  std::vector<Attendance> presence_;  // by agent; empty if everybody is there throughout
  Schedule schedule_;
  Schedule::Segment segment_;
  std::vector<std::unique_ptr<Protocol>> protocols_;
  std::vector<Mailbox> mailboxes_;
  std::vector<std::vector<Told>> learning_;       // by agent: what it is told, and when, the first one last
  std::vector<std::vector<Told>> to_learn_;       // what of that is still to come
  std::vector<std::vector<const Values*>> told_;  // by agent: what others announced; empty where nobody announces anything
  std::size_t message_size_ = 0, dimension_ = 0;
  Layout recorded_layout_;
  std::vector<double> recorded_;  // n x recorded dimension
  std::optional<Physics> physics_;
  bool steers_ = false;
  Truth truth_;
  std::vector<double> distances_;                  // of one agent
  std::vector<std::vector<double>> measurements_;  // by agent; empty without a plant
  std::vector<double> states_;                     // n x state dimension
  std::vector<HistoryHash> state_histories_;
  std::vector<std::uint64_t> state_hashes_;
  std::vector<double> payloads_;   // n x message_size_
  std::vector<double> estimates_;  // n x dimension_
  std::vector<HistoryHash> histories_;
  std::vector<std::uint64_t> hashes_;
  std::vector<AgentCounters> counters_;  // of the current stay: what was sent
  std::vector<AgentCounters> totals_;    // of all stays, as reported
  std::vector<AgentCounters> before_;    // of earlier stays; empty where nobody comes back
  std::map<Edge, LinkCounters> links_before_;
};

World::World(const Experiment& experiment, const ProtocolChoice& choice, Seed seed)
    : experiment_(experiment),
      choice_(choice),
      maker_(experiment, choice, seed),
      seed_(seed),
      dt_(experiment.dt),
      schedule_(experiment.schedule(seed)),
      segment_(schedule_.segment(0)),
      truth_(find_protocol(choice.name).truth) {
  physics_ = maker_.physics();
  const std::size_t n = experiment.agents;
  check(n >= 1, "a world has agents");
  const Graph support = schedule_.support(experiment.rounds);
  if (find_protocol(choice.name).announces) {
    learning_ = announcements(support, experiment.presence);
    for (auto& list : learning_) std::stable_sort(list.begin(), list.end(), [](const Told& a, const Told& b) { return a.since > b.since; });
    to_learn_ = learning_;
    told_.assign(n, std::vector<const Values*>(n, nullptr));
  }
  if (!experiment.presence.empty())
    for (std::size_t i = 0; i < n; ++i) presence_.push_back(experiment.presence_of(agent_at(i)));
  for (std::size_t i = 0; i < n; ++i) {
    const AgentId self = agent_at(i);
    protocols_.push_back(maker_.make(self));
    measurements_.emplace_back(physics_ ? physics_->measurement_size(self) : 0);
    const Layout& layout = protocols_.back()->message_layout();
    if (layout != protocols_.front()->message_layout())
      throw ConfigError("agent " + std::to_string(self.value) +
                        ": its state has another dimension than that of agent 1; allowed: one dimension for all");
    std::vector<AgentId> senders;
    for (const Neighbour& neighbour : support.in_neighbours(self)) senders.push_back(neighbour.id);
    mailboxes_.emplace_back(self, std::move(senders), layout, experiment.links_of(choice), seed, kNobodyRunsAhead,
                            experiment.presence_of(self).from);
  }
  message_size_ = protocols_.front()->message_layout().size();
  dimension_ = protocols_.front()->estimate_layout().size();
  recorded_layout_ = recorded_part(protocols_.front()->recorded_layout(), experiment.recording.state);
  recorded_.resize(n * recorded_layout_.size());
  payloads_.resize(n * message_size_);
  estimates_.resize(n * dimension_);
  histories_.resize(n);
  hashes_.resize(n);
  counters_.resize(n);
  totals_.resize(n);
  steers_ = physics_ && protocols_.front()->control_size() > 0;
  if (physics_) {
    states_.resize(n * physics_->state_layout().size());
    state_histories_.resize(n);
    state_hashes_.resize(n);
  }
  for (std::size_t i = 0; i < n; ++i)
    if (present(i, 0)) note_estimate(i);
  note_states();
}

Sense World::sense_of(std::size_t i, Round k) const {
  const AgentId self = agent_at(i);
  const Graph& graph = *segment_.graph;
  return {k, dt_, graph.in_neighbours(self), graph.out_degree(self), measurements_[i], self, told_of(i)};
}

/// What agent i has been told of others by round k.
void World::tell(std::size_t i, Round k) {
  told_[i][i] = &protocols_[i]->announcement();
  for (auto& later = to_learn_[i]; !later.empty() && later.back().since <= k; later.pop_back()) {
    const std::size_t j = index_of(later.back().from);
    told_[i][j] = &protocols_[j]->announcement();
  }
}

void World::note_states() {
  if (!physics_) return;
  const std::size_t size = physics_->state_layout().size();
  for (std::size_t i = 0; i < protocols_.size(); ++i) {
    if (!present(i, physics_->round())) continue;
    physics_->report_state(agent_at(i), std::span(states_).subspan(i * size, size));
    state_histories_[i].extend(physics_->state(agent_at(i)));
  }
}

/// u of every agent goes to the plant, which moves on.
void World::steer() {
  if (!physics_) return;
  const Round k = physics_->round();
  for (std::size_t i = 0; steers_ && i < protocols_.size(); ++i)
    if (present(i, k)) protocols_[i]->control(physics_->control(agent_at(i)));
  physics_->advance();
  note_states();
}

void World::note_estimate(std::size_t i) {
  const std::span<double> estimate(estimates_.data() + i * dimension_, dimension_);
  protocols_[i]->estimate(estimate);
  histories_[i].extend(estimate);
}

void World::advance(Round k) {
  if (k > segment_.last) segment_ = schedule_.segment(k);
  const std::size_t n = protocols_.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (!present(i, k)) continue;
    if (physics_) physics_->measure(agent_at(i), measurements_[i]);
    if (!told_.empty()) tell(i, k);
    const Sense sense = sense_of(i, k);
    protocols_[i]->emit(sense, std::span(payloads_.data() + i * message_size_, message_size_));
    counters_[i].sent += sense.out_degree;
  }
  const auto payload_of = [this](std::size_t j) { return std::span<const double>(payloads_.data() + j * message_size_, message_size_); };
  for (std::size_t i = 0; i < n; ++i) {
    if (!present(i, k)) continue;
    const Sense sense = sense_of(i, k);
    if (physics_ && physics_->distance_count(agent_at(i)) > 0) {
      distances_.resize(physics_->distance_count(agent_at(i)));
      physics_->distances(agent_at(i), distances_);
      mailboxes_[i].note_distances(distances_);
    }
    protocols_[i]->absorb(sense, mailboxes_[i].take_from(k, sense.in_neighbours, payload_of));
    note_estimate(i);
  }
  steer();
  begin_presence(k + 1);
}

/// Whoever joins at round k starts from its initial estimate.
void World::begin_presence(Round k) {
  for (std::size_t i = 0; i < presence_.size(); ++i) {
    const auto& again = presence_[i].again;
    if (std::any_of(again.begin(), again.end(), [k](const Attendance& stay) { return stay.from == k; }))
      come_back(i, k);
    else if (presence_[i].from == k)
      note_estimate(i);
  }
}

/// Agent i begins anew at round k: it remembers nothing of its earlier stay.
void World::come_back(std::size_t i, Round k) {
  const AgentId self = agent_at(i);
  if (before_.empty()) before_.resize(protocols_.size());
  before_[i] = counters_of(i);
  for (const AgentId from : mailboxes_[i].senders()) {
    links_before_[{from, self}] += mailboxes_[i].counters(from);
  }
  counters_[i] = {};
  histories_[i] = {};
  protocols_[i] = maker_.make(self);
  const std::span<const AgentId> senders = mailboxes_[i].senders();
  mailboxes_[i] = Mailbox(self, {senders.begin(), senders.end()}, protocols_[i]->message_layout(), experiment_.links_of(choice_), seed_,
                          kNobodyRunsAhead, k);
  if (!told_.empty()) {
    for (auto& told : told_)
      if (told[i]) told[i] = &protocols_[i]->announcement();
    std::fill(told_[i].begin(), told_[i].end(), nullptr);
    to_learn_[i] = learning_[i];
  }
  note_estimate(i);
}

/// Of all stays so far.
AgentCounters World::counters_of(std::size_t i) const {
  const LinkCounters links = mailboxes_[i].counters();
  AgentCounters total{counters_[i].sent, links.delivered, links.lost};
  if (!before_.empty()) total += before_[i];
  return total;
}

RoundReport World::report(Round k) {
  const std::size_t size = physics_ ? physics_->state_layout().size() : 0, beside = recorded_layout_.size();
  for (std::size_t i = 0; i < protocols_.size(); ++i) {
    totals_[i] = counters_of(i);
    hashes_[i] = histories_[i].value();
    if (physics_) state_hashes_[i] = state_histories_[i].value();
    const std::span<double> recorded(recorded_.data() + i * beside, beside);
    if (present(i, k)) {
      protocols_[i]->recorded(recorded);
      continue;
    }
    std::fill(recorded.begin(), recorded.end(), kAbsent);
    std::fill_n(estimates_.begin() + static_cast<std::ptrdiff_t>(i * dimension_), dimension_, kAbsent);
    std::fill_n(states_.begin() + static_cast<std::ptrdiff_t>(i * size), size, kAbsent);
  }
  return {k, estimates_, hashes_, totals_, states_, state_hashes_, recorded_};
}

Trace World::empty_trace() const {
  Trace trace;
  trace.agents = protocols_.size();
  trace.dimension = dimension_;
  trace.estimate_layout = protocols_.front()->estimate_layout();
  trace.recorded_layout = recorded_layout_;
  trace.recorded_dimension = recorded_layout_.size();
  if (physics_) trace.state_layout = physics_->state_layout();
  trace.state_dimension = trace.state_layout.size();
  trace.truth = truth_;
  trace.agrees_on_states = steers_ && truth_ == Truth::none;
  return trace;
}

std::vector<LinkTotals> World::links() const {
  std::vector<LinkTotals> links;
  for (std::size_t i = 0; i < mailboxes_.size(); ++i) {
    for (const AgentId from : mailboxes_[i].senders()) {
      LinkCounters counters = mailboxes_[i].counters(from);
      if (const auto earlier = links_before_.find({from, agent_at(i)}); earlier != links_before_.end()) counters += earlier->second;
      if (counters != LinkCounters{})
        links.push_back(
            {{from, agent_at(i)}, counters.delivered, counters.lost, counters.duplicated, counters.reordered, counters.superseded});
    }
  }
  std::sort(links.begin(), links.end());
  return links;
}

}  // namespace

AgentMaker::AgentMaker(const Experiment& experiment, const ProtocolChoice& choice, Seed run_seed)
    : experiment_(experiment), choice_(choice), seed_(run_seed), entry_(find_protocol(choice.name)) {
  if (!experiment.plant) return;
  physics_.emplace(plant_task(experiment, run_seed));
  for (std::size_t i = 0; i < experiment.agents; ++i) largest_control_ = std::max(largest_control_, physics_->control_size(agent_at(i)));
}

std::unique_ptr<Protocol> AgentMaker::make(AgentId agent) const {
  const Values initial = experiment_.initial_of(agent, seed_);
  const Values parameters = experiment_.parameters_of(choice_, agent);
  if (!physics_) return make_protocol(entry_, parameters, Setup{agent, experiment_.agents, experiment_.dt, initial}, std::nullopt);
  const Values model = physics_->knowledge(agent);
  const Setup setup{agent,
                    experiment_.agents,
                    experiment_.dt,
                    initial,
                    model,
                    physics_->measurement_size(agent),
                    physics_->state_layout().size(),
                    largest_control_};
  return make_protocol(entry_, parameters, setup, physics_->control_size(agent));
}

Round last_round(const Experiment& experiment) {
  if (experiment.presence.size() < experiment.agents) return experiment.rounds;
  Round last = 0;
  for (const auto& [agent, presence] : experiment.presence)
    for (const Attendance& stay : presence.stays())
      if (stay.from <= experiment.rounds) last = std::max(last, stay.until);
  return std::min(last, experiment.rounds);
}

Trace simulate(const Experiment& experiment, const ProtocolChoice& protocol, Seed run_seed, const ReportSink& sink) {
  World world(experiment, protocol, run_seed);
  Trace trace = world.empty_trace();
  const Round last = last_round(experiment);
  StopRule stop(last, experiment.convergence);
  const Round interval = experiment.report_interval();
  for (Round k = 0;; ++k) {
    if (k % interval == 0 || k == last) {
      const RoundReport report = world.report(k);
      trace.add(report);
      const bool over = stop.ends(report.k, [&] { return deviation(trace, report); });
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
