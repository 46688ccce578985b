#pragma once
/// What happens during a run: cuts and heals, links that change, joins and leaves, processes that are killed or stopped, degraded sensors.

#include "core/experiment.hpp"
#include "orchestrator/script/agents.hpp"
#include "orchestrator/script/links.hpp"

#include <map>
#include <set>

namespace consort::script {

/// Reads `events: [...]` into an experiment, of which agents, rounds, dt and links are known.
class Events {
 public:
  /// No event may be in a round after `last`.
  Events(Mistakes& mistakes, std::uint64_t last, Experiment& out) : mistakes_(mistakes), last_(last), out_(out) {}
  void read(const YAML::Node&);
  [[nodiscard]] const LinkChanges& link_changes() const { return link_changes_; }
  /// Once the plant is known: what its sensors are to suffer.
  void read_degradations(const std::filesystem::path& directory, Places& places);

 private:
  struct Degradation {
    YAML::Node node;
    std::string what;
    Round round;
  };
  struct EventOfProcess {
    Round round;
    std::string kind;
    YAML::Node node;
  };

  std::optional<Round> read_round(const Section& section, const YAML::Node& node, const std::string& what);
  void read_process_event(const YAML::Node& node, const std::string& what, std::optional<Round> round, const std::string& kind);
  void order_process_events(const YAML::Node& node);
  void follow(AgentId agent, std::vector<EventOfProcess>& events, const YAML::Node& node);
  void check_presence(const YAML::Node& node);

  Mistakes& mistakes_;
  std::uint64_t last_;
  Experiment& out_;
  LinkChanges link_changes_;
  std::vector<Degradation> degradations_;
  std::map<AgentId, std::vector<EventOfProcess>> process_events_;
  std::set<AgentId> unordered_;  // agents with an event that is in no round
};

}  // namespace consort::script
