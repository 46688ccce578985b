#pragma once
/// Everything between "bytes arrived" and "the algorithm sees its inbox": waiting room for what is early, duplicates, order,
/// and the link's loss, delay and noise. Both drivers use it; it knows no transport and no clock.

#include "core/graph.hpp"
#include "core/layout.hpp"
#include "core/link.hpp"

#include <memory>
#include <span>
#include <vector>

namespace consort {

/// One message as the algorithm sees it.
struct Received {
  AgentId from;
  Round sent = 0;                    ///< round in which it was emitted (earlier than the current one if the link delays)
  double weight = 1.0;               ///< w_ij of the edge in the round of emission
  std::span<const double> payload;   ///< valid until the next call of a non-const Mailbox function
};
/// Ascending by sender; at most one message per sender (the newest one due; an older one due in the same round is superseded).
using Inbox = std::span<const Received>;

struct LinkCounters {
  std::uint64_t delivered = 0, lost = 0;
};

class Mailbox {
 public:
  enum class Post { accepted, duplicate, stale, too_early, unknown_sender, wrong_size };

  /// `senders`: every agent that may ever be an in-neighbour, ascending. `window`: how far ahead of this agent a sender may be, rounds.
  Mailbox(AgentId self, std::vector<AgentId> senders, const Layout& layout, const LinkModel& links, Seed seed, Round window);

  /// Takes a copy of what `from` emitted in round `sent`. Order of calls never matters. No allocation in steady state.
  Post post(AgentId from, Round sent, std::span<const double> payload);

  /// Is the message that `from` emitted in round `sent` here?
  [[nodiscard]] bool heard(AgentId from, Round sent) const;
  [[nodiscard]] std::size_t missing(Round k, std::span<const Neighbour> in_neighbours) const;   ///< how many of round k are not here yet

  /// Closes round k (called for k = 0, 1, 2, ... in order): every message of round k from `in_neighbours` must have been posted; the links
  /// then decide. Returns what is due in round k. Messages of round k from others are discarded.
  Inbox take(Round k, std::span<const Neighbour> in_neighbours);

  /// The same for a driver that holds the round's messages itself: `payload_of(index_of(j))` instead of posted copies. Inline, no copy on an ideal link.
  template <class PayloadOf>
  Inbox take_from(Round k, std::span<const Neighbour> in_neighbours, PayloadOf&& payload_of);

  [[nodiscard]] LinkCounters counters() const;                    ///< over all links
  [[nodiscard]] LinkCounters counters(AgentId from) const;
  [[nodiscard]] std::span<const AgentId> senders() const;
};

}  // namespace consort
