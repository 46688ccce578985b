#pragma once
/// dds::core: exceptions, durations, statuses, and the entity every other class builds on.
///
/// A small subset of the ISO/IEC C++ DDS API over Cyclone's C library, with the same names. Entities are references, as in ISO: copies
/// share one entity, a child keeps its parent alive, and the entity is deleted with its last reference. Differences, all deliberate:
///  - topics are typed with the C struct idlc generates (Debian packages no C++ generator);
///  - listeners are structs of std::function instead of virtual classes;
///  - WaitSet::wait returns an empty sequence on a timeout instead of throwing;
///  - the status mask of an entity holds only what a listener or a StatusCondition handles, never Cyclone's default.

#include <dds/dds.h>

#include <atomic>
#include <chrono>
#include <concepts>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace dds::core {

// --- exceptions -------------------------------------------------------------------------------------------------------

/// Name of a return code as the standard spells it, e.g. "DDS_RETCODE_TIMEOUT".
inline const char* retcode_name(dds_return_t code) {
  switch (code) {
    case DDS_RETCODE_OK:
      return "DDS_RETCODE_OK";
    case DDS_RETCODE_ERROR:
      return "DDS_RETCODE_ERROR";
    case DDS_RETCODE_UNSUPPORTED:
      return "DDS_RETCODE_UNSUPPORTED";
    case DDS_RETCODE_BAD_PARAMETER:
      return "DDS_RETCODE_BAD_PARAMETER";
    case DDS_RETCODE_PRECONDITION_NOT_MET:
      return "DDS_RETCODE_PRECONDITION_NOT_MET";
    case DDS_RETCODE_OUT_OF_RESOURCES:
      return "DDS_RETCODE_OUT_OF_RESOURCES";
    case DDS_RETCODE_NOT_ENABLED:
      return "DDS_RETCODE_NOT_ENABLED";
    case DDS_RETCODE_IMMUTABLE_POLICY:
      return "DDS_RETCODE_IMMUTABLE_POLICY";
    case DDS_RETCODE_INCONSISTENT_POLICY:
      return "DDS_RETCODE_INCONSISTENT_POLICY";
    case DDS_RETCODE_ALREADY_DELETED:
      return "DDS_RETCODE_ALREADY_DELETED";
    case DDS_RETCODE_TIMEOUT:
      return "DDS_RETCODE_TIMEOUT";
    case DDS_RETCODE_NO_DATA:
      return "DDS_RETCODE_NO_DATA";
    case DDS_RETCODE_ILLEGAL_OPERATION:
      return "DDS_RETCODE_ILLEGAL_OPERATION";
    case DDS_RETCODE_NOT_ALLOWED_BY_SECURITY:
      return "DDS_RETCODE_NOT_ALLOWED_BY_SECURITY";
    default:
      return "unknown DDS return code";
  }
}

/// Base of everything this binding throws. what() reads "write to topic X: DDS_RETCODE_TIMEOUT (Timeout)".
class Exception : public std::runtime_error {
 public:
  Exception(dds_return_t code, const std::string& attempted)
      : std::runtime_error(attempted + ": " + retcode_name(code) + " (" + dds_strretcode(code) + ")"), code_(code) {}
  /// The return code of the call that failed; negative.
  dds_return_t code() const noexcept { return code_; }

 private:
  dds_return_t code_;
};

// clang-format off
struct Error : Exception { using Exception::Exception; };                     ///< not specified further; Cyclone's log on stderr says more
struct UnsupportedError : Exception { using Exception::Exception; };
struct InvalidArgumentError : Exception { using Exception::Exception; };
struct PreconditionNotMetError : Exception { using Exception::Exception; };
struct OutOfResourcesError : Exception { using Exception::Exception; };
struct NotEnabledError : Exception { using Exception::Exception; };
struct ImmutablePolicyError : Exception { using Exception::Exception; };
struct InconsistentPolicyError : Exception { using Exception::Exception; };
struct AlreadyClosedError : Exception { using Exception::Exception; };
struct TimeoutError : Exception { using Exception::Exception; };
struct IllegalOperationError : Exception { using Exception::Exception; };
struct NotAllowedBySecurityError : Exception { using Exception::Exception; };
// clang-format on

/// Turns a negative return code into the exception of its kind. `attempted` says what was tried, e.g. "write to topic information".
[[noreturn]] inline void raise(dds_return_t code, const std::string& attempted) {
  switch (code) {
    case DDS_RETCODE_UNSUPPORTED:
      throw UnsupportedError(code, attempted);
    case DDS_RETCODE_BAD_PARAMETER:
      throw InvalidArgumentError(code, attempted);
    case DDS_RETCODE_PRECONDITION_NOT_MET:
      throw PreconditionNotMetError(code, attempted);
    case DDS_RETCODE_OUT_OF_RESOURCES:
      throw OutOfResourcesError(code, attempted);
    case DDS_RETCODE_NOT_ENABLED:
      throw NotEnabledError(code, attempted);
    case DDS_RETCODE_IMMUTABLE_POLICY:
      throw ImmutablePolicyError(code, attempted);
    case DDS_RETCODE_INCONSISTENT_POLICY:
      throw InconsistentPolicyError(code, attempted);
    case DDS_RETCODE_ALREADY_DELETED:
      throw AlreadyClosedError(code, attempted);
    case DDS_RETCODE_TIMEOUT:
      throw TimeoutError(code, attempted);
    case DDS_RETCODE_ILLEGAL_OPERATION:
      throw IllegalOperationError(code, attempted);
    case DDS_RETCODE_NOT_ALLOWED_BY_SECURITY:
      throw NotAllowedBySecurityError(code, attempted);
    default:
      throw Error(code, attempted);
  }
}

