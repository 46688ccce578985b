#include "core/network/schedule.hpp"

#include "core/number_text.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <mutex>
#include <numeric>
#include <set>
#include <string>

namespace consort {

namespace {

constexpr Purpose kPairs{"random pairs"};
constexpr Purpose kLinks{"random links"};
constexpr Round kForEver = std::numeric_limits<Round>::max();

void require_agents(const std::shared_ptr<const Graph>& graph, std::size_t agents, const std::string& place) {
  check(graph != nullptr, "Schedule: a graph is missing");
  if (graph->agents() != agents) {
    throw ConfigError(place + ": the graph has " + std::to_string(graph->agents()) + " agents; the experiment has " +
                      std::to_string(agents));
  }
}

FixedSchedule for_ever(std::shared_ptr<const Graph> graph) { return {{{std::move(graph), 1}}, false}; }

Graph without_edges(std::size_t agents) { return Graph(agents, std::span<const Edge>{}); }

// A perfect matching (one agent sits out if n is odd) and how long it is kept.
struct Pairing {
  std::vector<std::uint32_t> partner;  // by position; own position: sits out
  Round dwell = 1;
};

void draw_pairing(std::size_t agents, const RandomPairs& pairs, Seed seed, std::uint32_t index, std::vector<std::uint32_t>& order,
                  Pairing& out) {
  Stream stream = seed.stream(kPairs, index);
  order.resize(agents);
  std::iota(order.begin(), order.end(), 0U);
  for (std::size_t i = agents - 1; i > 0; --i) std::swap(order[i], order[stream.below(i + 1)]);
  out.partner.resize(agents);
  std::iota(out.partner.begin(), out.partner.end(), 0U);
  for (std::size_t p = 0; p + 1 < agents; p += 2) {
    out.partner[order[p]] = order[p + 1];
    out.partner[order[p + 1]] = order[p];
  }
  out.dwell = pairs.dwell_min + static_cast<Round>(stream.below(std::uint64_t{pairs.dwell_max} - pairs.dwell_min + 1));
}

Graph graph_of_pairing(const Pairing& pairing) {
  const std::size_t agents = pairing.partner.size();
  std::vector<WeightedEdge> edges;
  edges.reserve(agents);
  for (std::size_t i = 0; i < agents; ++i) {
    if (pairing.partner[i] != i) edges.push_back({{agent_at(pairing.partner[i]), agent_at(i)}, 1.0});
  }
  return Graph(agents, edges);
}

Graph sample_of(const RandomLinks& links, Seed seed, Round k) {
  std::vector<WeightedEdge> edges = links.base->edges();
  std::erase_if(edges, [&](const WeightedEdge& e) {
    return seed.stream(kLinks, e.edge.from.value, e.edge.to.value, k).uniform() >= links.probability;
  });
  return Graph(links.base->agents(), edges);
}

// Union of graphs, one at a time; the largest weight counts.
class EdgeUnion {
 public:
  void add(const Graph& graph) {
    const auto more = graph.edges();
    merged_.clear();
    auto a = edges_.begin();
    auto b = more.begin();
    while (a != edges_.end() || b != more.end()) {
      if (b == more.end() || (a != edges_.end() && place(*a) < place(*b))) {
        merged_.push_back(*a++);
      } else if (a == edges_.end() || place(*b) < place(*a)) {
        merged_.push_back(*b++);
      } else {
        merged_.push_back({a->edge, std::max(a->weight, b->weight)});
        ++a, ++b;
      }
    }
    edges_.swap(merged_);
  }
  [[nodiscard]] Graph graph(std::size_t agents) const { return Graph(agents, edges_); }

 private:
  static std::pair<AgentId, AgentId> place(const WeightedEdge& e) { return {e.edge.to, e.edge.from}; }
  std::vector<WeightedEdge> edges_, merged_;  // ascending by receiver, then sender
};

// Calls `each` with every edge the event names; of groups, both ways between any two.
template <class Each>
void for_each_edge(const LinkEvent& event, Each&& each) {
  for (const Edge edge : event.edges) each(edge);
  for (const auto& senders : event.groups) {
    for (const auto& receivers : event.groups) {
      if (&senders == &receivers) continue;
      for (const AgentId from : senders)
        for (const AgentId to : receivers) each(Edge{from, to});
    }
  }
}

}  // namespace

// Starts of the pairings drawn so far, and the graphs asked for last. Everything in it can be drawn again at any time.
struct Schedule::Memory {
  struct Slot {
    std::uint32_t index = 0;
    std::size_t epoch = 0;
    std::shared_ptr<const Graph> graph;
  };
  static constexpr std::size_t kSlots = 64;

