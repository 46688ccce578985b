#include "idl/wire.hpp"

#include "idl/codec.hpp"

#include <mutex>

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

namespace consort::wire {
namespace {

using dds::core::Duration;
using dds::core::policy::Deadline;
using dds::core::policy::Durability;
using dds::core::policy::DurabilityService;
using dds::core::policy::History;
using dds::core::policy::IgnoreLocal;
using dds::core::policy::Lifespan;
using dds::core::policy::Liveliness;
using dds::core::policy::Partition;
using dds::core::policy::Reliability;

// What a topic is called and how it is typed. All of these are reliable and keep-all: nothing that steers or records a run may be lost,
// and the high watermark of dds::configuration keeps writes from blocking. All are transient-local too: a reader whose writer does not know
// it yet, as packets of discovery were lost, still gets what was written last. Where two things may be written before anybody answers, such
// a reader gets the last `kept`: who misses a report or a grant for good would keep everybody waiting.
constexpr std::int32_t kOnlyTheNewest = 1, kAllThatWaits = 64;
template <class T>
struct TopicOf;
template <>
struct TopicOf<Assignment> {
  using Wire = consort_wire_Assignment;
  static constexpr const char* name = "consort_assignment";
  static constexpr std::int32_t kept = kOnlyTheNewest;
};
template <>
struct TopicOf<PlantAssignment> {
  using Wire = consort_wire_PlantAssignment;
  static constexpr const char* name = "consort_plant_assignment";
  static constexpr std::int32_t kept = kOnlyTheNewest;
};
template <>
struct TopicOf<Grant> {
  using Wire = consort_wire_Grant;
  static constexpr const char* name = "consort_grant";
  static constexpr std::int32_t kept = kAllThatWaits;
};
template <>
struct TopicOf<Command> {
  using Wire = consort_wire_Command;
  static constexpr const char* name = kCommandTopic;
  static constexpr std::int32_t kept = kOnlyTheNewest;
};
template <>
struct TopicOf<Layouts> {
  using Wire = consort_wire_Layout;
  static constexpr const char* name = "consort_layout";
  static constexpr std::int32_t kept = kOnlyTheNewest;
};
template <>
struct TopicOf<Presence> {
  using Wire = consort_wire_Presence;
  static constexpr const char* name = kPresenceTopic;
  static constexpr std::int32_t kept = kOnlyTheNewest;
};
template <>
struct TopicOf<Telemetry> {
  using Wire = consort_wire_Telemetry;
  static constexpr const char* name = "consort_telemetry";
  static constexpr std::int32_t kept = kAllThatWaits;
};
constexpr const char* kInformationTopic = "consort_information";

constexpr std::size_t kMostKept = 100'000;  // samples
constexpr Duration kWriteLimit =
    Duration::from_millisecs(10'000);  // reached only if the high watermark is: then it is an error, not a wait

template <class Qos>
Qos steering_qos(std::int32_t kept) {
  Qos qos;
  qos << Reliability::Reliable(kWriteLimit) << History::KeepAll() << Durability::TransientLocal()
      << DurabilityService{.history = History::KeepLast(kept)};
  return qos;
}

// Only what another participant sends: a process hands messages to its own agents by direct call. In lockstep a reader keeps all until
// it is taken, and what is lost is asked for again: acknowledgements and heartbeats would cost a tenth. In real time the newest counts:
// `senders` share a reader's history, as there are no keys. DDS drops what has outlived its use by far; what is late by less is counted.
template <class Qos>
Qos information_qos(const std::optional<Delivery>& delivery, std::size_t senders = 1) {
  constexpr double kLateLifespans = 2.0;
  Qos qos;
  qos << IgnoreLocal::Participant();
  if (!delivery) {
    qos << Reliability::BestEffort();
    if constexpr (std::is_same_v<Qos, dds::sub::qos::DataReaderQos>) qos << History::KeepAll();
    return qos;
  }
  qos << (delivery->reliable ? Reliability::Reliable(kWriteLimit) : Reliability::BestEffort())
      << History::KeepLast(static_cast<std::int32_t>(std::min<std::size_t>(delivery->history * senders, kMostKept)))
      << Deadline{Duration::from_secs(delivery->deadline)} << Liveliness::Automatic(Duration::from_secs(delivery->liveliness_lease));
  if constexpr (std::is_same_v<Qos, dds::pub::qos::DataWriterQos>)
    qos << Lifespan{Duration::from_secs(kLateLifespans * delivery->lifespan)};
  return qos;
}

// Counts what DDS tells a reader.
struct EventCount {
  std::atomic<std::uint64_t> deadlines_missed{0}, liveliness_lost{0};

  template <class Wire>
  void listen(dds::sub::DataReaderListener<Wire>& listener) {
    listener.on_requested_deadline_missed = [this](auto&, const auto& status) {
      deadlines_missed.fetch_add(static_cast<std::uint64_t>(std::max(status.total_count_change(), 0)), std::memory_order_relaxed);
    };
    listener.on_liveliness_changed = [this](auto&, const auto& status) {
      liveliness_lost.fetch_add(static_cast<std::uint64_t>(std::max(status.not_alive_count_change(), 0)), std::memory_order_relaxed);
    };
  }
  [[nodiscard]] ReaderEvents now() const {
    return {deadlines_missed.load(std::memory_order_relaxed), liveliness_lost.load(std::memory_order_relaxed)};
  }
};

// Where a sample of the closed loop goes: a measurement to one process, an actuation to the plant.
template <class T>
struct LoopOf;
template <>
struct LoopOf<Measurement> {
  using Wire = consort_wire_Measurement;
  static constexpr const char* topic = "consort_measurement";
  static constexpr std::size_t senders = 1;
  static std::string partition(std::uint32_t process) { return "process" + std::to_string(process); }
};
template <>
struct LoopOf<Actuation> {
  using Wire = consort_wire_Actuation;
  static constexpr const char* topic = "consort_actuation";
  static constexpr std::size_t senders = kMostKept;  // every process
  static std::string partition(std::uint32_t) { return "plant"; }
};

// Decodes one sample for whoever takes it, if its writer belongs to the run and no bound is broken; else it is counted.
template <class Wire, class Use>
void take(Gate& gate, const dds::sub::Sample<Wire>& sample, Use&& use) {
  const Gate::Handle writer = sample.info().publication_handle();
  if (!gate.admits(writer)) return;
  try {
    use(decode(sample.data()));
  } catch (const Rejected& broken) {
    gate.refuse(writer, broken.what());
  }
}

// Everything that is here; `use(value, writer)`.
template <class Wire, class Use>
void take_all(Gate& gate, dds::sub::DataReader<Wire>& source, Use&& use) {
  for (auto samples = source.take(); samples.length() + samples.invalid() > 0; samples = source.take()) {
    for (const auto& sample : samples)
      take(gate, sample, [&](auto&& value) { use(std::forward<decltype(value)>(value), sample.info().publication_handle()); });
  }
}

// A reader's doorkeeper hears of every match.
auto judge_writers(Gate& gate, std::function<void(std::size_t)> on_matched = {}) {
  return [&gate, on_matched = std::move(on_matched)](auto&, const dds::core::status::SubscriptionMatchedStatus& status) {
    const Gate::Matches matches = gate.matched(status.last_publication_handle(), status.current_count_change());
    if (on_matched) on_matched(matches.now);
  };
}

// As judge_writers, of a writer.
auto judge_readers(Gate& gate, std::function<void(Gate::Matches)> on_matched) {
  return [&gate, on_matched = std::move(on_matched)](auto&, const dds::core::status::PublicationMatchedStatus& status) {
    on_matched(gate.matched(status.last_subscription_handle(), status.current_count_change()));
  };
}

std::string partition_of(AgentId agent) { return "agent" + std::to_string(agent.value); }

}  // namespace

// --- the steering topics ----------------------------------------------------------------------------------------------

template <class T>
struct Writer<T>::Impl {
  using Wire = typename TopicOf<T>::Wire;
  explicit Impl(const Participant& participant, const dds::pub::qos::PublisherQos& where = {},
                const Liveliness& liveliness = Liveliness::Automatic())
      : writer(dds::pub::Publisher(participant, where), dds::topic::Topic<Wire>(participant, TopicOf<T>::name),
               steering_qos<dds::pub::qos::DataWriterQos>(TopicOf<T>::kept) << participant.badge(TopicOf<T>::name) << liveliness) {}
  dds::pub::DataWriter<Wire> writer;
};

template <class T>
Writer<T>::Writer(const Participant& participant, std::optional<double> liveliness_lease)
    : impl_(std::make_unique<Impl>(
          participant, dds::pub::qos::PublisherQos{},
          liveliness_lease ? Liveliness::ManualByParticipant(Duration::from_secs(*liveliness_lease)) : Liveliness::Automatic())) {}
template <class T>
Writer<T>::~Writer() = default;
template <class T>
Writer<T>::Writer(Writer&&) noexcept = default;

template <class T>
void Writer<T>::write(const T& value) {
  Arena arena;
  impl_->writer.write(encode(value, arena));
}

template <class T>
std::uint64_t Writer<T>::sent_again_bytes() const {
  return impl_->writer.retransmitted_bytes();
}

template <class T>
bool Writer<T>::wait_for_acknowledgments(double seconds) {
  return impl_->writer.wait_for_acknowledgments(Duration::from_secs(seconds));
}

template <class T>
struct Reader<T>::Impl {
  using Wire = typename TopicOf<T>::Wire;
  Impl(const Participant& participant, std::function<void(T&&)> on_data, std::function<void(std::size_t)> on_matched,
       const dds::sub::qos::SubscriberQos& where = {})
      : gate(participant, TopicOf<T>::name, Gate::Kind::writers),
        reader(dds::sub::Subscriber(participant, where), dds::topic::Topic<Wire>(participant, TopicOf<T>::name),
               steering_qos<dds::sub::qos::DataReaderQos>(TopicOf<T>::kept) << participant.badge(TopicOf<T>::name),
               listener(std::move(on_data), std::move(on_matched))) {}

