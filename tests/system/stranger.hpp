#pragma once
/// Somebody who joins a run's domain without knowing its key, and writes whatever might do harm on every topic.

#include "core/random.hpp"
#include "idl/codec.hpp"

#include <dds/dds.hpp>

#include <limits>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "hostile.h"

DDS_TOPIC_TYPE(consort_wire_Assignment);
DDS_TOPIC_TYPE(consort_wire_PlantAssignment);
DDS_TOPIC_TYPE(consort_wire_Grant);
DDS_TOPIC_TYPE(consort_wire_Command);
DDS_TOPIC_TYPE(consort_wire_Information);
DDS_TOPIC_TYPE(consort_wire_Measurement);
DDS_TOPIC_TYPE(consort_wire_Actuation);
DDS_TOPIC_TYPE(consort_wire_Layout);
DDS_TOPIC_TYPE(consort_wire_Presence);
DDS_TOPIC_TYPE(consort_wire_Telemetry);
DDS_TOPIC_TYPE(consort_wire_Standing);
DDS_TOPIC_TYPE(hostile_Plain);
DDS_TOPIC_TYPE(hostile_Keyed);

namespace consort {

class Stranger {
 public:
  /// Joins the run `tag` in domain `wire_domain`, which within this process is domain `number`. `agents`: ids up to this one are forged.
  Stranger(std::uint32_t number, std::uint32_t wire_domain, const std::string& tag, std::uint32_t agents)
      : domain_(number, dds::configuration::xml({.tag = tag, .external_domain = wire_domain})), participant_(domain_), agents_(agents) {}

  [[nodiscard]] dds_guid_t guid() const { return participant_.guid(); }

