#include "plant/node.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>

namespace consort {
namespace {

constexpr std::uint32_t kPlant = 0;  // its name among the processes

}  // namespace

PlantNode::PlantNode(const wire::Participant& participant, const Meeting& meeting)
    : RunMember(participant, meeting),
      presence_(participant, liveliness_lease()),
      telemetry_(participant),
      assignments_(participant, [this](PlantAssignment&& part) { on_assignment(std::move(part)); }),
      grants_(participant, [this](Grant&& grant) { on_grant(std::move(grant)); }),
      commands_(
          participant, [this](wire::Command&& command) { on_command(command); }, [this](std::size_t n) { on_orchestrator(n); }) {}

void PlantNode::on_assignment(PlantAssignment&& part) {
  guarded([&] {
    if (part.epoch < newest_epoch_ || part.epoch == epoch_) return;  // of a run that is over or begun
    if (part.epoch > newest_epoch_) parts_.clear();
    newest_epoch_ = part.epoch;
    const std::uint32_t parts = part.parts;
    parts_[part.part] = std::move(part);
    assigned_ = parts_.size() == parts && epoch_ != newest_epoch_;
    if (assigned_) wake_.notify_one();
  });
}

void PlantNode::on_grant(Grant&& grant) {
  guarded([&] {
    if (!rounds_ || grant.epoch != epoch_ || finish_) return;
    granted_until_ = std::max(granted_until_, grant.until);
    if (delivery_) {
      if (!pacer_ && actuations_) events_before_ = actuations_->events();
      if (!pacer_) pacer_.emplace(grant.start_ns, dt_, 0, last_round_, std::vector{0.0}, [this](std::size_t, Round k) { beat(k); });
      return;
    }
    rounds_->grant(grant);
    rounds_->advance();
    if (rounds_->report_due()) wake_.notify_one();
  });
}

void PlantNode::beat(Round k) {
  guarded([&] {
    if (!rounds_ || finish_) return;
    rounds_->go_to(k);
  });
}

void PlantNode::on_actuation(const Actuation& actuation) {
  guarded([&] {
    if (actuation.epoch == kGreeting) {
      greeted_by_.insert(actuation.process);
      wake_.notify_one();
      return;
    }
    if (!rounds_ || actuation.epoch != epoch_ || finish_) return;
    rounds_->receive(actuation);
    rounds_->advance();
    if (rounds_->report_due()) wake_.notify_one();
  });
}

void PlantNode::depart(std::span<const AgentId> agents) {
  if (!rounds_) return;
  rounds_->depart(agents);
  rounds_->advance();
  wake_.notify_one();
}

/// Who comes back is alone in its process, so it names it.
void PlantNode::come_back(std::span<const AgentId> agents, Round round) {
  if (!rounds_) return;
  for (const AgentId agent : agents) greeted_by_.erase(agent.value);
  ready_until_ = std::min(ready_until_, round);
}

void PlantNode::run() {
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

void PlantNode::tell(const std::string& line) const { spdlog::info(line); }

void PlantNode::serve(Lock& lock) {
  while (true) {
    const auto has_work = [&] {
      return failure_ || shutdown_ || interrupted_ || orchestrator_lost_ || status_asked_ || assigned_ || (finish_ && !finished_) ||
             (rounds_ && !finish_ && rounds_->report_due()) || met_until() > ready_until_ || !greeted_;
    };
    // A match is announced a moment before the connection is complete, so a greeting can be lost: it is repeated until rounds are granted.
    if (pacer_) {
      if (!wake_.wait_for(lock, kReportEvery, has_work) && !finish_) send_reports(lock, false);
      if (somebody_joins()) greeted_ = false;
    } else if (!rounds_ || !somebody_joins())
      wake_.wait(lock, has_work);
    else if (!wait_or_greet(lock, has_work))
      greeted_ = false;
    if (failure_) std::rethrow_exception(failure_);
    if ((orphaned_ || orchestrator_lost_) && rounds_)
      for (const std::string& line : in_words(rounds_->collect_reports(true))) spdlog::warn(line);
    if (shutdown_ || interrupted_) return;
    if (orchestrator_lost_) lose_orchestrator();
    if (assigned_) begin_run(lock);
    if (!greeted_) greet();
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

void PlantNode::begin_run(Lock& lock) {
  lock.unlock();
  pacer_.reset();
  lock.lock();
  assigned_ = false;
  greet_again_ = kGreetSoon;
  epoch_ = newest_epoch_;
  ready_until_ = granted_until_ = 0;
  finish_ = finished_ = false;
  PlantAssignment run = std::move(parts_.begin()->second);
  for (auto at = std::next(parts_.begin()); at != parts_.end(); ++at) {
    PlantAssignment& part = at->second;
    run.agents.insert(run.agents.end(), part.agents.begin(), part.agents.end());
    run.process_of.insert(run.process_of.end(), part.process_of.begin(), part.process_of.end());
    std::move(part.task.parts.begin(), part.task.parts.end(), std::back_inserter(run.task.parts));
  }
  steered_ = run.steered;
  delivery_ = run.realtime ? std::optional(run.delivery) : std::nullopt;
  dt_ = run.task.dt;
  last_round_ = run.rounds;
  rounds_ = std::make_unique<PlantRounds>(run, [this](std::uint32_t process, Round round, std::span<const double> values) {
    measurements_.at(process).write({*epoch_, round, values});
  });
  spdlog::info("epoch {}: {} with {}, seed {}", *epoch_, run.task.model, counted(run.agents.size(), "agent"), run.task.seed.value);
  meet_agents(lock, largest_window(run.report_interval));
}

/// Creates the ends of the closed loop that earlier runs of the session did not.
void PlantNode::meet_agents(Lock& lock, Round window) {
  const std::vector<std::uint32_t> processes = rounds_->processes();
  lock.unlock();  // creating endpoints calls back
  if (!actuations_)
    actuations_.emplace(
        participant_, kPlant, [this](const Actuation& actuation) { on_actuation(actuation); }, delivery_);
  std::map<std::uint32_t, wire::MeasurementWriter> created;
  for (const std::uint32_t process : processes) {
    if (measurements_.contains(process)) continue;  // only this thread changes the map
    created.emplace(process, wire::MeasurementWriter(
                                 participant_, process,
                                 [this, name = process](std::size_t n) {
                                   guarded([&] {
                                     if (n > 0) {
                                       found_.insert(name);
                                     } else {
                                       found_.erase(name);
                                       greeted_by_.erase(name);  // whoever comes back has to greet again
                                     }
                                     greeted_ = false;
                                     greet_again_ = kGreetSoon;
                                     wake_.notify_one();
                                   });
                                 },
                                 window, delivery_));
  }
  lock.lock();
  measurements_.merge(created);
}

void PlantNode::greet() {
  greeted_ = true;
  for (const std::uint32_t process : found_) {
    const auto writer = measurements_.find(process);
    if (writer != measurements_.end()) writer->second.write({kGreeting, 0, {}});
  }
}

/// A process that takes part in a round which is not granted yet may still need a greeting.
bool PlantNode::somebody_joins() const {
  const std::vector<std::uint32_t>& all = rounds_->processes();
  return std::any_of(all.begin(), all.end(), [this](std::uint32_t process) {
    const Round next = rounds_->next(process);
    return next >= granted_until_ && next != kNever;
  });
}

/// Rounds below this one may be granted as far as the plant is concerned: every process that takes part by then has been found and has
/// greeted the plant. 0: not even the one it is in.
Round PlantNode::met_until() const {
  if (!rounds_) return 0;
  Round until = std::numeric_limits<Round>::max();
  for (const std::uint32_t process : rounds_->processes())
    if (!found_.contains(process) || (steered_ && !greeted_by_.contains(process))) until = std::min(until, rounds_->next(process));
  return until > rounds_->round() ? until : 0;
}

/// Why met_until() says 0, for a person.
std::string PlantNode::unmet() const {
  if (!rounds_) return "has no assignment yet";
  std::string text;
  for (const std::uint32_t process : rounds_->processes()) {
    if (rounds_->next(process) > rounds_->round()) continue;
    const bool found = found_.contains(process);
    if (found && (!steered_ || greeted_by_.contains(process))) continue;
    text += (text.empty() ? "" : ", ") + std::string(found ? "is not greeted by" : "has not found") + " the process of agent " +
            std::to_string(process);
  }
  return text;
}

void PlantNode::send_reports(Lock& lock, bool last) {
  wire::Telemetry telemetry{kPlant, *epoch_, last, rounds_->collect_reports(), {}, participant_.take_refusals(), rounds_->round()};
  if (last) telemetry.performance = performance();
  lock.unlock();
  telemetry_.write(telemetry);
  lock.lock();
}

Performance PlantNode::performance() const {
  Performance performance = usage(kPlant);
  if (pacer_) pacer_->tell(performance);
  performance.missed_inputs = rounds_->missed_inputs();
  performance.sent_again_bytes = presence_.sent_again_bytes() + telemetry_.sent_again_bytes();
  for (const auto& [process, writer] : measurements_) performance.sent_again_bytes += writer.sent_again_bytes();
  if (actuations_) {
    const wire::ReaderEvents events = actuations_->events() - events_before_;
    performance.dds_deadlines_missed = events.deadlines_missed;
    performance.liveliness_lost = events.liveliness_lost;
  }
  return performance;
}

void PlantNode::announce(Lock& lock, wire::State state, const std::string& note) {
  wire::Presence presence;
  presence.process = kPlant;
  presence.epoch = epoch_.value_or(0);
  presence.state = state;
  presence.pid = static_cast<std::uint64_t>(getpid());
  std::array<char, 64> host{};
  gethostname(host.data(), host.size() - 1);
  presence.host = host.data();
  presence.note = note;
  if (state == wire::State::status && met_until() == 0) {
    presence.note = unmet();
  } else if (rounds_) {
    presence.round = rounds_->round();
    const auto [agent, missing] = rounds_->progress();
    if (state == wire::State::status && missing > 0)
      presence.note = "waits in round " + std::to_string(presence.round) + " for the actuation of " + counted(missing, "process") +
                      (missing == 1 ? ", that of agent " : ", one that of agent ") + std::to_string(agent.value);
  }
  if (state == wire::State::ready) presence.round = ready_until_;
  constexpr std::array kWords{"hello", "met the agents", "asked for status", "failed", "leaving"};
  spdlog::info("epoch {}: {}{}", presence.epoch, kWords[static_cast<std::size_t>(state)],
               presence.note.empty() ? "" : ": " + presence.note);
  lock.unlock();
  presence_.write(presence);
  lock.lock();
}

}  // namespace consort
