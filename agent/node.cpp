#include "agent/node.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"
#include "protocols/registry.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace consort {

Node::Node(const wire::Participant& participant, NodeOptions options)
    : RunMember(participant, options.arrival, options.agents.front().value, options.agents),
      options_(std::move(options)),
      meeting_(options_.agents),
      layouts_(participant),
      assignments_(participant, [this](Assignment&& part) { on_assignment(std::move(part)); }) {
  check(std::is_sorted(agents_.begin(), agents_.end()), "a process hosts agents, ascending");
}

Node::~Node() = default;

void Node::on_assignment(Assignment&& part) {
  guarded([&] {
    if (outdated(part.epoch)) return;
    std::erase_if(part.members,
                  [&](const MemberTask& member) { return !std::binary_search(agents_.begin(), agents_.end(), member.agent); });
    // Who comes back may be told first what an earlier stay was told.
    const auto earlier = [&](const MemberTask& member) { return member.presence.from < options_.first_round; };
    if (part.epoch == options_.first_epoch && std::any_of(part.members.begin(), part.members.end(), earlier)) return;
    add_part(parts_, std::move(part));
  });
}

void Node::run_rounds() {
  const std::uint64_t before = rounds_->finished();
  rounds_->advance();
  if (rounds_->finished() != before) has_gone_on();
  if (rounds_->report_due()) wake_.notify_one();
}

// Without a plant a round ends when the next one begins, so that messages have one dt to travel. With one, its measurement comes first.
void Node::grant(const Grant& grant) {
  if (!rounds_) return;
  rounds_->grant(grant);
  const Assignment& run = assignment();
  if (delivery_) {
    Round first = run.rounds;
    for (const MemberTask& member : members_) first = std::min(first, member.presence.from);
    if (run.plant)
      start_clock(grant, run.dt, first, run.rounds - 1, {run.dt / 3.0, 2.0 * run.dt / 3.0});
    else
      start_clock(grant, run.dt, first, run.rounds, {0.0});
  }
  run_rounds();
}

void Node::beat(std::size_t phase, Round k) {
  const Assignment& run = assignment();
  if (run.plant) {
    if (phase == 0)
      rounds_->begin_round(k);
    else
      rounds_->end_round(k);
    return;
  }
  if (k > 0) rounds_->end_round(k - 1);
  if (k < run.rounds) rounds_->begin_round(k);
}

void Node::on_information(wire::InformationReader::Burst& burst) {
  guarded([&] {
    Information message;
    while (burst.next(message)) {
      if (message.epoch == kGreeting) {
        if (meeting_.greeted_by(message.sender)) wake_.notify_one();
      } else if (rounds_ && current(message.epoch)) {
        rounds_->receive(message);
      }
    }
    if (rounds_ && current(*epoch_)) run_rounds();
  });
}

void Node::on_measurement(const Measurement& measurement) {
  guarded([&] {
    if (measurement.epoch == kGreeting) {
      meeting_.greeted_by_plant();
      wake_.notify_one();
    } else if (rounds_ && current(measurement.epoch) && !rounds_->hosted().over()) {
      rounds_->receive(measurement);
      run_rounds();
    }
  });
}

void Node::on_standing(const Standing& standing) {
  guarded([&] {
    if (!rounds_ || standing.epoch != epoch_) return;  // also when it has finished: who asks has not
    rounds_->answer(standing);
    if (current(*epoch_)) run_rounds();
  });
}

void Node::depart(std::span<const AgentId> agents) {
  meeting_.departed(agents);
  wake_.notify_one();
  if (!rounds_) return;
  rounds_->depart(agents);
  rounds_->advance();
}

void Node::come_back(std::span<const AgentId> agents, Round round) {
  meeting_.comes_back(agents, round);
  if (rounds_) rounds_->come_back(agents, round);
}

void Node::on_announcement(Layouts&& layouts) {
  guarded([&] {
    if (std::binary_search(agents_.begin(), agents_.end(), layouts.agent)) return;  // our own, come back
    Layouts& known = announced_[layouts.agent];
    if (known.epoch >= layouts.epoch) return;
    known = std::move(layouts);
    if (known.epoch != epoch_ || !rounds_) return;  // begin_run takes what is ahead
    learn(known);
    wake_.notify_one();
  });
}

void Node::learn(const Layouts& layouts) {
  rounds_->hosted().learn(layouts.agent, layouts.announcement);
  meeting_.announced(layouts.agent);
  to_pass_on_.push_back(layouts.agent);
}

