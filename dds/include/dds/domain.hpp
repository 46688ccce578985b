#pragma once
/// dds::domain and dds::topic: a configured domain, a participant in it, typed topics.

#include "dds/policy.hpp"

#include <cstdlib>
#include <optional>

namespace dds::domain {

/// A domain of this process with its own configuration (Cyclone's; ISO has no such class). Create it before the first participant, once per
/// process and number; keep it longer than the participants.
class Domain : public core::Entity {
 public:
  /// `id` 0..230. `configuration` is Cyclone's: inline XML fragments and file names, separated by commas, the last one wins. Throws
  /// PreconditionNotMetError when this process has the domain already, Error when the configuration cannot be used (Cyclone's log says
  /// why).
  Domain(std::uint32_t id, const std::string& configuration)
      : Entity(std::make_shared<core::EntityState>("domain " + std::to_string(id))), id_(id) {
    state_->handle = core::expect(dds_create_domain(id, configuration.c_str()), "create ", state_->name);
  }
  std::uint32_t domain_id() const { return id_; }

 private:
  std::uint32_t id_;
};

/// `own` followed by the user's CYCLONEDDS_URI, so that the user's fragments win.
inline std::string with_user_configuration(const std::string& own, const char* user = std::getenv("CYCLONEDDS_URI")) {
  if (user == nullptr || *user == '\0') return own;
  return own.empty() ? std::string(user) : own + "," + user;
}

/// One process's membership of a domain. Create it after fork(), never before: its threads do not come along.
class DomainParticipant : public core::Entity {
 public:
  explicit DomainParticipant(std::uint32_t id, const qos::DomainParticipantQos& qos = {}) : DomainParticipant(id, qos, nullptr) {}
  explicit DomainParticipant(const Domain& domain, const qos::DomainParticipantQos& qos = {})
      : DomainParticipant(domain.domain_id(), qos, domain.state()) {}
  /// Its name on the network; no other participant has it.
  dds_guid_t guid() const {
    dds_guid_t result{};
    core::expect(dds_get_guid(handle(), &result), "get GUID of ", state_->name);
    return result;
  }
  /// Shows that this participant is alive, for Liveliness::ManualByParticipant.
  void assert_liveliness() { core::expect(dds_assert_liveliness(handle()), "assert liveliness of ", state_->name); }

 private:
  DomainParticipant(std::uint32_t id, const qos::DomainParticipantQos& qos, std::shared_ptr<core::EntityState> domain)
      : Entity(std::make_shared<core::EntityState>("participant in domain " + std::to_string(id), std::move(domain))) {
    state_->handle = core::expect(dds_create_participant(id, qos.get(), nullptr), "create ", state_->name);
  }
};

/// What discovery knows of the process behind a participant; empty where it does not say.
struct ParticipantBuiltinTopicData {
  dds_guid_t key{};
  std::string host, process, pid;
  std::vector<unsigned char> user_data;
};

/// A writer or reader as discovery knows it.
struct EndpointBuiltinTopicData {
  dds_guid_t key{}, participant_key{};
  std::string topic_name, type_name;
  std::vector<std::string> partition;
  std::vector<unsigned char> user_data;
};

namespace detail {

inline std::string property(const dds_qos_t* qos, const char* name) {
  char* value = nullptr;
  if (!dds_qget_prop(qos, name, &value)) return {};
  std::string result(value);
  dds_free(value);
  return result;
}

inline std::vector<unsigned char> user_data(const dds_qos_t* qos) {
  void* bytes = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(qos, &bytes, &size) || bytes == nullptr) return {};
  const auto* begin = static_cast<const unsigned char*>(bytes);
  std::vector<unsigned char> result(begin, begin + size);
  dds_free(bytes);
  return result;
}

inline EndpointBuiltinTopicData endpoint_data(const dds_builtintopic_endpoint_t& endpoint) {
  EndpointBuiltinTopicData result{endpoint.key, endpoint.participant_key, endpoint.topic_name, endpoint.type_name, {}, {}};
  std::uint32_t count = 0;
  char** names = nullptr;
  if (dds_qget_partition(endpoint.qos, &count, &names)) {
    for (std::uint32_t i = 0; i < count; ++i) {
      result.partition.emplace_back(names[i]);
      dds_free(names[i]);
    }
    dds_free(names);
  }
  result.user_data = user_data(endpoint.qos);
  return result;
}

}  // namespace detail