  /// Everything once, with rounds from `round` on.
  void attack(Round round) {
    for (const std::uint32_t epoch : {0u, 1u, 2u, 4'000'000'000u}) forge(epoch, round);
    break_bounds(round);
    garbage();
  }

 private:
  static constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

  /// The writers of one topic: where nobody says in which partition, and in all of them.
  template <class Wire>
  struct Pair {
    Pair(const dds::domain::DomainParticipant& participant, const char* name, bool steering)
        : topic(participant, name),
          plain(dds::pub::Publisher(participant), topic, qos(steering)),
          everywhere(dds::pub::Publisher(participant, dds::pub::qos::PublisherQos() << dds::core::policy::Partition("*")), topic,
                     qos(steering)) {}
    static dds::pub::qos::DataWriterQos qos(bool steering) {
      using namespace dds::core::policy;
      dds::pub::qos::DataWriterQos qos;
      qos << Reliability::Reliable() << History::KeepAll();
      if (steering) qos << Durability::TransientLocal() << DurabilityService{};
      return qos;
    }
    void write(const Wire& sample) {
      try {
        plain.write(sample);
        everywhere.write(sample);
      } catch (const dds::core::TimeoutError&) {  // nobody takes so much: then it has been sent already
      }
    }
    dds::topic::Topic<Wire> topic;
    dds::pub::DataWriter<Wire> plain, everywhere;
  };

  /// Samples that look like those of the run.
  void forge(std::uint32_t epoch, Round round) {
    using namespace wire;
    Arena arena;
    Values start;
    start.set("x", 1e6);
    for (std::uint32_t id = 1; id <= agents_; ++id) {
      const AgentId agent{id};
      const double wrong[] = {1e6};
      for (Round k = round; k < round + 20; ++k) {
        information_.write(encode(Information{epoch, agent, k, wrong}));
        measurement_.write(encode(Measurement{epoch, k, wrong}));
        actuation_.write(encode(Actuation{epoch, id, k, wrong}));
      }
      for (const State state : {State::hello, State::ready, State::status, State::failed, State::leaving})
        presence_.write(encode(Presence{id, epoch, state, 1, "elsewhere", {agent}, 1'000'000, {}, {}, "forged"}, arena));
      layout_.write(encode(Layouts{agent, epoch, {{{"z", 3, 1}}, 0, 0}, {{{"z", 3, 1}}, 0, 0}, start}, arena));
      const MemberReport report{agent, {round, round + 1}, {7.0, 7.0}, {1, 2}, {{1, 2, 3}, {4, 5, 6}}};
      telemetry_.write(encode(Telemetry{id, epoch, true, {report}, {{{AgentId{1}, agent}, 77, 77}}, {}}, arena));
      MemberTask member;
      member.agent = agent;
      member.process = id;
      member.initial = start;
      assignment_.write(encode(forged_assignment(epoch, member), arena));
    }
    for (const std::uint32_t process : {0u, 1u, 2u})
      standing_.write(encode(
          Standing{epoch, process, kNever, {{AgentId{1}, kNever}}, {{AgentId{1}, round, kNever, 9}, {AgentId{0}, round, 9, 9}}}, arena));
    presence_.write(encode(Presence{0, epoch, State::failed, 1, "elsewhere", {}, 0, {}, {}, "forged"}, arena));
    PlantAssignment plant;
    plant.epoch = epoch;
    plant.task.model = "integrator";
    plant.task.dt = 1.0;
    plant_assignment_.write(encode(plant, arena));
    const std::vector<WeightedEdge> edges{{{AgentId{1}, AgentId{2}}, 1.0}};
    grant_.write(encode(Grant{epoch, 1'000'000, 1, {{round, 0, edges}, {round + 1, 9, {}}}}, arena));
    for (const Order order : {Order::status, Order::finish, Order::shutdown, Order::departed})
      command_.write(encode(Command{epoch, order, {AgentId{1}, AgentId{2}}}, arena));
  }

  static Assignment forged_assignment(std::uint32_t epoch, const MemberTask& member) {
    Assignment assignment;
    assignment.epoch = epoch;
    assignment.protocol = "local_voting";
    assignment.agents = 3;
    assignment.rounds = 5;
    assignment.members = {member};
    return assignment;
  }

  /// Numbers that are none, ids out of range, absurd lengths.
  void break_bounds(Round round) {
    using namespace wire;
    Arena arena;
    const std::vector<double> endless(50'000, 1.0);
    for (const double value : {kNan, kInfinity, 1e308}) {
      const double values[] = {value};
      for (const std::uint32_t id : {0u, 1u, 100'001u, 4'294'967'295u}) {
        information_.write(encode(Information{1, AgentId{id}, round, values}));
        actuation_.write(encode(Actuation{1, id, round, values}));
        presence_.write(encode(Presence{id, 1, State::ready, 1, "", {AgentId{id}}, round, {}, {}, ""}, arena));
        telemetry_.write(encode(Telemetry{id, 1, true, {{AgentId{id}, {round}, {value}, {1}, {{1, 1, 1}}}}, {}, {}}, arena));
      }
      measurement_.write(encode(Measurement{1, round, values}));
    }
    information_.write(encode(Information{1, AgentId{1}, round, endless}));
    measurement_.write(encode(Measurement{1, round, endless}));
    actuation_.write(encode(Actuation{1, 1, round, endless}));
    consort_wire_Standing standing = encode(Standing{1, 2, round, {{AgentId{1}, round}}, {}}, arena);
    standing.rounds._length = 0;
    standing_.write(standing);
    Assignment broken = forged_assignment(1, {});
    broken.dt = kNan;
    broken.parts = 0;
    assignment_.write(encode(broken, arena));
    Grant many{1, 5, 9, {}};
    for (std::uint32_t i = 0; i < 5'000; ++i) many.segments.push_back({0, 4'000'000'000u, {}});
    grant_.write(encode(many, arena));
    consort_wire_Command command{};
    command.kind = 250;
    command_.write(command);
    layout_.write(encode(Layouts{AgentId{1}, 1, {{{"", 70'000, 70'000}}, 9, 9}, {}, {}}, arena));
  }

  /// Samples whose bytes are not even of the topic's type.
  void garbage() {
    for (auto& writer : garbage_) {
      std::vector<std::uint8_t> bytes(draws_.below(300));
      for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(draws_.below(256));
      const auto size = static_cast<std::uint32_t>(bytes.size());
      if (writer.keyed) {
        const hostile_Keyed sample{static_cast<std::uint32_t>(draws_.below(4)), {size, size, bytes.data(), false}};
        dds_write(writer.entity, &sample);
      } else {
        const hostile_Plain sample{{size, size, bytes.data(), false}};
        dds_write(writer.entity, &sample);
      }
    }
  }

  struct Garbage {
    dds_entity_t entity;
    bool keyed;
  };
  /// A writer of bytes that claims to be of the topic's type. It goes with its participant.
  Garbage garbage_writer(const char* topic, const char* type, bool keyed, bool steering) {
    dds_topic_descriptor_t descriptor = keyed ? hostile_Keyed_desc : hostile_Plain_desc;
    descriptor.m_typename = type;
    // A participant of its own, since one knows a topic by one type.
    const dds_entity_t participant = dds_create_participant(domain_.domain_id(), nullptr, nullptr);
    const dds_entity_t claimed = dds_create_topic(participant, &descriptor, topic, nullptr, nullptr);
    return {dds_create_writer(participant, claimed, Pair<consort_wire_Grant>::qos(steering).get(), nullptr), keyed};
  }

  dds::domain::Domain domain_;
  dds::domain::DomainParticipant participant_;
  std::uint32_t agents_;
  Stream draws_ = Seed{99}.stream(Purpose("garbage"));
  Pair<consort_wire_Assignment> assignment_{participant_, "consort_assignment", true};
  Pair<consort_wire_PlantAssignment> plant_assignment_{participant_, "consort_plant_assignment", true};
  Pair<consort_wire_Grant> grant_{participant_, "consort_grant", true};
  Pair<consort_wire_Command> command_{participant_, "consort_command", true};
  Pair<consort_wire_Information> information_{participant_, "consort_information", false};
  Pair<consort_wire_Measurement> measurement_{participant_, "consort_measurement", false};
  Pair<consort_wire_Actuation> actuation_{participant_, "consort_actuation", false};
  Pair<consort_wire_Standing> standing_{participant_, "consort_standing", false};
  Pair<consort_wire_Layout> layout_{participant_, "consort_layout", true};
  Pair<consort_wire_Presence> presence_{participant_, "consort_presence", true};
  Pair<consort_wire_Telemetry> telemetry_{participant_, "consort_telemetry", true};
  std::vector<Garbage> garbage_{garbage_writer("consort_assignment", "consort::wire::Assignment", true, true),
                                garbage_writer("consort_plant_assignment", "consort::wire::PlantAssignment", true, true),
                                garbage_writer("consort_grant", "consort::wire::Grant", false, true),
                                garbage_writer("consort_command", "consort::wire::Command", false, true),
                                garbage_writer("consort_layout", "consort::wire::Layout", true, true),
                                garbage_writer("consort_presence", "consort::wire::Presence", true, true),
                                garbage_writer("consort_telemetry", "consort::wire::Telemetry", false, true)};
};

}  // namespace consort
