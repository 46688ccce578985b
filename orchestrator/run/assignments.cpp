#include "orchestrator/run/assignments.hpp"

#include "core/network/announcements.hpp"
#include "orchestrator/run/ending.hpp"
#include "protocols/registry.hpp"

#include <algorithm>
#include <memory>
#include <utility>

namespace consort {
namespace {

constexpr std::size_t kMembersPerPart = 200;
constexpr std::size_t kLinksToldAlong = 10'000;  // of a run: so few cost nothing beside the reports they are told with

Delivery delivery_of(const Experiment& experiment) {
  constexpr double kDeadlineRounds = 3.0;
  const Transport& transport = experiment.transport;
  return {transport.reliable, transport.history, transport.lifespan.value_or(experiment.dt),
          transport.dds_deadline.value_or(kDeadlineRounds * experiment.dt), transport.liveliness_lease};
}

template <class Part>
void number(std::vector<Part>& parts) {
  for (std::size_t p = 0; p < parts.size(); ++p) {
    parts[p].part = static_cast<std::uint32_t>(p);
    parts[p].parts = static_cast<std::uint32_t>(parts.size());
  }
}

}  // namespace

Assignments::Assignments(const Experiment& experiment, const Placement& placement, const Job& job, std::uint32_t epoch)
    : experiment_(experiment),
      placement_(placement),
      job_(job),
      epoch_(epoch),
      maker_(experiment, experiment.protocols[job.protocol], job.seed) {
  if (find_protocol(protocol().name).announces) told_ = announcements(*placement.support, experiment.presence);
  const std::unique_ptr<Protocol> agent = maker_.make(agent_at(0));
  steers_ = experiment.plant && agent->control_size() > 0;
  outline_ = maker_.empty_trace(*agent);
  std::vector<std::size_t> heard(placement.processes.size());  // by process: agents of others
  for (const auto& readers : placement.readers)
    for (const std::size_t reader : readers) ++heard[reader];
  ahead_ = rounds_ahead(*std::max_element(heard.begin(), heard.end()), agent->message_layout().size());
}

Assignment Assignments::common(Round now, std::span<const AgentId> gone) const {
  Assignment common;
  common.epoch = epoch_;
  common.seed = job_.seed;
  common.protocol = protocol().name;
  common.agents = static_cast<std::uint32_t>(experiment_.agents);
  common.dt = experiment_.dt;
  common.rounds = experiment_.rounds;
  common.report_interval = experiment_.report_interval();
  common.window = largest_window(common.report_interval);
  common.ahead = ahead_;
  common.parameters = protocol().parameters;
  const LinkModel& links = experiment_.links_of(protocol());
  common.standard_link = links.standard;
  for (const LinkModel::Change& change : links.changes)
    if (!change.edge) common.link_changes.push_back(change);
  if (maker_.physics()) common.largest_state = static_cast<std::uint32_t>(maker_.physics()->state_layout().size());
  common.largest_control = static_cast<std::uint32_t>(maker_.largest_control());
  common.relays = need_relays(told_, *placement_.support, experiment_.presence);
  common.plant = experiment_.plant.has_value();
  common.steers = steers_;
  common.recorded = experiment_.recording.state;
  common.realtime = experiment_.mode == Mode::realtime;
  // A process may be gone before its last words.
  common.tells_links =
      common.realtime || experiment_.on_agent_loss == AgentLoss::go_on || placement_.support->edge_count() <= kLinksToldAlong;
  common.delivery = delivery_of(experiment_);
  for (const auto& [agent, presence] : experiment_.presence)
    if (!presence.holds(now)) common.joining.emplace(agent, presence.next(now));
  for (const AgentId agent : gone) common.joining[agent] = kNever;
  return common;
}

std::vector<Assignment> Assignments::agents(const std::function<bool(std::size_t process)>& meant, Round now,
                                            std::span<const AgentId> gone) const {
  const Assignment empty = common(now, gone);
  std::vector<Assignment> parts;
  for (std::size_t index = 0; index < experiment_.agents; ++index) {
    if (!meant(placement_.process_of[index])) continue;
    if (parts.empty() || parts.back().members.size() == kMembersPerPart) parts.push_back(empty);
    parts.back().members.push_back(member(agent_at(index), now));
  }
  number(parts);
  return parts;
}

MemberTask Assignments::member(AgentId agent, Round now) const {
  const std::size_t process = placement_.process_of[index_of(agent)];
  MemberTask member;
  member.agent = agent;
  member.process = placement_.processes[process].agents.front().value;
  member.initial = experiment_.initial_of(agent, job_.seed);
  if (const auto own = experiment_.overrides.find(agent); own != experiment_.overrides.end()) member.parameters = own->second.parameters;
  member.hears_everyone = hears_everyone(placement_, agent);
  if (!member.hears_everyone) {
    for (const Neighbour& neighbour : placement_.support->in_neighbours(agent)) member.in_neighbours.push_back(neighbour.id);
  }
  const std::vector<Attendance> stays = experiment_.presence_of(agent).stays();
  const auto stay = std::find_if(stays.begin(), stays.end(), [now](const Attendance& each) { return each.until > now; });
  member.presence = stay == stays.end() ? stays.back() : *stay;
  if (killed_in(experiment_, agent, member.presence.until)) member.presence.until = kNever;  // nobody knows the hour
  count_readers(member, now);
  if (const auto& physics = maker_.physics()) {
    member.model = physics->knowledge(agent);
    member.measurements = static_cast<std::uint32_t>(physics->measurement_size(agent));
    member.distances = static_cast<std::uint32_t>(physics->distance_count(agent));
  }
  if (!told_.empty()) member.told = told_[index_of(agent)];
  member.link_changes = experiment_.links_of(protocol()).changes_into(agent);
  return member;
}

// Which other processes read it, from its process's first round on or later.
void Assignments::count_readers(MemberTask& member, Round now) const {
  const std::size_t index = index_of(member.agent);
  const Round begins = std::max(now, placement_.processes[placement_.process_of[index]].presence.from);
  for (const std::size_t reader : placement_.readers[index])
    for (const Attendance& there : placement_.processes[reader].presence.stays()) {
      if (there.from > begins)
        member.late_readers.push_back(there.from);
      else if (there.until > begins)
        ++member.remote_readers;
    }
  std::sort(member.late_readers.begin(), member.late_readers.end());
}

/// The plant is the one sender of a process; the numbers of the largest one count.
Round Assignments::measured_ahead() const {
  std::vector<std::size_t> numbers(placement_.processes.size());
  for (std::size_t index = 0; index < experiment_.agents; ++index)
    numbers[placement_.process_of[index]] +=
        maker_.physics()->measurement_size(agent_at(index)) + maker_.physics()->distance_count(agent_at(index));
  return rounds_ahead(1, *std::max_element(numbers.begin(), numbers.end()));
}

std::vector<PlantAssignment> Assignments::plant() const {
  PlantTask task = plant_task(experiment_, job_.seed);
  std::vector<PlantPart> all = std::exchange(task.parts, {});
  std::vector<PlantAssignment> parts;
  for (std::size_t index = 0; index < all.size(); ++index) {
    if (parts.empty() || parts.back().agents.size() == kMembersPerPart) {
      PlantAssignment part;
      part.epoch = epoch_;
      part.rounds = experiment_.rounds;
      part.report_interval = experiment_.report_interval();
      part.ahead = measured_ahead();
      part.steered = steers_;
      part.realtime = experiment_.mode == Mode::realtime;
      part.delivery = delivery_of(experiment_);
      part.task = task;
      parts.push_back(std::move(part));
    }
    parts.back().agents.push_back(agent_at(index));
    parts.back().process_of.push_back(placement_.processes[placement_.process_of[index]].agents.front().value);
    parts.back().task.parts.push_back(std::move(all[index]));
  }
  number(parts);
  return parts;
}

}  // namespace consort
