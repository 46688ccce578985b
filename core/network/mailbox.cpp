#include "core/network/mailbox.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

namespace consort {

Mailbox::Mailbox(AgentId self, std::vector<AgentId> senders, const Layout& layout, const LinkModel& links, Seed seed, Round window,
                 Round first)
    : senders_(std::move(senders)),
      delivered_(senders_.size()),
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
  make_lines(self, links, seed);
}

void Mailbox::make_lines(AgentId self, const LinkModel& links, Seed seed) {
  bool ideal = true;
  links.for_each([&](const LinkSpec& spec) { ideal = ideal && spec.ideal(); });
  if (ideal) return;
  ideal = true;
  bool disturbs = false;
  lines_.reserve(senders_.size());
  for (const AgentId from : senders_) {
    Line& line = lines_.emplace_back();
    for (const auto& [since, spec] : links.periods({from, self})) {
      const Link& link = line.links.emplace_back(since, Link({from, self}, spec, static_cast<Eigen::Index>(noise_size_), seed)).second;
      ideal = ideal && link.ideal();
      delays_ = delays_ || spec.delays() || spec.duplication > 0.0;
      disturbs = disturbs || link.disturbs();
    }
  }
  if (ideal) lines_ = {};
  counters_.resize(lines_.size());
  if (disturbs) disturbed_.resize(senders_.size() * size_);
}

double Mailbox::bytes_per_sender(const Layout& layout, const LinkModel& links) {
  constexpr double kAllocation = 16.0, kIdeal = sizeof(AgentId) + sizeof(std::uint64_t) + sizeof(Received);
  bool ideal = true, noisy = false;
  links.for_each([&](const LinkSpec& spec) {
    ideal = ideal && spec.ideal();
    noisy = noisy || spec.noise_covariance.size() > 0 || spec.quantiser;
  });
  if (ideal) return kIdeal;
  const auto noise = static_cast<double>(layout.noise_size);
  const double disturbed = noisy ? sizeof(double) * (static_cast<double>(layout.size()) + 2.0 * noise * noise) : 0.0;
  return kIdeal + sizeof(LinkCounters) + sizeof(Line) + sizeof(std::pair<Round, Link>) + kAllocation + disturbed;
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

std::optional<Received> Mailbox::take_late(const Neighbour& from, Round sent, std::span<const double> payload) {
  const std::uint32_t slot = slot_of(from.id);
  check(slot != kUnknown && payload.size() == size_ && sent < next_, "Mailbox::take_late: a message of a sender, whose round is over");
  inbox_.clear();
  if (lines_.empty())
    inbox_.push_back({from.id, sent, from.weight, payload});
  else
    cross(sent, from, slot, payload);
  if (inbox_.empty()) return std::nullopt;
  ++delivered_[slot];
  return inbox_.front();
}

void Mailbox::cross(Round k, const Neighbour& neighbour, std::size_t slot, std::span<const double> payload) {
  const Link& link = lines_[slot].at(k);
  if (link.lost(k, distances_.empty() ? 0.0 : distances_[slot])) {
    ++counters_[slot].lost;
    return;
  }
  if (link.disturbs()) {
    const std::span<double> copy = std::span(disturbed_).subspan(slot * size_, size_);
    std::copy(payload.begin(), payload.end(), copy.begin());
    link.disturb(k, copy.subspan(noise_offset_, noise_size_));
    payload = copy;
  }
  const Round late = link.delay(k);
  send(k, late, neighbour, slot, payload);
  if (const auto again = link.copy_delay(k)) {
    ++counters_[slot].duplicated;
    if (late == 0 && *again == 0)
      ++counters_[slot].superseded;
    else
      send(k, *again, neighbour, slot, payload);
  }
}

// On its way, or, if it is not late, into the inbox of round k.
void Mailbox::send(Round k, Round late, const Neighbour& neighbour, std::size_t slot, std::span<const double> payload) {
  if (late == 0) {
    inbox_.push_back({neighbour.id, k, neighbour.weight, payload});
    return;
  }
  const Round due = k + std::min(late, std::numeric_limits<Round>::max() - k);
  std::copy(payload.begin(), payload.end(), lines_[slot].in_flight.add(due, k, neighbour.weight, size_).begin());
}

// Completes the inbox of round k with what was under way until now, and counts.
void Mailbox::add_due(Round k) {
  if (delays_) {
    Lookup slot_of_next(*this);
    for (const Received& received : inbox_) lines_[slot_of_next(received.from)].at_once = true;
    due_.clear();
    for (std::size_t slot = 0; slot < lines_.size(); ++slot) {
      Line& line = lines_[slot];
      LinkCounters& counters = counters_[slot];
      std::uint64_t newest = line.at_once ? std::uint64_t{k} + 1 : line.newest;
      const auto message = line.in_flight.take(k, [&](Round sent) {
        if (std::uint64_t{sent} + 1 < line.newest) ++counters.reordered;
        ++counters.superseded;
        newest = std::max(newest, std::uint64_t{sent} + 1);
      });
      line.newest = newest;
      if (std::exchange(line.at_once, false) || !message) continue;
      --counters.superseded;  // the newest is handed on
      due_.push_back({senders_[slot], message->sent, message->weight, message->payload});
    }
    merged_.clear();
    std::set_union(inbox_.begin(), inbox_.end(), due_.begin(), due_.end(), std::back_inserter(merged_),
                   [](const Received& a, const Received& b) { return a.from < b.from; });
    inbox_.swap(merged_);
  }
  Lookup slot_of_next(*this);
  for (const Received& received : inbox_) ++delivered_[slot_of_next(received.from)];
}

LinkCounters Mailbox::counters_of(std::size_t slot) const {
  LinkCounters counters = counters_.empty() ? LinkCounters{} : counters_[slot];
  counters.delivered = delivered_[slot];
  return counters;
}

LinkCounters Mailbox::counters() const {
  LinkCounters total;
  for (std::size_t slot = 0; slot < senders_.size(); ++slot) total += counters_of(slot);
  return total;
}

LinkCounters Mailbox::counters(AgentId from) const {
  const std::uint32_t slot = slot_of(from);
  check(slot != kUnknown, "Mailbox::counters: not one of the senders");
  return counters_of(slot);
}

void Mailbox::refuse(AgentId from, Round k, const char* why) {
  throw ContractViolation("Mailbox: in round " + std::to_string(k) + " in-neighbour " + std::to_string(from.value) + ' ' + why);
}

}  // namespace consort