/// Passes a non-negative return code on, raises a negative one. The text is only put together on failure.
inline dds_return_t expect(dds_return_t code, const char* attempted, const std::string& subject) {
  if (code < 0) [[unlikely]]
    raise(code, attempted + subject);
  return code;
}

// --- time and identity ------------------------------------------------------------------------------------------------

/// A length of time, ns. Infinite is a value of its own.
class Duration {
 public:
  /// Implicit, so that 100ms can be passed.
  template <class Rep, class Period>
  requires std::convertible_to<std::chrono::duration<Rep, Period>, std::chrono::nanoseconds>
  constexpr Duration(std::chrono::duration<Rep, Period> length) : nanoseconds_(std::chrono::nanoseconds(length).count()) {}
  static constexpr Duration infinite() { return Duration(std::chrono::nanoseconds(DDS_INFINITY)); }
  static constexpr Duration zero() { return Duration(std::chrono::nanoseconds(0)); }
  static constexpr Duration from_millisecs(std::int64_t milliseconds) { return Duration(std::chrono::milliseconds(milliseconds)); }
  /// `seconds` finite, rounded towards zero to whole nanoseconds.
  static constexpr Duration from_secs(double seconds) {
    return Duration(std::chrono::nanoseconds(static_cast<std::int64_t>(seconds * 1e9)));
  }
  constexpr dds_duration_t nanoseconds() const { return nanoseconds_; }
  constexpr auto operator<=>(const Duration&) const = default;

 private:
  dds_duration_t nanoseconds_;
};

/// Local name of an instance or of a matched endpoint; 0 is nil.
using InstanceHandle = dds_instance_handle_t;
using InstanceHandleSeq = std::vector<InstanceHandle>;

// --- statuses ---------------------------------------------------------------------------------------------------------

namespace status {

/// A set of statuses, e.g. `StatusMask::data_available() | StatusMask::subscription_matched()`.
class StatusMask {
 public:
  constexpr StatusMask() = default;
  constexpr explicit StatusMask(std::uint32_t bits) : bits_(bits) {}
  static constexpr StatusMask none() { return StatusMask(); }
  static constexpr StatusMask data_available() { return StatusMask(DDS_DATA_AVAILABLE_STATUS); }
  static constexpr StatusMask publication_matched() { return StatusMask(DDS_PUBLICATION_MATCHED_STATUS); }
  static constexpr StatusMask subscription_matched() { return StatusMask(DDS_SUBSCRIPTION_MATCHED_STATUS); }
  static constexpr StatusMask liveliness_changed() { return StatusMask(DDS_LIVELINESS_CHANGED_STATUS); }
  static constexpr StatusMask liveliness_lost() { return StatusMask(DDS_LIVELINESS_LOST_STATUS); }
  static constexpr StatusMask requested_deadline_missed() { return StatusMask(DDS_REQUESTED_DEADLINE_MISSED_STATUS); }
  static constexpr StatusMask requested_incompatible_qos() { return StatusMask(DDS_REQUESTED_INCOMPATIBLE_QOS_STATUS); }
  static constexpr StatusMask offered_incompatible_qos() { return StatusMask(DDS_OFFERED_INCOMPATIBLE_QOS_STATUS); }
  static constexpr StatusMask sample_lost() { return StatusMask(DDS_SAMPLE_LOST_STATUS); }
  constexpr StatusMask operator|(StatusMask other) const { return StatusMask(bits_ | other.bits_); }
  constexpr bool contains(StatusMask other) const { return (bits_ & other.bits_) == other.bits_; }
  constexpr std::uint32_t bits() const { return bits_; }
  constexpr bool operator==(const StatusMask&) const = default;

 private:
  std::uint32_t bits_ = 0;
};

/// How many matching endpoints there are, and how that changed since the status was last read.
template <class C>
class MatchedStatus {
 public:
  explicit MatchedStatus(const C& raw) : raw_(raw) {}
  std::uint32_t total_count() const { return raw_.total_count; }
  std::int32_t total_count_change() const { return raw_.total_count_change; }
  std::uint32_t current_count() const { return raw_.current_count; }
  std::int32_t current_count_change() const { return raw_.current_count_change; }