  dds::sub::DataReaderListener<Wire> listener(std::function<void(T&&)> on_data, std::function<void(std::size_t)> on_matched) {
    dds::sub::DataReaderListener<Wire> result;
    result.on_data_available = [this, on_data = std::move(on_data)](dds::sub::DataReader<Wire>& source) {
      take_all(gate, source, [&](auto&& value, Gate::Handle) { on_data(std::forward<decltype(value)>(value)); });
    };
    result.on_subscription_matched = judge_writers(gate, std::move(on_matched));
    return result;
  }

  Gate gate;
  dds::sub::DataReader<Wire> reader;
};

template <class T>
Reader<T>::Reader(const Participant& participant, std::function<void(T&&)> on_data, std::function<void(std::size_t)> on_matched)
    : impl_(std::make_unique<Impl>(participant, std::move(on_data), std::move(on_matched))) {}
template <class T>
Reader<T>::~Reader() = default;
template <class T>
Reader<T>::Reader(Reader&&) noexcept = default;

template class Writer<Assignment>;
template class Writer<PlantAssignment>;
template class Writer<Grant>;
template class Writer<Command>;
template class Writer<Layouts>;
template class Writer<Presence>;
template class Writer<Telemetry>;
template class Reader<Assignment>;
template class Reader<PlantAssignment>;
template class Reader<Grant>;
template class Reader<Command>;
template class Reader<Layouts>;
template class Reader<Telemetry>;

// --- who is alive -----------------------------------------------------------------------------------------------------

struct PresenceReader::Impl {
  using Wire = consort_wire_Presence;
  Impl(const Participant& participant, std::function<void(Presence&&)> on_data, std::function<void(const std::string&, bool)> on_liveliness)
      : self(participant),
        gate(participant, TopicOf<Presence>::name, Gate::Kind::writers),
        reader(dds::sub::Subscriber(participant), dds::topic::Topic<Wire>(participant, TopicOf<Presence>::name),
               steering_qos<dds::sub::qos::DataReaderQos>(TopicOf<Presence>::kept) << participant.badge(TopicOf<Presence>::name),
               listener(std::move(on_data), std::move(on_liveliness))) {}

