// What the agent process reads and writes: opened when a run needs it, kept for the runs after it.

#include "agent/node.hpp"
#include "protocols/registry.hpp"

#include <algorithm>
#include <chrono>

namespace consort {

// Creates the Information endpoints this run needs and earlier runs of the session did not; `senders` are those nobody here has heard yet.
void Node::open_information(Lock& lock, const std::vector<AgentId>& senders) {
  std::vector<AgentId> heard_elsewhere;
  for (const MemberTask& member : members_)
    if (member.remote_readers + member.late_readers.size() > 0 && !information_.contains(member.agent))
      heard_elsewhere.push_back(member.agent);
  const bool everybody = hears_everybody(senders);
  outlet_.assign(members_.size(), nullptr);
  lock.unlock();  // creating endpoints calls back
  std::map<AgentId, wire::InformationWriter> created;
  for (const AgentId agent : heard_elsewhere) {
    const auto on_matched = [this, agent](std::size_t readers) {
      guarded([&] {
        meeting_.found_readers(agent, readers);
        greet_anew();
      });
    };
    created.emplace(agent, wire::InformationWriter(participant_, agent, on_matched, delivery_));
  }
  std::optional<wire::InformationReader> listening;
  if (!senders.empty())
    listening.emplace(
        participant_, everybody ? std::vector<AgentId>{} : senders,
        [this](wire::InformationReader::Burst& burst) { on_information(burst); }, delivery_);
  lock.lock();
  information_.merge(created);
  if (listening) information_readers_.push_back(std::move(*listening));
  for (std::size_t m = 0; m < members_.size(); ++m) {
    const auto writer = information_.find(members_[m].agent);
    if (writer != information_.end()) outlet_[m] = &writer->second;
  }
}

// Creates the ends of the closed loop, if there is one and an earlier run of the session did not.
void Node::open_loop(Lock& lock) {
  const Assignment& run = assignment();
  if (!run.plant) return;
  const bool steers = run.steers;
  lock.unlock();  // creating endpoints calls back
  if (!measurements_)
    measurements_.emplace(
        participant_, process_, [this](const Measurement& measurement) { on_measurement(measurement); }, delivery_);
  std::optional<wire::ActuationWriter> created;
  if (steers && !actuations_) {
    const auto on_matched = [this](std::size_t readers) {
      guarded([&] {
        meeting_.found_plant(readers > 0);
        greet_anew();
      });
    };
    created.emplace(participant_, process_, on_matched, delivery_);
  }
  lock.lock();
  if (created) actuations_.emplace(std::move(*created));
}

// Where what is lost is asked for: tells those that earlier runs did not hear, and is told by those that hear us.
void Node::open_standings(Lock& lock, const std::vector<AgentId>& senders) {
  if (delivery_) return;
  const Assignment& run = assignment();
  wire::Senders whom, we;
  whom.every_agent = hears_everybody(senders);
  if (!whom.every_agent) whom.agents = senders;
  whom.plant = run.plant && !std::exchange(asks_plant_, asks_plant_ || run.plant);
  if (standing_readers_.empty()) we.agents = agents_;
  if (run.steers && !std::exchange(answers_plant_, true)) we.processes = {process_};
  lock.unlock();  // creating endpoints calls back
  std::optional<wire::StandingWriter> telling;
  if (!senders.empty() || whom.plant) telling.emplace(participant_, whom);
  std::optional<wire::StandingReader> told;
  if (!we.agents.empty() || !we.processes.empty()) told.emplace(participant_, we, [this](Standing&& standing) { on_standing(standing); });
  lock.lock();
  if (telling) standings_.push_back(std::move(*telling));
  if (told) standing_readers_.push_back(std::move(*told));
}

// Where agents announce themselves: creates the endpoints for it, once, and takes up what has been heard ahead of this run.
void Node::open_announcements(Lock& lock) {
  to_pass_on_.clear();
  if (!find_protocol(assignment().protocol).announces) return;
  const std::vector<AgentId> heard = meeting_.heard();
  const bool first = !announcements_;
  lock.unlock();  // creating endpoints calls back
  if (first) announcements_.emplace(participant_, agents_);
  std::optional<wire::AnnouncementReader> listening;
  if (first && !heard.empty()) listening.emplace(participant_, heard, [this](Layouts&& layouts) { on_announcement(std::move(layouts)); });
  lock.lock();
  if (listening) announcement_readers_.push_back(std::move(*listening));
  for (const auto& [agent, layouts] : announced_)
    if (layouts.epoch == epoch_) learn(layouts);
}

void Node::greet() {
  for (auto& [agent, writer] : information_) writer.write(kGreeting, 0, {});
  if (actuations_) actuations_->write({kGreeting, process_, 0, {}});
}

wire::ReaderEvents Node::reader_events() const {
  wire::ReaderEvents events;
  for (const wire::InformationReader& reader : information_readers_) events = events + reader.events();
  return measurements_ ? events + measurements_->events() : events;
}

std::uint64_t Node::sent_again_bytes() const {
  std::uint64_t bytes = layouts_.sent_again_bytes();
  for (const auto& [agent, writer] : information_) bytes += writer.sent_again_bytes();
  if (rounds_) bytes += rounds_->sent_again_bytes();
  return actuations_ ? bytes + actuations_->sent_again_bytes() : bytes;
}

// All agents here have left the run, that has been said, and nobody can lack a message of theirs: sees that the last word arrives.
void Node::leave(Lock& lock) {
  // s; who died without a word still counts as a reader, and acknowledges nothing
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(options_.lossy ? 10 : 1);
  const auto let_arrive = [end](auto& writer) {
    const std::chrono::duration<double> left = end - std::chrono::steady_clock::now();
    writer.wait_for_acknowledgments(std::max(left.count(), 0.0));
  };
  lock.unlock();
  let_arrive(telemetry_);  // first, as whoever reads it is alive
  if (announcements_) let_arrive(*announcements_);
  if (delivery_ && delivery_->reliable) {
    for (auto& [agent, writer] : information_) let_arrive(writer);
    if (actuations_) let_arrive(*actuations_);
  }
  lock.lock();
}

}  // namespace consort
