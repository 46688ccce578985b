#pragma once
/// dds::core::policy and the QoS sets: `qos << Reliability::Reliable() << History::KeepLast(8)`.

#include "dds/core.hpp"

#include <concepts>
#include <initializer_list>
#include <span>

namespace dds::core::policy {

/// Anything that can be put into a QoS set.
template <class P>
concept Policy = requires(const P& policy, dds_qos_t* qos) {
  policy.apply(qos);
};

constexpr std::int32_t kUnlimited = DDS_LENGTH_UNLIMITED;

/// Reliable: lost packets are repeated, and a write waits at most `max_blocking_time` for room, then throws TimeoutError. Reliable writers
/// match both kinds of reader, reliable readers only reliable writers.
class Reliability {
 public:
  static Reliability BestEffort() { return {DDS_RELIABILITY_BEST_EFFORT, Duration::zero()}; }
  static Reliability Reliable(Duration max_blocking_time = Duration::from_millisecs(100)) {
    return {DDS_RELIABILITY_RELIABLE, max_blocking_time};
  }
  void apply(dds_qos_t* qos) const { dds_qset_reliability(qos, kind_, blocking_.nanoseconds()); }

 private:
  Reliability(dds_reliability_kind_t kind, Duration blocking) : kind_(kind), blocking_(blocking) {}
  dds_reliability_kind_t kind_;
  Duration blocking_;
};

/// TransientLocal: a late reader gets what the writer's DurabilityService keeps. Both sides must ask for it.
class Durability {
 public:
  static Durability Volatile() { return Durability(DDS_DURABILITY_VOLATILE); }
  static Durability TransientLocal() { return Durability(DDS_DURABILITY_TRANSIENT_LOCAL); }
  void apply(dds_qos_t* qos) const { dds_qset_durability(qos, kind_); }

 private:
  explicit Durability(dds_durability_kind_t kind) : kind_(kind) {}
  dds_durability_kind_t kind_;
};

/// How many samples per instance are kept until taken (reader) or acknowledged (writer).
class History {
 public:
  static History KeepAll() { return {DDS_HISTORY_KEEP_ALL, 0}; }
  static History KeepLast(std::int32_t depth) { return {DDS_HISTORY_KEEP_LAST, depth}; }
  void apply(dds_qos_t* qos) const { dds_qset_history(qos, kind_, depth_); }
  dds_history_kind_t kind() const { return kind_; }
  std::int32_t depth() const { return depth_; }

 private:
  History(dds_history_kind_t kind, std::int32_t depth) : kind_(kind), depth_(depth) {}
  dds_history_kind_t kind_;
  std::int32_t depth_;
};

/// Upper bounds on what is kept; kUnlimited by default.
struct ResourceLimits {
  std::int32_t max_samples = kUnlimited, max_instances = kUnlimited, max_samples_per_instance = kUnlimited;
  void apply(dds_qos_t* qos) const { dds_qset_resource_limits(qos, max_samples, max_instances, max_samples_per_instance); }
};

/// What a transient-local writer keeps for late readers. Without it they get one sample, whatever the writer's own history.
struct DurabilityService {
  History history = History::KeepLast(1);
  ResourceLimits limits{};
  Duration service_cleanup_delay = Duration::zero();
  void apply(dds_qos_t* qos) const {
    dds_qset_durability_service(qos, service_cleanup_delay.nanoseconds(), history.kind(), history.depth(), limits.max_samples,
                                limits.max_instances, limits.max_samples_per_instance);
  }
};

/// Who shows that a writer is alive, and how often at least. A lease under 0.3 s gives false alarms on an overloaded host.
class Liveliness {
 public:
  static Liveliness Automatic(Duration lease = Duration::infinite()) { return {DDS_LIVELINESS_AUTOMATIC, lease}; }
  static Liveliness ManualByParticipant(Duration lease) { return {DDS_LIVELINESS_MANUAL_BY_PARTICIPANT, lease}; }
  static Liveliness ManualByTopic(Duration lease) { return {DDS_LIVELINESS_MANUAL_BY_TOPIC, lease}; }
  void apply(dds_qos_t* qos) const { dds_qset_liveliness(qos, kind_, lease_.nanoseconds()); }

