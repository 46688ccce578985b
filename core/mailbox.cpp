#include "core/mailbox.hpp"

#include <algorithm>
#include <iterator>
#include <string>

namespace consort {

Mailbox::Mailbox(AgentId self, std::vector<AgentId> senders, const Layout& layout, const LinkModel& links, Seed seed, Round window,
                 Round first)
    : senders_(std::move(senders)),
      counters_(senders_.size()),
      size_(layout.size()),
      noise_offset_(layout.noise_offset),
      noise_size_(layout.noise_size),
      window_(window),
      next_(first) {
  check(noise_offset_ + noise_size_ <= size_, "Mailbox: the disturbed part lies within the message");
  check(senders_.size() < kUnknown, "Mailbox: too many senders");
  AgentId previous{0};
  for (const AgentId from : senders_) {
    check(from > previous && from != self, "Mailbox: senders are ascending, numbered from 1, and never the agent itself");
    previous = from;
  }
  slots_.assign(previous.value, kUnknown);
  for (std::uint32_t slot = 0; slot < senders_.size(); ++slot) slots_[index_of(senders_[slot])] = slot;

  bool ideal = true, delays = false, noisy = false;
  for (const AgentId from : senders_) {
    const LinkSpec& spec = links.of({from, self});
    if (spec.ideal() && ideal) continue;
    if (links_.empty()) {
      // The first link that is not ideal: from here on every sender has one.
      links_.reserve(senders_.size());
      for (const AgentId earlier : senders_) {
        if (earlier == from) break;
        links_.emplace_back(Edge{earlier, self}, LinkSpec{}, static_cast<Eigen::Index>(noise_size_), seed);
      }
      ideal = false;
    }
    const Link& link = links_.emplace_back(Edge{from, self}, spec, static_cast<Eigen::Index>(noise_size_), seed);
    delays = delays || spec.delay_rounds > 0;
    noisy = noisy || link.noisy();
  }
  if (std::all_of(links_.begin(), links_.end(), [](const Link& link) { return link.ideal(); })) links_.clear();
  if (delays) in_flight_.resize(senders_.size());
  if (noisy) disturbed_.resize(senders_.size() * size_);
}

void Mailbox::Ring::grow(Round next, Round sent, std::size_t size) {
  std::size_t places = std::max<std::size_t>(2, stamps.size());
  while (places <= sent - next) places *= 2;
  Ring wider{std::vector<std::uint64_t>(places, 0), std::vector<double>(places * size)};
  for (std::size_t old = 0; old < stamps.size(); ++old) {
    if (stamps[old] <= next) continue;  // empty, or of a round that has been taken
    const std::size_t moved = wider.place(static_cast<Round>(stamps[old] - 1));
    wider.stamps[moved] = stamps[old];
    std::copy_n(payloads.begin() + static_cast<std::ptrdiff_t>(old * size), size,
                wider.payloads.begin() + static_cast<std::ptrdiff_t>(moved * size));
  }
  *this = std::move(wider);
}

Mailbox::Post Mailbox::post(AgentId from, Round sent, std::span<const double> payload) {
  const std::uint32_t slot = slot_of(from);
  if (slot == kUnknown) return Post::unknown_sender;
  if (payload.size() != size_) return Post::wrong_size;
  if (sent < next_) return Post::stale;
  if (sent - next_ > window_) return Post::too_early;
  if (rings_.empty()) rings_.resize(senders_.size());
  Ring& ring = rings_[slot];
  if (sent - next_ >= ring.stamps.size()) ring.grow(next_, sent, size_);
  const std::size_t place = ring.place(sent);
  if (ring.stamps[place] == std::uint64_t{sent} + 1) return Post::duplicate;
  ring.stamps[place] = std::uint64_t{sent} + 1;
  std::copy(payload.begin(), payload.end(), ring.payloads.begin() + static_cast<std::ptrdiff_t>(place * size_));
  return Post::accepted;
}

std::size_t Mailbox::missing(Round k, std::span<const Neighbour> in_neighbours) const {
  return static_cast<std::size_t>(
      std::count_if(in_neighbours.begin(), in_neighbours.end(), [this, k](const Neighbour& neighbour) { return !heard(neighbour.id, k); }));
}

Inbox Mailbox::take(Round k, std::span<const Neighbour> in_neighbours) {
  return close(k, in_neighbours, [this, k](AgentId from, std::size_t slot) {
    if (rings_.empty() || !rings_[slot].holds(k)) refuse(from, k, "has not been heard");
    return std::span<const double>(rings_[slot].payloads).subspan(rings_[slot].place(k) * size_, size_);
  });
}

void Mailbox::cross(Round k, const Neighbour& neighbour, std::size_t slot, std::span<const double> payload) {
  const Link& link = links_[slot];
  if (link.lost(k)) {
    ++counters_[slot].lost;
    return;
  }
  const Round delay = link.delay(k);
  if (delay == 0 && !link.noisy()) {
    inbox_.push_back({neighbour.id, k, neighbour.weight, payload});
    return;
  }
  const Round due = k + std::min(delay, std::numeric_limits<Round>::max() - k);
  const std::span<double> copy =
      delay > 0 ? in_flight_[slot].add(due, k, neighbour.weight, size_) : std::span(disturbed_).subspan(slot * size_, size_);
  std::copy(payload.begin(), payload.end(), copy.begin());
  link.add_noise(k, copy.subspan(noise_offset_, noise_size_));
  if (delay == 0) inbox_.push_back({neighbour.id, k, neighbour.weight, copy});
}

/// Completes the inbox of round k with what was under way until now, and counts.
void Mailbox::add_due(Round k) {
  if (!in_flight_.empty()) {
    due_.clear();
    for (std::size_t slot = 0; slot < in_flight_.size(); ++slot) {
      if (const auto message = in_flight_[slot].take(k)) due_.push_back({senders_[slot], message->sent, message->weight, message->payload});
    }
    // Of equal senders the union keeps the first range's: a message of this round, newer than all that was under way.
    merged_.clear();
    std::set_union(inbox_.begin(), inbox_.end(), due_.begin(), due_.end(), std::back_inserter(merged_),
                   [](const Received& a, const Received& b) { return a.from < b.from; });
    inbox_.swap(merged_);
  }
  for (const Received& received : inbox_) ++counters_[slot_of(received.from)].delivered;
}

LinkCounters Mailbox::counters() const {
  LinkCounters total;
  for (const auto& [delivered, lost] : counters_) {
    total.delivered += delivered;
    total.lost += lost;
  }
  return total;
}

LinkCounters Mailbox::counters(AgentId from) const {
  const std::uint32_t slot = slot_of(from);
  check(slot != kUnknown, "Mailbox::counters: not one of the senders");
  return counters_[slot];
}

void Mailbox::refuse(AgentId from, Round k, const char* why) {
  throw ContractViolation("Mailbox: in round " + std::to_string(k) + " in-neighbour " + std::to_string(from.value) + ' ' + why);
}

}  // namespace consort