  std::mutex mutex;
  std::vector<std::uint64_t> starts{0};  // starts[s]: first round of pairing s; the last entry is where the next, undrawn one begins
  std::vector<std::uint32_t> order;      // scratch of the shuffle
  Pairing pairing;                       // the one drawn last ...
  std::uint32_t pairing_index = std::numeric_limits<std::uint32_t>::max();  // ... and which it is
  std::array<Slot, kSlots> slots;
};

Schedule::Schedule(std::size_t agents, Spec spec, std::vector<LinkEvent> events, Seed seed, const std::map<AgentId, Attendance>& presence)
    : agents_(agents), spec_(std::move(spec)), seed_(seed), memory_(std::make_shared<Memory>()) {
  validate_spec();
  simplify_spec();
  if (const auto* fixed = std::get_if<FixedSchedule>(&spec_)) {
    std::uint64_t end = 0;
    for (const auto& interval : fixed->intervals) ends_.push_back(end += interval.rounds);
  }
  build_epochs(std::move(events), presence);
}

void Schedule::validate_spec() const {
  if (const auto* fixed = std::get_if<FixedSchedule>(&spec_)) {
    if (fixed->intervals.empty()) throw ConfigError("topology: the list of intervals is empty; allowed: one or more");
    for (std::size_t i = 0; i < fixed->intervals.size(); ++i) {
      const std::string place = "topology: interval " + std::to_string(i + 1);
      require_agents(fixed->intervals[i].graph, agents_, place);
      if (fixed->intervals[i].rounds < 1) throw ConfigError(place + " lasts 0 rounds; allowed: 1 or more");
    }
  } else if (const auto* pairs = std::get_if<RandomPairs>(&spec_)) {
    if (pairs->dwell_min < 1 || pairs->dwell_max < pairs->dwell_min) {
      throw ConfigError("topology random_pairs: dwell_rounds [" + std::to_string(pairs->dwell_min) + ", " +
                        std::to_string(pairs->dwell_max) + "]; allowed: 1 or more, ascending");
    }
  } else {
    const auto& links = std::get<RandomLinks>(spec_);
    require_agents(links.base, agents_, "topology random_links");
    if (!(links.probability >= 0.0 && links.probability <= 1.0)) {
      throw ConfigError("topology random_links: probability " + number_text(links.probability) + "; allowed: 0 to 1");
    }
  }
}

void Schedule::simplify_spec() {
  if (auto* fixed = std::get_if<FixedSchedule>(&spec_)) {
    std::vector<FixedSchedule::Interval> merged;
    for (const auto& interval : fixed->intervals) {
      const bool same = !merged.empty() && *merged.back().graph == *interval.graph;
      if (same && interval.rounds <= kForEver - merged.back().rounds) {
        merged.back().rounds += interval.rounds;
      } else {
        merged.push_back(interval);
      }
    }
    fixed->intervals = std::move(merged);
  } else if (std::holds_alternative<RandomPairs>(spec_)) {
    // Fewer than three agents leave nothing to draw.
    if (agents_ < 2) spec_ = for_ever(std::make_shared<Graph>(without_edges(agents_)));
    if (agents_ == 2) spec_ = for_ever(std::make_shared<Graph>(complete(2)));
  } else {
    const auto links = std::get<RandomLinks>(spec_);
    if (links.probability == 0.0) spec_ = for_ever(std::make_shared<Graph>(without_edges(agents_)));
    if (links.probability == 1.0 || links.base->edge_count() == 0) spec_ = for_ever(links.base);
  }
}

void Schedule::build_epochs(std::vector<LinkEvent> events, const std::map<AgentId, Attendance>& presence) {
  const auto require_agent = [this](AgentId id, Round round) {
    if (id.value >= 1 && id.value <= agents_) return;
    throw ConfigError("event of round " + std::to_string(round) + ": there is no agent " + std::to_string(id.value) + "; allowed: 1 to " +
                      std::to_string(agents_));
  };
  std::stable_sort(events.begin(), events.end(), [](const LinkEvent& a, const LinkEvent& b) { return a.round < b.round; });
  std::set<Round> firsts{0};
  for (const LinkEvent& event : events) firsts.insert(event.round);
  for (const auto& [agent, present] : presence) {
    require_agent(agent, present.from);
    for (const Attendance& stay : present.stays()) {
      firsts.insert(stay.from);
      if (stay.until != kForEver) firsts.insert(stay.until);
    }
  }
  std::set<Edge> cut;
  auto event = events.begin();
  for (const Round first : firsts) {
    for (; event != events.end() && event->round <= first; ++event) {
      if (event->heal && event->everything) cut.clear();
      for_each_edge(*event, [&](Edge edge) {
        require_agent(edge.from, event->round);
        require_agent(edge.to, event->round);
        if (event->heal) {
          cut.erase(edge);
        } else {
          cut.insert(edge);
        }
      });
    }
    Epoch epoch{first, {cut.begin(), cut.end()}, {}};
    for (const auto& [agent, present] : presence)
      if (!present.holds(first)) epoch.absent.push_back(agent);
    if (epochs_.empty() || epochs_.back().cut != epoch.cut || epochs_.back().absent != epoch.absent) epochs_.push_back(std::move(epoch));
  }
}

bool Schedule::Epoch::lacks(Edge edge) const {
  return std::binary_search(cut.begin(), cut.end(), edge) || std::binary_search(absent.begin(), absent.end(), edge.from) ||
         std::binary_search(absent.begin(), absent.end(), edge.to);
}

std::size_t Schedule::epoch_of(Round k) const {
  const auto after =
      std::upper_bound(epochs_.begin(), epochs_.end(), k, [](Round round, const Epoch& epoch) { return round < epoch.first; });
  return static_cast<std::size_t>(after - epochs_.begin()) - 1;
}

Round Schedule::last_of_epoch(std::size_t epoch) const { return epoch + 1 < epochs_.size() ? epochs_[epoch + 1].first - 1 : kForEver; }

Schedule::Span Schedule::span_of(const FixedSchedule& fixed, Round k) const {
  if (fixed.intervals.size() == 1) return {0, kForEver, 0};
  const std::uint64_t origin = fixed.periodic ? k - k % ends_.back() : 0;
  const auto end = std::upper_bound(ends_.begin(), ends_.end() - 1, k - origin);
  const auto index = static_cast<std::uint32_t>(end - ends_.begin());
  const bool held = !fixed.periodic && index + 1 == ends_.size();
  const std::uint64_t first = origin + (index == 0 ? 0 : ends_[index - 1]);
  const std::uint64_t last = held ? kForEver : std::min<std::uint64_t>(origin + *end - 1, kForEver);
  return {static_cast<Round>(first), static_cast<Round>(last), index};
}

Schedule::Span Schedule::span_of(const RandomPairs& pairs, Round k) const {
  auto& starts = memory_->starts;
  while (starts.back() <= k) {
    memory_->pairing_index = static_cast<std::uint32_t>(starts.size() - 1);
    draw_pairing(agents_, pairs, seed_, memory_->pairing_index, memory_->order, memory_->pairing);
    starts.push_back(starts.back() + memory_->pairing.dwell);
  }
  const auto after = std::upper_bound(starts.begin(), starts.end(), std::uint64_t{k});
  const std::uint64_t last = std::min<std::uint64_t>(*after - 1, kForEver);
  return {static_cast<Round>(*(after - 1)), static_cast<Round>(last), static_cast<std::uint32_t>(after - starts.begin() - 1)};
}

std::shared_ptr<const Graph> Schedule::base_graph(std::uint32_t index) const {
  if (const auto* fixed = std::get_if<FixedSchedule>(&spec_)) return fixed->intervals[index].graph;
  if (const auto* links = std::get_if<RandomLinks>(&spec_)) return std::make_shared<const Graph>(sample_of(*links, seed_, index));
  if (memory_->pairing_index != index) {
    draw_pairing(agents_, std::get<RandomPairs>(spec_), seed_, index, memory_->order, memory_->pairing);
    memory_->pairing_index = index;
  }
  return std::make_shared<const Graph>(graph_of_pairing(memory_->pairing));
}

std::shared_ptr<const Graph> Schedule::graph_of(std::uint32_t index, std::size_t epoch) const {
  const Epoch& now = epochs_[epoch];
  if (now.whole() && std::holds_alternative<FixedSchedule>(spec_)) return base_graph(index);
  Memory::Slot& slot = memory_->slots[(index + epoch) % Memory::kSlots];
  if (slot.graph != nullptr && slot.index == index && slot.epoch == epoch) return slot.graph;
  auto graph = base_graph(index);
  if (!now.whole()) {
    auto edges = graph->edges();
    std::erase_if(edges, [&now](const WeightedEdge& e) { return now.lacks(e.edge); });
    if (edges.size() < graph->edge_count()) graph = std::make_shared<const Graph>(agents_, std::span<const WeightedEdge>(edges));
  }
  slot = {index, epoch, graph};
  return graph;
}

Schedule::Segment Schedule::segment(Round k) const {
  const std::lock_guard lock(memory_->mutex);
  Span span{k, k, k};  // random links: every round on its own
  if (const auto* fixed = std::get_if<FixedSchedule>(&spec_)) span = span_of(*fixed, k);
  if (const auto* pairs = std::get_if<RandomPairs>(&spec_)) span = span_of(*pairs, k);
  const std::size_t epoch = epoch_of(k);
  return {std::max(span.first, epochs_[epoch].first), std::min(span.last, last_of_epoch(epoch)), graph_of(span.index, epoch)};
}

std::shared_ptr<const Graph> Schedule::support(Round rounds) const {
  const auto* fixed = std::get_if<FixedSchedule>(&spec_);
  const auto* links = std::get_if<RandomLinks>(&spec_);
  if (rounds == 0 || (fixed != nullptr && fixed->intervals.size() > 1)) return std::make_shared<const Graph>(union_over(0, rounds));
  // Every edge that may be drawn, but for those that are missing throughout.
  const auto all = fixed != nullptr   ? fixed->intervals.front().graph
                   : links != nullptr ? links->base
                                      : std::make_shared<const Graph>(complete(agents_));
  const std::span during(epochs_.data(), epoch_of(rounds - 1) + 1);
  if (std::any_of(during.begin(), during.end(), [](const Epoch& epoch) { return epoch.whole(); })) return all;
  auto edges = all->edges();
  std::erase_if(edges, [&](const WeightedEdge& e) {
    return std::all_of(during.begin(), during.end(), [&e](const Epoch& epoch) { return epoch.lacks(e.edge); });
  });
  return std::make_shared<const Graph>(agents_, std::span<const WeightedEdge>(edges));
}

double Schedule::most_edges() const {
  const double pairs = static_cast<double>(agents_) * (static_cast<double>(agents_) - 1.0);
  if (const auto* links = std::get_if<RandomLinks>(&spec_)) return static_cast<double>(links->base->edge_count());
  const auto* fixed = std::get_if<FixedSchedule>(&spec_);
  if (fixed == nullptr) return pairs;
  double edges = 0.0;
  for (const auto& interval : fixed->intervals) edges += static_cast<double>(interval.graph->edge_count());
  return std::min(edges, pairs);
}

Graph Schedule::union_over(Round first, Round window) const {
  const auto* fixed = std::get_if<FixedSchedule>(&spec_);
  const std::uint64_t end = std::min<std::uint64_t>(std::uint64_t{first} + window, std::uint64_t{kForEver} + 1);
  EdgeUnion all;
  std::shared_ptr<const Graph> newest;
  for (std::uint64_t k = first; k < end;) {
    const std::uint64_t epoch_end = std::min<std::uint64_t>(std::uint64_t{last_of_epoch(epoch_of(static_cast<Round>(k)))} + 1, end);
    // Within an epoch a periodic topology shows all its graphs in one period.
    const std::uint64_t enough = fixed != nullptr && fixed->periodic ? std::min(epoch_end, k + ends_.back()) : epoch_end;
    while (k < enough) {
      const Segment part = segment(static_cast<Round>(k));
      if (part.graph != newest) all.add(*part.graph);
      newest = part.graph;
      k = std::uint64_t{part.last} + 1;
    }
    k = std::max(k, epoch_end);
  }
  return all.graph(agents_);
}

bool Schedule::constant() const {
  const Segment start = segment(0);
  return start.first == 0 && start.last == kForEver;
}

}  // namespace consort