 private:
  Liveliness(dds_liveliness_kind_t kind, Duration lease) : kind_(kind), lease_(lease) {}
  dds_liveliness_kind_t kind_;
  Duration lease_;
};

/// At least one sample per instance and period, or the status says so.
struct Deadline {
  Duration period = Duration::infinite();
  void apply(dds_qos_t* qos) const { dds_qset_deadline(qos, period.nanoseconds()); }
};

/// A sample older than this is never delivered.
struct Lifespan {
  Duration duration = Duration::infinite();
  void apply(dds_qos_t* qos) const { dds_qset_lifespan(qos, duration.nanoseconds()); }
};

/// A set of names; endpoints match only when their sets meet. Belongs to publishers and subscribers.
class Partition {
 public:
  explicit Partition(std::string name) : names_{std::move(name)} {}
  explicit Partition(std::initializer_list<std::string> names) : names_(names) {}
  explicit Partition(std::vector<std::string> names) : names_(std::move(names)) {}
  void apply(dds_qos_t* qos) const {
    std::vector<const char*> pointers;
    for (const std::string& name : names_) pointers.push_back(name.c_str());
    dds_qset_partition(qos, static_cast<std::uint32_t>(pointers.size()), pointers.data());
  }
  const std::vector<std::string>& name() const { return names_; }

 private:
  std::vector<std::string> names_;
};

/// Bytes that travel with an endpoint's announcement, for those that match it to read.
class UserData {
 public:
  explicit UserData(std::span<const unsigned char> value) : value_(value.begin(), value.end()) {}
  void apply(dds_qos_t* qos) const { dds_qset_userdata(qos, value_.data(), value_.size()); }
  const std::vector<unsigned char>& value() const { return value_; }

 private:
  std::vector<unsigned char> value_;
};

/// Whether an instance is disposed of when its writer unregisters it or goes.
class WriterDataLifecycle {
 public:
  static WriterDataLifecycle AutoDisposeUnregisteredInstances() { return WriterDataLifecycle(true); }
  static WriterDataLifecycle ManuallyDisposeUnregisteredInstances() { return WriterDataLifecycle(false); }
  void apply(dds_qos_t* qos) const { dds_qset_writer_data_lifecycle(qos, autodispose_); }

 private:
  explicit WriterDataLifecycle(bool autodispose) : autodispose_(autodispose) {}
  bool autodispose_;
};

/// Cyclone's own: whose data an endpoint leaves alone. Participant: no delivery within one participant.
class IgnoreLocal {
 public:
  static IgnoreLocal None() { return IgnoreLocal(DDS_IGNORELOCAL_NONE); }
  static IgnoreLocal Participant() { return IgnoreLocal(DDS_IGNORELOCAL_PARTICIPANT); }
  static IgnoreLocal Process() { return IgnoreLocal(DDS_IGNORELOCAL_PROCESS); }
  void apply(dds_qos_t* qos) const { dds_qset_ignorelocal(qos, kind_); }

 private:
  explicit IgnoreLocal(dds_ignorelocal_kind_t kind) : kind_(kind) {}
  dds_ignorelocal_kind_t kind_;
};

}  // namespace dds::core::policy

namespace dds::core {

/// A set of policies for one kind of entity. What is not set keeps DDS's default (reader: best effort, keep last 1; writer: reliable).
template <class Kind>
class QosSet {
 public:
  QosSet() : qos_(checked(dds_create_qos())) {}
  QosSet(const QosSet& other) : QosSet() { expect(dds_copy_qos(qos_.get(), other.qos_.get()), "copy QoS", ""); }
  QosSet(QosSet&&) noexcept = default;
  QosSet& operator=(QosSet other) noexcept {
    qos_.swap(other.qos_);
    return *this;
  }
  template <policy::Policy P>
  QosSet& operator<<(const P& policy) & {
    policy.apply(qos_.get());
    return *this;
  }
  template <policy::Policy P>
  QosSet&& operator<<(const P& policy) && {
    policy.apply(qos_.get());
    return std::move(*this);
  }
  const dds_qos_t* get() const { return qos_.get(); }

 private:
  struct Deleter {
    void operator()(dds_qos_t* qos) const { dds_delete_qos(qos); }
  };
  static dds_qos_t* checked(dds_qos_t* qos) {
    if (qos == nullptr) raise(DDS_RETCODE_OUT_OF_RESOURCES, "create QoS");
    return qos;
  }
  std::unique_ptr<dds_qos_t, Deleter> qos_;
};

}  // namespace dds::core

namespace dds::domain::qos {
using DomainParticipantQos = core::QosSet<struct DomainParticipantKind>;
}
namespace dds::topic::qos {
using TopicQos = core::QosSet<struct TopicKind>;
}
namespace dds::pub::qos {
using PublisherQos = core::QosSet<struct PublisherKind>;
using DataWriterQos = core::QosSet<struct DataWriterKind>;
}  // namespace dds::pub::qos
namespace dds::sub::qos {
using SubscriberQos = core::QosSet<struct SubscriberKind>;
using DataReaderQos = core::QosSet<struct DataReaderKind>;
}  // namespace dds::sub::qos
