#pragma once
/// dds::pub: publishers and typed writers.

#include "dds/domain.hpp"

#include <dds/ddsc/dds_statistics.h>

#include <functional>

namespace dds::pub {

/// Groups writers; carries the partitions they publish in.
class Publisher : public core::Entity {
 public:
  explicit Publisher(const domain::DomainParticipant& participant, const qos::PublisherQos& qos = {})
      : Entity(std::make_shared<core::EntityState>("publisher", participant.state())) {
    state_->handle = core::expect(dds_create_publisher(participant.handle(), qos.get(), nullptr), "create ", state_->name);
  }
};

template <topic::TopicType T>
class DataWriter;

/// Callbacks of a writer; leave out what is not wanted. They run on Cyclone's threads and must neither block nor throw (a throw ends the
/// process).
template <class T>
struct DataWriterListener {
  std::function<void(DataWriter<T>&, const core::status::PublicationMatchedStatus&)> on_publication_matched{};
  std::function<void(DataWriter<T>&, const core::status::OfferedIncompatibleQosStatus&)> on_offered_incompatible_qos{};
  std::function<void(DataWriter<T>&, const core::status::LivelinessLostStatus&)> on_liveliness_lost{};
};

/// Publishes samples of one topic. All calls may come from any thread.
template <topic::TopicType T>
class DataWriter : public core::Entity {
 public:
  using Listener = DataWriterListener<T>;

  DataWriter(const Publisher& publisher, const topic::Topic<T>& topic, const qos::DataWriterQos& qos = {}, Listener listener = {})
      : Entity(std::make_shared<State>(topic, publisher, std::move(listener))) {
    const ListenerPointer callbacks = own_state()->make_callbacks();
    state_->handle = core::expect(dds_create_writer(publisher.handle(), topic.handle(), qos.get(), callbacks.get()),
                                  "create writer of topic ", state_->name);
  }

  /// Throws TimeoutError when a reliable writer finds no room within max_blocking_time, else the exception of the return code.
  void write(const T& sample) { core::expect(dds_write(handle(), &sample), "write to topic ", state_->name); }

  /// Waits until every matched reliable reader has everything; false after `timeout`.
  bool wait_for_acknowledgments(core::Duration timeout) {
    const dds_return_t code = dds_wait_for_acks(handle(), timeout.nanoseconds());
    if (code == DDS_RETCODE_TIMEOUT) return false;
    core::expect(code, "wait for acknowledgements on topic ", state_->name);
    return true;
  }

  /// Shows that this writer is alive, for Liveliness::ManualByTopic and ManualByParticipant.
  void assert_liveliness() { core::expect(dds_assert_liveliness(handle()), "assert liveliness of writer of topic ", state_->name); }

  /// What had to be sent again, as it had been lost.
  std::uint64_t retransmitted_bytes() const {
    const std::unique_ptr<dds_statistics, void (*)(dds_statistics*)> statistics(dds_create_statistics(handle()), dds_delete_statistics);
    const dds_stat_keyvalue* value = statistics ? dds_lookup_statistic(statistics.get(), "rexmit_bytes") : nullptr;
    return value ? value->u.u64 : 0;
  }

  core::status::PublicationMatchedStatus publication_matched_status() {
    dds_publication_matched_status_t raw{};
    core::expect(dds_get_publication_matched_status(handle(), &raw), "get matched status of writer of topic ", state_->name);
    return core::status::PublicationMatchedStatus(raw);
  }
  core::status::LivelinessLostStatus liveliness_lost_status() {
    dds_liveliness_lost_status_t raw{};
    core::expect(dds_get_liveliness_lost_status(handle(), &raw), "get liveliness status of writer of topic ", state_->name);
    return {{raw.total_count, raw.total_count_change}};
  }
  core::status::OfferedIncompatibleQosStatus offered_incompatible_qos_status() {
    dds_offered_incompatible_qos_status_t raw{};
    core::expect(dds_get_offered_incompatible_qos_status(handle(), &raw), "get QoS status of writer of topic ", state_->name);
    return {{{raw.total_count, raw.total_count_change}, raw.last_policy_id}};
  }

 private:
  struct ListenerDeleter {
    void operator()(dds_listener_t* listener) const { dds_delete_listener(listener); }
  };
  using ListenerPointer = std::unique_ptr<dds_listener_t, ListenerDeleter>;

  struct State : core::EntityState {
    State(const topic::Topic<T>& topic_of, const Publisher& publisher, Listener callbacks)
        : EntityState(topic_of.name(), publisher.state(), topic_of.state()), listener(std::move(callbacks)) {}
    ~State() override { this->close(); }  // before the callbacks go

    ListenerPointer make_callbacks() {
      ListenerPointer result(dds_create_listener(this));
      if (listener.on_publication_matched) {
        dds_lset_publication_matched(
            result.get(), [](dds_entity_t entity, const dds_publication_matched_status_t raw, void* self) noexcept {
              DataWriter writer(self, entity);
              writer.own_state()->listener.on_publication_matched(writer, core::status::PublicationMatchedStatus(raw));
            });
        this->listened |= DDS_PUBLICATION_MATCHED_STATUS;
      }
      if (listener.on_offered_incompatible_qos) {
        dds_lset_offered_incompatible_qos(result.get(),
                                          [](dds_entity_t entity, const dds_offered_incompatible_qos_status_t raw, void* self) noexcept {
                                            DataWriter writer(self, entity);
                                            writer.own_state()->listener.on_offered_incompatible_qos(
                                                writer, {{{raw.total_count, raw.total_count_change}, raw.last_policy_id}});
                                          });
        this->listened |= DDS_OFFERED_INCOMPATIBLE_QOS_STATUS;
      }
      if (listener.on_liveliness_lost) {
        dds_lset_liveliness_lost(result.get(), [](dds_entity_t entity, const dds_liveliness_lost_status_t raw, void* self) noexcept {
          DataWriter writer(self, entity);
          writer.own_state()->listener.on_liveliness_lost(writer, {{raw.total_count, raw.total_count_change}});
        });
        this->listened |= DDS_LIVELINESS_LOST_STATUS;
      }
      return result;
    }

    Listener listener;
  };

  /// A reference for the length of a callback; it does not own, as the entity outlives its callbacks.
  DataWriter(void* self, dds_entity_t entity) : Entity(std::shared_ptr<State>(std::shared_ptr<void>(), static_cast<State*>(self))) {
    state_->handle.store(entity, std::memory_order_relaxed);
  }
  State* own_state() const { return static_cast<State*>(state_.get()); }
};

}  // namespace dds::pub
