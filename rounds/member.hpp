#pragma once
/// One agent in a run, whoever drives it: its algorithm, the mailbox between it and its senders, when it takes part, what it has been told
/// of others, the hash of its history, its counters. A round is begin() and finish(). Who comes back is a new member.

#include "core/messages.hpp"
#include "core/network/mailbox.hpp"
#include "protocols/protocol.hpp"

#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace consort {

/// By agent: what it announces of itself, as far as that has come. Whoever has learnt it goes on reading it here.
using Announced = std::vector<std::optional<Values>>;

class alignas(64) Member {
 public:
  /// What it is made of.
  struct Parts {
    AgentId agent;
    Attendance attendance;
    Round first = 0;  ///< the round it begins with
    Seconds dt = 1.0;
    std::unique_ptr<Protocol> protocol;
    std::vector<AgentId> senders;  ///< everyone who may ever be an in-neighbour, ascending
    const LinkModel& links;
    Seed seed;
    Round window = 1;              ///< how far ahead of it a sender may be
    bool announces = false;        ///< its protocol wants to know what others announce
    std::size_t agents = 1;        ///< of the run
    std::vector<Told> told;        ///< whose announcement reaches it
    std::span<double> numbers;     ///< where its message and its estimate are to lie; empty: with it
    std::optional<bool> recorded;  ///< all or nothing of what is worth recording beside the estimate; nullopt: what fits
  };
  static std::size_t numbers_of(const Protocol& protocol);  ///< how many numbers its message and its estimate have
  /// Throws ConfigError on a link that makes no sense.
  explicit Member(Parts parts);

  [[nodiscard]] AgentId id() const { return sense_.self; }
  [[nodiscard]] Round round() const { return sense_.k; }
  [[nodiscard]] const Attendance& attendance() const { return attendance_; }
  [[nodiscard]] bool left() const { return sense_.k >= attendance_.until; }

  /// Takes up what it is told by its round. Whose announcement it lacks for that; nothing: it lacks none.
  std::optional<AgentId> learn(const Announced& announced);
  /// Its round begins, with this graph, what it measures (valid until it has finished), and those of the graph who are `gone`, ascending:
  /// they count if they have been heard. Its message, valid until it begins the next round.
  std::span<const double> begin(const Graph& graph, std::span<const double> y, std::span<const AgentId> gone = {});
  [[nodiscard]] bool begun() const { return begun_; }
  /// Of the round that has begun.
  [[nodiscard]] std::span<const double> message() const { return {numbers_, message_size_}; }
  [[nodiscard]] std::span<const Neighbour> in_neighbours() const { return sense_.in_neighbours; }
  /// Has its round begun, and is this agent one of its in-neighbours?
  [[nodiscard]] bool hears(AgentId from) const;
  /// Messages of its round that are still to come.
  [[nodiscard]] std::size_t missing() const { return mailbox_.missing(sense_.k, sense_.in_neighbours); }
  /// These are gone while its round goes on, ascending.
  void depart(std::span<const AgentId> gone);

  /// Its round ends: every message of it must be in the mailbox.
  void finish() { finish(mailbox_.take(sense_.k, sense_.in_neighbours)); }
  /// The same where the driver holds the messages itself: `message_of(index_of(j))`.
  template <class MessageOf>
  void finish_from(MessageOf&& message_of) {
    finish(mailbox_.take_from(sense_.k, sense_.in_neighbours, message_of));
  }
  /// The same where the driver has decided what is absorbed.
  void finish(Inbox inbox);
  /// Its round goes by without it.
  void miss();

  /// How it stands at the beginning of its round.
  struct Report {
    Round k = 0;
    std::span<const double> estimate;
    std::uint64_t hash = 0;
    AgentCounters counters;
  };
  [[nodiscard]] Report report() const;
  /// What is recorded beside the estimate; `out.size() == recorded_layout().size()`.
  void recorded(std::span<double> out) const { protocol_->recorded(out); }
  [[nodiscard]] const Layout& recorded_layout() const { return recorded_layout_; }
  /// Those of its in-links that carried anything, ascending.
  [[nodiscard]] std::vector<LinkTotals> links() const;

  [[nodiscard]] Mailbox& mailbox() { return mailbox_; }
  [[nodiscard]] const Mailbox& mailbox() const { return mailbox_; }
  [[nodiscard]] const Protocol& protocol() const { return *protocol_; }

 private:
  [[nodiscard]] std::span<double> estimate() const { return {numbers_ + message_size_, estimate_size_}; }
  void find_neighbours(std::span<const AgentId> gone);
  void extend_history();

  // What every round needs lies together, in as few cache lines as can be: a thousand members that take turns wait for memory.
  std::unique_ptr<Protocol> protocol_;
  Attendance attendance_;
  Sense sense_;
  const Graph* graph_ = nullptr;  // of the round that has begun
  double* numbers_;               // of its message, then of its estimate
  std::uint32_t message_size_, estimate_size_;
  HistoryHash history_;
  std::uint64_t sent_ = 0;
  bool begun_ = false;
  Mailbox mailbox_;
  std::vector<Told> to_learn_;        // what it is told later, the next one last
  std::vector<const Values*> told_;   // by agent: what it announced, as far as this member knows
  std::vector<Neighbour> remaining_;  // where its in-neighbours lie if somebody is gone
  std::vector<AgentId> given_up_;     // who is gone and was not heard in a round that is over or waited for
  Layout recorded_layout_;
  std::vector<double> own_numbers_;  // unless they lie with the driver
};

}  // namespace consort
