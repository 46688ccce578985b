// What a round of the observers does with what one agent is given, by hand.

#include "protocols/everybody/distributed_observer.hpp"

#include "protocols/everybody/acyclic_sensing.hpp"
#include "protocols/everybody/cooperative_localization.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

namespace consort {
namespace {

constexpr Seconds kDt = 0.1;

Values values_of(const std::map<std::string, Matrix>& entries) {
  Values out;
  for (const auto& [name, value] : entries) out.set(name, value);
  return out;
}
Matrix one(double value) { return Matrix::Constant(1, 1, value); }

/// Agent 1 of three scalar agents x' = 0 that measure themselves.
class Agent {
 public:
  explicit Agent(std::map<std::string, Matrix> parameters, std::map<std::string, Matrix> model = {})
      : model_(values_of({{"A", one(0)}, {"B", one(1)}, {"C", one(1)}}).overridden_by(values_of(model))),
        initial_(values_of({{"x", one(4)}})),
        protocol_(values_of(parameters), Setup{AgentId{1}, 3, kDt, initial_, model_, 1, 1}) {
    told_[1] = told_[2] = &others_;
  }
  struct From {
    unsigned sender;
    std::vector<double> x, heard_of;
    double out_degree = 1.0;
  };
  void absorb(double y, const std::vector<unsigned>& neighbours, const std::vector<From>& heard) {
    std::vector<Neighbour> in;
    for (const unsigned j : neighbours) in.push_back({AgentId{j}, 1.0});
    std::vector<std::vector<double>> payloads;
    for (const From& from : heard) {
      payloads.push_back(from.x);
      payloads.back().insert(payloads.back().end(), from.heard_of.begin(), from.heard_of.end());
      payloads.back().push_back(from.out_degree);
    }
    std::vector<Received> inbox;
    for (std::size_t i = 0; i < heard.size(); ++i) inbox.push_back({AgentId{heard[i].sender}, k_, 1.0, payloads[i]});
    protocol_.absorb(Sense{k_++, kDt, in, 1, std::span(&y, 1), AgentId{1}, told_}, inbox);
  }
  [[nodiscard]] std::vector<double> estimate() const {
    std::vector<double> out(4);
    protocol_.estimate(out);
    return out;
  }
  [[nodiscard]] std::vector<double> emit() const {
    const double y = 0.0;
    std::vector<double> payload(protocol_.message_layout().size());
    protocol_.emit(Sense{k_, kDt, {}, 2, std::span(&y, 1), AgentId{1}, told_}, payload);
    return payload;
  }
  std::vector<const Values*> told_ = {nullptr, nullptr, nullptr};
  Values others_ = values_of({{"A", one(0)}, {"B", one(1)}});