  dds::sub::DataReaderListener<Wire> listener(std::function<void(Presence&&)> on_data,
                                              std::function<void(const std::string&, bool)> on_liveliness) {
    dds::sub::DataReaderListener<Wire> result;
    result.on_data_available = [this, on_data = std::move(on_data)](dds::sub::DataReader<Wire>& source) {
      take_all(gate, source, [&](Presence&& presence, Gate::Handle writer) {
        presence.sender = sender(writer);
        on_data(std::move(presence));
      });
    };
    result.on_liveliness_changed = [this, on_liveliness = std::move(on_liveliness)](auto&, const auto& status) {
      if (status.not_alive_count_change() > 0 || status.alive_count_change() > 0)
        on_liveliness(sender(status.last_publication_handle()).guid, status.alive_count_change() > 0);
    };
    result.on_subscription_matched = judge_writers(gate);
    return result;
  }

  Sender sender(Gate::Handle writer) {
    const std::lock_guard lock(mutex);
    auto known = senders.find(writer);
    if (known == senders.end()) known = senders.emplace(writer, self.sender(writer)).first;
    return known->second;
  }

  Participant self;
  Gate gate;
  std::mutex mutex;
  std::map<Gate::Handle, Sender> senders;  // by their writer
  dds::sub::DataReader<Wire> reader;
};

PresenceReader::PresenceReader(const Participant& participant, std::function<void(Presence&&)> on_data,
                               std::function<void(const std::string&, bool)> on_liveliness)
    : impl_(std::make_unique<Impl>(participant, std::move(on_data), std::move(on_liveliness))) {}
PresenceReader::~PresenceReader() = default;
PresenceReader::PresenceReader(PresenceReader&&) noexcept = default;

// --- announcements ----------------------------------------------------------------------------------------------------

namespace {

Partition partitions_of(std::span<const AgentId> agents) {
  std::vector<std::string> names;
  for (const AgentId agent : agents) names.push_back(partition_of(agent));
  return Partition(names);
}

}  // namespace

struct AnnouncementWriter::Impl : Writer<Layouts>::Impl {
  using Writer<Layouts>::Impl::Impl;
};
AnnouncementWriter::AnnouncementWriter(const Participant& participant, std::span<const AgentId> agents)
    : impl_(std::make_unique<Impl>(participant, dds::pub::qos::PublisherQos() << partitions_of(agents))) {}
AnnouncementWriter::~AnnouncementWriter() = default;
AnnouncementWriter::AnnouncementWriter(AnnouncementWriter&&) noexcept = default;
void AnnouncementWriter::write(const Layouts& value) {
  Arena arena;
  impl_->writer.write(encode(value, arena));
}

bool AnnouncementWriter::wait_for_acknowledgments(double seconds) {
  return impl_->writer.wait_for_acknowledgments(Duration::from_secs(seconds));
}

struct AnnouncementReader::Impl : Reader<Layouts>::Impl {
  using Reader<Layouts>::Impl::Impl;
};
AnnouncementReader::AnnouncementReader(const Participant& participant, std::span<const AgentId> senders,
                                       std::function<void(Layouts&&)> on_data)
    : impl_(std::make_unique<Impl>(participant, std::move(on_data), std::function<void(std::size_t)>{},
                                   dds::sub::qos::SubscriberQos() << partitions_of(senders))) {}
AnnouncementReader::~AnnouncementReader() = default;
AnnouncementReader::AnnouncementReader(AnnouncementReader&&) noexcept = default;

// --- information ------------------------------------------------------------------------------------------------------

struct InformationWriter::Impl {
  using Wire = consort_wire_Information;
  Impl(const Participant& participant, AgentId sender, std::function<void(std::size_t)> on_matched, const std::optional<Delivery>& delivery)
      : agent(sender),
        gate(participant, kInformationTopic, Gate::Kind::readers),
        writer(dds::pub::Publisher(participant, dds::pub::qos::PublisherQos() << Partition(partition_of(sender))),
               dds::topic::Topic<Wire>(participant, kInformationTopic),
               information_qos<dds::pub::qos::DataWriterQos>(delivery) << participant.badge(kInformationTopic),
               {.on_publication_matched =
                    judge_readers(gate, [on_matched = std::move(on_matched)](Gate::Matches matches) { on_matched(matches.ever); })}) {}
  AgentId agent;
  Gate gate;
  dds::pub::DataWriter<Wire> writer;
};

InformationWriter::InformationWriter(const Participant& participant, AgentId agent, std::function<void(std::size_t)> on_matched,
                                     const std::optional<Delivery>& delivery)
    : impl_(std::make_unique<Impl>(participant, agent, std::move(on_matched), delivery)) {}
InformationWriter::~InformationWriter() = default;
InformationWriter::InformationWriter(InformationWriter&&) noexcept = default;

void InformationWriter::write(std::uint32_t epoch, Round round, std::span<const double> values) {
  impl_->writer.write(encode(Information{epoch, impl_->agent, round, values}));
}

std::uint64_t InformationWriter::sent_again_bytes() const { return impl_->writer.retransmitted_bytes(); }

bool InformationWriter::wait_for_acknowledgments(double seconds) {
  return impl_->writer.wait_for_acknowledgments(Duration::from_secs(seconds));
}

struct InformationReader::Burst::Impl {
  using Wire = consort_wire_Information;
  static constexpr std::size_t kBatch = 32;

