#include "agent/realtime.hpp"

#include <algorithm>

namespace consort {

Realtime::Realtime(const Assignment& run, std::span<const MemberTask> members, Send send, Act act)
    : Lockstep(run, members, std::move(send), std::move(act)),
      lifespan_(std::max<Round>(1, static_cast<Round>(run.delivery.lifespan / run.dt + 1e-6))),
      extra_(members_.size()) {
  for (std::size_t index = 0; index < members_.size(); ++index) extra_[index].incoming.resize(members_[index].mailbox.senders().size());
}

void Realtime::grant(const Grant& grant) {
  segments_.clear();
  for (const GrantedSegment& segment : grant.segments)
    if (segment.stated) segments_.push_back({segment.first, topology_from(*segment.stated)});
  until_ = std::max(until_, grant.until);
  for (Member& member : members_) member.topology_until = 0;
}

/// The newest one counts. It is laid out for the members that were there in its round.
void Realtime::receive(const Measurement& measurement) {
  check_length(measurement);
  std::size_t at = 0;
  for (std::size_t index = 0; index < members_.size(); ++index) {
    Member& member = members_[index];
    if (!member.attendance.holds(measurement.round)) continue;
    const std::span<const double> own = measurement.values.subspan(at, member.measurements);
    const std::span<const double> distances = measurement.values.subspan(at + member.measurements, member.distances);
    at += member.told_by_plant();
    Extra& extra = extra_[index];
    if (measurement.round < extra.y_of) continue;
    if (!distances.empty()) member.mailbox.note_distances(distances);
    extra.y.assign(own.begin(), own.end());
    extra.y_of = measurement.round + 1;
  }
}

std::size_t Realtime::slot_of(const Member& member, AgentId from) {
  const auto senders = member.mailbox.senders();
  return static_cast<std::size_t>(std::lower_bound(senders.begin(), senders.end(), from) - senders.begin());
}

void Realtime::deliver(Member& member, std::uint32_t index, AgentId from, Round round, std::span<const double> payload) {
  const Mailbox::Post post = member.mailbox.post(from, round, payload);
  if (post == Mailbox::Post::unknown_sender || post == Mailbox::Post::wrong_size || post == Mailbox::Post::too_early) return;
  Extra& extra = extra_[index];
  Incoming& incoming = extra.incoming[slot_of(member, from)];
  if (post == Mailbox::Post::duplicate) {
    ++incoming.counters.duplicated;
    return;
  }
  if (round + 1 < incoming.newest) ++incoming.counters.reordered;
  incoming.newest = std::max(incoming.newest, round + 1);
  if (post == Mailbox::Post::accepted || extra.last_ended == 0 || round + 1 > extra.last_ended) return;
  // Too late for its round: was it expected?
  const Round age = extra.last_ended - 1 - round;
  if (age >= 64) return;
  const std::uint64_t bit = std::uint64_t{1} << age;
  if ((incoming.missing & bit) != 0) {
    incoming.missing &= ~bit;
    --incoming.counters.lost;
    if (age + 1 < lifespan_) {
      ++incoming.counters.received;
      incoming.came |= bit;
      keep_late(member, incoming, from, round, payload);
    } else {
      ++incoming.counters.late;
    }
  } else if ((incoming.came & bit) != 0) {
    ++incoming.counters.duplicated;
  }
}

/// Its round is over, but it lives: it is used in the next one, if nothing newer comes.
void Realtime::keep_late(Member& member, Incoming& incoming, AgentId from, Round round, std::span<const double> payload) const {
  const auto received = member.mailbox.take_late({from, incoming.weight}, round, payload);
  if (!received || incoming.used_in > round) return;
  incoming.payload.assign(received->payload.begin(), received->payload.end());
  incoming.used = *received;
  incoming.used.payload = incoming.payload;
  incoming.used_in = round + 1;
}

/// Rounds that a member has missed go by without a change.
void Realtime::catch_up(std::size_t index, Round k) {
  Member& member = members_[index];
  if (member.k >= k) return;
  while (member.k < k && member.k < member.attendance.until) {
    if (member.attendance.holds(member.k)) ++member.report.slept;
    ++member.k;
    report_state(member);
    if (member.k == member.attendance.until) ++left_;
  }
  member.mailbox.skip(member.k);
}

bool Realtime::measured(std::size_t index) const { return members_[index].measurements == 0 || extra_[index].y_of > 0; }

void Realtime::begin_round(Round k) {
  for (std::size_t index = 0; index < members_.size(); ++index) {
    Member& member = members_[index];
    catch_up(index, k);
    member.emitted = false;
    if (member.k != k || !member.attendance.holds(k) || !measured(index)) continue;
    if (!find_topology(member)) continue;
    tell(member, false);
    find_neighbours(member);
    Extra& extra = extra_[index];
    if (member.measurements > 0 && extra.y_of != k + 1) ++missed_inputs_;
    member.y = extra.y;
    const Sense sense = sense_of(member);
    member.protocol->emit(sense, member.payload);
    member.counters.sent += sense.out_degree;
    member.emitted = true;
    if (member.topology->heard_elsewhere[index]) send_(index, k, member.payload);
    for (const std::uint32_t listener : member.topology->local_listeners[index])
      deliver(members_[listener], listener, member.id, k, member.payload);
  }
}

/// Who should have been heard in round k, and was not.
void Realtime::note_round(Member& member, Extra& extra, Round k) const {
  const Round passed = k + 1 - extra.last_ended;
  extra.last_ended = k + 1;
  for (Incoming& incoming : extra.incoming) {
    incoming.missing = passed < 64 ? incoming.missing << passed : 0;
    incoming.came = passed < 64 ? incoming.came << passed : 0;
  }
  extra.heard.clear();
  for (const Neighbour& neighbour : member.in_neighbours) {
    Incoming& incoming = extra.incoming[slot_of(member, neighbour.id)];
    ++incoming.counters.sent;
    incoming.weight = neighbour.weight;
    if (member.mailbox.heard(neighbour.id, k)) {
      ++incoming.counters.received;
      incoming.came |= 1;
      extra.heard.push_back(neighbour);
    } else {
      ++incoming.counters.lost;
      incoming.missing |= 1;
    }
  }
}

/// Where an in-neighbour has nothing new, its last message while that lives.
Inbox Realtime::with_held(Member& member, Extra& extra, Round k, Inbox fresh) const {
  if (lifespan_ <= 1) return fresh;
  extra.inbox.clear();
  auto next = fresh.begin();
  for (const Neighbour& neighbour : member.in_neighbours) {
    for (; next != fresh.end() && next->from < neighbour.id; ++next) extra.inbox.push_back(*next);
    Incoming& incoming = extra.incoming[slot_of(member, neighbour.id)];
    if (next != fresh.end() && next->from == neighbour.id) {
      incoming.payload.assign(next->payload.begin(), next->payload.end());
      incoming.used = *next;
      incoming.used.payload = incoming.payload;
      incoming.used_in = k + 1;
      extra.inbox.push_back(*next++);
    } else if (incoming.used_in > 0 && k + 1 - incoming.used_in < lifespan_) {
      extra.inbox.push_back(incoming.used);
    }
  }
  extra.inbox.insert(extra.inbox.end(), next, fresh.end());
  return extra.inbox;
}

void Realtime::end_round(Round k) {
  std::size_t at = 0;
  bool acts = false;
  controls_.clear();
  for (std::size_t index = 0; index < members_.size(); ++index) {
    Member& member = members_[index];
    Extra& extra = extra_[index];
    if (!member.attendance.holds(k)) continue;
    if (member.k == k && member.emitted) {
      find_neighbours(member);  // somebody may have departed since
      note_round(member, extra, k);
      const Inbox inbox = with_held(member, extra, k, member.mailbox.take(k, extra.heard));
      member.protocol->absorb(sense_of(member), inbox);
      extra.acted = true;
      ++member.k;
      member.emitted = false;
      report_state(member);
      if (member.k == member.attendance.until) ++left_;
    }
    if (!act_) continue;
    controls_.resize(at + member.protocol->control_size());
    if (extra.acted) member.protocol->control(std::span(controls_).subspan(at));
    at = controls_.size();
    acts = acts || extra.acted;
  }
  if (acts) act_(k, controls_);
  if (k + 1 == rounds_)  // whoever has overslept the end says so, too
    for (std::size_t index = 0; index < members_.size(); ++index) catch_up(index, rounds_);
}

std::vector<NetworkTotals> Realtime::network() const {
  std::vector<NetworkTotals> network;
  for (std::size_t index = 0; index < members_.size(); ++index) {
    const auto senders = members_[index].mailbox.senders();
    for (std::size_t slot = 0; slot < senders.size(); ++slot)
      if (const NetworkCounters& counters = extra_[index].incoming[slot].counters; counters.sent + counters.duplicated > 0)
        network.push_back({{senders[slot], members_[index].id}, counters});
  }
  return network;
}

}  // namespace consort
