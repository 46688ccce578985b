#include "rounds/simulate.hpp"

#include "core/errors.hpp"
#include "rounds/last_round.hpp"
#include "rounds/member.hpp"

#include <algorithm>
#include <map>
#include <string>

namespace consort {
namespace {

constexpr Round kNobodyRunsAhead = 1;  // of the agents here

// All agents of one run, side by side in memory.
class World {
 public:
  // `while_made` is called before each agent is made.
  World(const Experiment& experiment, const ProtocolEntry& entry, const ProtocolChoice& choice, Seed seed, const WhileMade& while_made);
  void advance(Round k);  // from the beginning of round k to the beginning of round k + 1
  [[nodiscard]] RoundReport report(Round k);
  [[nodiscard]] Trace empty_trace() const { return maker_.empty_trace(members_[0].protocol()); }
  [[nodiscard]] std::vector<LinkTotals> links() const;

 private:
  [[nodiscard]] Member member(AgentId agent, Round first);
  void extend_state_histories();
  void measure(std::size_t i);
  void steer();
  void come_back(Round k);

  const Experiment& experiment_;
  const ProtocolChoice& choice_;
  const ProtocolEntry& entry_;
  AgentMaker maker_;
  Seed seed_;
  Schedule schedule_;
  Schedule::Segment segment_;
  std::shared_ptr<const Graph> support_;
  std::vector<std::vector<Told>> told_;            // by agent: what it is told, and when; empty where nobody announces anything
  std::vector<Member> members_;                    // by agent
  std::vector<double> numbers_;                    // of all members, side by side: neighbours read them
  std::vector<std::span<const double>> messages_;  // by agent: of this round
  Announced announced_;
  std::optional<Physics> physics_;
  bool steers_ = false;
  std::vector<std::vector<double>> measurements_;  // by agent; empty without a plant
  std::vector<double> distances_;                  // of one agent
  std::vector<HistoryHash> state_histories_;
  // Of earlier stays of those that came back.
  struct Earlier {
    AgentCounters counters;
    std::map<AgentId, LinkCounters> links;
  };
  std::map<AgentId, Earlier> earlier_;
  // What is reported, agent after agent.
  std::vector<double> estimates_, states_, recorded_;
  std::vector<std::uint64_t> hashes_, state_hashes_;
  std::vector<AgentCounters> counters_;
};

World::World(const Experiment& experiment, const ProtocolEntry& entry, const ProtocolChoice& choice, Seed seed, const WhileMade& while_made)
    : experiment_(experiment),
      choice_(choice),
      entry_(entry),
      maker_(experiment, entry, choice, seed),
      seed_(seed),
      schedule_(experiment.schedule(seed)),
      segment_(schedule_.segment(0)),
      support_(schedule_.support(experiment.rounds)) {
  physics_ = maker_.physics();
  const std::size_t n = experiment.agents;
  check(n >= 1, "a world has agents");
  if (entry_.announces) told_ = announcements(*support_, experiment.presence);
  members_.reserve(n);
  messages_.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    if (while_made) while_made();
    const AgentId self = agent_at(i);
    members_.push_back(member(self, experiment.presence_of(self).from));
    measurements_.emplace_back(physics_ ? physics_->measurement_size(self) : 0);
    if (members_[i].protocol().message_layout() != members_[0].protocol().message_layout())
      throw ConfigError("agent " + std::to_string(self.value) +
                        ": its state has another dimension than that of agent 1; allowed: one dimension for all");
    if (entry_.announces) announced_.emplace_back(members_[i].protocol().announcement());
  }
  const Protocol& protocol = members_[0].protocol();
  estimates_.resize(n * protocol.estimate_layout().size());
  recorded_.resize(n * members_[0].recorded_layout().size());
  hashes_.resize(n);
  counters_.resize(n);
  steers_ = physics_ && protocol.control_size() > 0;
  if (physics_) {
    states_.resize(n * physics_->state_layout().size());
    state_histories_.resize(n);
    state_hashes_.resize(n);
  }
  extend_state_histories();
}

Member World::member(AgentId agent, Round first) {
  auto protocol = maker_.make(agent);
  const std::size_t size = Member::numbers_of(*protocol);
  if (numbers_.empty()) numbers_.resize(experiment_.agents * size);
  const bool alike = numbers_.size() == experiment_.agents * size;  // else the dimensions are refused
  std::vector<AgentId> senders;
  senders.reserve(support_->in_degree(agent));
  for (const Neighbour& neighbour : support_->in_neighbours(agent)) senders.push_back(neighbour.id);
  return Member({.agent = agent,
                 .attendance = experiment_.presence_of(agent),
                 .first = first,
                 .dt = experiment_.dt,
                 .protocol = std::move(protocol),
                 .senders = std::move(senders),
                 .links = experiment_.links_of(choice_),
                 .seed = seed_,
                 .window = kNobodyRunsAhead,
                 .announces = entry_.announces,
                 .agents = experiment_.agents,
                 .told = entry_.announces ? told_[index_of(agent)] : std::vector<Told>{},
                 .numbers = alike ? std::span(numbers_).subspan(index_of(agent) * size, size) : std::span<double>(),
                 .recorded = experiment_.recording.state});
}

void World::extend_state_histories() {
  for (std::size_t i = 0; i < state_histories_.size(); ++i)
    if (members_[i].attendance().holds(physics_->round())) state_histories_[i].extend(physics_->state(agent_at(i)));
}

void World::measure(std::size_t i) {
  const AgentId self = agent_at(i);
  physics_->measure(self, measurements_[i]);
  if (physics_->distance_count(self) == 0) return;
  distances_.resize(physics_->distance_count(self));
  physics_->distances(self, distances_);
  members_[i].mailbox().set_distances(distances_);
}

// u of every agent goes to the plant, which moves on.
void World::steer() {
  const Round k = physics_->round();
  for (std::size_t i = 0; steers_ && i < members_.size(); ++i)
    if (members_[i].attendance().holds(k)) members_[i].protocol().control(physics_->control(agent_at(i)));
  physics_->advance();
  extend_state_histories();
}

void World::advance(Round k) {
  if (k > segment_.last) segment_ = schedule_.segment(k);
  for (std::size_t i = 0; i < members_.size(); ++i) {
    Member& member = members_[i];
    if (!member.attendance().holds(k)) continue;
    if (physics_) measure(i);
    if (entry_.announces) member.learn(announced_);
    messages_[i] = member.begin(*segment_.graph, measurements_[i]);
  }
  const auto message_of = [this](std::size_t j) { return messages_[j]; };
  for (Member& member : members_)
    if (member.begun()) member.finish_from(message_of);
  if (physics_) steer();
  come_back(k + 1);
}

// Whoever begins a later stay at round k remembers nothing of its earlier ones.
void World::come_back(Round k) {
  for (const auto& [agent, presence] : experiment_.presence) {
    const auto begins = [k](const Attendance& stay) { return stay.from == k; };
    if (std::none_of(presence.again.begin(), presence.again.end(), begins)) continue;
    Member& member = members_[index_of(agent)];
    Earlier& earlier = earlier_[agent];
    earlier.counters += member.report().counters;
    for (const auto& [edge, counters] : member.links()) earlier.links[edge.from] += counters;
    member = this->member(agent, k);
  }
}

RoundReport World::report(Round k) {
  const std::size_t size = physics_ ? physics_->state_layout().size() : 0, beside = members_[0].recorded_layout().size();
  const std::size_t dimension = estimates_.size() / members_.size();
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const Member& member = members_[i];
    const Member::Report report = member.report();
    const auto earlier = earlier_.find(agent_at(i));
    counters_[i] = report.counters;
    if (earlier != earlier_.end()) counters_[i] += earlier->second.counters;
    hashes_[i] = k < member.attendance().from ? HistoryHash().value() : report.hash;
    if (physics_) state_hashes_[i] = state_histories_[i].value();
    const std::span<double> estimate(estimates_.data() + i * dimension, dimension), recorded(recorded_.data() + i * beside, beside),
        state(states_.data() + i * size, size);
    if (member.attendance().holds(k)) {
      std::copy(report.estimate.begin(), report.estimate.end(), estimate.begin());
      member.recorded(recorded);
      if (physics_) physics_->report_state(agent_at(i), state);
    } else {
      for (const std::span<double> absent : {estimate, recorded, state}) std::fill(absent.begin(), absent.end(), kAbsent);
    }
  }
  return {k, estimates_, hashes_, counters_, states_, state_hashes_, recorded_};
}

