#include "plant/node.hpp"

#include "core/counted.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <iterator>

namespace consort {
namespace {

constexpr std::uint32_t kPlant = 0;  // its name among the processes

}  // namespace

PlantNode::PlantNode(const wire::Participant& participant, const Arrival& arrival)
    : RunMember(participant, arrival, kPlant, {}),
      assignments_(participant, [this](PlantAssignment&& part) { on_assignment(std::move(part)); }) {}

void PlantNode::on_assignment(PlantAssignment&& part) {
  guarded([&] {
    if (!outdated(part.epoch)) add_part(parts_, std::move(part));
  });
}

void PlantNode::run_rounds() {
  const Round before = rounds_->round();
  rounds_->advance();
  if (rounds_->round() != before) has_gone_on();
  if (rounds_->report_due()) wake_.notify_one();
}

void PlantNode::grant(const Grant& grant) {
  if (!rounds_) return;
  granted_until_ = std::max(granted_until_, grant.until);
  if (delivery_) return start_clock(grant, dt_, 0, last_round_, {0.0});
  rounds_->grant(grant);
  run_rounds();
}

void PlantNode::beat(std::size_t, Round k) { rounds_->begin_round(k); }

void PlantNode::on_actuation(const Actuation& actuation) {
  guarded([&] {
    if (actuation.epoch == kGreeting) {
      meeting_.greeted_by(actuation.process);
      wake_.notify_one();
    } else if (rounds_ && current(actuation.epoch)) {
      rounds_->receive(actuation);
      run_rounds();
    }
  });
}

void PlantNode::on_standing(const Standing& standing) {
  guarded([&] {
    if (!rounds_ || standing.epoch != epoch_) return;  // also when it has finished: who asks has not
    rounds_->answer(standing);
    if (current(*epoch_)) run_rounds();
  });
}

void PlantNode::depart(std::span<const AgentId> agents) {
  if (!rounds_) return;
  rounds_->depart(agents);
  rounds_->advance();
  wake_.notify_one();
}

void PlantNode::come_back(std::span<const AgentId> agents, Round) { meeting_.comes_back(agents); }

void PlantNode::begin_run(Lock& lock) {
  granted_until_ = 0;
  PlantAssignment run = std::move(parts_.begin()->second);
  for (auto at = std::next(parts_.begin()); at != parts_.end(); ++at) {
    PlantAssignment& part = at->second;
    run.agents.insert(run.agents.end(), part.agents.begin(), part.agents.end());
    run.process_of.insert(run.process_of.end(), part.process_of.begin(), part.process_of.end());
    std::move(part.task.parts.begin(), part.task.parts.end(), std::back_inserter(run.task.parts));
  }
  delivery_ = run.realtime ? std::optional(run.delivery) : std::nullopt;
  dt_ = run.task.dt;
  last_round_ = run.rounds;
  rounds_ = std::make_unique<PlantRounds>(
      run,
      [this](std::uint32_t process, Round round, std::span<const double> values) {
        measurements_.at(process).write({*epoch_, round, values});
      },
      [this](Standing&& standing) {
        has_asked();
        standing.epoch = *epoch_;
        standings_->write(standing);
      });
  meeting_.begin(rounds_->processes(), run.steered);
  spdlog::info("epoch {}: {} with {}, seed {}", *epoch_, run.task.model, counted(run.agents.size(), "agent"), run.task.seed.value);
  open_loop(lock);
}

// Creates the ends of the closed loop that earlier runs of the session did not.
void PlantNode::open_loop(Lock& lock) {
  const std::vector<std::uint32_t> processes = rounds_->processes();
  lock.unlock();  // creating endpoints calls back
  if (!actuations_)
    actuations_.emplace(
        participant_, kPlant, [this](const Actuation& actuation) { on_actuation(actuation); }, delivery_);
  std::map<std::uint32_t, wire::MeasurementWriter> created;
  for (const std::uint32_t process : processes) {
    if (measurements_.contains(process)) continue;  // only this thread changes the map
    const auto on_matched = [this, process](std::size_t readers) {
      guarded([&] {
        meeting_.found(process, readers > 0);
        greet_anew();
      });
    };
    created.emplace(process, wire::MeasurementWriter(participant_, process, on_matched, delivery_));
  }
  if (!delivery_ && !standings_) {
    standings_.emplace(participant_, wire::Senders{.processes = processes});
    standing_reader_.emplace(participant_, wire::Senders{.plant = true}, [this](Standing&& standing) { on_standing(standing); });
  }
  lock.lock();
  measurements_.merge(created);
}

void PlantNode::greet() {
  for (const std::uint32_t process : meeting_.found()) {
    const auto writer = measurements_.find(process);
    if (writer != measurements_.end()) writer->second.write({kGreeting, 0, {}});
  }
}

std::string PlantNode::unmet() const { return rounds_ ? meeting_.unmet(next(), rounds_->round()) : "has no assignment yet"; }

bool PlantNode::fill(wire::Telemetry& telemetry) {
  telemetry.members = rounds_->collect_reports();
  telemetry.round = rounds_->round();
  return true;
}

void PlantNode::describe(wire::Presence& presence) const {
  if (!rounds_) return;
  presence.round = rounds_->round();
  const auto [agent, missing] = rounds_->progress();
  if (presence.state == wire::State::status && missing > 0)
    presence.note = "waits in round " + std::to_string(presence.round) + " for the actuation of " + counted(missing, "process") +
                    (missing == 1 ? ", that of agent " : ", one that of agent ") + std::to_string(agent.value);
}

wire::ReaderEvents PlantNode::reader_events() const { return actuations_ ? actuations_->events() : wire::ReaderEvents{}; }

std::uint64_t PlantNode::sent_again_bytes() const {
  std::uint64_t bytes = rounds_ ? rounds_->sent_again_bytes() : 0;
  for (const auto& [process, writer] : measurements_) bytes += writer.sent_again_bytes();
  return bytes;
}

}  // namespace consort
