#pragma once
/// What a process owes those who hear its members elsewhere, where messages may be lost: nobody begins more rounds than `ahead` beyond a
/// listener, so that what is on its way fits into the listener's buffers, and what was sent is kept until no listener can lack it. Whose
/// message of a round has come has come that far itself; where nothing comes back, a Standing says it. Pure.

#include "core/messages.hpp"
#include "core/network/sent_window.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace consort {

class Flow {
 public:
  /// `window`: no listener is ever further behind than this. Everybody begins in round `first`, or later.
  Flow(std::size_t agents, std::size_t members, Round ahead, Round window, Round first)
      : ahead_(ahead), window_(window), reached_(agents, first), members_(members) {}

  /// That agent, in another process, has come to round k. True: it was not known to have.
  bool reaches(AgentId reader, Round k) {
    if (index_of(reader) >= reached_.size()) return false;  // the run does not have it
    Round& known = reached_[index_of(reader)];
    if (k <= known) return false;
    known = k;
    return true;
  }
  /// It is gone: nobody waits for it.
  void departs(AgentId reader) { reached_[index_of(reader)] = kNever; }
  /// It is to begin there.
  void comes_back(AgentId reader, Round k) { reached_[index_of(reader)] = k; }

  /// May the member begin round k, in which these hear it?
  [[nodiscard]] bool may_begin(Round k, std::span<const AgentId> listeners) const {
    for (const AgentId reader : listeners)
      if (k > ahead_ && reached_[index_of(reader)] < k - ahead_) return false;
    return true;
  }
  /// The member has sent this in round k.
  void sent(std::size_t member, Round k, std::span<const AgentId> listeners, std::span<const double> message);
  /// What the member sent in rounds first <= k < first + rounds and has not been sent again more often than `asked` times: for each
  /// `send(k, message)`.
  template <class Send>
  void send_again(std::size_t member, const Standing::Gap& gap, Send&& send) {
    members_[member].sent.for_each(gap.first, gap.rounds, [&](SentWindow::Sent& sent) {
      if (sent.repeated > gap.asked) return;
      ++sent.repeated;
      send(sent.round, std::span<const double>(sent.values));
    });
  }

 private:
  struct Sender {
    SentWindow sent;
    std::vector<AgentId> audience;   // who has ever been among its listeners, ascending
    std::vector<AgentId> listeners;  // of the round before
  };

  Round ahead_, window_;
  std::vector<Round> reached_;  // by agent
  std::vector<Sender> members_;
};

}  // namespace consort