 private:
  Values model_, initial_;
  ProtocolOf<DistributedObserver> protocol_;
  Round k_ = 0;
};

double factor(double d, double mu = 1.0) { return (1 - std::exp(-mu * d * kDt)) / d; }

TEST(DistributedObserver, CorrectsByTheFormulas) {
  Agent agent({{"F", one(2)}});
  agent.absorb(5, {2, 3}, {{2, {1, 7, -1}, {-1, 0, -1}}, {3, {2, 6, 9}, {-1, -1, 0}}});
  const auto x = agent.estimate();
  EXPECT_NEAR(x[0], 4 + factor(3) * ((1 - 4) + (2 - 4)), 1e-14) << "two neighbours and bar, which is at 4 itself";
  EXPECT_NEAR(x[1], 7 + factor(2) * (6 - 7), 1e-14) << "begins at 7: agent 3 has not heard of agent 2, but estimates it";
  EXPECT_NEAR(x[2], 9 + factor(2) * (-1 - 9), 1e-14);
  EXPECT_NEAR(x[3], 4 + kDt * 2 * (5 - 4), 1e-14) << "bar follows the measurement";
}

TEST(DistributedObserver, WeighsByDegrees) {
  const std::vector<Agent::From> heard{{2, {1, 0, 0}, {0, 0, -2}, 4}, {3, {2, 0, 0}, {0, -2, 0}, 2}};
  Agent in({{"F", one(0)}, {"weights", one(1)}, {"mu", one(3)}}), out({{"F", one(0)}, {"weights", one(2)}, {"mu", one(3)}});
  in.absorb(0, {2, 3}, heard);
  EXPECT_NEAR(in.estimate()[0], 4 + factor(1, 3) * (1. / 3 * (1 - 4) + 1. / 3 * (2 - 4)), 1e-14) << "bar is one of three";
  out.absorb(0, {2, 3}, heard);
  EXPECT_NEAR(out.estimate()[0], 4 + factor(1.75, 3) * (.25 * (1 - 4) + .5 * (2 - 4)), 1e-14) << "bar has one listener";
}

TEST(DistributedObserver, AMissingMessageIsAnAbsentTerm) {
  Agent agent({{"F", one(0)}, {"weights", one(1)}});
  agent.absorb(0, {2, 3}, {{2, {1, 0, 0}, {0, 0, -2}, 1}});
  EXPECT_NEAR(agent.estimate()[0], 4 + factor(2. / 3) * (1. / 3 * (1 - 4)), 1e-14) << "its sender still counts for the weights";
}

TEST(DistributedObserver, TellsWhomItHasHeardOf) {
  Agent agent({{"F", one(0)}});
  EXPECT_EQ(agent.emit(), (std::vector<double>{4, 0, 0, 0, -1, -1, 2})) << "x, heard of, out-degree; told of both others";
  agent.told_[2] = nullptr;
  EXPECT_EQ(agent.emit()[5], -2) << "agent 3 is not there";
  agent.absorb(0, {2}, {{2, {0, 0, 0}, {-2, 0, -2}, 1}});
  const auto said = agent.emit();
  EXPECT_EQ((std::vector<double>{said[3], said[4], said[5]}), (std::vector<double>{1, 0, -2}));
}

TEST(DistributedObserver, ForgetsAfterTheRoundsItTakesNewsToCrossTheTeam) {
  Agent agent({{"F", one(0)}});
  agent.absorb(0, {2}, {{2, {0, 5, 0}, {-2, 0, -2}, 1}});
  for (Round k = 1; k <= 2; ++k) {
    agent.absorb(0, {}, {});
    EXPECT_FALSE(is_absent(agent.estimate()[1])) << k;
  }
  agent.absorb(0, {}, {});
  EXPECT_TRUE(is_absent(agent.estimate()[1]));
  EXPECT_TRUE(is_absent(agent.estimate()[2])) << "told of, but never heard of";
  agent.absorb(0, {2}, {{2, {0, 5, 0}, {-2, 0, -2}, 1}});
  EXPECT_TRUE(is_absent(agent.estimate()[1])) << "old news do not bring it back";
  agent.absorb(0, {2}, {{2, {0, 5, 0}, {-2, 5, -2}, 1}});
  EXPECT_EQ(agent.estimate()[1], 5) << "new ones do, at what the neighbour tells";
}

TEST(DistributedObserver, CouplingsVanishWithTheAgentTheyComeFrom) {
  Agent agent({{"F", one(1)}}, {{"C_2", one(10)}, {"A_2", one(1)}});
  agent.absorb(24, {2}, {{2, {4, 2, 0}, {0, 0, -2}, 1}});
  EXPECT_NEAR(agent.estimate()[3], 4 + kDt * (24 - 4 - 20) + 2 * kDt, 1e-14) << "bar' = A_12 hat_2, and nothing surprises";
  for (int k = 0; k < 3; ++k) agent.absorb(4, {}, {});
  const double before = agent.estimate()[3];
  agent.absorb(before + 1, {}, {});
  EXPECT_NEAR(agent.estimate()[3], before + kDt * 1.0, 1e-14);
}

double mu(const std::map<std::string, Matrix>& parameters, std::size_t agents) {
  const Values model = values_of({{"A", one(1.2)}, {"B", one(1)}, {"C", one(1)}}), given = values_of(parameters), none;
  return EverybodyDesign(given, Setup{AgentId{1}, agents, kDt, none, model, 1, 1}, "t").mu;
}

TEST(DistributedObserver, ComputesMuFromItsRules) {
  EXPECT_EQ(mu({{"mu_rule", one(1)}}, 4), 308);
  EXPECT_EQ(mu({{"mu_rule", one(2)}}, 4), 575);
  EXPECT_EQ(mu({{"mu_rule", one(2)}, {"rho", one(2.4)}}, 4), 1149);
  EXPECT_EQ(mu({}, 4), 1);
  EXPECT_THROW(mu({{"mu_rule", one(2)}, {"mu", one(3)}}, 4), ConfigError);
  EXPECT_THROW(mu({{"rho", one(3)}}, 4), ConfigError);
  EXPECT_THROW(mu({{"mu", one(0)}}, 4), ConfigError);
  EXPECT_THROW(mu({{"patience", one(.5)}}, 4), ConfigError);
}

/// The text of the ConfigError that `act` throws.
std::string complaint(const std::function<void()>& act) {
  try {
    act();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(DistributedObserver, RefusesWhatDoesNotFitNamingTheAgent) {
  EXPECT_EQ(complaint([] { Agent({}); }),
            "protocol distributed_observer: agent 1: parameter 'F' is missing; allowed: the gain of the agent's own measurements");
  EXPECT_EQ(complaint([] {
              Agent({{"F", Matrix::Ones(2, 2)}});
            }),
            "protocol distributed_observer: agent 1: F is 2 x 2; allowed: 1 x 1, its diagonal, or one number");
  EXPECT_EQ(complaint([] {
              Agent({{"F", one(1)}, {"input_amplitude", Matrix::Ones(2, 1)}});
            }),
            "protocol distributed_observer: agent 1: input_amplitude is 2 x 1; allowed: one number, or one per input, 1");
}

// --- localisation -------------------------------------------------------------------------------------------------------

Setup vehicle(const Values& model, std::size_t measured) { return {AgentId{1}, 3, kDt, no_values(), model, measured, 1}; }

TEST(CooperativeLocalization, RefusesAPlantThatMeasuresOtherwise) {
  const Values model = values_of({{"A", one(0)}, {"B", one(1)}, {"C", one(1)}}), parameters = values_of({{"F", one(-1)}});
  EXPECT_EQ(complaint([&] { ProtocolOf<CooperativeLocalization>(parameters, vehicle(model, 1)); }),
            "protocol cooperative_localization: agent 1 measures itself; allowed: a plant with 'sensing: {relative: ..., absolute: ...}'");
}

TEST(CooperativeLocalization, HandsOverWhatItMeasuresAndSaysWhomItDoes) {
  const Values model = values_of({{"A", one(0)}, {"B", one(1)}, {"C", one(1)}, {"relative", Vector{{2, 3}}}}),
               parameters = values_of({{"F", one(-1)}});
  const ProtocolOf<CooperativeLocalization> agent(parameters, vehicle(model, 2));
  const std::vector<double> y{7, kAbsent};
  std::vector<double> payload(agent.message_layout().size());
  agent.emit(Sense{0, kDt, {}, 1, y, AgentId{1}, {}}, payload);
  // x, heard_of, out_degree, layer, id, changed, measures, relative
  EXPECT_EQ(payload, (std::vector<double>{0, 0, 0, 0, -2, -2, 1, 3, 1, -1, 0, 1, 0, 0, 7, 0})) << "agent 3 is not there";
}

TEST(AcyclicSensingProtocol, RefusesIdsThatAreNone) {
  const Values model = values_of({{"A", one(0)}, {"B", one(1)}, {"C", one(1)}});
  for (const double id : {0.0, 1.5, -3.0}) {
    const Values parameters = values_of({{"id", one(id)}});
    EXPECT_THROW(ProtocolOf<AcyclicSensingGraph>(parameters, vehicle(model, 0)), ConfigError) << id;
  }
}

}  // namespace
}  // namespace consort
