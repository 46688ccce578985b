#pragma once
/// dds::domain and dds::topic: a configured domain, a participant in it, typed topics.

#include "dds/policy.hpp"

#include <cstdlib>

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
  /// Shows that this participant is alive, for Liveliness::ManualByParticipant.
  void assert_liveliness() { core::expect(dds_assert_liveliness(handle()), "assert liveliness of ", state_->name); }

 private:
  DomainParticipant(std::uint32_t id, const qos::DomainParticipantQos& qos, std::shared_ptr<core::EntityState> domain)
      : Entity(std::make_shared<core::EntityState>("participant in domain " + std::to_string(id), std::move(domain))) {
    state_->handle = core::expect(dds_create_participant(id, qos.get(), nullptr), "create ", state_->name);
    state_->apply_mask();
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
    state_->apply_mask();
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
