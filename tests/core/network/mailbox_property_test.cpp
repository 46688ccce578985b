#include "core/network/mailbox.hpp"

#include "tests/core/cases.hpp"
#include "tests/support/sanitized.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <map>

// Counts heap allocations by standing in front of malloc; sanitizers bring their own.
#ifndef CONSORT_SANITIZED
#define CONSORT_COUNTS_ALLOCATIONS
namespace {
std::atomic<std::uint64_t> allocations = 0;
}
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
#endif

namespace consort {
namespace {

using Post = Mailbox::Post;

/// A received message that owns its numbers.
struct Kept {
  AgentId from;
  Round sent;
  double weight;
  std::vector<double> payload;
  bool operator==(const Kept&) const = default;
};

std::vector<Kept> kept(Inbox inbox) {
  std::vector<Kept> messages;
  for (const Received& received : inbox)
    messages.push_back({received.from, received.sent, received.weight, {received.payload.begin(), received.payload.end()}});
  return messages;
}

/// The mailbox as one would write it down: a list of all that is under way.
class PlainMailbox {
 public:
  PlainMailbox(AgentId self, Layout layout, LinkModel links, Seed seed)
      : self_(self), layout_(std::move(layout)), links_(std::move(links)), seed_(seed) {}

  template <class PayloadOf>
  std::vector<Kept> take(Round k, std::span<const Neighbour> in_neighbours, const PayloadOf& payload_of) {
    for (const auto& [from, weight] : in_neighbours) {
      const Link link({from, self_}, links_.of({from, self_}, k), static_cast<Eigen::Index>(layout_.noise_size), seed_);
      LinkCounters& counter = counters[from];
      if (link.lost(k)) {
        ++counter.lost;
        continue;
      }
      std::vector<double> payload = payload_of(from, k);
      link.disturb(k, std::span(payload).subspan(layout_.noise_offset, layout_.noise_size));
      under_way_.push_back({k + link.delay(k), {from, k, weight, payload}});
      if (const auto again = link.copy_delay(k)) {
        ++counter.duplicated;
        under_way_.push_back({k + *again, {from, k, weight, payload}});
      }
    }
    std::map<AgentId, Kept> due_now;
    for (const auto& [due, message] : under_way_) {
      if (due > k) continue;
      LinkCounters& counter = counters[message.from];
      if (newest_.contains(message.from) && message.sent < newest_[message.from]) ++counter.reordered;
      if (due_now.contains(message.from)) ++counter.superseded;
      due_now[message.from] = message;  // the list is ascending in `sent`
    }
    std::erase_if(under_way_, [k](const auto& entry) { return entry.first <= k; });
    std::vector<Kept> inbox;
    for (const auto& [from, message] : due_now) {
      ++counters[from].delivered;
      newest_[from] = std::max(newest_[from], message.sent);
      inbox.push_back(message);
    }
    return inbox;
  }

  [[nodiscard]] std::uint64_t under_way(AgentId from) const {
    return static_cast<std::uint64_t>(
        std::count_if(under_way_.begin(), under_way_.end(), [from](const auto& entry) { return entry.second.from == from; }));
  }

  std::map<AgentId, LinkCounters> counters;

 private:
  AgentId self_;
  Layout layout_;
  LinkModel links_;
  Seed seed_;
  std::vector<std::pair<Round, Kept>> under_way_;
  std::map<AgentId, Round> newest_;  // that has arrived in a round before
};

/// An agent in a random switching topology with random links.
struct Case {
  explicit Case(std::uint64_t seed_value) : seed{seed_value}, stream(seed.stream(Purpose{"mailbox case"})) {
    agents = 2 + stream.below(6);
    self = agent_at(stream.below(agents));
    layout.fields = {{"x", 1 + stream.below(3), 1}, {"P", 1, 1}};
    layout.noise_size = layout.fields[0].size();
    for (std::size_t i = 0; i < agents; ++i) {
      if (agent_at(i) != self) senders.push_back(agent_at(i));
    }
    links.standard = random_link();
    for (const AgentId from : senders) {
      if (stream.uniform() < 0.3) links.overrides[{from, self}] = random_link();
    }
    if (stream.uniform() < 0.3) links.changes.push_back({static_cast<Round>(stream.below(kRounds)), std::nullopt, random_link()});
    if (stream.uniform() < 0.3) links.changes.push_back({kRounds / 2, Edge{senders.front(), self}, random_link()});
    std::sort(links.changes.begin(), links.changes.end(), [](const auto& a, const auto& b) { return a.since < b.since; });
    for (Round k = 0; k < kRounds; ++k) graphs.push_back(cases::random_graph(stream, agents, 0.6));
  }

