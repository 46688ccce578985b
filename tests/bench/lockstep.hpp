#pragma once
/// The arithmetic and the waiting of the raw programs: local voting on eight states in lockstep, with no link model, no telemetry, no
/// orchestrator. It is what an agent process cannot do without, and so the yardstick of Consort's own rounds per second.

#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

namespace consort::bench {

/// 72 bytes: a sender, its round, its state.
struct Message {
  std::uint32_t id;
  std::uint32_t round;
  double x[8];
};
static_assert(sizeof(Message) == 72);

enum class Shape { ring, complete };

/// In-neighbours of agent `id` of 0..n-1. Both shapes are undirected.
inline std::vector<std::uint32_t> neighbours_of(Shape shape, std::uint32_t n, std::uint32_t id) {
  std::vector<std::uint32_t> result;
  if (shape == Shape::ring) {
    if (n > 1) result.push_back((id + n - 1) % n);
    if (n > 2) result.push_back((id + 1) % n);
    return result;
  }
  for (std::uint32_t other = 0; other < n; ++other)
    if (other != id) result.push_back(other);
  return result;
}

/// The agents one process hosts: `count` from `first` on. Neighbours among them are reached by a direct call. An undirected neighbour is at
/// most one round ahead, so two rounds of sums are enough. Not thread-safe.
class Agents {
 public:
  Agents(Shape shape, std::uint32_t n, std::uint32_t first, std::uint32_t count) : routes_(n) {
    for (std::uint32_t id = first; id < first + count; ++id) add(shape, n, id, first, count);
  }

  /// Publishes round 0 of everybody; `publish(agent index, message)` is called for agents somebody elsewhere listens to.
  template <class Publish>
  void start(Publish&& publish) {
    for (Agent& agent : agents_) send(agent, publish);
    settle(publish);
  }

  /// A message from another process. What is not the sender's next round is dropped: a repetition, or the successor of a lost one.
  template <class Publish>
  void receive(const Message& message, Publish&& publish) {
    deliver(message);
    settle(publish);
  }

  /// Publishes the last two rounds again, for whoever missed one.
  template <class Publish>
  void repeat(Publish&& publish) {
    for (Agent& agent : agents_) {
      if (!agent.heard_elsewhere) continue;
      if (agent.round > 0) publish(agent.index, agent.sent[(agent.round + 1) % 2]);
      publish(agent.index, agent.sent[agent.round % 2]);
    }
  }

  std::size_t size() const { return agents_.size(); }
  bool heard_elsewhere(std::size_t index) const { return agents_[index].heard_elsewhere; }
  std::uint64_t rounds() const { return agents_.front().round; }
  std::uint64_t delivered() const { return delivered_; }

 private:
  struct Agent {
    std::uint32_t id = 0, index = 0, round = 0;
    bool heard_elsewhere = false;
    std::array<double, 8> x{};
    std::array<std::array<double, 8>, 2> sum{};
    std::array<std::uint32_t, 2> count{};
    std::vector<std::uint32_t> expected;  // next round, by in-neighbour
    std::array<Message, 2> sent{};        // by parity of the round
    double step = 0.0;
  };
  struct Route {
    std::uint32_t agent, slot;
  };

  void add(Shape shape, std::uint32_t n, std::uint32_t id, std::uint32_t first, std::uint32_t count) {
    Agent agent;
    agent.id = id;
    agent.index = static_cast<std::uint32_t>(agents_.size());
    const std::vector<std::uint32_t> neighbours = neighbours_of(shape, n, id);
    agent.expected.assign(neighbours.size(), 0);
    agent.step = 0.5 / static_cast<double>(neighbours.size() + 1);
    for (std::size_t i = 0; i < agent.x.size(); ++i) agent.x[i] = static_cast<double>((id * 37 + i * 11) % 100) / 100.0;
    for (std::uint32_t slot = 0; slot < neighbours.size(); ++slot) {
      routes_[neighbours[slot]].push_back({agent.index, slot});
      agent.heard_elsewhere |= neighbours[slot] < first || neighbours[slot] >= first + count;
    }
    agents_.push_back(std::move(agent));
  }

  void deliver(const Message& message) {
    for (const Route route : routes_[message.id]) {
      Agent& agent = agents_[route.agent];
      if (agent.expected[route.slot] != message.round) continue;
      ++agent.expected[route.slot];
      ++delivered_;
      const std::size_t parity = message.round % 2;
      for (std::size_t i = 0; i < 8; ++i) agent.sum[parity][i] += message.x[i];
      if (++agent.count[parity] == agent.expected.size() && agent.round == message.round) complete_.push_back(route.agent);
    }
  }

  template <class Publish>
  void settle(Publish&& publish) {
    while (!complete_.empty()) {
      Agent& agent = agents_[complete_.back()];
      complete_.pop_back();
      const std::size_t parity = agent.round % 2;
      const double degree = static_cast<double>(agent.expected.size());
      for (std::size_t i = 0; i < 8; ++i) agent.x[i] += agent.step * (agent.sum[parity][i] - degree * agent.x[i]);
      agent.sum[parity] = {};
      agent.count[parity] = 0;
      ++agent.round;
      if (agent.count[agent.round % 2] == agent.expected.size()) complete_.push_back(agent.index);
      send(agent, publish);
    }
  }

  template <class Publish>
  void send(Agent& agent, Publish&& publish) {
    Message& message = agent.sent[agent.round % 2];
    message.id = agent.id;
    message.round = agent.round;
    std::memcpy(message.x, agent.x.data(), sizeof message.x);
    if (agent.heard_elsewhere) publish(agent.index, message);
    deliver(message);
  }

  std::vector<Agent> agents_;
  std::vector<std::vector<Route>> routes_;  // by sender
  std::vector<std::uint32_t> complete_;     // agents whose round is complete
  std::uint64_t delivered_ = 0;
};

}  // namespace consort::bench
