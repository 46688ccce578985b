#include "rounds/lockstep.hpp"

#include "core/errors.hpp"

#include <algorithm>

namespace consort {

Lockstep::Lockstep(const Assignment& run, std::span<const MemberTask> tasks, Send send, Act act)
    : act_(run.steers ? std::move(act) : Act{}), hosted_(run, tasks, std::move(send)), missing_(tasks.size()), y_(tasks.size()) {}

Round Lockstep::report_point(const Member& member) const { return std::min(report_at_, member.attendance().until); }

void Lockstep::grant(const Grant& grant) {
  if (hosted_.granted() && grant.until <= hosted_.granted_until() && grant.report_at <= report_at_) return;
  hosted_.extend(grant);
  report_at_ = grant.report_at;
  whole_ = grant.whole;
  reached_report_ = 0;
  for (std::uint32_t member = 0; member < hosted_.size(); ++member) {
    if (hosted_[member].round() >= report_point(hosted_[member])) ++reached_report_;
    ready_.push_back(member);
  }
  report_due_ = reached_report_ == hosted_.size();
}

void Lockstep::depart(std::span<const AgentId> agents) {
  hosted_.depart(agents);
  for (std::uint32_t member = 0; member < hosted_.size(); ++member) {
    if (!hosted_[member].begun()) continue;
    missing_[member] = hosted_[member].missing();
    if (missing_[member] == 0) ready_.push_back(member);
  }
}

// Gives one message to one member; notices when that was the last one its round waited for.
void Lockstep::deliver(std::uint32_t member, AgentId from, Round round, std::span<const double> message) {
  Member& receiver = hosted_[member];
  if (receiver.mailbox().post(from, round, message) != Mailbox::Post::accepted) return;
  if (round != receiver.round() || !receiver.hears(from)) return;
  if (--missing_[member] == 0) ready_.push_back(member);
}

bool Lockstep::receive(const Information& message) {
  const std::span<const std::uint32_t> listeners = hosted_.listeners(message.sender);
  for (const std::uint32_t member : listeners) deliver(member, message.sender, message.round, message.values);
  return !listeners.empty();
}

void Lockstep::receive(const Measurement& measurement) {
  if (!measured_.empty() && measurement.round <= measured_.back().round) return;
  hosted_.check_length(measurement);
  measured_.push_back({measurement.round, {measurement.values.begin(), measurement.values.end()}});
  for (std::uint32_t member = 0; member < hosted_.size(); ++member)
    if (hosted_[member].round() == measurement.round) ready_.push_back(member);
}

// Is y of the member's round here?
bool Lockstep::find_measurement(std::size_t member) {
  if (hosted_.numbers_from_plant(member) == 0 && !act_) return true;  // who steers keeps step with the plant even if it measures nothing
  const Round k = hosted_[member].round();
  const auto entry = std::find_if(measured_.begin(), measured_.end(), [k](const Measured& measured) { return measured.round == k; });
  if (entry == measured_.end()) return false;
  std::size_t at = 0;
  for (std::size_t before = 0; before < member; ++before)
    if (hosted_[before].attendance().holds(k)) at += hosted_.numbers_from_plant(before);
  const std::span<const double> numbers = std::span<const double>(entry->values).subspan(at, hosted_.numbers_from_plant(member));
  y_[member] = numbers.first(hosted_.measurements(member));
  if (numbers.size() > y_[member].size()) hosted_[member].mailbox().set_distances(numbers.subspan(y_[member].size()));
  return true;
}

void Lockstep::begin(std::size_t member) {
  const Member& sender = hosted_[member];
  if (!hosted_.find_topology(member)) throw RunError(two_masters(sender.round()));
  if (const auto from = hosted_.lacking(member))
    throw RunError("agent " + std::to_string(sender.id().value) + ", round " + std::to_string(sender.round()) +
                   ": nothing has been heard of what agent " + std::to_string(from->value) + " announced");
  const std::span<const std::uint32_t> listeners = hosted_.begin(member, y_[member]);
  missing_[member] = sender.missing();
  for (const std::uint32_t listener : listeners) deliver(listener, sender.id(), sender.round(), sender.message());
}

// The member's control of round k. With the last one of the round they go to the plant: nobody can be a round ahead, since the plant
// waits for them.
void Lockstep::steer(std::size_t member, Round k) {
  std::size_t total = 0, at = 0, taking_part = 0;
  for (std::size_t other = 0; other < hosted_.size(); ++other) {
    if (!hosted_[other].attendance().holds(k)) continue;
    if (other == member) at = total;
    total += hosted_[other].protocol().control_size();
    ++taking_part;
  }
  controls_.resize(total);
  const Protocol& protocol = hosted_[member].protocol();
  protocol.control(std::span(controls_).subspan(at, protocol.control_size()));
  if (++steered_ < taking_part) return;
  steered_ = 0;
  act_(k, controls_);
}

void Lockstep::finish(std::size_t member) {
  const Round k = hosted_[member].round();
  hosted_.finish(member);
  if (act_) steer(member, k);
  if (!measured_.empty())
    for (const Round slowest = hosted_.slowest_round(); !measured_.empty() && measured_.front().round < slowest;) measured_.pop_front();
  if (k + 1 == report_point(hosted_[member]) && ++reached_report_ == hosted_.size()) report_due_ = true;
}

void Lockstep::advance() {
  while (!ready_.empty()) {
    const std::uint32_t index = ready_.back();
    ready_.pop_back();
    const Member& member = hosted_[index];
    while (member.round() < hosted_.granted_until() && !member.left()) {
      if (!member.begun()) {
        if (!find_measurement(index)) break;
        begin(index);
      }
      if (missing_[index] > 0) break;
      finish(index);
    }
  }
}

std::vector<MemberReport> Lockstep::collect_reports() {
  const bool whole = whole_report_due();
  if (whole) whole_ = false;
  report_due_ = false;
  return hosted_.collect_reports(whole);
}

}  // namespace consort
