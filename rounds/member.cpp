#include "rounds/member.hpp"

#include <algorithm>

namespace consort {

std::size_t Member::numbers_of(const Protocol& protocol) { return protocol.message_layout().size() + protocol.estimate_layout().size(); }

Member::Member(Parts parts)
    : protocol_(std::move(parts.protocol)),
      attendance_(std::move(parts.attendance)),
      message_size_(static_cast<std::uint32_t>(protocol_->message_layout().size())),
      estimate_size_(static_cast<std::uint32_t>(protocol_->estimate_layout().size())),
      mailbox_(parts.agent, std::move(parts.senders), protocol_->message_layout(), parts.links, parts.seed, parts.window, parts.first),
      to_learn_(std::move(parts.told)),
      recorded_layout_(recorded_part(protocol_->recorded_layout(), parts.recorded)),
      own_numbers_(parts.numbers.empty() ? numbers_of(*protocol_) : 0) {
  numbers_ = parts.numbers.empty() ? own_numbers_.data() : parts.numbers.data();
  sense_.k = parts.first;
  sense_.dt = parts.dt;
  sense_.self = parts.agent;
  if (parts.announces) {
    told_.assign(parts.agents, nullptr);
    told_[index_of(parts.agent)] = &protocol_->announcement();
    sense_.told = told_;
  }
  std::stable_sort(to_learn_.begin(), to_learn_.end(), [](const Told& a, const Told& b) { return a.since > b.since; });
  extend_history();
}

std::optional<AgentId> Member::learn(const Announced& announced) {
  for (; !to_learn_.empty() && to_learn_.back().since <= sense_.k; to_learn_.pop_back()) {
    const AgentId from = to_learn_.back().from;
    const std::optional<Values>& values = announced[index_of(from)];
    if (!values) return from;
    told_[index_of(from)] = &*values;
  }
  return {};
}

std::span<const double> Member::begin(const Graph& graph, std::span<const double> y, std::span<const AgentId> gone) {
  graph_ = &graph;
  sense_.y = y;
  find_neighbours(gone);
  protocol_->emit(sense_, {numbers_, message_size_});
  sent_ += sense_.out_degree;
  begun_ = true;
  return message();
}

void Member::depart(std::span<const AgentId> gone) {
  if (begun_) find_neighbours(gone);
}

// Whom it hears in its round: the in-neighbours of the graph, without those that are gone and have not been heard.
void Member::find_neighbours(std::span<const AgentId> gone) {
  sense_.in_neighbours = graph_->in_neighbours(id());
  sense_.out_degree = graph_->out_degree(id());
  if (gone.empty()) return;
  for (const AgentId agent : gone) sense_.out_degree -= graph_->has({id(), agent}) ? 1 : 0;
  remaining_.clear();
  for (const Neighbour& neighbour : sense_.in_neighbours) {
    if (std::binary_search(gone.begin(), gone.end(), neighbour.id)) {
      if (std::find(given_up_.begin(), given_up_.end(), neighbour.id) != given_up_.end()) continue;
      if (!mailbox_.heard(neighbour.id, sense_.k)) {
        given_up_.push_back(neighbour.id);
        continue;
      }
    }
    remaining_.push_back(neighbour);
  }
  sense_.in_neighbours = remaining_;
}

bool Member::hears(AgentId from) const {
  if (!begun_) return false;
  const auto at = std::lower_bound(sense_.in_neighbours.begin(), sense_.in_neighbours.end(), from,
                                   [](const Neighbour& neighbour, AgentId id) { return neighbour.id < id; });
  return at != sense_.in_neighbours.end() && at->id == from;
}

void Member::finish(Inbox inbox) {
  protocol_->absorb(sense_, inbox);
  begun_ = false;
  ++sense_.k;
  extend_history();
}

void Member::miss() {
  begun_ = false;
  ++sense_.k;
  mailbox_.skip(sense_.k);
  extend_history();
}

void Member::extend_history() {
  protocol_->estimate(estimate());
  history_.extend(estimate());
}

Member::Report Member::report() const {
  const LinkCounters links = mailbox_.counters();
  return {sense_.k, estimate(), history_.value(), {sent_, links.delivered, links.lost}};
}

std::vector<LinkTotals> Member::links() const {
  std::vector<LinkTotals> links;
  for (const AgentId from : mailbox_.senders())
    if (const LinkCounters counters = mailbox_.counters(from); counters != LinkCounters{}) links.push_back({{from, id()}, counters});
  return links;
}

}  // namespace consort