std::vector<LinkTotals> World::links() const {
  std::vector<LinkTotals> links;
  for (const Member& member : members_) {
    std::map<AgentId, LinkCounters> totals;
    if (const auto earlier = earlier_.find(member.id()); earlier != earlier_.end()) totals = earlier->second.links;
    for (const auto& [edge, counters] : member.links()) totals[edge.from] += counters;
    for (const auto& [from, counters] : totals) links.push_back({{from, member.id()}, counters});
  }
  std::sort(links.begin(), links.end());
  return links;
}

// The rounds of the experiment, as far as they go.
void run(World& world, const Experiment& experiment, const ReportSink& sink, Trace& trace) {
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
}

}  // namespace

double bytes_to_simulate(const Experiment& experiment, const ProtocolChoice& choice, const Protocol& agent) {
  constexpr double kAgent = 2000.0, kCopies = 4.0;  // of an agent beside its numbers; of those, in its state and on their way
  const auto n = static_cast<double>(experiment.agents), edges = experiment.schedule(experiment.seed).most_edges();
  const auto numbers = static_cast<double>(agent.message_layout().size() + agent.estimate_layout().size() + agent.recorded_layout().size());
  const double per_edge = Mailbox::bytes_per_sender(agent.message_layout(), experiment.links_of(choice)) + sizeof(LinkTotals);
  const double drawn = std::holds_alternative<RandomPairs>(experiment.topology) ? sizeof(Neighbour) : 0.0;
  const double heard_of = find_protocol(choice.name).announces ? n * (sizeof(Values*) + 2.0 * sizeof(Told)) : 0.0;
  return n * (kAgent + kCopies * sizeof(double) * numbers + heard_of) + edges * (per_edge + drawn);
}

