/// Round trips of every type on the wire, and the refusal of every sample that breaks a bound of consort.idl.

#include "idl/codec.hpp"

#include "core/errors.hpp"
#include "tests/support/wire_samples.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <stdexcept>

namespace consort::wire {
namespace {

TEST(Codec, AssignmentSurvivesTheRoundTrip) {
  const Assignment in = some_assignment();
  Arena arena;
  const Assignment out = decode(encode(in, arena));
  EXPECT_EQ(out.part, 1u);
  EXPECT_EQ(out.parts, 3u);
  EXPECT_EQ(out.epoch, 7u);
  EXPECT_EQ(out.seed, in.seed);
  EXPECT_EQ(out.protocol, in.protocol);
  EXPECT_EQ(out.agents, 12u);
  EXPECT_EQ(out.dt, 0.25);
  EXPECT_EQ(out.rounds, 300u);
  EXPECT_EQ(out.report_interval, 4u);
  EXPECT_EQ(out.window, 64u);
  EXPECT_EQ(out.parameters.scalar("Q"), 0.1);
  EXPECT_EQ(out.standard_link.loss_probability, 0.5);
  EXPECT_EQ(out.standard_link.noise_covariance, in.standard_link.noise_covariance);
  ASSERT_EQ(out.members.size(), 2u);
  EXPECT_EQ(out.members[0].agent, AgentId{3});
  EXPECT_EQ(out.members[1].process, 3u);
  EXPECT_EQ(*out.members[0].initial.find("x"), *in.members[0].initial.find("x"));
  EXPECT_EQ(*out.members[0].parameters.find("Omega"), *in.members[0].parameters.find("Omega"));
  EXPECT_EQ(out.members[0].in_neighbours, in.members[0].in_neighbours);
  EXPECT_EQ(out.members[0].remote_readers, 2u);
  EXPECT_EQ(out.members[0].late_readers, in.members[0].late_readers);
  EXPECT_EQ(*out.members[0].model.find("A"), Matrix(Matrix::Identity(2, 2)));
  EXPECT_EQ(out.members[0].measurements, 2u);
  EXPECT_EQ(out.members[0].distances, 3u);
  EXPECT_EQ(out.members[0].presence, (Attendance{5, 80}));
  EXPECT_EQ(out.members[0].told, in.members[0].told);
  EXPECT_EQ(out.largest_state, 4u);
  EXPECT_EQ(out.largest_control, 2u);
  EXPECT_EQ(out.recorded, true);
  EXPECT_TRUE(out.relays && out.tells_links);
  EXPECT_TRUE(out.plant && out.steers);
  EXPECT_EQ(out.joining, in.joining);
  const Edge edge{AgentId{1}, AgentId{3}};
  LinkModel links;
  links.changes = out.members[0].link_changes;
  EXPECT_EQ(links.of(edge, 39).delay_rounds, 9u);
  EXPECT_EQ(links.of(edge, 40), everything());
  ASSERT_EQ(out.link_changes.size(), 1u);
  EXPECT_EQ(out.link_changes[0].since, 20u);
  EXPECT_FALSE(out.link_changes[0].edge);
  EXPECT_EQ(out.link_changes[0].spec, everything());
  EXPECT_TRUE(out.members[1].hears_everyone);
}

TEST(Codec, PlantAssignmentSurvivesTheRoundTrip) {
  const PlantAssignment in = some_plant_assignment();
  Arena arena;
  const PlantAssignment out = decode(encode(in, arena));
  EXPECT_EQ(out.parts, 2u);
  EXPECT_EQ(out.epoch, 3u);
  EXPECT_EQ(out.rounds, 90u);
  EXPECT_EQ(out.report_interval, 3u);
  EXPECT_TRUE(out.steered);
  EXPECT_EQ(out.task.model, "integrator");
  EXPECT_EQ(out.task.seed, Seed{17});
  EXPECT_EQ(out.task.dt, 0.02);
  EXPECT_EQ(out.agents, in.agents);
  EXPECT_EQ(out.process_of, in.process_of);
  const PlantPart& part = out.task.parts.at(0);
  EXPECT_EQ(part.parameters.scalar("order"), 2.0);
  EXPECT_EQ(part.initial.scalar("position"), 1.5);
  EXPECT_EQ(part.sensed, in.task.parts[0].sensed);
  EXPECT_TRUE(part.relative && part.absolute);
  EXPECT_EQ(part.presence, (Attendance{4, 60}));
  const Signal& signal = part.signals.at(0);
  EXPECT_EQ(signal.on, Disturbance::On::input);
  EXPECT_EQ(signal.kind, Signal::Kind::sinusoid);
  EXPECT_EQ(signal.number, 1u);
  EXPECT_EQ(signal.hold_rounds, 5u);
  EXPECT_EQ(signal.first, 11u);
  EXPECT_EQ(out.task.parts[0].distances, in.task.parts[0].distances);
  EXPECT_EQ(signal.frequency, 2.0);
  EXPECT_EQ(signal.amplitude, in.task.parts[0].signals[0].amplitude);
  EXPECT_EQ(signal.phase, in.task.parts[0].signals[0].phase);
}

TEST(Codec, TheClosedLoopsSamplesSurviveTheRoundTrip) {
  const std::vector<double> values{1.0, -2.5};
  const auto measured = encode(Measurement{3, 7, values});
  EXPECT_EQ(decode(measured).round, 7u);
  EXPECT_EQ(decode(measured).values[1], -2.5);
  const auto acted = encode(Actuation{3, 4, 7, values});
  EXPECT_EQ(decode(acted).process, 4u);
  EXPECT_EQ(decode(acted).values[0], 1.0);
  const std::vector<double> broken{std::numeric_limits<double>::infinity()};
  EXPECT_THROW(decode(encode(Measurement{3, 7, broken})), Rejected);
  EXPECT_THROW(decode(encode(Actuation{3, 4, 7, broken})), Rejected);
  EXPECT_THROW(decode(encode(Actuation{3, 0, 7, values})), Rejected);
}

TEST(Codec, AStandingSurvivesTheRoundTripAndItsBoundsAreChecked) {
  Arena arena;
  const Standing in = some_standing(), out = decode(encode(in, arena));
  EXPECT_EQ(out.process, in.process);
  EXPECT_EQ(out.slowest, in.slowest);
  EXPECT_EQ(out.readers, in.readers);
  ASSERT_EQ(out.gaps.size(), 2u);
  EXPECT_EQ(out.gaps[1].sender, AgentId{9});
  EXPECT_EQ(out.gaps[1].first, 18u);
  EXPECT_EQ(out.gaps[1].rounds, 4u);
  EXPECT_EQ(out.gaps[1].asked, 2u);
  Standing empty_gap = in;
  empty_gap.gaps[0].rounds = 0;
  EXPECT_THROW(decode(encode(empty_gap, arena)), Rejected);
  auto lacks_a_round = encode(in, arena);
  lacks_a_round.rounds._length = 1;
  EXPECT_THROW(decode(lacks_a_round), Rejected);
}

TEST(Codec, APlantAssignmentThatBreaksABoundIsRejected) {
  const auto rejected = [](auto&& spoil) {
    PlantAssignment in = some_plant_assignment();
    spoil(in);
    Arena arena;
    EXPECT_THROW(decode(encode(in, arena)), Rejected);
  };
  rejected([](PlantAssignment& in) { in.task.dt = 0.0; });
  rejected([](PlantAssignment& in) { in.report_interval = 0; });
  rejected([](PlantAssignment& in) { in.part = 2; });
  rejected([](PlantAssignment& in) {
    in.task.parts[0].relative = in.task.parts[0].absolute = false;
    in.task.parts[0].sensed.clear();
  });
  rejected([](PlantAssignment& in) { in.task.parts[0].presence = {9, 9}; });
  rejected([](PlantAssignment& in) { in.task.parts[0].signals[0].hold_rounds = 0; });
  rejected([](PlantAssignment& in) { in.task.parts[0].signals[0].amplitude(0, 0) = std::numeric_limits<double>::quiet_NaN(); });
  rejected([](PlantAssignment& in) { in.process_of[0] = 0; });
}

TEST(Codec, GrantSurvivesTheRoundTripWithAndWithoutWeights) {
  const std::vector<WeightedEdge> plain{{{AgentId{1}, AgentId{2}}, 1.0}, {{AgentId{2}, AgentId{1}}, 1.0}};
  const std::vector<WeightedEdge> weighted{{{AgentId{1}, AgentId{2}}, 0.5}};
  Arena arena;
  const Grant out =
      decode(encode(Grant{2, 50, 25, {{0, 1, plain}, {10, 2, weighted}, {20, 1, {}}, {30, 3, std::vector<WeightedEdge>{}}}}, arena));
  EXPECT_EQ(out.epoch, 2u);
  EXPECT_EQ(out.until, 50u);
  EXPECT_EQ(out.report_at, 25u);
  ASSERT_EQ(out.segments.size(), 4u);
  EXPECT_EQ(out.segments[0].stated, plain);
  EXPECT_EQ(out.segments[1].stated, weighted);
  EXPECT_FALSE(out.segments[2].stated.has_value()) << "a graph stated before is only named";
  EXPECT_TRUE(out.segments[3].stated.has_value()) << "a graph without edges is a graph";
}

TEST(Codec, TheOtherTypesSurviveTheRoundTrip) {
  Arena arena;
  EXPECT_EQ(decode(encode(Command{4, Order::finish}, arena)).order, Order::finish);
  const std::vector<AgentId> gone{AgentId{2}, AgentId{7}};
  EXPECT_EQ(decode(encode(Command{4, Order::departed, gone}, arena)).agents, gone);
  const Command refused = decode(encode(Command{4, Order::refused, {}, 0, "0110aa", "it is there already"}, arena));
  EXPECT_EQ(refused.order, Order::refused);
  EXPECT_EQ(refused.to, "0110aa");
  EXPECT_EQ(refused.note, "it is there already");
  Values model;
  model.set("A", Matrix::Constant(2, 3, 0.5));
  const consort::Layout message{{{"x", 2, 1}, {"P", 2, 2}}, 0, 2}, estimate{{{"x", 2, 1}}, 0, 0}, beside{{{"P", 2, 2}}};
  const Layouts layouts = decode(encode(Layouts{AgentId{5}, 6, message, estimate, model, beside}, arena));
  EXPECT_EQ(*layouts.announcement.find("A"), *model.find("A"));
  EXPECT_EQ(layouts.message, message);
  EXPECT_EQ(layouts.estimate, estimate);
  EXPECT_EQ(layouts.recorded, beside);
  Presence presence{3, 4, State::status, 99, "host", {AgentId{3}, AgentId{4}}, 17, AgentId{4}, {AgentId{1}}, std::string(600, 'n')};
  const Presence present = decode(encode(presence, arena));
  EXPECT_EQ(present.agents, presence.agents);
  EXPECT_EQ(present.waiting_for, presence.waiting_for);
  EXPECT_EQ(present.note, std::string(511, 'n')) << "a note is cut, not refused";
  Telemetry telemetry{3,
                      4,
                      true,
                      {{AgentId{3}, {0, 5}, {1.0, 2.0}, {11, 12}, {{1, 2, 3}, {4, 5, 6}}, {0.5, kAbsent}, 9}},
                      {{{AgentId{1}, AgentId{3}}, 8, 9}}};
  const Telemetry told = decode(encode(telemetry, arena));
  ASSERT_EQ(told.members.size(), 1u);
  EXPECT_EQ(told.members[0].rounds, telemetry.members[0].rounds);
  EXPECT_EQ(told.members[0].estimates, telemetry.members[0].estimates);
  ASSERT_EQ(told.members[0].recorded.size(), 2u);
  EXPECT_EQ(told.members[0].recorded[0], 0.5);
  EXPECT_TRUE(is_absent(told.members[0].recorded[1]));
  EXPECT_EQ(told.members[0].hashes, telemetry.members[0].hashes);
  EXPECT_EQ(told.members[0].counters[1].lost, 6u);
  EXPECT_EQ(told.members[0].slept, 9u);
  ASSERT_EQ(told.links.size(), 1u);
  EXPECT_EQ(told.links[0].counters.lost, 9u);
  const std::vector<double> values{1.0, -0.0};
  const Information information = decode(encode(Information{1, AgentId{2}, 3, values}));
  EXPECT_EQ(information.values.data(), values.data()) << "a view, not a copy";
}

TEST(Codec, ANameThatDoesNotFitIsTheWritersMistake) {
  Assignment in = some_assignment();
  in.protocol = std::string(64, 'p');
  Arena arena;
  EXPECT_THROW(encode(in, arena), ConfigError);
}

template <class Change>
void expect_assignment_refused(const char* what, Change change) {
  SCOPED_TRACE(what);
  const Assignment in = some_assignment();
  Arena arena;
  consort_wire_Assignment sample = encode(in, arena);
  change(sample);
  EXPECT_THROW(decode(sample), Rejected);
}

TEST(Codec, RefusesAssignmentsThatBreakABound) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  expect_assignment_refused("part beyond parts", [](auto& s) { s.part = 3; });
  expect_assignment_refused("no parts", [](auto& s) { s.parts = 0; });
  expect_assignment_refused("no agents", [](auto& s) { s.agents = 0; });
  expect_assignment_refused("absurd number of agents", [](auto& s) { s.agents = 4'000'000'000u; });
  expect_assignment_refused("dt zero", [](auto& s) { s.dt = 0; });
  expect_assignment_refused("dt not a number", [&](auto& s) { s.dt = nan; });
  expect_assignment_refused("report interval zero", [](auto& s) { s.report_interval = 0; });
  expect_assignment_refused("changes out of order", [](auto& s) { s.members._buffer[0].links._buffer[0].since = 41; });
  expect_assignment_refused("values and shape differ", [](auto& s) { s.members._buffer[0].initial._buffer[0].rows = 5; });
  expect_assignment_refused("an id of zero", [](auto& s) { s.members._buffer[0].agent = 0; });
  expect_assignment_refused("an id beyond the agents", [](auto& s) { s.members._buffer[0].agent = 13; });
  expect_assignment_refused("neighbours out of order", [](auto& s) { s.members._buffer[0].in_neighbours._buffer[0] = 12; });
  expect_assignment_refused("a value without a name", [](auto& s) { s.members._buffer[0].initial._buffer[0].name[0] = '\0'; });
}

/// Of the second change of the first member's links, which does all that a link can do.
consort_wire_NamedArray& effect(consort_wire_Assignment& sample, std::string_view name) {
  const auto& effects = sample.members._buffer[0].links._buffer[1].effects;
  const auto found = std::find_if(effects._buffer, effects._buffer + effects._length, [&](const auto& each) { return each.name == name; });
  if (found == effects._buffer + effects._length) throw std::invalid_argument("no effect " + std::string(name));
  return *found;
}

TEST(Codec, RefusesLinksThatMakeNoSense) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto expect_refused = [](const char* name, std::size_t number, double value) {
    expect_assignment_refused(name, [&](auto& s) { effect(s, name).values._buffer[number] = value; });
  };
  expect_refused("bernoulli", 0, 1.5);
  expect_refused("bernoulli", 0, nan);
  expect_refused("jitter", 0, 4.0);  // of no kind
  expect_refused("jitter", 1, nan);
  expect_refused("delay_rounds", 0, 1'000'000.0);
  expect_refused("delay_rounds", 0, 1.5);
  expect_refused("delay_rounds", 0, -1.0);
  expect_refused("duplication", 0, 2.0);
  expect_refused("reordering", 1, 70'000.0);
  expect_refused("quantisation", 0, 64.0);
  expect_refused("quantisation", 1, 9.0);  // the range upside down
  expect_refused("distance", 0, 6.0);      // the distances upside down
  expect_assignment_refused("bursts that never change", [](auto& s) { std::fill_n(effect(s, "gilbert_elliott").values._buffer, 2, 0.0); });
  expect_assignment_refused("noise of the wrong shape", [](auto& s) { effect(s, "noise_covariance").rows = 3; });
  expect_assignment_refused("too few numbers",
                            [](auto& s) { effect(s, "gilbert_elliott").rows = effect(s, "gilbert_elliott").values._length = 3; });
  expect_assignment_refused("an effect that nobody knows", [](auto& s) { std::strcpy(effect(s, "duplication").name, "duplicity"); });
  expect_assignment_refused("an effect twice", [](auto& s) { std::strcpy(effect(s, "duplication").name, "bernoulli"); });
}

TEST(Codec, RefusesOtherSamplesThatBreakABound) {
  Arena arena;
  const double infinity = std::numeric_limits<double>::infinity();
  auto command = encode(Command{1, Order::status}, arena);
  command.kind = 9;
  EXPECT_THROW(decode(command), Rejected);

  auto grant = encode(Grant{1, 5, 5, {{0, 0, std::vector<WeightedEdge>{{{AgentId{1}, AgentId{2}}, 0.5}}}}}, arena);
  grant.report_at = 6;
  EXPECT_THROW(decode(grant), Rejected);
  grant.report_at = 5;
  grant.segments._buffer[0].weights._buffer[0] = -1.0;
  EXPECT_THROW(decode(grant), Rejected);
  grant.segments._buffer[0].weights._buffer[0] = 1.0;
  grant.segments._buffer[0].edges._buffer[1] = 1;
  EXPECT_THROW(decode(grant), Rejected) << "a self-loop";
  grant.segments._buffer[0].edges._buffer[1] = 2;
  grant.segments._buffer[0].graph = 1u << 30;
  EXPECT_THROW(decode(grant), Rejected) << "a graph number that would take all memory";

  const std::vector<double> values{1.0, infinity};
  EXPECT_THROW(decode(encode(Information{1, AgentId{2}, 3, values})), Rejected);
  auto information = encode(Information{1, AgentId{2}, 3, std::span(values).first(1)});
  information.sender = 0;
  EXPECT_THROW(decode(information), Rejected);

  const MemberReport report{AgentId{3}, {0, 5}, {1.0, 2.0}, {11, 12}, {{1, 2, 3}, {4, 5, 6}}, {}, 9};
  const Telemetry reported{3, 4, false, {report}, {}};
  auto telemetry = encode(reported, arena);
  telemetry.members._buffer[0].hashes._length = 1;
  EXPECT_THROW(decode(telemetry), Rejected);
  telemetry.members._buffer[0].hashes._length = 2;
  telemetry.members._buffer[0].estimates._length = 1;
  EXPECT_THROW(decode(telemetry), Rejected);
  telemetry.members._buffer[0].estimates._length = 2;
  double infinite[2]{0.0, infinity};
  telemetry.members._buffer[0].recorded._buffer = infinite;
  telemetry.members._buffer[0].recorded._length = 1;
  EXPECT_THROW(decode(telemetry), Rejected) << "one number for two reports";
  telemetry.members._buffer[0].recorded._length = 2;
  EXPECT_THROW(decode(telemetry), Rejected) << "not finite";

  auto layout = encode(Layouts{AgentId{5}, 6, {{{"x", 2, 1}}, 0, 2}, {}}, arena);
  layout.noise_size = 3;
  EXPECT_THROW(decode(layout), Rejected);

  auto presence = encode(Presence{3, 4, State::hello, 99, "host", {AgentId{3}, AgentId{4}}, 0, {}, {}, ""}, arena);
  presence.state = 77;
  EXPECT_THROW(decode(presence), Rejected);
}

}  // namespace
}  // namespace consort::wire
