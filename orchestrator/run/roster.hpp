#pragma once
/// Who may take part: the processes a run has a place for, who holds each place, and what is said to those who may not. Pure.

#include "core/types.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace consort {

/// A process as it introduces itself.
struct Newcomer {
  std::string id;               ///< its name on the network; no other process has it
  std::vector<AgentId> agents;  ///< ascending; none: the plant
  std::string host;
  std::uint64_t pid = 0;
  bool fits = true;   ///< it is of the run's build
  std::string build;  ///< for a person
};

class Roster {
 public:
  struct Place {
    std::string name;             ///< for a person: agent-3
    std::vector<AgentId> agents;  ///< ascending; none: the plant
    bool external = false;        ///< by whoever takes it first; else by the process that is launched for it
  };
  /// `host`, `build`: of the orchestrator.
  Roster(std::vector<Place> places, std::string host, std::string build);

  enum class Standing {
    member,   ///< it holds a place
    former,   ///< it did, and its last words may still come
    refused,  ///< `why`
  };
  struct Verdict {
    Standing standing = Standing::refused;
    std::size_t place = 0;  ///< member, former: which one
    std::string why = {};   ///< refused
    bool first = false;     ///< it has not been judged so before
  };
  /// Somebody who takes a place that is free holds it from then on. Who has been refused once, stays refused.
  Verdict judge(const Newcomer& newcomer);

  /// This process has just been started for that place; `host`: on another than the orchestrator's.
  void launched(std::size_t place, std::uint64_t pid, const std::string& host = {}) {
    launched_.at(place) = pid;
    launched_on_.at(place) = host.empty() ? host_ : host;
    gone_.at(place).reset();
  }
  enum class Departure { left, killed, died };  ///< the first two by plan
  /// Its holder is gone; somebody else may come.
  void vacate(std::size_t place, Departure how);
  /// Nobody may take it any more.
  void close(std::size_t place) { closed_.insert(place); }
  /// Another job begins, with everybody.
  void open_all() { closed_.clear(); }

  /// Of whoever holds it now.
  [[nodiscard]] std::optional<std::size_t> place_of(const std::string& id) const;

 private:
  [[nodiscard]] std::string objection(const Newcomer& newcomer, std::optional<std::size_t> place) const;
  [[nodiscard]] std::string misplaced(const Newcomer& newcomer) const;
  [[nodiscard]] std::string not_by_hand(std::size_t place) const;

  std::vector<Place> places_;
  std::string host_, build_;
  std::vector<std::optional<Newcomer>> holders_;  // by place
  std::vector<std::uint64_t> launched_;           // by place: pid
  std::vector<std::string> launched_on_;          // by place: host
  std::vector<std::optional<Departure>> gone_;    // by place: how the process went that was there last, if none is now
  std::set<std::size_t> closed_;
  std::map<std::string, std::size_t> former_;
  std::map<std::string, std::string> refused_;  // and why
};

}  // namespace consort
