// Local voting and static consensus with a plant, one agent at a time: what they measure, steer, refuse, and do without messages.

#include "core/errors.hpp"
#include "protocols/registry.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>

namespace consort {
namespace {

Values double_integrator() {
  Values model;
  model.set("A", (Matrix(2, 2) << 0, 1, 0, 0).finished());
  model.set("B", (Matrix(2, 1) << 0, 1).finished());
  model.set("C", Matrix(Matrix::Identity(2, 2)));
  return model;
}

/// One agent in round 0 of a run with dt = 0.1 s.
struct Lone {
  Values parameters, initial, model;
  std::vector<double> y;
  std::unique_ptr<Protocol> protocol;

  Lone(const char* name, Values its_parameters, Values its_model, std::vector<double> measured)
      : parameters(std::move(its_parameters)), model(std::move(its_model)), y(std::move(measured)) {
    protocol = find_protocol(name).make(parameters, consort::Setup{AgentId{1}, 3, 0.1, initial, model, y.size()});
  }
  [[nodiscard]] Sense sense() const { return {.k = 0, .dt = 0.1, .in_neighbours = {}, .out_degree = 1, .y = y, .self = AgentId{1}}; }
  std::vector<double> control_after(std::span<const Received> inbox) {
    protocol->absorb(sense(), inbox);
    std::vector<double> u(protocol->control_size());
    protocol->control(u);
    return u;
  }
};

std::string refusal(const std::function<void()>& action) {
  try {
    action();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no ConfigError";
}

TEST(LocalVoting, SteersByWhatItMeasuresNotByWhatItStartedWith) {
  Lone agent("local_voting", {}, {}, {1.0, 2.0});
  std::vector<double> payload(2), estimate(2);
  agent.protocol->emit(agent.sense(), payload);
  EXPECT_EQ(payload, agent.y);
  const std::array first{4.0, 0.0}, second{1.0, 3.0};
  EXPECT_EQ(agent.control_after(std::array{Received{AgentId{2}, 0, 1.0, first}, Received{AgentId{3}, 0, 0.5, second}}),
            (std::vector<double>{3.0, -1.5}));
  agent.protocol->estimate(estimate);
  EXPECT_EQ(estimate, agent.y);
}

TEST(LocalVoting, AMissingMessageIsAnAbsentTermAndNobodyToHearIsNoControl) {
  const std::array first{4.0};
  EXPECT_EQ(Lone("local_voting", {}, {}, {1.0}).control_after(std::array{Received{AgentId{2}, 0, 1.0, first}}), std::vector<double>{3.0});
  EXPECT_EQ(Lone("local_voting", {}, {}, {1.0}).control_after({}), std::vector<double>{0.0}) << "a leader";
}

TEST(LocalVoting, SteersNothingWithoutAPlant) {
  Values initial;
  initial.set("x", 1.0);
  const auto agent = find_protocol("local_voting").make({}, consort::Setup{AgentId{1}, 3, 0.1, initial});
  EXPECT_EQ(agent->control_size(), 0U);
  initial.set("x", Matrix(Vector::Ones(3)));
  const Values model;
  EXPECT_NE(refusal([&] {
              find_protocol("local_voting").make({}, consort::Setup{AgentId{4}, 4, 0.1, initial, model, 2});
            }).find("agent 4"),
            std::string::npos);
}

TEST(StaticConsensus, AppliesCouplingTimesRegulatorGainToTheDisagreement) {
  Values parameters;
  parameters.set("c", 2.0);
  Lone agent("static_consensus", parameters, double_integrator(), {1.0, 0.5});
  const std::array first{2.0, 0.0}, second{0.0, 1.5};
  // sum = 1 (1, -.5) + 3 (-1, 1) = (-2, 2.5), K = [1 sqrt 3]
  const auto u = agent.control_after(std::array{Received{AgentId{2}, 0, 1.0, first}, Received{AgentId{3}, 0, 3.0, second}});
  ASSERT_EQ(u.size(), 1U);
  EXPECT_NEAR(u[0], 2.0 * (-2.0 + std::sqrt(3.0) * 2.5), 1e-12);
  // A missing message is an absent term.
  EXPECT_NEAR(agent.control_after(std::array{Received{AgentId{2}, 0, 1.0, first}})[0], 2.0 * (1.0 - std::sqrt(3.0) * 0.5), 1e-12);
  EXPECT_EQ(agent.control_after({})[0], 0.0) << "a leader";
}

TEST(StaticConsensus, RefusesWhatItCannotSteer) {
  Values parameters;
  parameters.set("c", 1.0);
  const auto says = [&](const Values& with, const Values& model, const char* text) {
    const std::string found = refusal([&] { Lone("static_consensus", with, model, {0.0, 0.0}); });
    EXPECT_NE(found.find(text), std::string::npos) << found;
  };
  says({}, double_integrator(), "'c'");
  says(parameters, {}, "does not know its dynamics");
  Values model = double_integrator();
  model.set("C", (Matrix(2, 2) << 1, 0, 1, 1).finished());
  says(parameters, model, "C = I");
  model = double_integrator();
  model.set("B", (Matrix(2, 1) << 1, 0).finished());
  says(parameters, model, "stabilisable");
  parameters.set("c", 0.0);
  says(parameters, double_integrator(), "above 0");
}

}  // namespace
}  // namespace consort