  Impl(const Participant& participant, std::span<const AgentId> senders, std::function<void(Burst&)> on_burst,
       const std::optional<Delivery>& delivery)
      : gate(participant, kInformationTopic, Gate::Kind::writers),
        reader(dds::sub::Subscriber(participant, dds::sub::qos::SubscriberQos() << partitions(senders)),
               dds::topic::Topic<Wire>(participant, kInformationTopic),
               information_qos<dds::sub::qos::DataReaderQos>(delivery, senders.empty() ? kMostKept : senders.size())
                   << participant.badge(kInformationTopic),
               listener(std::move(on_burst), delivery.has_value())) {}

  static Partition partitions(std::span<const AgentId> senders) {
    std::vector<std::string> names;
    for (const AgentId sender : senders) names.push_back(partition_of(sender));
    if (names.empty()) names.emplace_back("agent*");
    return Partition(names);
  }

  dds::sub::DataReaderListener<Wire> listener(std::function<void(Burst&)> on_burst, bool realtime) {
    dds::sub::DataReaderListener<Wire> result;
    if (realtime) events.listen(result);
    result.on_data_available = [this, on_burst = std::move(on_burst)](dds::sub::DataReader<Wire>& from) {
      source = &from;
      source->take_into(batch);
      next = batch.begin();
      Burst burst(*this);
      on_burst(burst);
    };
    result.on_subscription_matched = judge_writers(gate);
    return result;
  }

