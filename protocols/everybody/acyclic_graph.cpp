#include "protocols/everybody/acyclic_graph.hpp"

#include <algorithm>
#include <tuple>

namespace consort {

AcyclicSensing::AcyclicSensing(AgentId self, std::size_t agents, double id, bool absolute, Round patience)
    : self_(self),
      absolute_(absolute),
      patience_(patience),
      says_{absolute ? 0.0 : static_cast<double>(agents), id, -1.0},
      others_(agents) {}

void AcyclicSensing::absorb(Round k, std::span<const Neighbour> in_neighbours, std::span<const char> measures,
                            std::span<const Told> heard) {
  check(measures.size() == others_.size(), "DAGC: one entry per agent says whom an agent measures");
  for (const Told& told : heard) {
    Other& other = others_.at(index_of(told.from));
    other.says = told.says;
    other.measures_me = told.measures_me;
    other.heard = true;
    says_.changed = std::max(says_.changed, told.says.changed);
  }
  std::vector<char> audible(others_.size(), 0);
  for (const Neighbour& j : in_neighbours) audible.at(index_of(j.id)) = 1;
  bool changed = !started_;
  const auto none = static_cast<double>(others_.size());
  double layer = none;
  for (std::size_t j = 0; j < others_.size(); ++j) {
    Other& other = others_[j];
    if (audible[j] == 0) other.heard = other.measures_me = false;  // what it said does not outlive it
    // An edge is there as long as its other end can be heard and one of the two measures the other.
    const bool edge = other.heard && (measures[j] != 0 || other.measures_me);
    changed = changed || edge != other.edge;
    other.edge = edge;
    if (edge) layer = std::min(layer, other.says.layer + 1.0);
  }
  started_ = true;
  says_.layer = absolute_ ? 0.0 : layer;
  if (changed) says_.changed = static_cast<double>(k);
  done_ = static_cast<double>(k) - says_.changed >= none + static_cast<double>(patience_);
}

AcyclicSensing::Use AcyclicSensing::use(AgentId j) const {
  const Other& other = others_.at(index_of(j));
  if (!other.edge) return Use::none;
  const auto mine = std::tuple(says_.layer, says_.id, self_.value), theirs = std::tuple(other.says.layer, other.says.id, j.value);
  return mine > theirs ? Use::mine : Use::theirs;
}

}  // namespace consort