 protected:
  C raw_;
};

class PublicationMatchedStatus : public MatchedStatus<dds_publication_matched_status_t> {
 public:
  using MatchedStatus::MatchedStatus;
  InstanceHandle last_subscription_handle() const { return raw_.last_subscription_handle; }
};

class SubscriptionMatchedStatus : public MatchedStatus<dds_subscription_matched_status_t> {
 public:
  using MatchedStatus::MatchedStatus;
  InstanceHandle last_publication_handle() const { return raw_.last_publication_handle; }
};

/// Matched writers that are alive or not, by their liveliness lease.
class LivelinessChangedStatus {
 public:
  explicit LivelinessChangedStatus(const dds_liveliness_changed_status_t& raw) : raw_(raw) {}
  std::uint32_t alive_count() const { return raw_.alive_count; }
  std::uint32_t not_alive_count() const { return raw_.not_alive_count; }
  std::int32_t alive_count_change() const { return raw_.alive_count_change; }
  std::int32_t not_alive_count_change() const { return raw_.not_alive_count_change; }
  InstanceHandle last_publication_handle() const { return raw_.last_publication_handle; }

 private:
  dds_liveliness_changed_status_t raw_;
};

/// A count of events and its change since the status was last read.
struct CountStatus {
  std::uint32_t total = 0;
  std::int32_t change = 0;
  std::uint32_t total_count() const { return total; }
  std::int32_t total_count_change() const { return change; }
};
struct LivelinessLostStatus : CountStatus {};
struct RequestedDeadlineMissedStatus : CountStatus {};
struct SampleLostStatus : CountStatus {};

/// Endpoints on the same topic that did not match because of a QoS policy.
struct IncompatibleQosStatus : CountStatus {
  std::uint32_t last_policy = 0;
  /// Number of the policy, as the standard counts them.
  std::uint32_t last_policy_id() const { return last_policy; }
  /// Name of the policy, e.g. "Reliability".
  const char* last_policy_name() const {
    static constexpr const char* kNames[] = {"Invalid",
                                             "UserData",
                                             "Durability",
                                             "Presentation",
                                             "Deadline",
                                             "LatencyBudget",
                                             "Ownership",
                                             "OwnershipStrength",
                                             "Liveliness",
                                             "TimeBasedFilter",
                                             "Partition",
                                             "Reliability",
                                             "DestinationOrder",
                                             "History",
                                             "ResourceLimits",
                                             "EntityFactory",
                                             "WriterDataLifecycle",
                                             "ReaderDataLifecycle",
                                             "TopicData",
                                             "GroupData",
                                             "TransportPriority",
                                             "Lifespan",
                                             "DurabilityService"};
    return last_policy < std::size(kNames) ? kNames[last_policy] : "unknown";
  }
};
struct RequestedIncompatibleQosStatus : IncompatibleQosStatus {};
struct OfferedIncompatibleQosStatus : IncompatibleQosStatus {};

}  // namespace status

// --- entity -----------------------------------------------------------------------------------------------------------

/// What all references to one entity share. Listener callbacks get its address, so it never moves.
struct EntityState {
  explicit EntityState(std::string entity_name, std::shared_ptr<EntityState> entity_parent = nullptr,
                       std::shared_ptr<EntityState> entity_topic = nullptr)
      : name(std::move(entity_name)), parent(std::move(entity_parent)), topic(std::move(entity_topic)) {}
  EntityState(const EntityState&) = delete;
  EntityState& operator=(const EntityState&) = delete;
  virtual ~EntityState() { close(); }

  /// Waits for running callbacks of this entity, so it must not be called from one of them. The listener goes first: a callback that runs
  /// while its entity is being deleted would find every call on it refused. The codes are not looked at: an entity that went with its
  /// participant already is what is wanted.
  void close() {
    if (closed.exchange(true)) return;
    const dds_entity_t entity = handle.load();
    if (entity <= 0) return;
    if (listened != 0) dds_set_listener(entity, nullptr);
    dds_delete(entity);
    handle = 0;
  }

  std::atomic<dds_entity_t> handle{0};  ///< a listener may run, on the receive thread, before the creating call has returned
  std::atomic<bool> closed{false};
  std::string name;  ///< for error texts: a topic's name for topics and endpoints
  std::shared_ptr<EntityState> parent, topic;
  std::uint32_t listened = 0, conditioned = 0;  ///< statuses with a listener; those of its StatusCondition
};

/// Reference to any DDS entity. Copies share the entity.
class Entity {
 public:
  dds_entity_t handle() const { return state_->handle.load(std::memory_order_relaxed); }
  InstanceHandle instance_handle() const {
    InstanceHandle result = 0;
    expect(dds_get_instance_handle(handle(), &result), "get instance handle of ", state_->name);
    return result;
  }
  /// Deletes the entity now, whoever else refers to it, and its children with it. Not from one of its own callbacks, nor while children
  /// have listeners.
  void close() { state_->close(); }
  const std::shared_ptr<EntityState>& state() const { return state_; }
  bool operator==(const Entity& other) const { return state_ == other.state_; }

 protected:
  explicit Entity(std::shared_ptr<EntityState> state) : state_(std::move(state)) {}
  std::shared_ptr<EntityState> state_;
};

}  // namespace dds::core
