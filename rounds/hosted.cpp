#include "rounds/hosted.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"
#include "protocols/registry.hpp"

#include <algorithm>

namespace consort {
namespace {

std::vector<AgentId> senders_of(const MemberTask& task, std::uint32_t agents) {
  if (!task.hears_everyone) return task.in_neighbours;
  std::vector<AgentId> everyone;
  for (std::uint32_t id = 1; id <= agents; ++id)
    if (id != task.agent.value) everyone.push_back(AgentId{id});
  return everyone;
}

LinkModel links_of(const Assignment& run, const MemberTask& task) {
  LinkModel links{run.standard_link, {}, task.link_changes};
  links.changes.insert(links.changes.end(), run.link_changes.begin(), run.link_changes.end());
  std::stable_sort(links.changes.begin(), links.changes.end(), [](const auto& a, const auto& b) { return a.since < b.since; });
  return links;
}

Member member_of(const Assignment& run, const MemberTask& task) {
  const ProtocolEntry& entry = find_protocol(run.protocol);
  return Member({.agent = task.agent,
                 .attendance = task.presence,
                 .first = task.presence.from,
                 .dt = run.dt,
                 .protocol = entry.make(run.parameters.overridden_by(task.parameters),
                                        Setup{task.agent, run.agents, run.dt, task.initial, task.model, task.measurements,
                                              run.largest_state, run.largest_control}),
                 .senders = senders_of(task, run.agents),
                 .links = links_of(run, task),
                 .seed = run.seed,
                 .window = run.window,
                 .announces = entry.announces,
                 .agents = run.agents,
                 .told = task.told,
                 .numbers = {},
                 .recorded = run.recorded});
}

std::vector<std::uint32_t> members_by_agent(std::uint32_t agents, std::span<const MemberTask> tasks) {
  std::vector<std::uint32_t> members(agents, GrantedGraphs::kNobody);
  for (std::uint32_t member = 0; member < tasks.size(); ++member) members[index_of(tasks[member].agent)] = member;
  return members;
}

}  // namespace

Hosted::Hosted(const Assignment& run, std::span<const MemberTask> tasks, Send send)
    : rounds_(run.rounds),
      report_interval_(run.report_interval),
      steers_(run.steers),
      send_(std::move(send)),
      listeners_(run.agents),
      member_of_(members_by_agent(run.agents, tasks)),
      graphs_(member_of_, tasks.size()) {
  check(!tasks.empty(), "a process hosts agents");
  if (find_protocol(run.protocol).announces) announced_.resize(run.agents);
  places_.reserve(tasks.size());
  first_ = tasks.front().presence.from;
  for (const MemberTask& task : tasks) {
    Place& place = places_.emplace_back(Place{member_of(run, task), task.measurements, task.distances, {}, nullptr});
    place.report.agent = task.agent;
    for (const AgentId sender : place.member.mailbox().senders())
      listeners_[index_of(sender)].push_back(static_cast<std::uint32_t>(places_.size() - 1));
    first_ = std::min(first_, task.presence.from);
    learn(task.agent, place.member.protocol().announcement());
    round_over(place);
  }
}

std::span<const std::uint32_t> Hosted::listeners(AgentId agent) const {
  if (index_of(agent) >= listeners_.size()) return {};
  return listeners_[index_of(agent)];
}

std::optional<std::size_t> Hosted::member_with(AgentId agent) const {
  if (agent.value == 0 || index_of(agent) >= member_of_.size() || member_of_[index_of(agent)] == GrantedGraphs::kNobody)
    return std::nullopt;
  return member_of_[index_of(agent)];
}

void Hosted::learn(AgentId agent, const Values& announcement) {
  if (index_of(agent) < announced_.size() && !announced_[index_of(agent)]) announced_[index_of(agent)] = announcement;
}

void Hosted::depart(std::span<const AgentId> agents) {
  for (const AgentId agent : agents)
    if (member_of_[index_of(agent)] == GrantedGraphs::kNobody && !std::binary_search(gone_.begin(), gone_.end(), agent))
      gone_.insert(std::upper_bound(gone_.begin(), gone_.end(), agent), agent);
  for (Place& place : places_) place.member.depart(gone_);
}

void Hosted::extend(const Grant& grant) {
  graphs_.extend(grant.segments, slowest_round(), first_);
  grant_until(grant);
}

void Hosted::replace(const Grant& grant) {
  graphs_.replace(grant.segments);
  grant_until(grant);
}

void Hosted::grant_until(const Grant& grant) {
  until_ = std::max(until_, grant.until);
  for (Place& place : places_) place.topology_until = 0;  // the last segment may have ended
}

bool Hosted::find_topology(std::size_t member) {
  Place& place = places_[member];
  const Round k = place.member.round();
  if (place.topology && k < place.topology_until) return true;
  const GrantedGraphs::Segment segment = graphs_.at(k);
  if (!segment.topology) return false;
  place.topology = segment.topology;
  place.topology_until = segment.end;
  return true;
}

std::span<const std::uint32_t> Hosted::begin(std::size_t member, std::span<const double> y) {
  Place& place = places_[member];
  place.member.learn(announced_);
  const std::span<const double> message = place.member.begin(place.topology->graph, y, gone_);
  if (!place.topology->remote_listeners[member].empty()) send_(member, place.member.round(), message);
  return place.topology->local_listeners[member];
}

void Hosted::finish(std::size_t member) {
  places_[member].member.finish();
  round_over(places_[member]);
}

void Hosted::finish(std::size_t member, Inbox inbox) {
  places_[member].member.finish(inbox);
  round_over(places_[member]);
}

void Hosted::miss(std::size_t member) {
  Place& place = places_[member];
  if (place.member.attendance().holds(place.member.round())) ++place.report.slept;
  place.member.miss();
  round_over(place);
}

void Hosted::round_over(Place& place) {
  const Round k = place.member.round(), until = place.member.attendance().until;
  if (k % report_interval_ == 0 || k == rounds_ || k == until) add_report(place);
  if (k == until) ++left_;
}

void Hosted::add_report(Place& place) {
  const Member::Report now = place.member.report();
  MemberReport& report = place.report;
  report.rounds.push_back(now.k);
  report.estimates.insert(report.estimates.end(), now.estimate.begin(), now.estimate.end());
  report.hashes.push_back(now.hash);
  report.counters.push_back(now.counters);
  const std::size_t beside = place.member.recorded_layout().size();
  report.recorded.resize(report.recorded.size() + beside);
  place.member.recorded(std::span(report.recorded).last(beside));
}

void Hosted::check_length(const Measurement& measurement) const {
  std::size_t expected = 0;
  for (const Place& place : places_)
    if (place.member.attendance().holds(measurement.round)) expected += place.measurements + place.distances;
  if (measurement.values.size() == expected) return;
  throw RunError("the measurement of round " + std::to_string(measurement.round) + " has " + counted(measurement.values.size(), "number") +
                 "; agents " + std::to_string(places_.front().member.id().value) + "... expect " + std::to_string(expected));
}

std::vector<MemberReport> Hosted::collect_reports(bool whole) {
  std::vector<MemberReport> reports;
  reports.reserve(places_.size());
  for (Place& place : places_) {
    if (whole && (place.report.rounds.empty() || place.report.rounds.back() != place.member.round())) add_report(place);
    MemberReport fresh;
    fresh.agent = place.report.agent;
    fresh.slept = place.report.slept;
    reports.push_back(std::exchange(place.report, std::move(fresh)));
  }
  return reports;
}

std::vector<LinkTotals> Hosted::links() const {
  std::vector<LinkTotals> links;
  for (const Place& place : places_)
    for (const LinkTotals& link : place.member.links()) links.push_back(link);
  return links;
}

Round Hosted::last() const {
  Round last = 0;
  for (const Place& place : places_) last = std::max(last, place.member.attendance().until);
  return last;
}

Round Hosted::slowest_round() const {
  Round slowest = kNever;
  for (const Place& place : places_)
    if (!place.member.left()) slowest = std::min(slowest, place.member.round());
  return slowest;
}

Hosted::Progress Hosted::slowest() const {
  const Place& place = *std::min_element(places_.begin(), places_.end(), [](const Place& one, const Place& other) {
    const Member &a = one.member, &b = other.member;
    return a.left() != b.left() ? b.left() : a.round() < b.round();
  });
  const Member& member = place.member;
  Progress progress{member.id(), member.round(), {}};
  if (!member.begun()) {
    progress.for_measurement = !member.left() && member.round() < until_ && (place.measurements + place.distances > 0 || steers_);
    return progress;
  }
  for (const Neighbour& neighbour : member.in_neighbours())
    if (!member.mailbox().heard(neighbour.id, member.round())) progress.waiting_for.push_back(neighbour.id);
  return progress;
}

}  // namespace consort