namespace {

void simulate(World& world, const Experiment& experiment, const ReportSink& sink, Trace& trace) {
  const std::shared_ptr<Shelf> shelf = trace.shelf;
  trace = world.empty_trace();
  trace.shelf = shelf;
  try {
    run(world, experiment, sink, trace);
  } catch (...) {
    trace.links = world.links();
    throw;
  }
  trace.links = world.links();
}

}  // namespace

void simulate(const Experiment& experiment, const ProtocolChoice& protocol, Seed run_seed, const ReportSink& sink, Trace& trace,
              const WhileMade& while_made) {
  World world(experiment, find_protocol(protocol.name), protocol, run_seed, while_made);
  simulate(world, experiment, sink, trace);
}

Trace simulate(const Experiment& experiment, const ProtocolEntry& entry, const Values& parameters, Seed run_seed, const ReportSink& sink) {
  const ProtocolChoice choice{std::string(entry.name), parameters};
  World world(experiment, entry, choice, run_seed, {});
  Trace trace;
  simulate(world, experiment, sink, trace);
  return trace;
}

Trace simulate(const Experiment& experiment, const ProtocolChoice& protocol, Seed run_seed, const ReportSink& sink,
               const WhileMade& while_made) {
  Trace trace;
  simulate(experiment, protocol, run_seed, sink, trace, while_made);
  return trace;
}

}  // namespace consort
