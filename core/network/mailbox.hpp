#pragma once
/// Everything between "bytes arrived" and "the algorithm sees its inbox": waiting room for what is early, duplicates, order,
/// and what the link does: loss, delay, copies, noise. All drivers use it; it knows no transport and no clock.

#include "core/counters.hpp"
#include "core/errors.hpp"
#include "core/layout.hpp"
#include "core/network/graph.hpp"
#include "core/network/in_flight.hpp"
#include "core/network/link.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace consort {

/// One message as the algorithm sees it.
struct Received {
  AgentId from;
  Round sent = 0;                   ///< round in which it was emitted (earlier than the current one if the link delays)
  double weight = 1.0;              ///< w_ij of the edge in the round of emission
  std::span<const double> payload;  ///< valid until the next call of a non-const Mailbox function
};
/// Ascending by sender; at most one message per sender (the newest one due; an older one due in the same round is superseded).
using Inbox = std::span<const Received>;

class Mailbox {
 public:
  enum class Post { accepted, duplicate, stale, too_early, unknown_sender, wrong_size };

  /// `senders`: every agent that may ever be an in-neighbour, ascending. `window`: how far ahead of this agent a sender may be, rounds.
  /// Throws ConfigError on a link that makes no sense (see Link).
  /// The first round to take is `first`.
  Mailbox(AgentId self, std::vector<AgentId> senders, const Layout& layout, const LinkModel& links, Seed seed, Round window,
          Round first = 0);

  /// About how many bytes there are in a mailbox for each of its senders.
  static double bytes_per_sender(const Layout& layout, const LinkModel& links);

  /// Takes a copy of what `from` emitted in round `sent`. Order of calls never matters. No allocation in steady state.
  /// `stale`: that round has been taken. `too_early`: more than `window` rounds ahead of the next round to take. `duplicate`: the first one
  /// is kept.
  Post post(AgentId from, Round sent, std::span<const double> payload);

  /// Is the message that `from` emitted in round `sent` here? False for a round that has been taken and for an unknown sender.
  [[nodiscard]] bool heard(AgentId from, Round sent) const {
    const std::size_t slot = slot_of(from);
    return slot != kUnknown && sent >= next_ && !rings_.empty() && rings_[slot].holds(sent);
  }
  [[nodiscard]] std::size_t missing(Round k, std::span<const Neighbour> in_neighbours) const;  ///< how many of round k are not here yet

  /// How far the senders are away in the round that is taken next, one number per sender. Without a call all are near.
  void set_distances(std::span<const double> distances) { distances_.assign(distances.begin(), distances.end()); }

  /// Closes round k (called for k = 0, 1, 2, ... in order): every message of round k from `in_neighbours` must have been posted; the links
  /// then decide. Returns what is due in round k. Messages of round k from others are discarded.
  Inbox take(Round k, std::span<const Neighbour> in_neighbours);

  /// A message whose round has been taken without it, but which may still be used: the link decides on it as ever. What it hands on at
  /// once is returned (valid until the next call of a non-const function), what it delays will be due.
  std::optional<Received> take_late(const Neighbour& from, Round sent, std::span<const double> payload);

  /// Rounds before k are over without having been taken.
  void skip(Round k) { next_ = std::max(next_, k); }

  /// The same for a driver that holds the round's messages itself: `payload_of(index_of(j))` instead of posted copies. Inline, no copy on
  /// an ideal link.
  template <class PayloadOf>
  Inbox take_from(Round k, std::span<const Neighbour> in_neighbours, PayloadOf&& payload_of) {
    return close(k, in_neighbours,
                 [&payload_of](AgentId from, std::size_t) -> std::span<const double> { return payload_of(index_of(from)); });
  }

  [[nodiscard]] LinkCounters counters() const;  ///< over all links
  [[nodiscard]] LinkCounters counters(AgentId from) const;
  [[nodiscard]] std::span<const AgentId> senders() const { return senders_; }

 private:
  static constexpr std::uint32_t kUnknown = std::numeric_limits<std::uint32_t>::max();

  /// Posted messages of one sender that wait for their round: a power of two of places, round r at r mod places. Grows when a sender runs
  /// ahead.
  struct Ring {
    std::vector<std::uint64_t> stamps;  // round + 1 of what lies there; 0: nothing yet
    std::vector<double> payloads;
    [[nodiscard]] std::size_t place(Round sent) const { return sent & (stamps.size() - 1); }
    [[nodiscard]] bool holds(Round sent) const { return !stamps.empty() && stamps[place(sent)] == std::uint64_t{sent} + 1; }
    void grow(Round next, Round sent, std::size_t size);
  };

