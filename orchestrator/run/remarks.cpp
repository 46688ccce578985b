#include "orchestrator/run/remarks.hpp"

#include <algorithm>

namespace consort {
namespace {

std::string remark_on(const Refusal& refusal) {
  const std::string writer =
      "participant " + (refusal.writer.empty() ? "unknown" : refusal.writer) + (refusal.who.empty() ? std::string() : ", " + refusal.who);
  if (refusal.reason == Refusal::Reason::malformed)
    return "packets arrive that DDS cannot read: another program uses these ports, or somebody forges them; they are left out and counted";
  if (refusal.reason == Refusal::Reason::key)
    return refusal.who + " has another key than this run: start it with the CONSORT_KEY of this one; what it writes is left out";
  if (refusal.reason == Refusal::Reason::build)
    return refusal.who + " and does not understand this run, which is " + wire::Build::own().text() +
           ": install the same build on both; what it writes is left out";
  if (refusal.reason == Refusal::Reason::bound)
    return "samples of " + refusal.topic + " by " + writer + " break a bound of the wire (" + refusal.field + ") and are left out";
  return "a stranger takes part, who does not know the run's key: " + writer + "; what it writes, first to " + refusal.topic +
         ", is left out and counted";
}

}  // namespace

void Remarks::refused(std::vector<Refusal> refusals) {
  for (Refusal& refusal : refusals) {
    const auto known = std::find_if(refusals_.begin(), refusals_.end(), [&](const Refusal& each) { return each.same(refusal); });
    if (known != refusals_.end()) {
      known->samples += refusal.samples;
      continue;
    }
    const bool is_new = std::none_of(refusals_.begin(), refusals_.end(),
                                     [&](const Refusal& each) { return each.writer == refusal.writer && each.reason == refusal.reason; });
    if (is_new) add(remark_on(refusal));
    refusals_.push_back(std::move(refusal));
  }
}

void Remarks::let_in(const wire::Build& build, const std::string& who, const std::string& host) {
  const wire::Build own = wire::Build::own();
  if (own.same_sources(build) || !other_sources_.emplace(build.commit, host).second) return;
  add(who + " is built of commit " + build.commit + ", this run of " + own.commit +
      ": they understand each other, but may compute differently; build or install all programs together (others of that commit on that " +
      "host are not named)");
}

}  // namespace consort
