#pragma once
/// Which agent uses which relative measurement, so that nobody's estimate depends on itself: the acyclic sensing graph, built by the agents
/// out of what they tell each other. This is one agent's share.
///
/// Source: Huang, Jiang, Zhao, Cheng, Wu 2025, Algorithm 1 (DAGC). The layer of an agent is its distance to an agent with an absolute
/// position, counted in sensing edges of either direction; an edge is used by the end with the larger (layer, id), whoever measures it. Two
/// agents that measure each other share one edge. Line 21 as printed lacks the minus sign of its siblings; lines 8 and 19 mend an id that
/// two agents drew by chance, which does not make ids unique: here ids are given, and equal ones are told apart by the agents' numbers.
///
/// It ends by itself: an agent that sees its own edges change says so with the round, the news travels by maximum, and whoever has heard of
/// no change within the last m + patience rounds, m the agreed maximum of agents, knows that all layers are final. (A layer depends on
/// nothing further than m - 1 edges away, and one that nobody supports any more grows by one a round, up to m, where it ends as "none".)

#include "core/network/graph.hpp"

#include <span>
#include <vector>

namespace consort {

class AcyclicSensing {
 public:
  /// What an agent says of itself in every round.
  struct Says {
    double layer = 0.0;     ///< 0..m; m: no agent with an absolute position within reach
    double id = 0.0;        ///< breaks ties between equal layers
    double changed = -1.0;  ///< newest round in which anybody's edges are known to have changed; -1: never
  };
  struct Told {
    AgentId from;
    Says says;
    bool measures_me = false;
  };

  AcyclicSensing(AgentId self, std::size_t agents, double id, bool absolute, Round patience);

  [[nodiscard]] const Says& says() const { return says_; }
  /// One round: who can be heard, whom the agent measures itself (by agent, not 0), and what was heard, ascending.
  void absorb(Round k, std::span<const Neighbour> in_neighbours, std::span<const char> measures, std::span<const Told> heard);

  [[nodiscard]] std::size_t layer() const { return static_cast<std::size_t>(says_.layer); }
  [[nodiscard]] bool grounded() const { return layer() < others_.size(); }  ///< some agent with an absolute position is within reach
  /// All layers are final. Until then nothing that use() says should be acted upon.
  [[nodiscard]] bool done() const { return done_; }
  enum class Use { none, mine, theirs };
  /// Who uses the edge between this agent and j. none: there is none.
  [[nodiscard]] Use use(AgentId j) const;

 private:
  struct Other {
    Says says;
    bool measures_me = false, heard = false, edge = false;
  };
  AgentId self_;
  bool absolute_;
  Round patience_;
  Says says_;
  bool done_ = false, started_ = false;
  std::vector<Other> others_;  // by agent
};

}  // namespace consort
