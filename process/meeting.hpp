#pragma once
/// Who has met whom: what a process knows of those it is to hear and to be heard by, and up to which round it may therefore run. Knows no
/// transport: what DDS finds and what greetings come is told by call.

#include "core/messages.hpp"

#include <functional>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace consort {

/// Of a process that hosts agents. Endpoints outlive a run, and so does what is known of them.
class AgentsMeeting {
 public:
  /// The agents hosted here, ascending.
  explicit AgentsMeeting(std::vector<AgentId> hosted) : hosted_(std::move(hosted)) {}

  /// A run begins. Remote agents that its members may hear and that no earlier run did, ascending: their greetings count from now on.
  std::vector<AgentId> begin(const Assignment& run, std::span<const MemberTask> tasks);

  /// So many processes have read that hosted agent so far.
  void found_readers(AgentId hosted, std::size_t processes) { readers_of_[hosted] = processes; }
  /// The plant reads what the agents do; it does not (any more).
  void found_plant(bool there) { plant_found_ = there; }
  /// The connection works. False: nobody here hears that agent.
  bool greeted_by(AgentId agent);
  void greeted_by_plant() { greeted_by_plant_ = true; }
  /// What the agent announced in this run is here.
  void announced(AgentId agent) { announced_.insert(agent); }
  /// Nobody waits to meet them; who comes back has to greet again.
  void departed(std::span<const AgentId> agents);
  void comes_back(std::span<const AgentId> agents, Round round);

  /// Remote agents that may be heard here, in this run or an earlier one, ascending.
  [[nodiscard]] const std::vector<AgentId>& heard() const { return heard_; }
  /// Everybody who reads us from the start has been found; where somebody is gone, who is left can only be tried.
  [[nodiscard]] bool may_greet() const;
  /// No round of ours is granted yet, or not yet the first round of somebody who will read us. (A grant alone says nothing: who joins is
  /// still told the newest of the rounds before it.)
  [[nodiscard]] bool greeting_needed(Round granted_until) const;
  /// Rounds below this one may be granted as far as this process is concerned: everybody it hears by then has greeted it, everybody who
  /// reads it from the start has been found, and so has the plant; announcements are here. 0: not even the first.
  [[nodiscard]] Round met_until() const;
  /// Why met_until() says 0, for a person.
  [[nodiscard]] std::string unmet() const;

 private:
  // What a hosted agent needs in this run.
  struct Need {
    AgentId agent;
    Round first = 0, last = 0;  // its own first round; that of whoever reads it last
    std::size_t readers = 0;    // from its first round on
    std::vector<Told> told;
  };
  [[nodiscard]] bool here(AgentId agent) const { return std::binary_search(hosted_.begin(), hosted_.end(), agent); }
  [[nodiscard]] bool lacks(const Told& told) const;
  [[nodiscard]] bool awaits(AgentId agent) const { return !greeted_by_.contains(agent) && !gone_.contains(agent); }
  [[nodiscard]] std::size_t readers_of(AgentId agent) const;
  [[nodiscard]] bool greets() const { return has_readers_ || acts_; }

  std::vector<AgentId> hosted_;
  std::vector<Need> needs_;
  std::map<AgentId, Round> joining_;
  bool plant_ = false;
  bool has_readers_ = false, acts_ = false;    // in this run or an earlier one
  std::map<AgentId, std::size_t> readers_of_;  // by hosted agent that is heard elsewhere
  std::vector<AgentId> heard_;
  std::set<AgentId> greeted_by_;
  std::set<AgentId> gone_, announced_;  // in this run
  bool plant_found_ = false, greeted_by_plant_ = false;
};

/// Of the plant: it knows processes, by the lowest id of the agents they host. `next(process)`: the round from the plant's own on in which
/// somebody of that process next takes part; kNever if in none.
class PlantMeeting {
 public:
  using Next = std::function<Round(std::uint32_t process)>;

  /// A run of these processes begins; `steered`: the plant hears what their agents do.
  void begin(std::vector<std::uint32_t> processes, bool steered);

  /// The process reads its measurements; it does not any more: whoever comes back has to greet again.
  void found(std::uint32_t process, bool there);
  void greeted_by(std::uint32_t process) { greeted_by_.insert(process); }
  /// Who comes back is alone in its process, so it names it.
  void comes_back(std::span<const AgentId> agents);

  [[nodiscard]] const std::set<std::uint32_t>& found() const { return found_; }
  /// A process that takes part in a round which is not granted yet may still need a greeting.
  [[nodiscard]] bool greeting_needed(const Next& next, Round granted_until) const;
  /// As AgentsMeeting::met_until(); `now`: the plant's round.
  [[nodiscard]] Round met_until(const Next& next, Round now) const;
  [[nodiscard]] std::string unmet(const Next& next, Round now) const;

 private:
  [[nodiscard]] bool met(std::uint32_t process) const { return found_.contains(process) && (!steered_ || greeted_by_.contains(process)); }

  std::vector<std::uint32_t> processes_;
  bool steered_ = false;
  std::set<std::uint32_t> found_, greeted_by_;
};

}  // namespace consort
