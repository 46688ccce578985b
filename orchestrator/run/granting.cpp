#include "orchestrator/run/granting.hpp"

#include "core/errors.hpp"

#include <algorithm>

namespace consort {
namespace {

constexpr std::uint32_t kNumbers = 64;    // of graphs
constexpr double kFirstGrantRounds = 64;  // before the speed is known
constexpr double kGrantSeconds = 0.25;    // half a grant window, in wall-clock time: the report period, and how far a stop rule overshoots

Round round_up(double rounds, Round multiple) {
  const auto wanted = static_cast<Round>(std::clamp(rounds, 1.0, static_cast<double>(kLargestHalfWindow)));
  return (wanted + multiple - 1) / multiple * multiple;
}

bool comes_in(const std::vector<Attendance>& stays, Round round) {
  return std::any_of(stays.begin(), stays.end(), [round](const Attendance& stay) { return stay.from == round; });
}

}  // namespace

GrantedSegment GraphNumbers::segment(Round first, const std::shared_ptr<const Graph>& graph) {
  const auto known = std::find(graphs_.begin(), graphs_.end(), graph);
  if (known != graphs_.end()) return {first, static_cast<std::uint32_t>(known - graphs_.begin()), {}};
  const std::uint32_t number = next_++ % kNumbers;
  if (number >= graphs_.size()) graphs_.resize(number + 1);
  graphs_[number] = graph;
  return {first, number, graph->edges()};
}

Seconds time_until_proceed(const Experiment& experiment, const Fault& stop) {
  const auto proceed = std::find_if(experiment.faults.begin(), experiment.faults.end(), [&](const Fault& fault) {
    return fault.kind == Fault::Kind::proceed && fault.agent == stop.agent && fault.round > stop.round;
  });
  check(proceed != experiment.faults.end(), "every stop has its continue");
  return (proceed->round - stop.round) * experiment.dt;
}

Granting::Granting(const Experiment& experiment, Seed seed, std::uint32_t epoch)
    : experiment_(experiment), epoch_(epoch), schedule_(experiment.schedule(seed)), interval_(experiment.report_interval()) {}

Round Granting::next_pause() const {
  Round next = experiment_.rounds;
  const auto consider = [&](Round round) {
    if (round > paused_ && round < next) next = round;
  };
  for (const auto& [agent, presence] : experiment_.presence)
    for (const Attendance& stay : presence.stays()) consider(stay.from);
  for (const Fault& fault : experiment_.faults)
    if (fault.kind != Fault::Kind::proceed) consider(fault.round);
  return next;
}

std::optional<Granting::Pause> Granting::due(Round reached) {
  const Round round = next_pause();
  if (reached < round || round >= experiment_.rounds) return std::nullopt;
  paused_ = round;
  Pause pause{round, {}, false, {}};
  for (const Fault& fault : experiment_.faults)
    if (fault.round == round && (fault.kind == Fault::Kind::kill || fault.kind == Fault::Kind::stop)) pause.faults.push_back(fault);
  for (const auto& [agent, presence] : experiment_.presence) {
    pause.joins = pause.joins || comes_in(presence.stays(), round);
    if (comes_in(presence.again, round)) pause.back.push_back(agent);
  }
  return pause;
}

bool Granting::kills_at(Round round) const {
  return std::any_of(experiment_.faults.begin(), experiment_.faults.end(),
                     [round](const Fault& fault) { return fault.kind == Fault::Kind::kill && fault.round == round; });
}

Grant Granting::grant(Round reached, double seconds) {
  const Round pause = next_pause();
  const double speed = reached / std::max(seconds, 1e-6);
  half_ = round_up(reached == 0 ? kFirstGrantRounds : std::min(speed * kGrantSeconds, 4.0 * half_), interval_);
  const auto bounded = [pause](std::uint64_t k) { return static_cast<Round>(std::min<std::uint64_t>(k, pause)); };
  granted_ = std::max(granted_, bounded(std::uint64_t{reached} + 2 * std::uint64_t{half_}));
  report_at_ = bounded(std::uint64_t{reached} + half_);
  Grant grant{epoch_, granted_, report_at_, {}};
  while (stated_until_ < granted_) {
    const Schedule::Segment segment = schedule_.segment(stated_until_);
    grant.segments.push_back(graphs_.segment(stated_until_, segment.graph));
    stated_until_ = segment.last >= experiment_.rounds ? experiment_.rounds : segment.last + 1;
  }
  grant.whole = report_at_ == pause && kills_at(pause);
  grant.reached = told_reached_ = reached;
  return grant;
}

std::optional<Grant> Granting::release(Round reached) {
  const auto leaves = [&](const auto& each) {
    const std::vector<Attendance> stays = each.second.stays();
    return std::any_of(stays.begin(), stays.end(),
                       [&](const Attendance& stay) { return stay.until > told_reached_ && stay.until <= reached; });
  };
  if (std::none_of(experiment_.presence.begin(), experiment_.presence.end(), leaves)) return std::nullopt;
  told_reached_ = reached;
  return Grant{epoch_, granted_, report_at_, {}, 0, false, reached};
}

}  // namespace consort
