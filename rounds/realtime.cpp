#include "rounds/realtime.hpp"

#include <algorithm>

namespace consort {

Realtime::Realtime(const Assignment& run, std::span<const MemberTask> tasks, Send send, Act act)
    : rounds_(run.rounds),
      lifespan_(std::max<Round>(1, static_cast<Round>(run.delivery.lifespan / run.dt + 1e-6))),
      act_(run.steers ? std::move(act) : Act{}),
      hosted_(run, tasks, std::move(send)),
      listeners_(tasks.size()) {
  for (std::size_t member = 0; member < listeners_.size(); ++member)
    listeners_[member].incoming.resize(hosted_[member].mailbox().senders().size());
}

// The newest one counts. It is laid out for the members that were there in its round.
void Realtime::receive(const Measurement& measurement) {
  hosted_.check_length(measurement);
  std::size_t at = 0;
  for (std::size_t index = 0; index < hosted_.size(); ++index) {
    Member& member = hosted_[index];
    if (!member.attendance().holds(measurement.round)) continue;
    const std::span<const double> numbers = measurement.values.subspan(at, hosted_.numbers_from_plant(index));
    const std::span<const double> own = numbers.first(hosted_.measurements(index)), distances = numbers.subspan(own.size());
    at += numbers.size();
    Listener& listener = listeners_[index];
    if (measurement.round < listener.y_of) continue;
    if (!distances.empty()) member.mailbox().set_distances(distances);
    listener.y.assign(own.begin(), own.end());
    listener.y_of = measurement.round + 1;
  }
}

bool Realtime::receive(const Information& message) {
  const std::span<const std::uint32_t> listeners = hosted_.listeners(message.sender);
  for (const std::uint32_t member : listeners) deliver(member, message.sender, message.round, message.values);
  return !listeners.empty();
}

std::size_t Realtime::slot_of(const Member& member, AgentId from) {
  const auto senders = member.mailbox().senders();
  return static_cast<std::size_t>(std::lower_bound(senders.begin(), senders.end(), from) - senders.begin());
}

void Realtime::deliver(std::uint32_t member, AgentId from, Round round, std::span<const double> message) {
  Member& receiver = hosted_[member];
  const Mailbox::Post post = receiver.mailbox().post(from, round, message);
  if (post == Mailbox::Post::unknown_sender || post == Mailbox::Post::wrong_size || post == Mailbox::Post::too_early) return;
  Listener& listener = listeners_[member];
  Incoming& incoming = listener.incoming[slot_of(receiver, from)];
  if (post == Mailbox::Post::duplicate) {
    ++incoming.counters.duplicated;
    return;
  }
  if (round + 1 < incoming.newest) ++incoming.counters.reordered;
  incoming.newest = std::max(incoming.newest, round + 1);
  if (post == Mailbox::Post::accepted || listener.last_ended == 0 || round + 1 > listener.last_ended) return;
  // Too late for its round: was it expected?
  const Round age = listener.last_ended - 1 - round;
  if (age >= 64) return;
  const std::uint64_t bit = std::uint64_t{1} << age;
  if ((incoming.missing & bit) != 0) {
    incoming.missing &= ~bit;
    --incoming.counters.lost;
    if (age + 1 < lifespan_) {
      ++incoming.counters.received;
      incoming.came |= bit;
      use_late(receiver, incoming, from, round, message);
    } else {
      ++incoming.counters.late;
    }
  } else if ((incoming.came & bit) != 0) {
    ++incoming.counters.duplicated;
  }
}

void Realtime::Incoming::use(const Received& received, Round round) {
  payload.assign(received.payload.begin(), received.payload.end());
  used = received;
  used.payload = payload;
  used_in = round + 1;
}

// Its round is over, but it lives: it is used in the next one, if nothing newer comes.
void Realtime::use_late(Member& member, Incoming& incoming, AgentId from, Round round, std::span<const double> message) const {
  const auto received = member.mailbox().take_late({from, incoming.weight}, round, message);
  if (received && incoming.used_in <= round) incoming.use(*received, round);
}

// Rounds that a member has missed go by without a change.
void Realtime::catch_up(std::size_t member, Round k) {
  while (hosted_[member].round() < k && !hosted_[member].left()) hosted_.miss(member);
}

void Realtime::begin_round(Round k) {
  for (std::size_t index = 0; index < hosted_.size(); ++index) {
    catch_up(index, k);
    const Member& member = hosted_[index];
    Listener& listener = listeners_[index];
    const bool measures = hosted_.measurements(index) > 0;
    if (member.round() != k || !member.attendance().holds(k) || (measures && listener.y_of == 0)) continue;
    if (!hosted_.find_topology(index)) continue;
    if (measures && listener.y_of != k + 1) ++missed_inputs_;
    for (const std::uint32_t other : hosted_.begin(index, listener.y)) deliver(other, member.id(), k, member.message());
  }
}

// Who should have been heard in round k, and was not.
void Realtime::count_round(const Member& member, Listener& listener, Round k) {
  const Round passed = k + 1 - listener.last_ended;
  listener.last_ended = k + 1;
  for (Incoming& incoming : listener.incoming) {
    incoming.missing = passed < 64 ? incoming.missing << passed : 0;
    incoming.came = passed < 64 ? incoming.came << passed : 0;
  }
  listener.heard.clear();
  for (const Neighbour& neighbour : member.in_neighbours()) {
    Incoming& incoming = listener.incoming[slot_of(member, neighbour.id)];
    ++incoming.counters.sent;
    incoming.weight = neighbour.weight;
    if (member.mailbox().heard(neighbour.id, k)) {
      ++incoming.counters.received;
      incoming.came |= 1;
      listener.heard.push_back(neighbour);
    } else {
      ++incoming.counters.lost;
      incoming.missing |= 1;
    }
  }
}

// Where an in-neighbour has nothing new, its last message while that lives.
Inbox Realtime::with_held(const Member& member, Listener& listener, Round k, Inbox fresh) const {
  if (lifespan_ <= 1) return fresh;
  listener.inbox.clear();
  auto next = fresh.begin();
  for (const Neighbour& neighbour : member.in_neighbours()) {
    for (; next != fresh.end() && next->from < neighbour.id; ++next) listener.inbox.push_back(*next);
    Incoming& incoming = listener.incoming[slot_of(member, neighbour.id)];
    if (next != fresh.end() && next->from == neighbour.id) {
      incoming.use(*next, k);
      listener.inbox.push_back(*next++);
    } else if (incoming.used_in > 0 && k + 1 - incoming.used_in < lifespan_) {
      listener.inbox.push_back(incoming.used);
    }
  }
  listener.inbox.insert(listener.inbox.end(), next, fresh.end());
  return listener.inbox;
}

void Realtime::end_round(Round k) {
  std::size_t at = 0;
  bool acts = false;
  controls_.clear();
  for (std::size_t index = 0; index < hosted_.size(); ++index) {
    Member& member = hosted_[index];
    Listener& listener = listeners_[index];
    if (!member.attendance().holds(k)) continue;
    if (member.round() == k && member.begun()) {
      count_round(member, listener, k);
      hosted_.finish(index, with_held(member, listener, k, member.mailbox().take(k, listener.heard)));
      listener.acted = true;
    }
    if (!act_) continue;
    controls_.resize(at + member.protocol().control_size());
    if (listener.acted) member.protocol().control(std::span(controls_).subspan(at));
    at = controls_.size();
    acts = acts || listener.acted;
  }
  if (acts) act_(k, controls_);
  if (k + 1 == rounds_)  // whoever has overslept the end says so, too
    for (std::size_t index = 0; index < hosted_.size(); ++index) catch_up(index, rounds_);
}

std::vector<NetworkTotals> Realtime::network() const {
  std::vector<NetworkTotals> network;
  for (std::size_t index = 0; index < hosted_.size(); ++index) {
    const auto senders = hosted_[index].mailbox().senders();
    for (std::size_t slot = 0; slot < senders.size(); ++slot)
      if (const NetworkCounters& counters = listeners_[index].incoming[slot].counters; counters.sent + counters.duplicated > 0)
        network.push_back({{senders[slot], hosted_[index].id()}, counters});
  }
  return network;
}

}  // namespace consort
