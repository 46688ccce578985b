#include "agent/lockstep.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"
#include "protocols/registry.hpp"

#include <algorithm>
#include <limits>

namespace consort {
namespace {

/// What a run grants fits together; what two grant does not.
std::string two_masters(Round round) {
  return "round " + std::to_string(round) +
         " was granted twice, or never: do two `consort run` with the same --name and key go on at once?";
}

constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();
constexpr Round kForever = std::numeric_limits<Round>::max();

std::vector<AgentId> senders_of(const MemberTask& member, std::uint32_t agents) {
  if (!member.hears_everyone) return member.in_neighbours;
  std::vector<AgentId> everyone;
  for (std::uint32_t id = 1; id <= agents; ++id) {
    if (id != member.agent.value) everyone.push_back(AgentId{id});
  }
  return everyone;
}

}  // namespace

Lockstep::Lockstep(const Assignment& run, std::span<const MemberTask> members, Send send, Act act)
    : agents_(run.agents),
      dt_(run.dt),
      rounds_(run.rounds),
      report_interval_(run.report_interval),
      send_(std::move(send)),
      act_(run.steers ? std::move(act) : Act{}),
      member_of_(run.agents, kNobody),
      listeners_(run.agents) {
  const ProtocolEntry& entry = find_protocol(run.protocol);
  members_.reserve(members.size());
  for (const MemberTask& assigned : members) {
    const auto index = static_cast<std::uint32_t>(members_.size());
    auto protocol = entry.make(run.parameters.overridden_by(assigned.parameters),
                               Setup{assigned.agent, run.agents, run.dt, assigned.initial, assigned.model, assigned.measurements,
                                     run.largest_state, run.largest_control});
    auto senders = senders_of(assigned, run.agents);
    for (const AgentId sender : senders) listeners_[index_of(sender)].push_back(index);
    member_of_[index_of(assigned.agent)] = index;
    LinkModel links{run.standard_link, {}, assigned.link_changes};
    links.changes.insert(links.changes.end(), run.link_changes.begin(), run.link_changes.end());
    std::stable_sort(links.changes.begin(), links.changes.end(), [](const auto& a, const auto& b) { return a.since < b.since; });
    const Layout& message = protocol->message_layout();
    Mailbox mailbox(assigned.agent, std::move(senders), message, links, run.seed, run.window, assigned.presence.from);
    std::vector<double> payload(message.size()), estimate(protocol->estimate_layout().size());
    Layout recorded = recorded_part(protocol->recorded_layout(), run.recorded);
    first_ = index == 0 ? assigned.presence.from : std::min(first_, assigned.presence.from);
    members_.push_back({.id = assigned.agent,
                        .attendance = assigned.presence,
                        .measurements = assigned.measurements,
                        .distances = assigned.distances,
                        .y = {},
                        .protocol = std::move(protocol),
                        .to_learn = assigned.told,
                        .told = {},
                        .mailbox = std::move(mailbox),
                        .payload = std::move(payload),
                        .estimate = std::move(estimate),
                        .recorded = std::move(recorded),
                        .report = {.agent = assigned.agent, .rounds = {}, .estimates = {}, .hashes = {}, .counters = {}},
                        .hash = {},
                        .counters = {},
                        .k = assigned.presence.from,
                        .in_neighbours = {},
                        .remaining = {},
                        .given_up = {},
                        .topology = nullptr});
    std::vector<Told>& to_learn = members_.back().to_learn;
    std::stable_sort(to_learn.begin(), to_learn.end(), [](const Told& a, const Told& b) { return a.since > b.since; });
    report_state(members_.back());
  }
  if (!entry.announces) return;
  for (Member& member : members_) {
    announced_.emplace(member.id, member.protocol->announcement());
    member.told.assign(agents_, nullptr);
    member.told[index_of(member.id)] = &announced_.at(member.id);
  }
}

void Lockstep::learn(AgentId agent, const Values& announcement) { announced_.emplace(agent, announcement); }

/// What the member knows of others at the beginning of its round.
void Lockstep::tell(Member& member, bool all) const {
  while (!member.to_learn.empty() && member.to_learn.back().since <= member.k) {
    const AgentId from = member.to_learn.back().from;
    const auto announced = announced_.find(from);
    if (announced == announced_.end() && !all) return;
    if (announced == announced_.end())
      throw RunError("agent " + std::to_string(member.id.value) + ", round " + std::to_string(member.k) +
                     ": nothing has been heard of what agent " + std::to_string(from.value) + " announced");
    member.told[index_of(from)] = &announced->second;
    member.to_learn.pop_back();
  }
}

std::shared_ptr<const Lockstep::Topology> Lockstep::topology_from(std::vector<WeightedEdge> edges) const {
  for (const auto& [edge, weight] : edges) {
    if (edge.from.value > agents_ || edge.to.value > agents_) {
      throw RunError("a grant names an edge " + std::to_string(edge.from.value) + " -> " + std::to_string(edge.to.value) +
                     ", but there are only " + std::to_string(agents_) + " agents");
    }
  }
  auto topology = std::make_shared<Topology>(Topology{Graph(agents_, edges), {}, {}});
  topology->local_listeners.resize(members_.size());
  topology->heard_elsewhere.resize(members_.size());
  for (const auto& [edge, weight] : edges) {
    const std::uint32_t sender = member_of_[index_of(edge.from)], receiver = member_of_[index_of(edge.to)];
    if (sender == kNobody) continue;
    if (receiver == kNobody)
      topology->heard_elsewhere[sender] = true;
    else
      topology->local_listeners[sender].push_back(receiver);
  }
  return topology;
}

void Lockstep::grant(const Grant& grant) {
  if (!segments_.empty() && grant.until <= until_ && grant.report_at <= report_at_) return;
  Round slowest_round = kForever;
  for (const Member& member : members_) slowest_round = std::min(slowest_round, member.k);
  while (segments_.size() > 1 && segments_[1].first <= slowest_round) segments_.pop_front();
  for (const GrantedSegment& segment : grant.segments) {
    if (!segments_.empty() && segments_.back().first >= segment.first) throw RunError(two_masters(segment.first));
    if (segment.graph >= graphs_.size()) graphs_.resize(segment.graph + 1);
    if (segment.stated) graphs_[segment.graph] = topology_from(*segment.stated);
    if (!graphs_[segment.graph] && segment.first < first_) continue;  // stated before this process joined, and over by then
    if (!graphs_[segment.graph]) throw RunError("a grant refers to graph " + std::to_string(segment.graph) + ", which was never stated");
    segments_.push_back({segment.first, graphs_[segment.graph]});
  }
  until_ = std::max(until_, grant.until);
  report_at_ = grant.report_at;
  whole_ = grant.whole;
  reached_report_ = static_cast<std::size_t>(
      std::count_if(members_.begin(), members_.end(), [&](const Member& m) { return m.k >= std::min(report_at_, m.attendance.until); }));
  report_due_ = reached_report_ == members_.size();
  for (std::uint32_t index = 0; index < members_.size(); ++index) {
    members_[index].topology_until = 0;  // the last segment may have ended
    ready_.push_back(index);
  }
}

bool Lockstep::find_topology(Member& member) const {
  if (member.topology && member.k < member.topology_until) return true;
  const auto after = std::upper_bound(segments_.begin(), segments_.end(), member.k, [](Round k, const Segment& s) { return k < s.first; });
  if (after == segments_.begin()) return false;
  member.topology = std::prev(after)->topology;
  member.topology_until = after == segments_.end() ? kForever : after->first;
  return true;
}

Sense Lockstep::sense_of(const Member& member) const {
  const Graph& graph = member.topology->graph;
  std::size_t out_degree = graph.out_degree(member.id);
  for (const AgentId gone : gone_) out_degree -= graph.has({member.id, gone}) ? 1 : 0;
  return {.k = member.k,
          .dt = dt_,
          .in_neighbours = member.in_neighbours,
          .out_degree = out_degree,
          .y = member.y,
          .self = member.id,
          .told = member.told};
}

/// Whom the member hears in its round: the in-neighbours of the topology, without those that are gone and have not been heard.
void Lockstep::find_neighbours(Member& member) const {
  member.in_neighbours = member.topology->graph.in_neighbours(member.id);
  if (gone_.empty()) return;
  const auto contains = [](const std::vector<AgentId>& agents, AgentId id) {
    return std::find(agents.begin(), agents.end(), id) != agents.end();
  };
  member.remaining.clear();
  for (const Neighbour& neighbour : member.in_neighbours) {
    if (contains(gone_, neighbour.id)) {
      if (contains(member.given_up, neighbour.id)) continue;
      if (!member.mailbox.heard(neighbour.id, member.k)) {
        member.given_up.push_back(neighbour.id);
        continue;
      }
    }
    member.remaining.push_back(neighbour);
  }
  member.in_neighbours = member.remaining;
}

void Lockstep::depart(std::span<const AgentId> agents) {
  for (const AgentId agent : agents)
    if (member_of_[index_of(agent)] == kNobody && !std::binary_search(gone_.begin(), gone_.end(), agent))
      gone_.insert(std::upper_bound(gone_.begin(), gone_.end(), agent), agent);
  for (std::uint32_t index = 0; index < members_.size(); ++index) {
    Member& member = members_[index];
    if (!member.emitted) continue;
    find_neighbours(member);
    member.missing = member.mailbox.missing(member.k, member.in_neighbours);
    if (member.missing == 0) ready_.push_back(index);
  }
}

/// Gives one message to one member; notes when that was the last one its round waited for.
void Lockstep::deliver(Member& member, std::uint32_t index, AgentId from, Round round, std::span<const double> payload) {
  if (member.mailbox.post(from, round, payload) != Mailbox::Post::accepted) return;
  if (round != member.k || !member.emitted) return;
  const auto at = std::lower_bound(member.in_neighbours.begin(), member.in_neighbours.end(), from,
                                   [](const Neighbour& neighbour, AgentId id) { return neighbour.id < id; });
  if (at == member.in_neighbours.end() || at->id != from) return;
  if (--member.missing == 0) ready_.push_back(index);
}

bool Lockstep::receive(const Information& message) {
  if (index_of(message.sender) >= listeners_.size()) return false;
  const auto& listeners = listeners_[index_of(message.sender)];
  for (const std::uint32_t index : listeners) deliver(members_[index], index, message.sender, message.round, message.values);
  return !listeners.empty();
}

void Lockstep::emit(std::size_t index) {
  Member& member = members_[index];
  if (!find_topology(member)) throw RunError(two_masters(member.k));
  tell(member, true);
  find_neighbours(member);
  const Sense sense = sense_of(member);
  member.protocol->emit(sense, member.payload);
  member.counters.sent += sense.out_degree;
  member.emitted = true;
  member.missing = member.mailbox.missing(member.k, sense.in_neighbours);
  if (member.topology->heard_elsewhere[index]) send_(index, member.k, member.payload);
  for (const std::uint32_t listener : member.topology->local_listeners[index]) {
    deliver(members_[listener], listener, member.id, member.k, member.payload);
  }
}

void Lockstep::report_state(Member& member) {
  member.protocol->estimate(member.estimate);
  member.hash.extend(member.estimate);
  if (member.k % report_interval_ == 0 || member.k == rounds_ || member.k == member.attendance.until) add_report(member);
}

void Lockstep::add_report(Member& member) {
  const LinkCounters links = member.mailbox.counters();
  member.counters.delivered = links.delivered;
  member.counters.lost = links.lost;
  member.report.rounds.push_back(member.k);
  member.report.estimates.insert(member.report.estimates.end(), member.estimate.begin(), member.estimate.end());
  member.report.hashes.push_back(member.hash.value());
  member.report.counters.push_back(member.counters);
  auto& recorded = member.report.recorded;
  recorded.resize(recorded.size() + member.recorded.size());
  member.protocol->recorded(std::span(recorded).last(member.recorded.size()));
}

void Lockstep::check_length(const Measurement& measurement) const {
  std::size_t expected = 0;
  for (const Member& member : members_)
    if (member.attendance.holds(measurement.round)) expected += member.told_by_plant();
  if (measurement.values.size() != expected) {
    throw RunError("the measurement of round " + std::to_string(measurement.round) + " has " +
                   counted(measurement.values.size(), "number") + "; agents " + std::to_string(members_.front().id.value) + "... expect " +
                   std::to_string(expected));
  }
}

void Lockstep::receive(const Measurement& measurement) {
  if (!measured_.empty() && measurement.round <= measured_.back().round) return;
  check_length(measurement);
  measured_.push_back({measurement.round, {measurement.values.begin(), measurement.values.end()}});
  for (std::uint32_t index = 0; index < members_.size(); ++index)
    if (members_[index].k == measurement.round) ready_.push_back(index);
}

/// Is y of the member's round here?
bool Lockstep::find_measurement(std::size_t index) {
  Member& member = members_[index];
  if (member.told_by_plant() == 0 && !act_) return true;  // who steers keeps step with the plant even if it measures nothing
  const auto entry = std::find_if(measured_.begin(), measured_.end(), [&](const Measured& measured) { return measured.round == member.k; });
  if (entry == measured_.end()) return false;
  std::size_t at = 0;
  for (std::size_t before = 0; before < index; ++before)
    if (members_[before].attendance.holds(member.k)) at += members_[before].told_by_plant();
  member.y = std::span<const double>(entry->values).subspan(at, member.measurements);
  if (member.distances > 0)
    member.mailbox.note_distances(std::span<const double>(entry->values).subspan(at + member.measurements, member.distances));
  return true;
}

/// The member's control of round k. With the last one of the round they go to the plant: nobody can be a round ahead, since the plant
/// waits for them.
void Lockstep::steer(std::size_t index) {
  const Round k = members_[index].k;
  std::size_t total = 0, at = 0, taking_part = 0;
  for (std::size_t m = 0; m < members_.size(); ++m) {
    if (!members_[m].attendance.holds(k)) continue;
    if (m == index) at = total;
    total += members_[m].protocol->control_size();
    ++taking_part;
  }
  controls_.resize(total);
  members_[index].protocol->control(std::span(controls_).subspan(at, members_[index].protocol->control_size()));
  if (++steered_ < taking_part) return;
  steered_ = 0;
  act_(k, controls_);
}

void Lockstep::finish_round(std::size_t index) {
  Member& member = members_[index];
  const Sense sense = sense_of(member);
  member.protocol->absorb(sense, member.mailbox.take(member.k, sense.in_neighbours));
  if (act_) steer(index);
  ++member.k;
  member.emitted = false;
  if (member.told_by_plant() > 0 || act_) {
    Round slowest_round = kForever;
    for (const Member& other : members_)
      if (other.k < other.attendance.until) slowest_round = std::min(slowest_round, other.k);
    while (!measured_.empty() && measured_.front().round < slowest_round) measured_.pop_front();
  }
  report_state(member);
  if (member.k == member.attendance.until) ++left_;
  if (member.k == std::min(report_at_, member.attendance.until) && ++reached_report_ == members_.size()) report_due_ = true;
}

void Lockstep::advance() {
  while (!ready_.empty()) {
    const std::uint32_t index = ready_.back();
    ready_.pop_back();
    Member& member = members_[index];
    while (member.k < until_ && member.k < member.attendance.until) {
      if (!member.emitted) {
        if (!find_measurement(index)) break;
        emit(index);
      }
      if (member.missing > 0) break;
      finish_round(index);
    }
  }
}

std::vector<MemberReport> Lockstep::take_all() {
  for (Member& member : members_)
    if (member.report.rounds.empty() || member.report.rounds.back() != member.k) add_report(member);
  whole_ = false;
  return take_reports();
}

std::vector<MemberReport> Lockstep::take_reports() {
  if (whole_report_due()) return take_all();
  std::vector<MemberReport> reports;
  reports.reserve(members_.size());
  for (Member& member : members_) {
    MemberReport fresh{.agent = member.id, .rounds = {}, .estimates = {}, .hashes = {}, .counters = {}, .slept = member.report.slept};
    reports.push_back(std::exchange(member.report, std::move(fresh)));
  }
  report_due_ = false;
  return reports;
}

std::vector<LinkReport> Lockstep::links() const {
  std::vector<LinkReport> links;
  for (const Member& member : members_) {
    for (const AgentId from : member.mailbox.senders()) {
      const LinkCounters counters = member.mailbox.counters(from);
      if (counters != LinkCounters{})
        links.push_back(
            {{from, member.id}, counters.delivered, counters.lost, counters.duplicated, counters.reordered, counters.superseded});
    }
  }
  return links;
}

Lockstep::Progress Lockstep::slowest() const {
  const auto left = [](const Member& m) { return m.k >= m.attendance.until; };
  const auto member = std::min_element(members_.begin(), members_.end(),
                                       [&](const Member& a, const Member& b) { return left(a) != left(b) ? left(b) : a.k < b.k; });
  Progress progress{member->id, member->k, {}};
  if (!member->emitted) {
    progress.for_measurement = !left(*member) && member->k < until_ && (member->told_by_plant() > 0 || act_);
    return progress;
  }
  for (const Neighbour& neighbour : member->in_neighbours) {
    if (!member->mailbox.heard(neighbour.id, member->k)) progress.waiting_for.push_back(neighbour.id);
  }
  return progress;
}

}  // namespace consort
