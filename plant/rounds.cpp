#include "plant/rounds.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"

#include <algorithm>

namespace consort {

PlantRounds::PlantRounds(const PlantAssignment& run, Send send, Tell tell)
    : physics_(run.task),
      send_(std::move(send)),
      tell_(std::move(tell)),
      rounds_(run.rounds),
      report_interval_(run.report_interval),
      ahead_(run.ahead),
      steered_(run.steered),
      realtime_(run.realtime),
      hashes_(run.agents.size()) {
  for (std::size_t index = 0; index < run.agents.size(); ++index) {
    const AgentId agent = agent_at(index);
    check(run.agents[index] == agent, "a plant is told of every agent");
    const Attendance attendance = run.task.parts[index].presence;
    attendance_.push_back(attendance);
    processes_[run.process_of[index]].agents.push_back(agent);
    reports_.push_back({.agent = agent, .rounds = {}, .estimates = {}, .hashes = {}, .counters = {}});
  }
  for (const auto& [name, process] : processes_) names_.push_back(name);
  extend_histories();
}

bool PlantRounds::takes_part(const Process& process) const {
  return std::any_of(process.agents.begin(), process.agents.end(), [this](AgentId i) { return physics_.present(i, physics_.round()); });
}

void PlantRounds::grant(const Grant& grant) {
  if (grant.until <= until_ && grant.report_at <= report_at_) return;
  until_ = std::max(until_, grant.until);
  report_at_ = grant.report_at;
  report_due_ = physics_.round() >= report_at_;
}

void PlantRounds::receive(const Actuation& actuation) {
  const auto at = processes_.find(actuation.process);
  if (at == processes_.end()) return;
  if (realtime_ ? !steered_ || actuation.round < at->second.newest
                : at->second.acted || actuation.round != physics_.round() || !measured_ || !steered_) {
    if (at->second.asked > 0 && at->second.asked_of == actuation.round) ++came_twice_;
    return;
  }
  ++heard_;
  const auto is_there = [&](AgentId i) { return physics_.present(i, actuation.round); };
  if (std::none_of(at->second.agents.begin(), at->second.agents.end(), is_there)) return;  // will be killed, but on the clock a moment late
  std::size_t used = 0;
  for (const AgentId i : at->second.agents) {
    if (!is_there(i)) continue;
    const std::span<double> control = physics_.control(i);
    if (used + control.size() <= actuation.values.size())
      std::copy_n(actuation.values.begin() + static_cast<std::ptrdiff_t>(used), control.size(), control.begin());
    used += control.size();
  }
  if (used != actuation.values.size()) {
    throw RunError("the actuation of round " + std::to_string(actuation.round) + " from the process of agent " +
                   std::to_string(actuation.process) + " has " + counted(actuation.values.size(), "number") + "; the plant takes " +
                   std::to_string(used));
  }
  at->second.newest = actuation.round + 1;
  at->second.acted = true;
  if (!realtime_) --missing_;
}

void PlantRounds::depart(std::span<const AgentId> agents) {
  std::map<std::uint32_t, bool> took_part;
  for (const auto& [name, process] : processes_) took_part[name] = takes_part(process);
  for (const AgentId agent : agents) physics_.depart(agent);
  for (const auto& [name, process] : processes_)
    if (steered_ && measured_ && took_part[name] && !process.acted && !takes_part(process)) --missing_;
}

Round PlantRounds::next(std::uint32_t process) const {
  Round next = kNever;
  for (const AgentId i : processes_.at(process).agents) next = std::min(next, physics_.next(i));
  return next;
}

// Who is not steered does not wait for the agents, but goes no further ahead than their sockets hold.
bool PlantRounds::may_measure() {
  const Round k = physics_.round();
  for (auto& [name, process] : processes_) {
    const bool there = takes_part(process);
    if (there && !process.there) process.reached = std::max(process.reached, k);
    process.there = there;
    if (there && !steered_ && k > ahead_ && process.reached < k - ahead_) return false;
  }
  return true;
}

void PlantRounds::measure() {
  const Round k = physics_.round();
  missing_ = 0;
  measured_ = true;
  for (auto& [name, process] : processes_) {
    process.acted = false;
    if (!takes_part(process)) continue;
    if (steered_) ++missing_;
    values_.clear();
    for (const AgentId i : process.agents) {
      if (!physics_.present(i, k)) continue;
      const std::size_t size = physics_.measurement_size(i), distances = physics_.distance_count(i);
      values_.resize(values_.size() + size + distances);
      const std::span<double> numbers = std::span(values_).last(size + distances);
      physics_.measure(i, numbers.first(size));
      physics_.distances(i, numbers.last(distances));
    }
    if (!realtime_) {
      process.sent.forget_before(steered_ ? k : process.reached);
      process.sent.push(k, values_);
    }
    send_(name, k, values_);
  }
}

void PlantRounds::answer(const Standing& standing) {
  const auto at = processes_.find(standing.process);
  if (at == processes_.end()) return;
  Process& process = at->second;
  if (standing.slowest != kNever) process.reached = std::max(process.reached, standing.slowest);
  for (const Standing::Gap& gap : standing.gaps) {
    if (gap.sender != AgentId{0}) continue;
    process.sent.for_each(gap.first, gap.rounds, [&](SentWindow::Sent& sent) {
      if (sent.repeated > gap.asked) return;
      ++sent.repeated;
      sent_again_bytes_ += sizeof(double) * sent.values.size();
      send_(standing.process, sent.round, sent.values);
    });
  }
}

bool PlantRounds::ask() {
  if (!measured_ || missing_ == 0) return false;
  Standing standing;
  standing.slowest = physics_.round();
  for (auto& [name, process] : processes_) {
    if (process.acted || !takes_part(process)) continue;
    if (std::exchange(process.asked_of, physics_.round()) != physics_.round()) process.asked = 0;
    standing.gaps.push_back({AgentId{name}, physics_.round(), 1, process.asked++});
  }
  if (tell_) tell_(std::move(standing));
  return true;
}

void PlantRounds::advance() {
  while (physics_.round() < until_) {
    if (!measured_) {
      if (!may_measure()) return;
      measure();
    }
    if (missing_ > 0) return;
    physics_.advance();
    measured_ = false;
    extend_histories();
    if (physics_.round() == report_at_) report_due_ = true;
  }
}

namespace {

bool ends(const Attendance& attendance, Round k) {
  return k == attendance.until ||
         std::any_of(attendance.again.begin(), attendance.again.end(), [k](const Attendance& stay) { return k == stay.until; });
}

}  // namespace

void PlantRounds::begin_round(Round k) {
  while (physics_.round() < k) {
    if (steered_)
      for (const auto& [name, process] : processes_)
        missed_inputs_ += takes_part(process) && process.newest != physics_.round() + 1 ? 1 : 0;
    physics_.advance();
    extend_histories();
  }
  if (k < rounds_) measure();
}

void PlantRounds::extend_histories() {
  const Round k = physics_.round();
  const bool reported = k % report_interval_ == 0 || k == rounds_;
  for (std::size_t index = 0; index < attendance_.size(); ++index) {
    const Attendance& attendance = attendance_[index];
    const std::span<const double> state = physics_.state(agent_at(index));
    if (attendance.holds(k)) hashes_[index].extend(state);
    if (!(attendance.holds(k) && reported) && !ends(attendance, k)) continue;
    add_report(index);
  }
}

void PlantRounds::add_report(std::size_t index) {
  MemberReport& report = reports_[index];
  report.rounds.push_back(physics_.round());
  report.estimates.resize(report.estimates.size() + state_layout().size());
  physics_.report_state(agent_at(index), std::span(report.estimates).last(state_layout().size()));
  report.hashes.push_back(hashes_[index].value());
  report.counters.push_back({});
}

std::vector<MemberReport> PlantRounds::collect_reports(bool whole) {
  for (std::size_t index = 0; whole && index < reports_.size(); ++index)
    if (reports_[index].rounds.empty() || reports_[index].rounds.back() != physics_.round()) add_report(index);
  std::vector<MemberReport> reports;
  for (MemberReport& report : reports_) {
    MemberReport fresh{.agent = report.agent, .rounds = {}, .estimates = {}, .hashes = {}, .counters = {}};
    reports.push_back(std::exchange(report, std::move(fresh)));
  }
  report_due_ = false;
  return reports;
}

PlantRounds::Progress PlantRounds::progress() const {
  if (!measured_ || missing_ == 0) return {};
  for (const auto& [name, process] : processes_)
    if (!process.acted && takes_part(process)) return {process.agents.front(), missing_};
  return {};
}

}  // namespace consort