bool Node::do_more(Lock& lock) {
  if (!to_pass_on_.empty()) pass_on(lock);
  if (!over()) return true;
  last_words_ = true;
  send_last_report(lock);
  if (!may_leave()) return true;
  leave(lock);
  return false;
}

void Node::begin_run(Lock& lock) {
  collect_members();
  last_words_ = false;
  const Assignment& run = assignment();
  delivery_ = run.realtime ? std::optional(run.delivery) : std::nullopt;
  rounds_ = rounds_of(
      run, members_,
      [this](std::size_t member, Round round, std::span<const double> message) {
        if (outlet_[member]) outlet_[member]->write(*epoch_, round, message);
      },
      [this](Round round, std::span<const double> controls) {
        actuations_->write({*epoch_, process_, round, controls});
      },
      [this](Standing&& standing) {
        if (!standing.gaps.empty()) has_asked();
        standing.epoch = *epoch_;
        standing.process = process_;
        for (wire::StandingWriter& writer : standings_) writer.write(standing);
      });
  spdlog::info("epoch {}: {} with {}, seed {}", *epoch_, run.protocol, counted(run.agents, "agent"), run.seed.value);
  const std::vector<AgentId> senders = meeting_.begin(run, members_);
  open_information(lock, senders);
  open_loop(lock);
  open_standings(lock, senders);
  open_announcements(lock);
  // Whoever joins a run that is under way may hear how it stands before it is ready to.
  if (lost_early_ && lost_early_->epoch == epoch_) depart(lost_early_->agents);
  if (delivery_ && granted_early_ && granted_early_->epoch == epoch_) grant(*granted_early_);  // in lockstep it is told again
  write_layouts(lock);
}

void Node::collect_members() {
  members_.clear();
  for (auto& [number, part] : parts_) std::move(part.members.begin(), part.members.end(), std::back_inserter(members_));
  const bool placed_here =
      std::all_of(members_.begin(), members_.end(), [&](const MemberTask& member) { return member.process == process_; });
  if (members_.size() != agents_.size() || !placed_here) {
    throw ConfigError("this run does not host these agents together (its `placement: agents_per_process` decides); is --id right?");
  }
  std::sort(members_.begin(), members_.end(), [](const MemberTask& a, const MemberTask& b) { return a.agent < b.agent; });
}

// What each member's numbers are, and what it announces.
void Node::write_layouts(Lock& lock) {
  std::vector<Layouts> layouts;
  for (std::size_t m = 0; m < members_.size(); ++m) {
    const Member& member = rounds_->hosted()[m];
    const Protocol& protocol = member.protocol();
    layouts.push_back(
        {member.id(), *epoch_, protocol.message_layout(), protocol.estimate_layout(), protocol.announcement(), member.recorded_layout()});
  }
  lock.unlock();
  for (const Layouts& each : layouts) {
    layouts_.write(each);
    if (announcements_) announcements_->write(each);
  }
  lock.lock();
}

// What others announced goes on to those that read us.
void Node::pass_on(Lock& lock) {
  std::vector<Layouts> layouts;
  if (assignment().relays)
    for (const AgentId agent : to_pass_on_) layouts.push_back(announced_.at(agent));
  to_pass_on_.clear();
  lock.unlock();
  for (const Layouts& each : layouts) announcements_->write(each);
  lock.lock();
}

bool Node::greeting_needed() const { return rounds_ && meeting_.greeting_needed(rounds_->hosted().granted_until()); }

bool Node::fill(wire::Telemetry& telemetry) {
  telemetry.round = rounds_->hosted().slowest().round;
  const bool tells_links = telemetry.last || assignment().tells_links;
  if (tells_links || rounds_->whole_report_due()) telemetry.links = rounds_->hosted().links();
  telemetry.members = rounds_->collect_reports();
  if (tells_links) telemetry.network = rounds_->network();
  const auto silent = [](const MemberReport& report) { return report.rounds.empty(); };
  return telemetry.last || !delivery_ || !std::all_of(telemetry.members.begin(), telemetry.members.end(), silent);
}

void Node::describe(wire::Presence& presence) const {
  if (!rounds_) return;
  Hosted::Progress slowest = rounds_->hosted().slowest();
  presence.round = slowest.round;
  presence.waiting_agent = slowest.agent;
  presence.waiting_for = std::move(slowest.waiting_for);
  if (slowest.for_measurement && presence.state == wire::State::status) presence.note = "waits for its measurement";
  if (presence.waiting_for.size() > 32) presence.waiting_for.resize(32);
}

}  // namespace consort
