#pragma once
/// The wire: core values <-> samples on DDS topics. The only room that sees the generated types. Whatever is read is validated: what
/// comes from outside the run or breaks a bound of consort.idl is dropped, counted and named (Participant::take_refusals), never passed on.

#include "core/network/announcements.hpp"
#include "core/plant_task.hpp"
#include "core/trace.hpp"
#include "idl/trust.hpp"

#include <dds/dds.hpp>

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace consort::wire {

/// What one agent is told at the start of a run.
struct Member {
  AgentId agent;
  std::uint32_t process = 0;  ///< lowest id among the agents hosted together with it
  Values initial;
  Values parameters;                            ///< on top of the common ones
  bool hears_everyone = false;                  ///< every other agent may be an in-neighbour
  std::vector<AgentId> in_neighbours;           ///< else: everyone who may ever be one, ascending
  std::uint32_t remote_readers = 0;             ///< processes other than its own that read it from its first round on
  std::vector<Round> late_readers;              ///< when a further process begins to, ascending
  std::vector<LinkModel::Change> link_changes;  ///< of its in-links, ascending; an exception is a change in round 0
  Values model;                                 ///< what it knows of its own dynamics; empty without a plant
  std::uint32_t measurements = 0;               ///< length of y_i; 0 without a plant
  std::uint32_t distances = 0;                  ///< numbers that follow it: how far its in-neighbours are away; 0: its links do not ask
  std::vector<Told> told;                       ///< whose announcement reaches it, ascending by agent
  Attendance presence;
};

constexpr const char* kCommandTopic = "consort_command";
constexpr const char* kPresenceTopic = "consort_presence";

/// Half a grant window is never longer, in rounds (nor shorter than a report interval).
constexpr Round kLargestHalfWindow = 512;
/// Nobody is ever granted more rounds beyond the slowest agent: so much is kept for later by who is ahead and by who hears of it.
constexpr Round largest_window(Round report_interval) { return 2 * std::max(kLargestHalfWindow, report_interval) + report_interval; }

/// How samples are delivered in real time. In lockstep they are reliable, and all are kept.
struct Delivery {
  bool reliable = false;
  std::uint32_t history = 1;
  Seconds lifespan = 1.0;  ///< how long a message may be used
  Seconds deadline = 1.0, liveliness_lease = 1.0;
};

/// One part of a run's assignment; part p of `parts` holds some of the members.
struct Assignment {
  std::uint32_t part = 0, parts = 1, epoch = 0;
  Seed seed;
  std::string protocol;
  std::uint32_t agents = 0;
  Seconds dt = 1.0;
  Round rounds = 0, report_interval = 1, window = 1;
  Values parameters;
  LinkSpec standard_link;
  std::vector<LinkModel::Change> link_changes;  ///< of that one, ascending
  std::uint32_t largest_state = 0;              ///< n_j of the largest part of the plant; 0 without one
  std::uint32_t largest_control = 0;            ///< length of the longest u of any agent; 0 without a plant
  bool relays = false;                          ///< what others announced is passed on to whoever reads an agent
  bool steers = false;                          ///< the plant waits for every agent's actuation
  bool plant = false;                           ///< there is a plant: whoever measures waits for it
  bool realtime = false;                        ///< the wall clock paces the rounds
  Delivery delivery;
  std::optional<bool> recorded = {};  ///< all or nothing of what is worth recording beside estimates; nullopt: what fits
  std::map<AgentId, Round> joining;   ///< agents that are not there, and when they join: nobody waits to meet them before
  std::vector<Member> members;
};

/// One part of what the plant is told; part p of `parts` holds some of the agents, ascending.
struct PlantAssignment {
  std::uint32_t part = 0, parts = 1, epoch = 0;
  Round rounds = 0, report_interval = 1;
  bool steered = false;
  bool realtime = false;
  Delivery delivery;
  PlantTask task;                         ///< `parts` of the agents named by `agents`, in that order
  std::vector<AgentId> agents;            ///< ascending
  std::vector<std::uint32_t> process_of;  ///< by position in `agents`: lowest id among the agents hosted together with it
};

struct Segment {
  Round first = 0;
  std::uint32_t graph = 0;
  std::optional<std::vector<WeightedEdge>> stated;
};

struct Grant {
  std::uint32_t epoch = 0;
  Round until = 0, report_at = 0;
  std::vector<Segment> segments;
  std::uint64_t start_ns = 0;  ///< realtime: wall clock of round 0; the segments are then all that hold from the current round on
  bool whole = false;          ///< the report at report_at says how each agent stands, and its links
};

enum class Order : std::uint8_t { status, finish, shutdown, departed, come_back, welcome, refused };
struct Command {
  std::uint32_t epoch = 0;
  Order order = Order::status;
  std::vector<AgentId> agents = {};  ///< departed: all that are gone so far, ascending; come_back: who does
  Round round = 0;                   ///< come_back: from this one on
  std::string to = {};               ///< welcome, refused: GUID of the participant that is meant
  std::string note = {};             ///< refused: why
};

/// A view: `values` is valid during the call it is handed to.
struct Information {
  std::uint32_t epoch = 0;
  AgentId sender;
  Round round = 0;
  std::span<const double> values;
};

struct Layouts {
  AgentId agent;
  std::uint32_t epoch = 0;
  Layout message, estimate;
  Values announcement = {};
  Layout recorded = {};  ///< what its reports hold beside the estimate
};

/// Views: `values` is valid during the call it is handed to.
struct Measurement {
  std::uint32_t epoch = 0;
  Round round = 0;
  std::span<const double> values;
};
struct Actuation {
  std::uint32_t epoch = 0, process = 0;
  Round round = 0;
  std::span<const double> values;
};

enum class State : std::uint8_t { hello, ready, status, failed, leaving };
struct Presence {
  std::uint32_t process = 0, epoch = 0;
  State state = State::hello;
  std::uint64_t pid = 0;
  std::string host;
  std::vector<AgentId> agents;
  Round round = 0;
  AgentId waiting_agent;
  std::vector<AgentId> waiting_for;
  std::string note;
  Sender sender = {};  ///< not sent: whoever reads it learns it from DDS
};

struct MemberReport {
  AgentId agent;
  std::vector<Round> rounds;
  std::vector<double> estimates;
  std::vector<std::uint64_t> hashes;
  std::vector<AgentCounters> counters;
  std::vector<double> recorded = {};  ///< what is recorded beside the estimates
  std::uint64_t slept = 0;            ///< real time: rounds of this stay that it has left out so far
};
struct LinkReport {
  Edge edge;
  std::uint64_t delivered = 0, lost = 0, duplicated = 0, reordered = 0, superseded = 0;
};
struct Telemetry {
  std::uint32_t process = 0, epoch = 0;
  bool last = false;
  std::vector<MemberReport> members;
  std::vector<LinkReport> links;
  std::vector<Refusal> refusals = {};  ///< since the telemetry before
  Round round = 0;                     ///< of its slowest agent
  std::vector<NetworkTotals> network = {};
  Performance performance = {};  ///< `process` is above
};

/// Writes one topic with the QoS that topic has. T: Assignment, PlantAssignment, Grant, Command, Layouts, Presence, Telemetry.
/// write() throws dds::core::Error, and ConfigError if a text or number does not fit the wire.
template <class T>
class Writer {
  friend class AnnouncementWriter;

 public:
  /// With a lease (s): whoever reads it knows that the process is gone when for so long it has not shown that it is alive.
  explicit Writer(const Participant& participant, std::optional<double> liveliness_lease = {});
  ~Writer();
  Writer(Writer&&) noexcept;
  void write(const T& value);
  [[nodiscard]] std::uint64_t sent_again_bytes() const;
  /// Blocks until every matched reader has acknowledged, or `seconds` have passed; says which.
  bool wait_for_acknowledgments(double seconds);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Reads one topic. `on_data` runs on DDS's receive thread for every valid sample; it must not block. `on_matched(n)`: now n writers of the
/// run are matched.
template <class T>
class Reader {
  friend class AnnouncementReader;

 public:
  Reader(const Participant& participant, std::function<void(T&&)> on_data, std::function<void(std::size_t)> on_matched = {});
  ~Reader();
  Reader(Reader&&) noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Reads Presence, and is told when a process (GUID of its participant) that wrote with a liveliness lease falls silent (false) and is
/// heard again (true).
class PresenceReader {
 public:
  PresenceReader(const Participant& participant, std::function<void(Presence&&)> on_data,
                 std::function<void(const std::string& sender, bool alive)> on_liveliness);
  ~PresenceReader();
  PresenceReader(PresenceReader&&) noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Announcements among agents: layout messages, in the partitions of the agents whose process writes them (their own, and those it passes
/// on). Whoever connects late still gets each of them.
class AnnouncementWriter {
 public:
  AnnouncementWriter(const Participant& participant, std::span<const AgentId> agents);
  ~AnnouncementWriter();
  AnnouncementWriter(AnnouncementWriter&&) noexcept;
  void write(const Layouts& value);
  /// Blocks until every matched reader has acknowledged, or `seconds` have passed; says which.
  bool wait_for_acknowledgments(double seconds);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

class AnnouncementReader {
 public:
  /// What the processes of the `senders` write. `on_data` runs on a receive thread; it must not block.
  AnnouncementReader(const Participant& participant, std::span<const AgentId> senders, std::function<void(Layouts&&)> on_data);
  ~AnnouncementReader();
  AnnouncementReader(AnnouncementReader&&) noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// One agent's Information, in that agent's partition. `on_matched(n)`: n readers (processes of the run) have been matched so far; those
/// that have left count.
/// `delivery`: in real time; else reliable, and the newest `kept` messages are kept for readers that miss some: a reader that is alive
/// needs no more than a window of them, and one that died without a word would need them for ever.
class InformationWriter {
 public:
  InformationWriter(const Participant& participant, AgentId agent, std::function<void(std::size_t)> on_matched, Round kept,
                    const std::optional<Delivery>& delivery = {});
  ~InformationWriter();
  InformationWriter(InformationWriter&&) noexcept;
  void write(std::uint32_t epoch, Round round, std::span<const double> values);
  [[nodiscard]] std::uint64_t sent_again_bytes() const;
  /// Blocks until every matched reader has acknowledged, or `seconds` have passed; says which.
  bool wait_for_acknowledgments(double seconds);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// What DDS told a reader in real time.
struct ReaderEvents {
  std::uint64_t deadlines_missed = 0, liveliness_lost = 0;
  ReaderEvents operator+(const ReaderEvents& other) const {
    return {deadlines_missed + other.deadlines_missed, liveliness_lost + other.liveliness_lost};
  }
  ReaderEvents operator-(const ReaderEvents& other) const {
    return {deadlines_missed - other.deadlines_missed, liveliness_lost - other.liveliness_lost};
  }
};

/// The Information of some agents (of all, if `senders` is empty), handed over in bursts on a receive thread. No allocation in steady
/// state.
class InformationReader {
 public:
  /// The samples that are here now; to be drained before the callback returns.
  class Burst {
   public:
    /// Fills `message` (valid until the next call); false when there is no more. Invalid samples are skipped and counted.
    bool next(Information& message);

   private:
    friend class InformationReader;
    struct Impl;
    explicit Burst(Impl& impl) : impl_(impl) {}
    Impl& impl_;
  };
  InformationReader(const Participant& participant, std::span<const AgentId> senders, std::function<void(Burst&)> on_burst,
                    const std::optional<Delivery>& delivery = {});
  ~InformationReader();
  InformationReader(InformationReader&&) noexcept;
  [[nodiscard]] ReaderEvents events() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// One end of the closed loop: writes and reads bare numbers of a round, point to point. `on_matched(n)`: now n readers of the
/// run are matched.
/// The plant has a MeasurementWriter per process and one ActuationReader; a process has one MeasurementReader and one ActuationWriter.
template <class T>
class LoopWriter {
 public:
  /// Measurement: to the process of that name alone. Actuation: to the plant. `kept`, `delivery`: as those of an InformationWriter.
  LoopWriter(const Participant& participant, std::uint32_t process, std::function<void(std::size_t)> on_matched, Round kept,
             const std::optional<Delivery>& delivery = {});
  ~LoopWriter();
  LoopWriter(LoopWriter&&) noexcept;
  void write(const T& value);
  [[nodiscard]] std::uint64_t sent_again_bytes() const;
  /// Blocks until every matched reader has acknowledged, or `seconds` have passed; says which.
  bool wait_for_acknowledgments(double seconds);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

template <class T>
class LoopReader {
 public:
  /// Measurement: those of process `process`. Actuation: everybody's. `on_data` runs on a receive thread; it must not block.
  LoopReader(const Participant& participant, std::uint32_t process, std::function<void(const T&)> on_data,
             const std::optional<Delivery>& delivery = {});
  ~LoopReader();
  LoopReader(LoopReader&&) noexcept;
  [[nodiscard]] ReaderEvents events() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

using MeasurementWriter = LoopWriter<Measurement>;
using MeasurementReader = LoopReader<Measurement>;
using ActuationWriter = LoopWriter<Actuation>;
using ActuationReader = LoopReader<Actuation>;

}  // namespace consort::wire