  Gate gate;
  EventCount events;
  dds::sub::SampleBatch<Wire, kBatch> batch;
  dds::sub::SampleBatch<Wire, kBatch>::iterator next = batch.end();
  dds::sub::DataReader<Wire>* source = nullptr;  // set while a burst is being read
  dds::sub::DataReader<Wire> reader;
};

bool InformationReader::Burst::next(Information& message) {
  while (true) {
    if (impl_.next == impl_.batch.end()) {
      if (!impl_.batch.full()) return false;
      impl_.source->take_into(impl_.batch);
      impl_.next = impl_.batch.begin();
      continue;
    }
    const auto sample = *impl_.next;
    ++impl_.next;
    bool taken = false;
    take(impl_.gate, sample, [&](const Information& information) {
      message = information;
      taken = true;
    });
    if (taken) return true;
  }
}

struct InformationReader::Impl : Burst::Impl {
  using Burst::Impl::Impl;
};

InformationReader::InformationReader(const Participant& participant, std::span<const AgentId> senders, std::function<void(Burst&)> on_burst,
                                     const std::optional<Delivery>& delivery)
    : impl_(std::make_unique<Impl>(participant, senders, std::move(on_burst), delivery)) {}
InformationReader::~InformationReader() = default;
InformationReader::InformationReader(InformationReader&&) noexcept = default;
ReaderEvents InformationReader::events() const { return impl_->events.now(); }

// --- the closed loop --------------------------------------------------------------------------------------------------

template <class T>
struct LoopWriter<T>::Impl {
  using Wire = typename LoopOf<T>::Wire;
  Impl(const Participant& participant, std::uint32_t process, std::function<void(std::size_t)> on_matched,
       const std::optional<Delivery>& delivery)
      : gate(participant, LoopOf<T>::topic, Gate::Kind::readers),
        writer(dds::pub::Publisher(participant, dds::pub::qos::PublisherQos() << Partition(LoopOf<T>::partition(process))),
               dds::topic::Topic<Wire>(participant, LoopOf<T>::topic),
               information_qos<dds::pub::qos::DataWriterQos>(delivery) << participant.badge(LoopOf<T>::topic),
               {.on_publication_matched =
                    judge_readers(gate, [on_matched = std::move(on_matched)](Gate::Matches matches) { on_matched(matches.now); })}) {}
  Gate gate;
  dds::pub::DataWriter<Wire> writer;
};

template <class T>
LoopWriter<T>::LoopWriter(const Participant& participant, std::uint32_t process, std::function<void(std::size_t)> on_matched,
                          const std::optional<Delivery>& delivery)
    : impl_(std::make_unique<Impl>(participant, process, std::move(on_matched), delivery)) {}
template <class T>
LoopWriter<T>::~LoopWriter() = default;
template <class T>
LoopWriter<T>::LoopWriter(LoopWriter&&) noexcept = default;
template <class T>
void LoopWriter<T>::write(const T& value) {
  impl_->writer.write(encode(value));
}

template <class T>
std::uint64_t LoopWriter<T>::sent_again_bytes() const {
  return impl_->writer.retransmitted_bytes();
}

template <class T>
bool LoopWriter<T>::wait_for_acknowledgments(double seconds) {
  return impl_->writer.wait_for_acknowledgments(Duration::from_secs(seconds));
}

template <class T>
struct LoopReader<T>::Impl {
  using Wire = typename LoopOf<T>::Wire;
  Impl(const Participant& participant, std::uint32_t process, std::function<void(const T&)> on_data,
       const std::optional<Delivery>& delivery)
      : gate(participant, LoopOf<T>::topic, Gate::Kind::writers),
        reader(dds::sub::Subscriber(participant, dds::sub::qos::SubscriberQos() << Partition(LoopOf<T>::partition(process))),
               dds::topic::Topic<Wire>(participant, LoopOf<T>::topic),
               information_qos<dds::sub::qos::DataReaderQos>(delivery, LoopOf<T>::senders) << participant.badge(LoopOf<T>::topic),
               listener(std::move(on_data), delivery.has_value())) {}