  [[nodiscard]] std::uint32_t slot_of(AgentId from) const {
    // Where everybody may be a sender, an agent lies at its number, or, behind the agent itself, one before.
    for (const std::size_t at : {index_of(from), index_of(from) - 1})
      if (at < senders_.size() && senders_[at] == from) return static_cast<std::uint32_t>(at);
    const auto at = std::lower_bound(senders_.begin(), senders_.end(), from);
    return at != senders_.end() && *at == from ? static_cast<std::uint32_t>(at - senders_.begin()) : kUnknown;
  }
  /// Looks senders up one after the other, ascending: usually it is the very next.
  class Lookup {
   public:
    explicit Lookup(const Mailbox& mailbox) : mailbox_(mailbox) {}
    std::uint32_t operator()(AgentId from) {
      const auto& senders = mailbox_.senders_;
      const std::uint32_t slot = next_ < senders.size() && senders[next_] == from ? next_ : mailbox_.slot_of(from);
      next_ = slot + 1;
      return slot;
    }

   private:
    const Mailbox& mailbox_;
    std::uint32_t next_ = 0;
  };
  template <class PayloadOf>  // payload_of(sender, slot)
  Inbox close(Round k, std::span<const Neighbour> in_neighbours, const PayloadOf& payload_of);
  /// A sender's link as it changes over the rounds, and what has come over it.
  struct Line {
    std::vector<std::pair<Round, Link>> links;  // from which round on; ascending, the first from round 0
    std::size_t now = 0;
    std::uint64_t newest = 0;  // round + 1 of the newest message that has arrived; 0: none yet
    bool at_once = false;      // the message of the round being closed was not late
    InFlight in_flight;
    const Link& at(Round k) {
      while (now > 0 && links[now].first > k) --now;  // a late message
      while (now + 1 < links.size() && links[now + 1].first <= k) ++now;
      return links[now].second;
    }
  };
  void make_lines(AgentId self, const LinkModel& links, Seed seed);
  void cross(Round k, const Neighbour& neighbour, std::size_t slot, std::span<const double> payload);
  void send(Round k, Round late, const Neighbour& neighbour, std::size_t slot, std::span<const double> payload);
  void add_due(Round k);
  [[nodiscard]] LinkCounters counters_of(std::size_t slot) const;
  [[noreturn]] static void refuse(AgentId from, Round k, const char* why);

  std::vector<AgentId> senders_;          // by slot, ascending
  std::vector<std::uint64_t> delivered_;  // by slot
  std::vector<LinkCounters> counters_;    // by slot: all but `delivered`; empty if all links are ideal
  std::vector<Line> lines_;               // by slot; empty if all links are ideal
  bool delays_ = false;                   // some link delays or copies
  std::vector<double> distances_;         // by slot; empty: all are near
  std::vector<double> disturbed_;         // by slot: payloads with noise; empty if no link adds any
  std::vector<Ring> rings_;               // by slot; empty until the first post
  std::vector<Received> inbox_, due_, merged_;
  std::size_t size_;  // numbers in a payload
  std::size_t noise_offset_, noise_size_;
  Round window_;
  Round next_ = 0;  // the round to take next
};

template <class PayloadOf>
Inbox Mailbox::close(Round k, std::span<const Neighbour> in_neighbours, const PayloadOf& payload_of) {
  check(k == next_, "Mailbox: rounds are taken one after the other");
  ++next_;
  const bool ideal = lines_.empty();
  inbox_.resize(ideal ? in_neighbours.size() : 0);
  Received* received = inbox_.data();
  Lookup slot_of_next(*this);
  AgentId previous{0};
  for (const Neighbour& neighbour : in_neighbours) {
    if (neighbour.id <= previous) refuse(neighbour.id, k, "is out of order: in-neighbours are ascending");
    previous = neighbour.id;
    const std::uint32_t slot = slot_of_next(neighbour.id);
    if (slot == kUnknown) refuse(neighbour.id, k, "is not one of the senders");
    const std::span<const double> payload = payload_of(neighbour.id, slot);
    if (payload.size() != size_) refuse(neighbour.id, k, "has a message of the wrong size");
    if (ideal) {
      ++delivered_[slot];
      *received++ = {neighbour.id, k, neighbour.weight, payload};
    } else {
      cross(k, neighbour, slot, payload);
    }
  }
  if (!ideal) add_due(k);
  return inbox_;
}

}  // namespace consort