  LinkSpec random_link() {
    LinkSpec spec;
    if (stream.uniform() < 0.5) spec.loss_probability = stream.uniform();
    if (stream.uniform() < 0.5) spec.delay_rounds = static_cast<Round>(stream.below(5));
    if (stream.uniform() < 0.5) spec.noise_covariance = Matrix::Constant(1, 1, stream.uniform());
    if (stream.uniform() < 0.3) spec.bursts = BurstLoss{stream.uniform(), stream.uniform(), stream.uniform(), stream.uniform()};
    if (stream.uniform() < 0.5) {
      const auto kind = static_cast<Jitter::Kind>(1 + stream.below(3));
      spec.jitter = {kind, 2 * stream.uniform(), static_cast<double>(stream.below(4))};
    }
    if (stream.uniform() < 0.3) spec.duplication = stream.uniform();
    if (stream.uniform() < 0.3) spec.reordering = Reordering{stream.uniform(), static_cast<Round>(1 + stream.below(3))};
    if (stream.uniform() < 0.3) spec.quantiser = Quantiser{4, -2.0, 2.0};
    return spec;
  }

  [[nodiscard]] std::vector<double> payload(AgentId from, Round sent) const {
    Stream numbers = seed.stream(Purpose{"payload"}, from.value, sent);
    std::vector<double> values(layout.size());
    for (double& value : values) value = numbers.normal();
    return values;
  }

  /// Messages that `from` has sent in all rounds.
  [[nodiscard]] std::uint64_t emitted(AgentId from) const {
    std::uint64_t count = 0;
    for (Round k = 0; k < kRounds; ++k)
      for (const Neighbour& neighbour : in_neighbours(k)) count += neighbour.id == from;
    return count;
  }

  [[nodiscard]] Mailbox mailbox() const { return Mailbox(self, senders, layout, links, seed, kWindow); }
  [[nodiscard]] std::span<const Neighbour> in_neighbours(Round k) const { return graphs[k].in_neighbours(self); }

  /// Before round k is taken: random messages of rounds up to the window ahead, repeats, then what is missing; in random order.
  void post_round(Mailbox& box, Round k, Stream& order) const {
    std::vector<std::pair<AgentId, Round>> messages;
    for (const AgentId from : senders) {
      for (Round sent = k; sent <= k + kWindow; ++sent) {
        const bool needed = sent == k && !box.heard(from, k);
        if (needed || order.uniform() < 0.3) messages.push_back({from, sent});
      }
    }
    cases::shuffle(order, messages);
    for (const auto& [from, sent] : messages) {
      const bool heard = box.heard(from, sent);
      // A repeat with other numbers must change nothing.
      std::vector<double> numbers = payload(from, sent);
      if (heard) numbers[0] += 1.0;
      ASSERT_EQ(box.post(from, sent, numbers), heard ? Post::duplicate : Post::accepted);
      ASSERT_TRUE(box.heard(from, sent));
    }
    ASSERT_EQ(box.missing(k, in_neighbours(k)), 0U);
  }

