#include "rounds/lockstep.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <utility>

namespace consort {

Lockstep::Lockstep(const Assignment& run, std::span<const MemberTask> tasks, Send send, Act act, Tell tell)
    : send_(std::move(send)),
      act_(run.steers ? std::move(act) : Act{}),
      tell_(std::move(tell)),
      hosted_(run, tasks,
              [this](std::size_t member, Round k, std::span<const double> message) {
                flow_.sent(member, k, hosted_.remote_listeners(member), message);
                send_(member, k, message);
              }),
      flow_(run.agents, tasks.size(), run.ahead, run.window, hosted_.first()),
      pace_(std::max<Round>(run.ahead / 2, 1)),
      ahead_(run.ahead),
      missing_(tasks.size()),
      y_(tasks.size()),
      told_(tasks.size(), hosted_.first()),
      told_plant_(hosted_.first()) {
  for (const auto& [agent, round] : run.joining)
    if (!hosted_.member_with(agent)) flow_.reaches(agent, round);
}

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
  for (const AgentId agent : agents) flow_.departs(agent);
  go_on_blocked();
  for (std::uint32_t member = 0; member < hosted_.size(); ++member) {
    if (!hosted_[member].begun()) continue;
    missing_[member] = hosted_[member].missing();
    if (missing_[member] == 0) ready_.push_back(member);
  }
}

void Lockstep::come_back(std::span<const AgentId> agents, Round round) {
  for (const AgentId agent : agents) flow_.comes_back(agent, round);
}

// Gives one message to one member; notices when that was the last one its round waited for, or that one before it has been lost: a
// sender's messages do not overtake each other.
void Lockstep::deliver(std::uint32_t member, AgentId from, Round round, std::span<const double> message) {
  Member& receiver = hosted_[member];
  const Mailbox::Post post = receiver.mailbox().post(from, round, message);
  if (post == Mailbox::Post::duplicate || post == Mailbox::Post::stale) note_twice(member, from, round);
  if (post != Mailbox::Post::accepted) return;
  ++heard_;
  if (!receiver.hears(from)) return;
  const Round now = receiver.round();
  if (round == now && --missing_[member] == 0) ready_.push_back(member);
  if (round == now || receiver.mailbox().heard(from, now)) return;
  const auto asked = asked_.find({member, from});
  if (asked == asked_.end() || asked->second.round != now) ask_for(member, from);
}

bool Lockstep::receive(const Information& message) {
  const std::span<const std::uint32_t> listeners = hosted_.listeners(message.sender);
  for (const std::uint32_t member : listeners) deliver(member, message.sender, message.round, message.values);
  if (!listeners.empty() && flow_.reaches(message.sender, message.round)) go_on_blocked();
  return !listeners.empty();
}

const Lockstep::Measured* Lockstep::measured(Round k) const {
  const auto at =
      std::lower_bound(measured_.begin(), measured_.end(), k, [](const Measured& each, Round round) { return each.round < round; });
  return at != measured_.end() && at->round == k ? &*at : nullptr;
}

void Lockstep::receive(const Measurement& measurement) {
  const Round k = measurement.round;
  if (k < hosted_.slowest_round() || measured(k) != nullptr) {
    for (std::size_t member = 0; member < hosted_.size(); ++member) note_twice(member, AgentId{0}, k);
    return;
  }
  ++heard_;
  hosted_.check_length(measurement);
  const auto after =
      std::upper_bound(measured_.begin(), measured_.end(), k, [](Round round, const Measured& each) { return round < each.round; });
  measured_.insert(after, {k, {measurement.values.begin(), measurement.values.end()}});
  for (std::uint32_t member = 0; member < hosted_.size(); ++member) {
    const Member& receiver = hosted_[member];
    if (receiver.round() == k) ready_.push_back(member);
    if (receiver.round() >= k || receiver.begun() || receiver.left() || !needs_measurement(member) || measured(receiver.round())) continue;
    const auto asked = asked_.find({member, AgentId{0}});
    if (asked == asked_.end() || asked->second.round != receiver.round()) ask_for_measurement(member);
  }
}

// Who steers keeps step with the plant even if it measures nothing.
bool Lockstep::needs_measurement(std::size_t member) const { return hosted_.numbers_from_plant(member) > 0 || act_; }

// Is y of the member's round here?
bool Lockstep::find_measurement(std::size_t member) {
  if (!needs_measurement(member)) return true;
  const Round k = hosted_[member].round();
  const Measured* entry = measured(k);
  if (entry == nullptr) return false;
  std::size_t at = 0;
  for (std::size_t before = 0; before < member; ++before)
    if (hosted_[before].attendance().holds(k)) at += hosted_.numbers_from_plant(before);
  const std::span<const double> numbers = std::span<const double>(entry->values).subspan(at, hosted_.numbers_from_plant(member));
  y_[member] = numbers.first(hosted_.measurements(member));
  if (numbers.size() > y_[member].size()) hosted_[member].mailbox().set_distances(numbers.subspan(y_[member].size()));
  return true;
}

bool Lockstep::may_begin(std::uint32_t member) {
  const Round k = hosted_[member].round();
  if (!hosted_.find_topology(member)) throw RunError(two_masters(k));
  if (flow_.may_begin(k, hosted_.remote_listeners(member))) return true;
  blocked_.push_back(member);
  return false;
}

void Lockstep::go_on_blocked() {
  ready_.insert(ready_.end(), blocked_.begin(), blocked_.end());
  blocked_.clear();
}

