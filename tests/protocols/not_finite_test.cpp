/// A protocol whose numbers leave the range of double says so, with its name, the agent and the round, and hands nothing on.

#include "protocols/adapter.hpp"
#include "protocols/registry.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

namespace consort {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Its estimate is what it hears, and it sends a number of its own.
template <Truth kTruth>
struct Echo {
  static constexpr std::string_view name = "echo";
  static constexpr std::string_view summary = "", source = "", assumptions = "";
  static constexpr Truth truth = kTruth;
  static constexpr std::array<ValueDoc, 0> parameters{};
  static constexpr std::array initial{ValueDoc{"x", "vector n", "", ""}};
  struct Params {};
  struct State {
    Vector x;
  };
  struct Message {
    Vector x;
    static constexpr std::array<std::string_view, 1> field_names{"x"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x); }
  };
  static Params params(const Values&, Eigen::Index) { return {}; }
  static State init(const Params&, const consort::Setup& setup) { return {setup.initial.vector("x")}; }
  static Message message(const Params&, const State& s, const Sense&) { return {s.x}; }
  static State transition(const Params&, const State&, const Sense&, HeardInbox<Message> inbox) { return {inbox[0].message.x}; }
  static const Vector& estimate(const State& s) { return s.x; }
};

std::string told(const std::function<void()>& action) {
  try {
    action();
  } catch (const RunError& error) {
    return error.what();
  }
  return "nothing";
}

template <Truth kTruth>
std::string after_hearing(double number) {
  Values initial;
  initial.set("x", Matrix(Vector::Zero(3)));
  ProtocolOf<Echo<kTruth>> protocol({}, consort::Setup{AgentId{4}, 9, 1.0, initial});
  const std::array<double, 3> payload{1.0, number, 2.0};
  return told([&] {
    protocol.absorb(Sense{.k = 17, .in_neighbours = {}, .y = {}, .self = AgentId{4}}, std::array{Received{AgentId{2}, 17, 1.0, payload}});
  });
}

TEST(NotFinite, EndsTheRunInTheRoundInWhichItHappens) {
  const std::string text = "echo: agent 4, round 17: the estimate is no longer finite";
  for (const double number : {kInfinity, -kInfinity, kNaN}) {
    EXPECT_EQ(after_hearing<Truth::none>(number), text);
    EXPECT_EQ(after_hearing<Truth::everybody>(number), text);
  }
  EXPECT_EQ(after_hearing<Truth::none>(kAbsent), text) << "nobody is absent here";
  EXPECT_EQ(after_hearing<Truth::everybody>(kAbsent), "nothing") << "an absent agent has no numbers";
  EXPECT_EQ(after_hearing<Truth::none>(1.7e308), "nothing");
}

TEST(NotFinite, IsNotSentEither) {
  Values initial;
  initial.set("x", Matrix(Vector::Constant(2, kInfinity)));
  const ProtocolOf<Echo<Truth::none>> protocol({}, consort::Setup{AgentId{4}, 9, 1.0, initial});
  std::vector<double> payload(2);
  EXPECT_EQ(told([&] { protocol.emit(Sense{.k = 3, .in_neighbours = {}, .y = {}, .self = AgentId{4}}, payload); }),
            "echo: agent 4, round 3: what it sends is no longer finite");
}

/// Values that every protocol accepts.
Values plain(std::span<const ValueDoc> docs, Eigen::Index n) {
  Values out;
  for (const ValueDoc& doc : docs)
    if (doc.fallback.empty()) out.set(doc.name, doc.shape == "vector n" ? Matrix(Vector::Ones(n)) : Matrix::Ones(1, 1));
  return out;
}

/// x' = A x + B u seen whole, of n states.
Values known(Eigen::Index n) {
  Values model;
  Matrix A = Matrix::Zero(n, n);
  for (Eigen::Index i = 0; i + 1 < n; ++i) A(i, i + 1) = 1.0;
  model.set("A", A);
  model.set("B", Matrix(Matrix::Identity(n, n).rightCols(1)));
  model.set("C", Matrix(Matrix::Identity(n, n)));
  return model;
}

TEST(NotFinite, NoProtocolHandsItOn) {
  std::size_t ended = 0;
  for (const ProtocolEntry& entry : protocol_table()) {
    if (entry.truth == Truth::everybody) continue;  // their numbers come with announcements: see Echo
    std::string text;
    for (const Eigen::Index n : {0, 1, 2}) {  // 0: no plant
      if (n == 0 && entry.needs_plant) continue;
      const Values parameters = plain(entry.parameters, std::max<Eigen::Index>(n, 1)),
                   initial = plain(entry.initial, std::max<Eigen::Index>(n, 1)), model = n > 0 ? known(n) : Values{};
      std::unique_ptr<Protocol> protocol;
      try {
        protocol = entry.make(parameters, consort::Setup{AgentId{1}, 3, 0.5, initial, model, static_cast<std::size_t>(n)});
      } catch (const ConfigError&) {
        continue;  // it wants another plant
      }
      if (entry.name == "minimum_energy_consensus" || entry.name == "measured_consensus") continue;  // they measure whom they hear
      std::vector<double> y(static_cast<std::size_t>(n)), sent(protocol->message_layout().size()), u(protocol->control_size()),
          estimate(protocol->estimate_layout().size()), heard(sent.size());
      const std::array neighbours{Neighbour{AgentId{2}, 1e3}};
      const auto all_finite = [](const std::vector<double>& values) {
        return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
      };
      Round k = 0;
      text = told([&] {
        for (; k < 60; ++k) {
          const double huge = k % 2 == 0 ? 1.7e308 : -1.7e308;
          std::fill(y.begin(), y.end(), huge);
          const Sense sense{.k = k, .dt = 0.5, .in_neighbours = neighbours, .out_degree = 1, .y = y, .self = AgentId{1}};
          protocol->emit(sense, sent);
          ASSERT_TRUE(all_finite(sent)) << entry.name;
          heard = sent;  // what a neighbour of the same kind might say, but far away
          for (std::size_t i = 0; i < protocol->message_layout().noise_size; ++i)
            heard[protocol->message_layout().noise_offset + i] = -huge;
          protocol->absorb(sense, std::array{Received{AgentId{2}, k, 1e3, heard}});
          protocol->estimate(estimate);
          protocol->control(u);
          ASSERT_TRUE(all_finite(estimate) && all_finite(u)) << entry.name;
        }
      });
      if (text == "nothing") continue;
      const std::string place = std::string(entry.name) + ": agent 1, round " + std::to_string(k) + ": ";
      EXPECT_EQ(text.substr(0, place.size()), place) << text;
      ++ended;
      break;
    }
  }
  EXPECT_GE(ended, 15U) << "averages of finite numbers are finite; nearly nothing else is for ever";
}

}  // namespace
}  // namespace consort