  static constexpr Round kRounds = 40;
  static constexpr Round kWindow = 6;
  Seed seed;
  Stream stream;
  std::size_t agents = 0;
  AgentId self;
  std::vector<AgentId> senders;
  Layout layout;
  LinkModel links;
  std::vector<Graph> graphs;
};

TEST(Mailbox, AgreesWithThePlainOneInWhateverOrderMessagesCome) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const Case c(seed);
    Mailbox posted = c.mailbox(), shuffled = c.mailbox(), supplied = c.mailbox();
    PlainMailbox plain(c.self, c.layout, c.links, c.seed);
    Stream one = c.seed.stream(Purpose{"order one"}), other = c.seed.stream(Purpose{"order two"});
    for (Round k = 0; k < Case::kRounds; ++k) {
      SCOPED_TRACE(k);
      c.post_round(posted, k, one);
      c.post_round(shuffled, k, other);
      const auto expected = plain.take(k, c.in_neighbours(k), [&c](AgentId from, Round sent) { return c.payload(from, sent); });
      ASSERT_TRUE(kept(posted.take(k, c.in_neighbours(k))) == expected);
      ASSERT_TRUE(kept(shuffled.take(k, c.in_neighbours(k))) == expected);
      std::vector<std::vector<double>> numbers;
      for (std::size_t i = 0; i < c.agents; ++i) numbers.push_back(c.payload(agent_at(i), k));
      const Inbox inbox = supplied.take_from(k, c.in_neighbours(k), [&](std::size_t i) { return std::span<const double>(numbers[i]); });
      ASSERT_TRUE(kept(inbox) == expected);
    }
    for (const AgentId from : c.senders) {
      for (const Mailbox* box : {&posted, &shuffled, &supplied}) {
        const LinkCounters found = box->counters(from);
        ASSERT_EQ(found, plain.counters[from]);
        ASSERT_EQ(c.emitted(from) + found.duplicated, found.delivered + found.lost + found.superseded + plain.under_way(from));
      }
    }
  }
}

TEST(Mailbox, DrawsTheSameWithMoreSenders) {
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    const Case c(seed);
    std::vector<AgentId> more = c.senders;
    for (std::size_t extra = 0; extra < 3; ++extra) more.push_back(agent_at(c.agents + extra));
    Mailbox small = c.mailbox(), large(c.self, more, c.layout, c.links, c.seed, Case::kWindow);
    Stream order = c.seed.stream(Purpose{"order"});
    for (Round k = 0; k < Case::kRounds; ++k) {
      SCOPED_TRACE(k);
      c.post_round(small, k, order);
      c.post_round(large, k, order);
      large.post(more.back(), k, c.payload(more.back(), k));
      ASSERT_TRUE(kept(small.take(k, c.in_neighbours(k))) == kept(large.take(k, c.in_neighbours(k))));
    }
  }
}

#ifdef CONSORT_COUNTS_ALLOCATIONS
TEST(Mailbox, AllocatesNothingInSteadyState) {
  constexpr std::size_t kAgents = 12;
  const Layout layout{{{"x", 4, 1}}, 0, 4};
  const Graph graph = complete(kAgents);
  const auto neighbours = graph.in_neighbours(AgentId{1});
  std::vector<AgentId> senders;
  for (const Neighbour& neighbour : neighbours) senders.push_back(neighbour.id);
  const std::vector<double> numbers(4, 1.0);
  for (const LinkSpec& spec :
       {LinkSpec{}, LinkSpec{0.3, 0, Matrix()}, LinkSpec{0.0, 0, Matrix::Identity(4, 4)}, LinkSpec{0.3, 3, Matrix::Ones(4, 4)},
        LinkSpec{.delay_rounds = 2, .bursts = BurstLoss{0.1, 0.5}, .duplication = 1.0, .quantiser = Quantiser{}}}) {
    Mailbox posted(AgentId{1}, senders, layout, {spec, {}}, Seed{1}, 8), supplied = posted;
    std::uint64_t before = 0;
    for (Round k = 0; k < 400; ++k) {
      if (k == 200) before = allocations;
      for (std::size_t s = 0; s < senders.size(); ++s) posted.post(senders[s], k + static_cast<Round>((s + k) % 8), numbers);
      for (const AgentId from : senders) posted.post(from, k, numbers);
      (void)posted.take(k, neighbours);
      (void)supplied.take_from(k, neighbours, [&numbers](std::size_t) { return std::span<const double>(numbers); });
    }
    const std::uint64_t after = allocations;
    EXPECT_EQ(after, before);
    EXPECT_GT(before, 0U);
    EXPECT_GT(posted.counters().delivered, 2000U);
  }
}
#endif

}  // namespace
}  // namespace consort
