#include "orchestrator/run/pacing.hpp"

#include <algorithm>
#include <cmath>

namespace consort {
namespace {

constexpr double kToldAhead = 2.0;    // s: how far ahead the graphs are told
constexpr double kJoinLead = 1.0;     // s: a process is started so long before its first round,
constexpr double kAfterDeath = 0.05;  // s: but after the end of the one before it
constexpr std::size_t kMostGraphs = 4096;

Round end_before(const Attendance& presence, const Attendance& stay) {
  Round end = 0;
  for (const Attendance& other : presence.stays())
    if (other.until <= stay.from) end = other.until;
  return end;
}

}  // namespace

Pacing::Pacing(const Experiment& experiment, Seed seed, std::uint32_t epoch, std::uint64_t start_ns, double last_reports)
    : experiment_(experiment), epoch_(epoch), start_ns_(start_ns), last_reports_(last_reports), schedule_(experiment.schedule(seed)) {}

std::optional<Grant> Pacing::graphs(double elapsed) {
  const double rounds = elapsed / experiment_.dt, most = experiment_.rounds;
  const Round now = rounds <= 0.0 ? 0 : static_cast<Round>(std::min(rounds, most));
  const auto ahead = [&](double seconds) { return static_cast<Round>(std::min(now + std::ceil(seconds / experiment_.dt) + 1.0, most)); };
  if (granted_ >= ahead(kToldAhead / 2.0)) return std::nullopt;
  granted_ = ahead(kToldAhead);
  Grant grant{epoch_, granted_, 0, {}, start_ns_};
  for (Round k = now; k < granted_;) {
    const Schedule::Segment segment = schedule_.segment(k);
    grant.segments.push_back({k, static_cast<std::uint32_t>(grant.segments.size() % kMostGraphs), segment.graph->edges()});
    if (segment.last >= granted_) break;
    k = segment.last + 1;
  }
  return grant;
}

std::vector<Fault> Pacing::faults(double elapsed) {
  std::vector<Fault> due;
  for (; next_fault_ < experiment_.faults.size(); ++next_fault_) {
    const Fault& fault = experiment_.faults[next_fault_];
    if (elapsed < fault.round * experiment_.dt) break;
    if (fault.kind == Fault::Kind::kill || fault.kind == Fault::Kind::stop) due.push_back(fault);
  }
  return due;
}

std::vector<Pacing::Call> Pacing::calls(double elapsed) {
  std::vector<Call> due;
  for (const auto& [agent, presence] : experiment_.presence)
    for (const Attendance& stay : presence.stays()) {
      const double start = std::max(stay.from * experiment_.dt - kJoinLead, end_before(presence, stay) * experiment_.dt + kAfterDeath);
      if (stay.from == 0 || elapsed < start || elapsed >= stay.until * experiment_.dt) continue;
      due.push_back({agent, stay.from, called_.emplace(stay.from, agent).second});
    }
  return due;
}

}  // namespace consort
