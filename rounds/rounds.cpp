#include "rounds/rounds.hpp"

#include "rounds/lockstep.hpp"
#include "rounds/realtime.hpp"

namespace consort {

std::unique_ptr<Rounds> rounds_of(const Assignment& run, std::span<const MemberTask> tasks, Send send, Act act, Tell tell) {
  if (run.realtime) return std::make_unique<Realtime>(run, tasks, std::move(send), std::move(act));
  return std::make_unique<Lockstep>(run, tasks, std::move(send), std::move(act), std::move(tell));
}

}  // namespace consort
