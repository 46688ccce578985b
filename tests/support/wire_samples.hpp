#pragma once
/// Samples of what goes on the wire, with something in every field.

#include "idl/codec.hpp"

namespace consort::wire {

/// A link with all that a link can do.
inline LinkSpec everything() {
  LinkSpec spec;
  spec.loss_probability = 0.25;
  spec.delay_rounds = 2;
  spec.noise_covariance = Matrix::Identity(2, 2);
  spec.bursts = BurstLoss{0.125, 0.5, 0.0625, 0.75};
  spec.jitter = {Jitter::Kind::normal, 1.5, 0.5};
  spec.duplication = 0.375;
  spec.reordering = Reordering{0.875, 3};
  spec.quantiser = Quantiser{12, -4.0, 8.0};
  spec.distance = DistanceLoss{1.0, 5.0};
  return spec;
}

inline Assignment some_assignment() {
  Assignment in;
  in.part = 1;
  in.parts = 3;
  in.epoch = 7;
  in.seed = Seed{0xFFFFFFFFFFFFFFFFULL};
  in.protocol = "kalman_consensus";
  in.agents = 12;
  in.dt = 0.25;
  in.rounds = 300;
  in.report_interval = 4;
  in.window = 64;
  in.recorded = true;
  in.parameters.set("Q", 0.1);
  in.standard_link.loss_probability = 0.5;
  in.standard_link.noise_covariance = Matrix::Identity(2, 2);
  MemberTask member;
  member.agent = AgentId{3};
  member.process = 3;
  member.initial.set("x", Matrix::Constant(2, 1, 1.5));
  member.parameters.set("Omega", Matrix::Identity(2, 2));
  member.in_neighbours = {AgentId{1}, AgentId{12}};
  member.remote_readers = 2;
  member.late_readers = {5, 9};
  member.model.set("A", Matrix::Identity(2, 2));
  member.measurements = 2;
  member.distances = 3;
  member.presence = {5, 80};
  member.told = {{AgentId{1}, 5}, {AgentId{12}, 9}};
  LinkSpec late;
  late.delay_rounds = 9;
  member.link_changes = {{0, Edge{AgentId{1}, AgentId{3}}, late}, {40, Edge{AgentId{1}, AgentId{3}}, everything()}};
  in.link_changes.push_back({20, std::nullopt, everything()});
  in.plant = in.steers = in.relays = in.tells_links = true;
  in.largest_state = 4;
  in.largest_control = 2;
  in.joining = {{AgentId{3}, 5}};
  MemberTask deaf;
  deaf.agent = AgentId{4};
  deaf.process = 3;
  deaf.hears_everyone = true;
  in.members = {member, deaf};
  return in;
}

inline PlantAssignment some_plant_assignment() {
  PlantAssignment in;
  in.part = 0;
  in.parts = 2;
  in.epoch = 3;
  in.rounds = 90;
  in.report_interval = 3;
  in.steered = true;
  in.task.model = "integrator";
  in.task.seed = Seed{17};
  in.task.dt = 0.02;
  PlantPart part;
  part.parameters.set("order", 2.0);
  part.initial.set("position", 1.5);
  part.sensed = {AgentId{2}, AgentId{1}};
  part.relative = part.absolute = true;
  part.presence = {4, 60};
  Signal signal;
  signal.on = Disturbance::On::input;
  signal.kind = Signal::Kind::sinusoid;
  signal.number = 1;
  signal.hold_rounds = 5;
  signal.first = 11;
  signal.amplitude = Matrix::Constant(1, 1, 0.1);
  signal.frequency = 2.0;
  signal.phase = Matrix::Constant(2, 1, 0.5);
  part.signals = {signal};
  part.distances = {AgentId{1}, AgentId{4}};
  in.agents = {AgentId{2}};
  in.process_of = {1};
  in.task.parts = {part};
  return in;
}

inline Grant some_grant() {
  const std::vector<WeightedEdge> weighted{{{AgentId{1}, AgentId{2}}, 0.5}, {{AgentId{2}, AgentId{1}}, 2.0}};
  return {2, 50, 25, {{0, 1, weighted}, {20, 1, {}}, {30, 3, std::vector<WeightedEdge>{}}}, 0, true, 20};
}

inline Standing some_standing() {
  return {2, 3, 17, {{AgentId{3}, 17}, {AgentId{4}, 19}}, {{AgentId{0}, 17, 1, 0}, {AgentId{9}, 18, 4, 2}}};
}

inline Layouts some_layouts() {
  Values model;
  model.set("A", Matrix::Constant(2, 3, 0.5));
  return {AgentId{5}, 6, {{{"x", 2, 1}, {"P", 2, 2}}, 0, 2}, {{{"x", 2, 1}}, 0, 0}, model, {{{"P", 2, 2}}, 0, 0}};
}

inline Presence some_presence() {
  return {3, 4, State::status, 99, "host", {AgentId{3}, AgentId{4}}, 17, AgentId{4}, {AgentId{1}}, "waits"};
}

inline Telemetry some_telemetry() {
  return {3,
          4,
          true,
          {{AgentId{3}, {0, 5}, {1.0, 2.0}, {11, 12}, {{1, 2, 3}, {4, 5, 6}}, {0.5, 0.25}}},
          {{{AgentId{1}, AgentId{3}}, 8, 9}},
          {{"consort_grant", Refusal::Reason::bound, "report_at", "0110", "consort (pid 1 on host)", 7}}};
}

}  // namespace consort::wire
