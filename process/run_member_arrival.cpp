// How a process comes into its run, and what it does when that is lost.

#include "core/errors.hpp"
#include "process/run_member.hpp"

#include <spdlog/spdlog.h>

namespace consort {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kSecondThought{2};  // an orchestrator that is not ours may be a stranger beside ours
constexpr std::chrono::milliseconds kAskEvery{500};

}  // namespace

// Says hello until the orchestrator has answered: who is not launched may be one too many, and does nothing before. False: it is to end.
// Throws RunError saying why if the run does not want this process, TimeoutError if there is no run for so long.
bool RunMember::join_run(Lock& lock) {
  say(lock, wire::State::hello);
  if (arrival_.launched) return true;
  const auto begin = Clock::now();
  auto logged = begin;
  auto objected = Clock::time_point::max();  // since when
  const auto seconds = [&] {
    return std::to_string(std::chrono::duration_cast<std::chrono::seconds>(Clock::now() - begin).count()) + " s";
  };
  while (!welcomed_) {
    wake_.wait_for(lock, kAskEvery, [&] { return welcomed_ || failure_ || shutdown_ || interrupted_ || !refusal_.empty(); });
    if (failure_) std::rethrow_exception(failure_);
    if (shutdown_ || interrupted_) return false;
    if (!refusal_.empty()) throw RunError("the run refuses this process: " + refusal_);
    if (welcomed_) break;
    if (orchestrator_writers_ > 0) {
      say(lock, wire::State::hello);  // the answer was lost, or is on its way
      continue;
    }
    const std::string objection = objection_to_orchestrators();
    objected = objection.empty() ? Clock::time_point::max() : std::min(objected, Clock::now());
    if (!objection.empty() && Clock::now() - objected > kSecondThought) throw RunError(objection);
    if (arrival_.wait > 0.0 && Clock::now() - begin > std::chrono::duration<double>(arrival_.wait))
      throw TimeoutError(
          "met nobody in " + seconds() + "; looked for " + arrival_.sought +
          ": do name, domain and interface agree with what `consort run --external` has printed? (--wait: how long to look; a run without "
          "--external meets nobody from outside)");
    if (Clock::now() - logged > std::chrono::duration<double>(arrival_.log_every)) {
      logged = Clock::now();
      spdlog::info("has met nobody for {}; looks for {}", seconds(), arrival_.sought);
    }
  }
  return true;
}

// Who would have waited for its run for ever will meet the next one, once somebody starts it again: its exit code says so.
void RunMember::lose_orchestrator() const {
  constexpr const char* kText = "the orchestrator disappeared: no sign of life for as long as its run allows (transport.silence)";
  if (arrival_.wait == 0.0) throw TimeoutError(kText);
  throw RunError(kText);
}

// Why those that look like this run's orchestrator are not: they have another key, or are of another build. Whoever has been welcomed
// does not ask any more, so no stranger can end it.
std::string RunMember::objection_to_orchestrators() const {
  for (const Refusal& refusal : participant_.refusals()) {
    if (refusal.topic != wire::kCommandTopic) continue;
    const std::string who = "the orchestrator of this run, " + refusal.who + ", ";
    if (refusal.reason == Refusal::Reason::key)
      return who + "has another key: start this process with the CONSORT_KEY that `consort run` has printed or was given";
    if (refusal.reason == Refusal::Reason::build)
      return who + "does not understand this process, which is " + wire::Build::own().text() + ": install the same build on both";
  }
  return {};
}

}  // namespace consort
