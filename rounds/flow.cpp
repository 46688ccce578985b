#include "rounds/flow.hpp"

#include <algorithm>
#include <iterator>

namespace consort {

void Flow::sent(std::size_t member, Round k, std::span<const AgentId> listeners, std::span<const double> message) {
  Sender& sender = members_[member];
  if (!std::equal(listeners.begin(), listeners.end(), sender.listeners.begin(), sender.listeners.end())) {
    sender.listeners.assign(listeners.begin(), listeners.end());
    std::vector<AgentId> audience;
    std::set_union(sender.audience.begin(), sender.audience.end(), listeners.begin(), listeners.end(), std::back_inserter(audience));
    sender.audience = std::move(audience);
  }
  Round needed = k;
  for (const AgentId reader : sender.audience) needed = std::min(needed, reached_[index_of(reader)]);
  sender.sent.forget_before(std::max(needed, k > window_ ? k - window_ : 0));
  sender.sent.push(k, message);
}

}  // namespace consort
