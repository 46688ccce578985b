#include "agent/node.hpp"

#include "core/counted.hpp"
#include "protocols/registry.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <limits>

namespace consort {
namespace {

std::string host_name() {
  std::array<char, 64> name{};
  gethostname(name.data(), name.size() - 1);
  return name.data();
}

}  // namespace

Node::Node(const wire::Participant& participant, NodeOptions options)
    : RunMember(participant, options.meeting),
      options_(std::move(options)),
      host_(host_name()),
      presence_(participant, liveliness_lease()),
      layouts_(participant),
      telemetry_(participant),
      assignments_(participant, [this](Assignment&& part) { on_assignment(std::move(part)); }),
      grants_(participant, [this](Grant&& grant) { on_grant(std::move(grant)); }),
      commands_(
          participant, [this](wire::Command&& command) { on_command(command); }, [this](std::size_t n) { on_orchestrator(n); }) {
  check(!options_.agents.empty() && std::is_sorted(options_.agents.begin(), options_.agents.end()), "a process hosts agents, ascending");
}

Node::~Node() = default;

void Node::on_assignment(Assignment&& part) {
  guarded([&] {
    if (part.epoch < newest_epoch_ || part.epoch == epoch_) return;  // of a run that is over or begun
    std::erase_if(part.members, [&](const MemberTask& member) {
      return !std::binary_search(options_.agents.begin(), options_.agents.end(), member.agent);
    });
    // Who comes back may be told first what an earlier stay was told.
    const auto outdated = [&](const MemberTask& member) { return member.presence.from < options_.first_round; };
    if (part.epoch == options_.first_epoch && std::any_of(part.members.begin(), part.members.end(), outdated)) return;
    if (part.epoch > newest_epoch_) parts_.clear();
    newest_epoch_ = part.epoch;
    const std::uint32_t parts = part.parts;
    parts_[part.part] = std::move(part);
    assigned_ = parts_.size() == parts;
    if (assigned_) wake_.notify_one();
  });
}

void Node::on_grant(Grant&& grant) {
  guarded([&] {
    if (rounds_ && grant.epoch == epoch_)
      take(grant);
    else
      granted_early_ = std::move(grant);
  });
}

void Node::take(const Grant& grant) {
  if (finish_) return;
  rounds_->grant(grant);
  if (delivery_ && !pacer_) start_clock(grant);
  rounds_->advance();
  if (rounds_->report_due()) wake_.notify_one();
}

/// Without a plant a round ends when the next one begins, so that messages have one dt to travel. With one, its measurement comes first.
void Node::start_clock(const Grant& grant) {
  const Assignment& run = parts_.begin()->second;
  Round first = run.rounds;
  for (const MemberTask& member : members_) first = std::min(first, member.presence.from);
  const auto call = [this](std::size_t phase, Round k) { beat(phase, k); };
  events_before_ = reader_events();
  if (run.plant)
    pacer_.emplace(grant.start_ns, run.dt, first, run.rounds - 1, std::vector{run.dt / 3.0, 2.0 * run.dt / 3.0}, call);
  else
    pacer_.emplace(grant.start_ns, run.dt, first, run.rounds, std::vector{0.0}, call);
}

void Node::beat(std::size_t phase, Round k) {
  guarded([&] {
    if (!rounds_ || finish_) return;
    const Assignment& run = parts_.begin()->second;
    if (run.plant) {
      if (phase == 0)
        rounds_->begin_round(k);
      else
        rounds_->end_round(k);
      return;
    }
    if (k > 0) rounds_->end_round(k - 1);
    if (k < run.rounds) rounds_->begin_round(k);
  });
}

void Node::on_information(wire::InformationReader::Burst& burst) {
  guarded([&] {
    Information message;
    while (burst.next(message)) {
      if (message.epoch == kGreeting)
        on_greeting(message.sender);
      else if (rounds_ && message.epoch == epoch_ && !finish_)
        rounds_->receive(message);
    }
    if (!rounds_ || finish_) return;
    rounds_->advance();
    if (rounds_->report_due()) wake_.notify_one();
  });
}

void Node::on_greeting(AgentId sender) {
  if (!std::binary_search(heard_remotely_.begin(), heard_remotely_.end(), sender)) return;
  greeted_by_.insert(sender);
  wake_.notify_one();
}

void Node::on_measurement(const Measurement& measurement) {
  guarded([&] {
    if (measurement.epoch == kGreeting) {
      plant_greeted_us_ = true;
      wake_.notify_one();
      return;
    }
    if (!rounds_ || measurement.epoch != epoch_ || finish_ || rounds_->hosted().over()) return;
    rounds_->receive(measurement);
    rounds_->advance();
    if (rounds_->report_due()) wake_.notify_one();
  });
}

void Node::depart(std::span<const AgentId> agents) {
  gone_.insert(agents.begin(), agents.end());
  for (const AgentId agent : agents) greeted_by_.erase(agent);  // who comes back has to greet again
  wake_.notify_one();
  if (!rounds_) return;
  rounds_->depart(agents);
  rounds_->advance();
}

void Node::come_back(std::span<const AgentId> agents, Round round) {
  for (const AgentId agent : agents) {
    gone_.erase(agent);
    greeted_by_.erase(agent);
    parts_.begin()->second.joining[agent] = round;
  }
  ready_until_ = std::min(ready_until_, round);
}

void Node::on_announcement(Layouts&& layouts) {
  guarded([&] {
    if (std::binary_search(options_.agents.begin(), options_.agents.end(), layouts.agent)) return;  // our own, come back
    Layouts& known = announced_[layouts.agent];
    if (known.epoch >= layouts.epoch) return;
    known = std::move(layouts);
    if (known.epoch != epoch_ || !rounds_) return;  // begin_run takes what is ahead
    rounds_->hosted().learn(known.agent, known.announcement);
    to_pass_on_.push_back(known.agent);
    wake_.notify_one();
  });
}

void Node::run() {
  Lock lock(mutex_);
  const bool met = meet_run(lock);  // who is refused tells nobody: the run knows
  try {
    if (met) serve(lock);
  } catch (const std::exception& failure) {
    if (!lock.owns_lock()) lock.lock();
    announce(lock, wire::State::failed, failure.what());
    ended_ = true;
    lock.unlock();
    presence_.wait_for_acknowledgments(2.0);
    throw;
  }
  announce(lock, wire::State::leaving);
  ended_ = true;
  lock.unlock();
  if (liveliness_lease()) presence_.wait_for_acknowledgments(2.0);  // else it would seem to have died
}

void Node::tell(const std::string& line) const { spdlog::info(line); }

void Node::serve(Lock& lock) {
  while (true) {
    const auto has_work = [&] {
      return failure_ || shutdown_ || interrupted_ || orchestrator_lost_ || status_asked_ || assigned_ || (finish_ && !finished_) ||
             (rounds_ && !finish_ && (rounds_->report_due() || rounds_->hosted().over())) || met_until() > ready_until_ ||
             (!greeted_ && may_greet()) || !to_pass_on_.empty();
    };
    // A match is announced a moment before the connection is complete, so a greeting can be lost: it is repeated until rounds are granted.
    if (pacer_) {
      if (!wake_.wait_for(lock, kReportEvery, has_work) && !finish_) send_reports(lock, false);
      if (greeting_needed()) greeted_ = false;
    } else if (!greeting_needed())
      wake_.wait(lock, has_work);
    else if (!wait_or_greet(lock, has_work))
      greeted_ = false;
    if (failure_) std::rethrow_exception(failure_);
    if ((orphaned_ || orchestrator_lost_) && rounds_)
      for (const std::string& line : in_words(rounds_->hosted().collect_reports(true))) spdlog::warn(line);
    if (shutdown_ || interrupted_) return;
    if (orchestrator_lost_) lose_orchestrator();
    if (assigned_) begin_run(lock);
    if (!to_pass_on_.empty()) pass_on(lock);
    if (rounds_ && !finish_ && rounds_->hosted().over()) return take_leave(lock);  // and neither greets nor is ready any more
    if (!greeted_ && may_greet()) greet();
    if (const Round until = met_until(); until > ready_until_) {
      ready_until_ = until;
      announce(lock, wire::State::ready);
    }
    if (rounds_ && !finish_ && rounds_->report_due()) send_reports(lock, false);
    if (finish_ && !finished_) {
      finished_ = true;
      send_reports(lock, true);
    }
    if (std::exchange(status_asked_, false)) announce(lock, wire::State::status);
  }
}

void Node::begin_run(Lock& lock) {
  lock.unlock();
  pacer_.reset();
  lock.lock();
  assigned_ = false;
  greet_again_ = kGreetSoon;
  epoch_ = newest_epoch_;
  ready_until_ = 0;
  finish_ = finished_ = false;
  gone_.clear();
  members_.clear();
  for (auto& [number, part] : parts_) std::move(part.members.begin(), part.members.end(), std::back_inserter(members_));
  const std::uint32_t process = options_.agents.front().value;
  const bool placed_here =
      std::all_of(members_.begin(), members_.end(), [&](const MemberTask& member) { return member.process == process; });
  if (members_.size() != options_.agents.size() || !placed_here) {
    throw ConfigError("this run does not host these agents together (its `placement: agents_per_process` decides); is --id right?");
  }
  std::sort(members_.begin(), members_.end(), [](const MemberTask& a, const MemberTask& b) { return a.agent < b.agent; });
  Send send = [this](std::size_t member, Round round, std::span<const double> payload) {
    if (outlet_[member]) outlet_[member]->write(*epoch_, round, payload);
  };
  Act act = [this, process](Round round, std::span<const double> controls) { actuations_->write({*epoch_, process, round, controls}); };
  const Assignment& run = parts_.begin()->second;
  if (run.realtime) delivery_ = run.delivery;
  rounds_ = rounds_of(run, members_, std::move(send), std::move(act));
  spdlog::info("epoch {}: {} with {}, seed {}", *epoch_, parts_.begin()->second.protocol, counted(parts_.begin()->second.agents, "agent"),
               parts_.begin()->second.seed.value);
  meet_neighbours(lock);
  meet_plant(lock);
  meet_announcers(lock);
  const std::uint32_t epoch = *epoch_;
  // Whoever joins a run that is under way may hear how it stands before it is ready to.
  if (lost_early_ && lost_early_->epoch == epoch) depart(lost_early_->agents);
  if (delivery_ && granted_early_ && granted_early_->epoch == epoch) take(*granted_early_);  // in lockstep it is told again
  std::vector<Layouts> layouts;
  for (std::size_t m = 0; m < members_.size(); ++m) {
    const Member& member = rounds_->hosted()[m];
    const Protocol& protocol = member.protocol();
    layouts.push_back({members_[m].agent, epoch, protocol.message_layout(), protocol.estimate_layout(), protocol.announcement(),
                       member.recorded_layout()});
  }
  lock.unlock();
  for (const Layouts& layout : layouts) {
    layouts_.write(layout);
    if (announcements_) announcements_->write(layout);
  }
  lock.lock();
}

/// Where agents announce themselves: creates the endpoints for it, once, and takes what has been heard ahead of this run.
void Node::meet_announcers(Lock& lock) {
  to_pass_on_.clear();
  if (!find_protocol(parts_.begin()->second.protocol).announces) return;
  const std::vector<AgentId> heard = heard_remotely_;
  const bool first = !announcements_;
  lock.unlock();  // creating endpoints calls back
  if (first) announcements_.emplace(participant_, options_.agents);
  std::optional<wire::AnnouncementReader> listening;
  if (first && !heard.empty()) listening.emplace(participant_, heard, [this](Layouts&& layouts) { on_announcement(std::move(layouts)); });
  lock.lock();
  if (listening) announcement_readers_.push_back(std::move(*listening));
  for (const auto& [agent, layouts] : announced_) {
    if (layouts.epoch != epoch_) continue;
    rounds_->hosted().learn(agent, layouts.announcement);
    to_pass_on_.push_back(agent);
  }
}

/// What others announced goes on to those that read us.
void Node::pass_on(Lock& lock) {
  std::vector<Layouts> layouts;
  if (parts_.begin()->second.relays)
    for (const AgentId agent : to_pass_on_) layouts.push_back(announced_.at(agent));
  to_pass_on_.clear();
  lock.unlock();
  for (const Layouts& each : layouts) announcements_->write(each);
  lock.lock();
}

/// Creates the Information endpoints this run needs and earlier runs of the session did not.
void Node::meet_neighbours(Lock& lock) {
  outlet_.assign(members_.size(), nullptr);
  std::vector<AgentId> wanted;
  std::vector<std::pair<std::size_t, AgentId>> new_writers;
  const std::uint32_t agents = parts_.begin()->second.agents;
  for (std::size_t m = 0; m < members_.size(); ++m) {
    const MemberTask& member = members_[m];
    if (member.hears_everyone) {
      for (std::uint32_t id = 1; id <= agents; ++id) wanted.push_back(AgentId{id});
    } else {
      wanted.insert(wanted.end(), member.in_neighbours.begin(), member.in_neighbours.end());
    }
    if (member.remote_readers + member.late_readers.size() > 0 && !information_.contains(member.agent))
      new_writers.emplace_back(m, member.agent);
  }
  std::sort(wanted.begin(), wanted.end());
  wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
  const bool everyone = wanted.size() + options_.agents.size() >= agents && options_.agents.size() < agents;
  std::erase_if(wanted, [&](AgentId id) {
    return std::binary_search(options_.agents.begin(), options_.agents.end(), id) ||
           std::binary_search(heard_remotely_.begin(), heard_remotely_.end(), id);
  });
  const bool first_reader = heard_remotely_.empty();
  if (!wanted.empty()) {
    heard_remotely_.insert(heard_remotely_.end(), wanted.begin(), wanted.end());
    std::sort(heard_remotely_.begin(), heard_remotely_.end());
  }
  const bool wildcard = everyone && first_reader && wanted.size() + options_.agents.size() == agents;

  const Round window = parts_.begin()->second.window;
  lock.unlock();  // creating endpoints calls back
  std::vector<std::pair<AgentId, wire::InformationWriter>> created;
  for (const auto& [member, agent] : new_writers) {
    created.emplace_back(agent, wire::InformationWriter(
                                    participant_, agent,
                                    [this, id = agent](std::size_t n) {
                                      guarded([&] {
                                        readers_of_[id] = n;
                                        greeted_ = false;
                                        greet_again_ = kGreetSoon;
                                        wake_.notify_one();
                                      });
                                    },
                                    window, delivery_));
  }
  std::optional<wire::InformationReader> listening;
  if (!wanted.empty()) {
    listening.emplace(
        participant_, wildcard ? std::vector<AgentId>{} : wanted, [this](wire::InformationReader::Burst& burst) { on_information(burst); },
        delivery_);
  }
  lock.lock();
  for (auto& [agent, writer] : created) information_.emplace(agent, std::move(writer));
  if (listening) information_readers_.push_back(std::move(*listening));
  for (std::size_t m = 0; m < members_.size(); ++m) {
    const auto writer = information_.find(members_[m].agent);
    if (writer != information_.end()) outlet_[m] = &writer->second;
  }
}

/// Creates the ends of the closed loop, if there is one and an earlier run of the session did not.
void Node::meet_plant(Lock& lock) {
  const Assignment& run = parts_.begin()->second;
  if (!run.plant) return;
  const std::uint32_t process = options_.agents.front().value;
  const bool steers = run.steers;
  const Round window = run.window;
  lock.unlock();  // creating endpoints calls back
  if (!measurements_)
    measurements_.emplace(
        participant_, process, [this](const Measurement& measurement) { on_measurement(measurement); }, delivery_);
  std::optional<wire::ActuationWriter> created;
  if (steers && !actuations_) {
    created.emplace(
        participant_, process,
        [this](std::size_t n) {
          guarded([&] {
            plant_found_ = n > 0;
            greeted_ = false;
            greet_again_ = kGreetSoon;
            wake_.notify_one();
          });
        },
        window, delivery_);
  }
  lock.lock();
  if (created) actuations_.emplace(std::move(*created));
}

/// Everybody who reads us from the start has been found; where somebody is gone, who is left can only be tried.
bool Node::may_greet() const {
  if (!rounds_ || (information_.empty() && !actuations_) || (actuations_ && !plant_found_)) return false;
  if (!gone_.empty()) return true;
  return std::all_of(members_.begin(), members_.end(), [&](const MemberTask& member) {
    const auto readers = readers_of_.find(member.agent);
    return member.remote_readers == 0 || (readers != readers_of_.end() && readers->second >= member.remote_readers);
  });
}

void Node::greet() {
  greeted_ = true;
  for (auto& [agent, writer] : information_) writer.write(kGreeting, 0, {});
  if (actuations_) actuations_->write({kGreeting, options_.agents.front().value, 0, {}});
}

/// No round of ours is granted yet, or not yet the first round of somebody who will read us. (A grant alone says nothing: who joins is
/// still told the newest of the rounds before it.)
bool Node::greeting_needed() const {
  if (!rounds_ || (information_.empty() && !actuations_)) return false;
  return std::any_of(members_.begin(), members_.end(), [until = rounds_->hosted().granted_until()](const MemberTask& member) {
    return member.presence.from >= until || (!member.late_readers.empty() && member.late_readers.back() >= until);
  });
}

/// Rounds below this one may be granted as far as this process is concerned: everybody it hears by then has greeted it, everybody who
/// reads it from the start has been found, and so has the plant. 0: not even the first.
Round Node::met_until() const {
  if (!rounds_) return 0;
  const Assignment& run = parts_.begin()->second;
  if ((!information_.empty() || actuations_) && !may_greet()) return 0;
  if (run.plant && !plant_greeted_us_) return 0;
  Round until = std::numeric_limits<Round>::max();
  Round first = until;  // of this process
  for (const MemberTask& member : members_) first = std::min(first, member.presence.from);
  for (const MemberTask& member : members_) {
    for (const Told& told : member.told) {
      const auto announced = announced_.find(told.from);
      const bool here = std::binary_search(options_.agents.begin(), options_.agents.end(), told.from);
      if (here || gone_.contains(told.from) || (announced != announced_.end() && announced->second.epoch == epoch_)) continue;
      if (told.since <= first) return 0;
      until = std::min(until, told.since);
    }
  }
  if (greeted_by_.size() == heard_remotely_.size()) return until;
  for (const AgentId agent : heard_remotely_) {
    if (greeted_by_.contains(agent) || gone_.contains(agent)) continue;
    const auto joining = run.joining.find(agent);
    if (joining == run.joining.end() || joining->second <= first) return 0;
    until = std::min(until, joining->second);
  }
  return until;
}

/// Why met_until() says 0, for a person.
std::string Node::unmet() const {
  if (!rounds_) return "has no assignment yet";
  const Assignment& run = parts_.begin()->second;
  std::string text;
  const auto add = [&text](const std::string& what) { text += (text.empty() ? "" : ", ") + what; };
  for (const MemberTask& member : members_) {
    const auto readers = readers_of_.find(member.agent);
    const std::size_t found = readers == readers_of_.end() ? 0 : readers->second;
    if (gone_.empty() && found < member.remote_readers)
      add("has found " + std::to_string(found) + " of " + counted(member.remote_readers, "reader") + " of agent " +
          std::to_string(member.agent.value));
    for (const Told& told : member.told)
      if (!announced_.contains(told.from)) add("lacks the announcement of agent " + std::to_string(told.from.value));
  }
  for (const AgentId agent : heard_remotely_)
    if (!greeted_by_.contains(agent) && !gone_.contains(agent)) add("is not greeted by agent " + std::to_string(agent.value));
  if (actuations_ && !plant_found_) add("has not found the plant");
  if (run.plant && !plant_greeted_us_) add("is not greeted by the plant");
  return text;
}

void Node::send_reports(Lock& lock, bool last) {
  wire::Telemetry telemetry{options_.agents.front().value,    *epoch_, last, {}, {}, participant_.take_refusals(),
                            rounds_->hosted().slowest().round};
  if (last || rounds_->whole_report_due()) telemetry.links = rounds_->hosted().links();
  telemetry.members = rounds_->collect_reports();
  const auto silent = [](const MemberReport& report) { return report.rounds.empty(); };
  const bool nothing = std::all_of(telemetry.members.begin(), telemetry.members.end(), silent) && telemetry.refusals.empty();
  if (delivery_ && !last && nothing) return;
  if (last) telemetry.network = rounds_->network();
  if (last) telemetry.performance = performance();
  lock.unlock();
  telemetry_.write(telemetry);
  lock.lock();
}

wire::ReaderEvents Node::reader_events() const {
  wire::ReaderEvents events;
  for (const wire::InformationReader& reader : information_readers_) events = events + reader.events();
  return measurements_ ? events + measurements_->events() : events;
}

Performance Node::performance() const {
  Performance performance = usage(options_.agents.front().value);
  if (pacer_) pacer_->tell(performance);
  performance.missed_inputs = rounds_->missed_inputs();
  performance.sent_again_bytes = presence_.sent_again_bytes() + layouts_.sent_again_bytes() + telemetry_.sent_again_bytes();
  for (const auto& [agent, writer] : information_) performance.sent_again_bytes += writer.sent_again_bytes();
  if (actuations_) performance.sent_again_bytes += actuations_->sent_again_bytes();
  const wire::ReaderEvents events = reader_events() - events_before_;
  performance.dds_deadlines_missed = events.deadlines_missed;
  performance.liveliness_lost = events.liveliness_lost;
  return performance;
}

/// All agents here have left the run: says the last word, sees that it arrives, and ends.
void Node::take_leave(Lock& lock) {
  // s; who died without a word still counts as a reader, and acknowledges nothing
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(options_.lossy ? 10 : 1);
  const auto let_arrive = [end](auto& writer) {
    const std::chrono::duration<double> left = end - std::chrono::steady_clock::now();
    writer.wait_for_acknowledgments(std::max(left.count(), 0.0));
  };
  send_reports(lock, true);
  lock.unlock();
  let_arrive(telemetry_);  // first, as whoever reads it is alive
  for (auto& [agent, writer] : information_) let_arrive(writer);
  if (announcements_) let_arrive(*announcements_);
  if (actuations_) let_arrive(*actuations_);
  lock.lock();
}

void Node::announce(Lock& lock, wire::State state, const std::string& note) {
  wire::Presence presence;
  presence.process = options_.agents.front().value;
  presence.epoch = epoch_.value_or(0);
  presence.state = state;
  presence.pid = static_cast<std::uint64_t>(getpid());
  presence.host = host_;
  presence.agents = options_.agents;
  presence.note = note;
  if (state == wire::State::status && met_until() == 0) {
    presence.note = unmet();
  } else if (rounds_) {
    auto slowest = rounds_->hosted().slowest();
    presence.round = slowest.round;
    presence.waiting_agent = slowest.agent;
    presence.waiting_for = std::move(slowest.waiting_for);
    if (slowest.for_measurement && state == wire::State::status) presence.note = "waits for its measurement";
    if (presence.waiting_for.size() > 32) presence.waiting_for.resize(32);
  }
  if (state == wire::State::ready) presence.round = ready_until_;
  constexpr std::array kWords{"hello", "met the neighbours", "asked for status", "failed", "leaving"};
  spdlog::info("epoch {}: {}{}", presence.epoch, kWords[static_cast<std::size_t>(state)], note.empty() ? "" : ": " + note);
  lock.unlock();
  presence_.write(presence);
  lock.lock();
}

}  // namespace consort