void Lockstep::begin(std::size_t member) {
  const Member& sender = hosted_[member];
  if (const auto from = hosted_.lacking(member))
    throw RunError("agent " + std::to_string(sender.id().value) + ", round " + std::to_string(sender.round()) +
                   ": nothing has been heard of what agent " + std::to_string(from->value) + " announced");
  const std::span<const std::uint32_t> listeners = hosted_.begin(member, y_[member]);
  missing_[member] = sender.missing();
  if (hosted_.unanswered(member) && sender.round() >= told_[member] + pace_) say_round(member);
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
  acted_.forget_before(k);
  acted_.push(k, controls_);
  act_(k, controls_);
}

void Lockstep::finish(std::size_t member) {
  const Round k = hosted_[member].round();
  hosted_.finish(member);
  ++finished_;
  if (act_) steer(member, k);
  if (!measured_.empty()) {
    const Round slowest = hosted_.slowest_round();
    while (!measured_.empty() && measured_.front().round < slowest) measured_.pop_front();
    if (!act_ && slowest != kNever && slowest >= told_plant_ + pace_) say_round(member);
  }
  if (k + 1 == report_point(hosted_[member]) && ++reached_report_ == hosted_.size()) report_due_ = true;
}

void Lockstep::advance() {
  while (!ready_.empty()) {
    const std::uint32_t index = ready_.back();
    ready_.pop_back();
    const Member& member = hosted_[index];
    while (member.round() < hosted_.granted_until() && !member.left()) {
      if (!member.begun()) {
        if (!find_measurement(index) || !may_begin(index)) break;
        begin(index);
      }
      if (missing_[index] > 0) break;
      finish(index);
    }
  }
  tell();
}

// --- where messages are lost ---------------------------------------------------------------------------------------------

void Lockstep::answer(const Standing& standing) {
  bool news = false;
  for (const auto& [reader, round] : standing.readers) news = flow_.reaches(reader, round) || news;
  if (news) go_on_blocked();
  for (const Standing::Gap& gap : standing.gaps) {
    if (standing.process == 0) {
      act_again(gap);
    } else if (const auto member = hosted_.member_with(gap.sender)) {
      flow_.send_again(*member, gap, [&](Round k, std::span<const double> message) {
        sent_again_bytes_ += message.size_bytes();
        send_(*member, k, message);
      });
    }
  }
}

void Lockstep::act_again(const Standing::Gap& gap) {
  if (gap.sender != hosted_[0].id()) return;
  acted_.for_each(gap.first, gap.rounds, [&](SentWindow::Sent& sent) {
    if (sent.repeated++ > gap.asked) return;
    sent_again_bytes_ += sizeof(double) * sent.values.size();
    act_(sent.round, sent.values);
  });
}

bool Lockstep::ask() {
  for (std::uint32_t member = 0; member < hosted_.size(); ++member) {
    const Member& receiver = hosted_[member];
    if (receiver.left() || receiver.round() >= hosted_.granted_until()) continue;
    if (receiver.begun()) {
      for (const Neighbour& neighbour : receiver.in_neighbours())
        if (!hosted_.member_with(neighbour.id) && !receiver.mailbox().heard(neighbour.id, receiver.round())) ask_for(member, neighbour.id);
    } else if (needs_measurement(member) && measured(receiver.round()) == nullptr) {
      ask_for_measurement(member);
    } else {
      say_round(member);  // some of those it hears may think it further behind than it is
    }
  }
  return tell();
}

// A message has come that is here already.
void Lockstep::note_twice(std::size_t member, AgentId from, Round round) {
  if (asked_.empty()) return;
  const auto asked = asked_.find({member, from});
  if (asked != asked_.end() && asked->second.round == round && asked->second.times > 0) ++came_twice_;
}

void Lockstep::say_round(std::size_t member) { standing_.readers[hosted_[member].id()] = told_[member] = hosted_[member].round(); }

void Lockstep::ask_for(std::size_t member, AgentId from) {
  const Member& receiver = hosted_[member];
  Asked& asked = asked_[{member, from}];
  if (asked.round != receiver.round()) asked = {receiver.round(), 0};
  Round rounds = 1;
  while (rounds < ahead_ && !receiver.mailbox().heard(from, receiver.round() + rounds)) ++rounds;
  standing_.gaps.push_back({from, receiver.round(), rounds, asked.times++});
  say_round(member);
}

void Lockstep::ask_for_measurement(std::size_t member) {
  const Round k = hosted_[member].round();
  Asked& asked = asked_[{member, AgentId{0}}];
  if (asked.round != k) asked = {k, 0};
  Round rounds = 1;
  while (rounds < ahead_ && measured(k + rounds) == nullptr) ++rounds;
  standing_.gaps.push_back({AgentId{0}, k, rounds, asked.times++});
  say_round(member);
}

// Tells what there is to tell; false if that is nothing.
bool Lockstep::tell() {
  if (standing_.readers.empty()) return false;
  standing_.slowest = told_plant_ = hosted_.slowest_round();
  if (tell_) tell_(std::exchange(standing_, {}));
  standing_ = {};
  return true;
}

std::vector<MemberReport> Lockstep::collect_reports() {
  const bool whole = whole_report_due();
  if (whole) whole_ = false;
  report_due_ = false;
  return hosted_.collect_reports(whole);
}

}  // namespace consort
