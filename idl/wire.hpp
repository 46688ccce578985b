#pragma once
/// The wire: messages (core/messages.hpp), and what a process says of itself, <-> samples on DDS topics. The only room that sees the
/// generated types. Whatever is read is validated: what comes from outside the run or breaks a bound of consort.idl is dropped, counted and
/// named (Participant::take_refusals), never passed on.

#include "core/messages.hpp"
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

constexpr const char* kCommandTopic = "consort_command";
constexpr const char* kPresenceTopic = "consort_presence";

enum class Order : std::uint8_t { status, finish, shutdown, departed, come_back, welcome, refused };
struct Command {
  std::uint32_t epoch = 0;
  Order order = Order::status;
  std::vector<AgentId> agents = {};  ///< departed: all that are gone so far, ascending; come_back: who does
  Round round = 0;                   ///< come_back: from this one on
  std::string to = {};               ///< welcome, refused: GUID of the participant that is meant
  std::string note = {};             ///< refused: why
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

struct Telemetry {
  std::uint32_t process = 0, epoch = 0;
  bool last = false;
  std::vector<MemberReport> members;
  std::vector<LinkTotals> links;
  std::vector<Refusal> refusals = {};  ///< since the telemetry before
  Round round = 0;                     ///< of its slowest agent
  std::vector<NetworkTotals> network = {};
  Performance performance = {};  ///< `process` is above
};

/// A process that no parent waits for shows so often that it is alive, and DDS says that it is silent when it has not for so long (s).
constexpr double kSignOfLifeEvery = 0.15, kSignOfLifeLease = 0.7;

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
/// `delivery`: in real time; else best effort, and whoever lacks something says so (StandingWriter).
class InformationWriter {
 public:
  InformationWriter(const Participant& participant, AgentId agent, std::function<void(std::size_t)> on_matched,
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
  /// Measurement: to the process of that name alone. Actuation: to the plant. `delivery`: as that of an InformationWriter.
  LoopWriter(const Participant& participant, std::uint32_t process, std::function<void(std::size_t)> on_matched,
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

/// Whom a Standing concerns: who sends what somebody may lack.
struct Senders {
  std::vector<AgentId> agents = {};           ///< their messages
  bool every_agent = false;                   ///< of whatever agent
  bool plant = false;                         ///< its measurements
  std::vector<std::uint32_t> processes = {};  ///< what their agents do
};

/// Tells these senders what they have not been heard to say. Best effort: who lacks something asks again.
class StandingWriter {
 public:
  StandingWriter(const Participant& participant, const Senders& senders);
  ~StandingWriter();
  StandingWriter(StandingWriter&&) noexcept;
  void write(const Standing& value);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// What these senders are told. `on_data` runs on a receive thread; it must not block.
class StandingReader {
 public:
  StandingReader(const Participant& participant, const Senders& senders, std::function<void(Standing&&)> on_data);
  ~StandingReader();
  StandingReader(StandingReader&&) noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace consort::wire
