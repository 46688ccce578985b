/// What protocols say is worth recording beside their estimates.

#include "protocols/registry.hpp"
#include "tests/support/direct.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace consort {
namespace {

std::unique_ptr<Protocol> made(std::string_view name, const Values& initial) {
  return find_protocol(name).make({}, Setup{.self = AgentId{1}, .agents = 3, .initial = initial});
}

std::vector<double> recorded_by(const Protocol& protocol) {
  std::vector<double> numbers(protocol.recorded_layout().size());
  protocol.recorded(numbers);
  return numbers;
}

Values two_dimensional() {
  Values initial;
  initial.set("x", Vector(Vector::Constant(2, 1.0)));
  initial.set("P", (Matrix(2, 2) << 4.0, 1.0, 1.0, 2.0).finished());
  return initial;
}

TEST(Recorded, KalmanProtocolsRecordTheirCovariance) {
  for (const char* name : {"kalman_consensus", "continuous_kalman_consensus", "unbiased_kalman_consensus"}) {
    SCOPED_TRACE(name);
    const auto protocol = made(name, two_dimensional());
    EXPECT_EQ(protocol->recorded_layout().fields, (std::vector<Field>{{"P", 2, 2}}));
    EXPECT_EQ(recorded_by(*protocol), (std::vector{4.0, 1.0, 1.0, 2.0}));
  }
}

TEST(Recorded, InformationProtocolsRecordTheirInformation) {
  for (const char* name : {"unbiased_information_consensus", "robust_information_consensus"}) {
    SCOPED_TRACE(name);
    const auto protocol = made(name, two_dimensional());
    EXPECT_EQ(protocol->recorded_layout().fields, (std::vector<Field>{{"Y", 2, 2}}));
    const std::vector<double> Y = recorded_by(*protocol);
    EXPECT_NEAR(Y[0], 2.0 / 7.0, 1e-15);
    EXPECT_NEAR(Y[1], -1.0 / 7.0, 1e-15);
    EXPECT_NEAR(Y[3], 4.0 / 7.0, 1e-15);
  }
}

TEST(Recorded, NamesDifferFromThoseOfTheEstimate) {
  for (const ProtocolEntry& entry : protocol_table()) {
    std::set<std::string_view> names;
    for (const auto docs : {entry.estimate, entry.recorded})
      for (const ValueDoc& doc : docs) {
        EXPECT_TRUE(names.insert(doc.name).second) << entry.name << ": " << doc.name;
        EXPECT_FALSE(doc.meaning.empty()) << entry.name << ": " << doc.name;
      }
    EXPECT_FALSE(entry.estimate.empty()) << entry.name;
  }
}

TEST(Recorded, WholeFieldsUpToSixteenNumbersUnlessTheFileSaysOtherwise) {
  const Layout all{{{"u", 2, 1}, {"e", 14, 1}, {"P", 3, 3}, {"q", 1, 1}}};
  EXPECT_EQ(recorded_part(all, std::nullopt).fields, (std::vector<Field>{{"u", 2, 1}, {"e", 14, 1}}));
  EXPECT_EQ(recorded_part(all, true), all);
  EXPECT_EQ(recorded_part(all, false).size(), 0u);
  EXPECT_EQ(recorded_part({{{"P", 4, 4}}}, std::nullopt).size(), 16u);
  EXPECT_EQ(recorded_part({{{"P", 5, 5}}}, std::nullopt).size(), 0u);
}

/// u and more, of which something may be infinite.
struct Steering {
  static constexpr std::string_view name = "steering", summary = "s", source = "s", assumptions = "a";
  static constexpr std::array<ValueDoc, 0> parameters{}, initial{};
  static constexpr std::array recorded_values{ValueDoc{"gain", "scalar", "", "g"}, ValueDoc{"P", "matrix 2 x 2", "", "p"}};
  struct Params {};
  struct State {
    Vector x, u;
    double gain;
    Matrix P;
  };
  struct Message {
    double x = 0.0;
    static constexpr std::array<std::string_view, 1> field_names{"x"};
    static constexpr std::string_view noisy_field = "x";
    static auto fields(auto& m) { return std::tie(m.x); }
  };
  static Params params(const Values&, Eigen::Index) { return {}; }
  static State init(const Params&, const Setup&) {
    return {Vector::Zero(1), Vector::Constant(2, 3.0), std::numeric_limits<double>::infinity(), Matrix::Identity(2, 2)};
  }
  static Message message(const Params&, const State&, const Sense&) { return {}; }
  static State transition(const Params&, const State& s, const Sense&, HeardInbox<Message>) { return s; }
  static const Vector& estimate(const State& s) { return s.x; }
  static const Vector& control(const Params&, const State& s) { return s.u; }
  static auto recorded(const Params&, const State& s) { return std::tie(s.gain, s.P); }
};

TEST(Recorded, ControlOfWhoSteersComesFirstAndWhatIsNotFiniteIsAbsent) {
  Values initial;
  initial.set("x", 0.0);
  const ProtocolOf<Steering> protocol({}, consort::Setup{.self = AgentId{1}, .agents = 1, .initial = initial});
  EXPECT_EQ(protocol.recorded_layout().fields, (std::vector<Field>{{"u", 2, 1}, {"gain", 1, 1}, {"P", 2, 2}}));
  const std::vector<double> numbers = recorded_by(protocol);
  EXPECT_EQ(std::vector(numbers.begin(), numbers.begin() + 2), (std::vector{3.0, 3.0}));
  EXPECT_TRUE(is_absent(numbers[2]));
  EXPECT_EQ(std::vector(numbers.begin() + 3, numbers.end()), (std::vector{1.0, 0.0, 0.0, 1.0}));
  const ProtocolOf<Steering> among_longer({}, consort::Setup{.self = AgentId{1}, .agents = 2, .initial = initial, .largest_control = 3});
  EXPECT_EQ(among_longer.recorded_layout().fields[0], (Field{"u", 3, 1})) << "all agents record as much";
  EXPECT_TRUE(is_absent(recorded_by(among_longer)[2])) << "what one of them lacks is absent";
  std::vector<double> first(2);
  protocol.recorded(first);
  EXPECT_EQ(first, (std::vector{3.0, 3.0})) << "a part of it ends where a field does";
}

}  // namespace
}  // namespace consort