  dds::sub::DataReaderListener<Wire> listener(std::function<void(const T&)> on_data, bool realtime) {
    dds::sub::DataReaderListener<Wire> result;
    if (realtime) events.listen(result);
    result.on_data_available = [this, on_data = std::move(on_data)](dds::sub::DataReader<Wire>& source) {
      take_all(gate, source, [&](auto&& value, Gate::Handle) { on_data(std::forward<decltype(value)>(value)); });
    };
    result.on_subscription_matched = judge_writers(gate);
    return result;
  }

  Gate gate;
  EventCount events;
  dds::sub::DataReader<Wire> reader;
};

template <class T>
LoopReader<T>::LoopReader(const Participant& participant, std::uint32_t process, std::function<void(const T&)> on_data,
                          const std::optional<Delivery>& delivery)
    : impl_(std::make_unique<Impl>(participant, process, std::move(on_data), delivery)) {}
template <class T>
LoopReader<T>::~LoopReader() = default;
template <class T>
LoopReader<T>::LoopReader(LoopReader&&) noexcept = default;
template <class T>
ReaderEvents LoopReader<T>::events() const {
  return impl_->events.now();
}

template class LoopWriter<Measurement>;
template class LoopWriter<Actuation>;
template class LoopReader<Measurement>;
template class LoopReader<Actuation>;

// --- what is lacking --------------------------------------------------------------------------------------------------

namespace {

constexpr const char* kStandingTopic = "consort_standing";

Partition partitions_of(const Senders& senders) {
  std::vector<std::string> names;
  if (senders.every_agent) names.emplace_back("agent*");
  for (const AgentId agent : senders.agents) names.push_back(partition_of(agent));
  for (const std::uint32_t process : senders.processes) names.push_back(LoopOf<Measurement>::partition(process));
  if (senders.plant) names.push_back(LoopOf<Actuation>::partition(0));
  return Partition(names);
}

}  // namespace

struct StandingWriter::Impl {
  using Wire = consort_wire_Standing;
  Impl(const Participant& participant, const Senders& senders)
      : writer(dds::pub::Publisher(participant, dds::pub::qos::PublisherQos() << partitions_of(senders)),
               dds::topic::Topic<Wire>(participant, kStandingTopic),
               information_qos<dds::pub::qos::DataWriterQos>(std::nullopt) << participant.badge(kStandingTopic)) {}
  dds::pub::DataWriter<Wire> writer;
};

StandingWriter::StandingWriter(const Participant& participant, const Senders& senders)
    : impl_(std::make_unique<Impl>(participant, senders)) {}
StandingWriter::~StandingWriter() = default;
StandingWriter::StandingWriter(StandingWriter&&) noexcept = default;
void StandingWriter::write(const Standing& value) {
  Arena arena;
  impl_->writer.write(encode(value, arena));
}

struct StandingReader::Impl {
  using Wire = consort_wire_Standing;
  Impl(const Participant& participant, const Senders& senders, std::function<void(Standing&&)> on_data)
      : gate(participant, kStandingTopic, Gate::Kind::writers),
        reader(dds::sub::Subscriber(participant, dds::sub::qos::SubscriberQos() << partitions_of(senders)),
               dds::topic::Topic<Wire>(participant, kStandingTopic),
               information_qos<dds::sub::qos::DataReaderQos>(std::nullopt) << participant.badge(kStandingTopic),
               listener(std::move(on_data))) {}

  dds::sub::DataReaderListener<Wire> listener(std::function<void(Standing&&)> on_data) {
    dds::sub::DataReaderListener<Wire> result;
    result.on_data_available = [this, on_data = std::move(on_data)](dds::sub::DataReader<Wire>& source) {
      take_all(gate, source, [&](auto&& value, Gate::Handle) { on_data(std::forward<decltype(value)>(value)); });
    };
    result.on_subscription_matched = judge_writers(gate);
    return result;
  }

  Gate gate;
  dds::sub::DataReader<Wire> reader;
};

StandingReader::StandingReader(const Participant& participant, const Senders& senders, std::function<void(Standing&&)> on_data)
    : impl_(std::make_unique<Impl>(participant, senders, std::move(on_data))) {}
StandingReader::~StandingReader() = default;
StandingReader::StandingReader(StandingReader&&) noexcept = default;

}  // namespace consort::wire