/// What discovery has found of one kind, itself included. Those that have left are remembered. May be asked from a listener, also from one
/// that runs while its entity is being created.
class Discovered : public core::Entity {
 protected:
  Discovered(const DomainParticipant& participant, dds_entity_t topic, const char* what)
      : Entity(std::make_shared<core::EntityState>(what, participant.state())) {
    state_->handle = core::expect(dds_create_reader(participant.handle(), topic, nullptr, nullptr), "create reader of ", state_->name);
  }
  /// Hands the newest data of an instance to `use`, if there is any.
  template <class Raw, class Use>
  void read(dds_instance_handle_t instance, Use&& use) const {
    void* data = nullptr;
    dds_sample_info_t info;
    const dds_return_t count = dds_read_instance(handle(), &data, &info, 1, 1, instance);
    if (count == DDS_RETCODE_PRECONDITION_NOT_MET || count == DDS_RETCODE_BAD_PARAMETER || count == DDS_RETCODE_NO_DATA) return;  // unknown
    if (core::expect(count, "read from ", state_->name) == 0) return;
    if (info.valid_data) use(*static_cast<const Raw*>(data));
    dds_return_loan(handle(), &data, count);
  }
};

class DiscoveredParticipants : public Discovered {
 public:
  explicit DiscoveredParticipants(const DomainParticipant& participant)
      : Discovered(participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, "the participants") {}

  /// Only the key is filled in if it was never found.
  ParticipantBuiltinTopicData find(const dds_guid_t& guid) const {
    ParticipantBuiltinTopicData result{guid, {}, {}, {}, {}};
    dds_builtintopic_participant_t key{};
    key.key = guid;
    const dds_instance_handle_t instance = dds_lookup_instance(handle(), &key);
    if (instance == DDS_HANDLE_NIL) return result;
    read<dds_builtintopic_participant_t>(instance, [&](const dds_builtintopic_participant_t& found) {
      result.host = detail::property(found.qos, "__Hostname");
      result.process = detail::property(found.qos, "__ProcessName");
      result.pid = detail::property(found.qos, "__Pid");
      result.user_data = detail::user_data(found.qos);
    });
    return result;
  }
};

/// Writers or readers, by the handle that statuses and samples have for them.
class DiscoveredEndpoints : public Discovered {
 public:
  enum class Kind { writers, readers };
  DiscoveredEndpoints(const DomainParticipant& participant, Kind kind)
      : Discovered(participant, kind == Kind::writers ? DDS_BUILTIN_TOPIC_DCPSPUBLICATION : DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION,
                   kind == Kind::writers ? "the writers" : "the readers") {}

  std::optional<EndpointBuiltinTopicData> find(core::InstanceHandle endpoint) const {
    std::optional<EndpointBuiltinTopicData> result;
    read<dds_builtintopic_endpoint_t>(endpoint, [&](const dds_builtintopic_endpoint_t& found) { result = detail::endpoint_data(found); });
    return result;
  }
};

}  // namespace dds::domain

namespace dds::topic {

/// Ties the C struct idlc generates to its descriptor. Specialise it with DDS_TOPIC_TYPE.
template <class T>
struct topic_type_support;

/// In the global namespace, once per type: DDS_TOPIC_TYPE(module_Name).
#define DDS_TOPIC_TYPE(type)                                                  \
  template <>                                                                 \
  struct dds::topic::topic_type_support<type> {                               \
    static const dds_topic_descriptor_t& descriptor() { return type##_desc; } \
  }

/// A type that has a descriptor.
template <class T>
concept TopicType = requires {
  { topic_type_support<T>::descriptor() } -> std::convertible_to<const dds_topic_descriptor_t&>;
};

/// A named stream of samples of one type.
template <TopicType T>
class Topic : public core::Entity {
 public:
  Topic(const domain::DomainParticipant& participant, const std::string& name, const qos::TopicQos& qos = {})
      : Entity(std::make_shared<core::EntityState>(name, participant.state())) {
    state_->handle =
        core::expect(dds_create_topic(participant.handle(), &topic_type_support<T>::descriptor(), name.c_str(), qos.get(), nullptr),
                     "create topic ", name);
  }
  const std::string& name() const { return state_->name; }
};

/// A sample with memory of its own, for taking into and for building: strings and sequences in it are freed with it, and reused by the next
/// take.
template <TopicType T>
class OwnSample {
 public:
  OwnSample() = default;
  OwnSample(const OwnSample&) = delete;
  OwnSample& operator=(const OwnSample&) = delete;
  ~OwnSample() { dds_sample_free(&value_, &topic_type_support<T>::descriptor(), DDS_FREE_CONTENTS); }
  T& operator*() { return value_; }
  const T& operator*() const { return value_; }
  T* operator->() { return &value_; }
  const T* operator->() const { return &value_; }

 private:
  T value_{};
};

}  // namespace dds::topic
