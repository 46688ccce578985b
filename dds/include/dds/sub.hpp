#pragma once
/// dds::sub: subscribers, typed readers, and three ways to take samples.

#include "dds/domain.hpp"

#include <algorithm>
#include <array>
#include <functional>

namespace dds::sub {

/// Groups readers; carries the partitions they listen to.
class Subscriber : public core::Entity {
 public:
  explicit Subscriber(const domain::DomainParticipant& participant, const qos::SubscriberQos& qos = {})
      : Entity(std::make_shared<core::EntityState>("subscriber", participant.state())) {
    state_->handle = core::expect(dds_create_subscriber(participant.handle(), qos.get(), nullptr), "create ", state_->name);
  }
};

/// What came with a sample. A sample that is not valid() has no data: it reports the end of an instance or of its writer.
class SampleInfo {
 public:
  SampleInfo() = default;
  explicit SampleInfo(const dds_sample_info_t& raw) : raw_(raw) {}
  bool valid() const { return raw_.valid_data; }
  bool alive() const { return raw_.instance_state == DDS_IST_ALIVE; }
  core::InstanceHandle instance_handle() const { return raw_.instance_handle; }
  core::InstanceHandle publication_handle() const { return raw_.publication_handle; }
  /// When the writer wrote it, ns since the epoch.
  dds_time_t source_timestamp() const { return raw_.source_timestamp; }

 private:
  dds_sample_info_t raw_{};
};

/// A sample and its info, by reference.
template <class T>
class Sample {
 public:
  Sample(const T& data, const dds_sample_info_t& info) : data_(&data), info_(info) {}
  const T& data() const { return *data_; }
  const SampleInfo& info() const { return info_; }

 private:
  const T* data_;
  SampleInfo info_;
};

/// Walks over the valid samples of an array of pointers and infos.
template <class T>
class ValidSampleIterator {
 public:
  ValidSampleIterator(void* const* data, const dds_sample_info_t* info, const dds_sample_info_t* end)
      : data_(data), info_(info), end_(end) {
    skip();
  }
  Sample<T> operator*() const { return {*static_cast<const T*>(*data_), *info_}; }
  ValidSampleIterator& operator++() {
    ++data_, ++info_;
    skip();
    return *this;
  }
  bool operator==(const ValidSampleIterator& other) const { return info_ == other.info_; }

 private:
  void skip() {
    while (info_ != end_ && !info_->valid_data) ++data_, ++info_;
  }
  void* const* data_;
  const dds_sample_info_t* info_;
  const dds_sample_info_t* end_;
};

/// Samples lent by the reader, given back on destruction. Iterating skips the invalid ones.
template <class T>
class LoanedSamples {
 public:
  using iterator = ValidSampleIterator<T>;
  LoanedSamples(const std::shared_ptr<core::EntityState>& reader, std::uint32_t max_samples)
      : reader_(reader), data_(max_samples, nullptr), infos_(max_samples) {
    count_ =
        core::expect(dds_take(reader->handle, data_.data(), infos_.data(), max_samples, max_samples), "take from topic ", reader->name);
  }
  LoanedSamples(LoanedSamples&& other) noexcept
      : reader_(std::move(other.reader_)),
        data_(std::move(other.data_)),
        infos_(std::move(other.infos_)),
        count_(std::exchange(other.count_, 0)) {}
  LoanedSamples& operator=(LoanedSamples&& other) noexcept {
    if (this != &other) {
      return_loan();
      reader_ = std::move(other.reader_);
      data_ = std::move(other.data_);
      infos_ = std::move(other.infos_);
      count_ = std::exchange(other.count_, 0);
    }
    return *this;
  }
  ~LoanedSamples() { return_loan(); }

  iterator begin() const { return {data_.data(), infos_.data(), infos_.data() + count_}; }
  iterator end() const { return {data_.data() + count_, infos_.data() + count_, infos_.data() + count_}; }
  /// Number of valid samples.
  std::size_t length() const {
    return static_cast<std::size_t>(
        std::count_if(infos_.begin(), infos_.begin() + count_, [](const auto& info) { return info.valid_data; }));
  }
  /// Number of entries with no data: an instance or its writer ended.
  std::size_t invalid() const { return static_cast<std::size_t>(count_) - length(); }

 private:
  /// Fails only when the reader is gone already, and the loan with it.
  void return_loan() noexcept {
    if (count_ > 0) dds_return_loan(reader_->handle, data_.data(), count_);
    count_ = 0;
  }
  std::shared_ptr<core::EntityState> reader_;
  std::vector<void*> data_;
  std::vector<dds_sample_info_t> infos_;
  std::int32_t count_ = 0;
};

/// Room for N samples, filled by DataReader::take_into without an allocation in steady state. Iterating skips the invalid ones.
template <topic::TopicType T, std::size_t N>
class SampleBatch {
 public:
  using iterator = ValidSampleIterator<T>;
  SampleBatch() {
    for (std::size_t i = 0; i < N; ++i) data_[i] = &*samples_[i];
  }
  iterator begin() const { return {data_.data(), infos_.data(), infos_.data() + count_}; }
  iterator end() const { return {data_.data() + count_, infos_.data() + count_, infos_.data() + count_}; }
  /// All N places were used, so there may be more to take.
  bool full() const { return count_ == static_cast<std::int32_t>(N); }

  void take_from(dds_entity_t reader, const std::string& topic) {
    count_ = 0;
    count_ = core::expect(dds_take(reader, data_.data(), infos_.data(), N, N), "take from topic ", topic);
  }

 private:
  std::array<topic::OwnSample<T>, N> samples_;
  std::array<void*, N> data_;
  std::array<dds_sample_info_t, N> infos_;
  std::int32_t count_ = 0;
};

using PublicationBuiltinTopicData = domain::EndpointBuiltinTopicData;

template <topic::TopicType T>
class DataReader;

/// Callbacks of a reader; leave out what is not wanted. They run on Cyclone's receive thread: while one runs nothing else is received, so
/// it must not block, and it must not throw (a throw ends the process). Callbacks of one reader never overlap; data_available may come
/// before the constructor has returned, which is why the reader is an argument.
template <class T>
struct DataReaderListener {
  std::function<void(DataReader<T>&)> on_data_available{};
  std::function<void(DataReader<T>&, const core::status::SubscriptionMatchedStatus&)> on_subscription_matched{};
  std::function<void(DataReader<T>&, const core::status::LivelinessChangedStatus&)> on_liveliness_changed{};
  std::function<void(DataReader<T>&, const core::status::RequestedDeadlineMissedStatus&)> on_requested_deadline_missed{};
  std::function<void(DataReader<T>&, const core::status::RequestedIncompatibleQosStatus&)> on_requested_incompatible_qos{};
  std::function<void(DataReader<T>&, const core::status::SampleLostStatus&)> on_sample_lost{};
};

/// Receives samples of one topic. All calls may come from any thread; a buffer given to take_into belongs to one thread at a time.
template <topic::TopicType T>
class DataReader : public core::Entity {
 public:
  using Listener = DataReaderListener<T>;

  DataReader(const Subscriber& subscriber, const topic::Topic<T>& topic, const qos::DataReaderQos& qos = {}, Listener listener = {})
      : Entity(std::make_shared<State>(topic, subscriber, std::move(listener))) {
    const ListenerPointer callbacks = own_state()->make_callbacks();
    state_->handle = core::expect(dds_create_reader(subscriber.handle(), topic.handle(), qos.get(), callbacks.get()),
                                  "create reader of topic ", state_->name);
  }

  /// Takes up to `max_samples` on loan (DDS clears the memory of as many, each time). Call again until it comes back empty.
  LoanedSamples<T> take(std::uint32_t max_samples = 16) { return LoanedSamples<T>(state_, max_samples); }

  /// Takes the next valid sample into the caller's memory: no allocation, and a third of the cost of a loan. Strings and sequences in
  /// `sample` are reused or freed, so they must come from an earlier take or be zero (topic::OwnSample does both). False when there is
  /// none.
  bool take_into(T& sample, SampleInfo& info) {
    void* data = &sample;
    dds_sample_info_t raw;
    while (core::expect(dds_take(handle(), &data, &raw, 1, 1), "take from topic ", state_->name) > 0) {
      if (!raw.valid_data) continue;
      info = SampleInfo(raw);
      return true;
    }
    return false;
  }
  bool take_into(T& sample) {
    SampleInfo info;
    return take_into(sample, info);
  }
  /// Takes up to N samples; a batch that is not full() afterwards has emptied the reader, so no second call is needed to know.
  template <std::size_t N>
  SampleBatch<T, N>& take_into(SampleBatch<T, N>& batch) {
    batch.take_from(handle(), state_->name);
    return batch;
  }

  core::status::SubscriptionMatchedStatus subscription_matched_status() {
    dds_subscription_matched_status_t raw{};
    core::expect(dds_get_subscription_matched_status(handle(), &raw), "get matched status of reader of topic ", state_->name);
    return core::status::SubscriptionMatchedStatus(raw);
  }
  core::status::LivelinessChangedStatus liveliness_changed_status() {
    dds_liveliness_changed_status_t raw{};
    core::expect(dds_get_liveliness_changed_status(handle(), &raw), "get liveliness status of reader of topic ", state_->name);
    return core::status::LivelinessChangedStatus(raw);
  }
  core::status::RequestedDeadlineMissedStatus requested_deadline_missed_status() {
    dds_requested_deadline_missed_status_t raw{};
    core::expect(dds_get_requested_deadline_missed_status(handle(), &raw), "get deadline status of reader of topic ", state_->name);
    return {{raw.total_count, raw.total_count_change}};
  }
  core::status::RequestedIncompatibleQosStatus requested_incompatible_qos_status() {
    dds_requested_incompatible_qos_status_t raw{};
    core::expect(dds_get_requested_incompatible_qos_status(handle(), &raw), "get QoS status of reader of topic ", state_->name);
    return {{{raw.total_count, raw.total_count_change}, raw.last_policy_id}};
  }
  core::status::SampleLostStatus sample_lost_status() {
    dds_sample_lost_status_t raw{};
    core::expect(dds_get_sample_lost_status(handle(), &raw), "get loss status of reader of topic ", state_->name);
    return {{raw.total_count, raw.total_count_change}};
  }

 private:
  struct ListenerDeleter {
    void operator()(dds_listener_t* listener) const { dds_delete_listener(listener); }
  };
  using ListenerPointer = std::unique_ptr<dds_listener_t, ListenerDeleter>;

  struct State : core::EntityState {
    State(const topic::Topic<T>& topic_of, const Subscriber& subscriber, Listener callbacks)
        : EntityState(topic_of.name(), subscriber.state(), topic_of.state()), listener(std::move(callbacks)) {}
    ~State() override { this->close(); }  // before the callbacks go

    ListenerPointer make_callbacks() {
      ListenerPointer result(dds_create_listener(this));
      dds_listener_t* raw_listener = result.get();
      if (listener.on_data_available) {
        dds_lset_data_available(raw_listener, [](dds_entity_t entity, void* self) noexcept {
          DataReader reader(self, entity);
          reader.own_state()->listener.on_data_available(reader);
        });
        this->listened |= DDS_DATA_AVAILABLE_STATUS;
      }
      if (listener.on_subscription_matched) {
        dds_lset_subscription_matched(
            raw_listener, [](dds_entity_t entity, const dds_subscription_matched_status_t raw, void* self) noexcept {
              DataReader reader(self, entity);
              reader.own_state()->listener.on_subscription_matched(reader, core::status::SubscriptionMatchedStatus(raw));
            });
        this->listened |= DDS_SUBSCRIPTION_MATCHED_STATUS;
      }
      if (listener.on_liveliness_changed) {
        dds_lset_liveliness_changed(raw_listener, [](dds_entity_t entity, const dds_liveliness_changed_status_t raw, void* self) noexcept {
          DataReader reader(self, entity);
          reader.own_state()->listener.on_liveliness_changed(reader, core::status::LivelinessChangedStatus(raw));
        });
        this->listened |= DDS_LIVELINESS_CHANGED_STATUS;
      }
      set_failure_callbacks(raw_listener);
      return result;
    }

    void set_failure_callbacks(dds_listener_t* raw_listener) {
      if (listener.on_requested_deadline_missed) {
        dds_lset_requested_deadline_missed(
            raw_listener, [](dds_entity_t entity, const dds_requested_deadline_missed_status_t raw, void* self) noexcept {
              DataReader reader(self, entity);
              reader.own_state()->listener.on_requested_deadline_missed(reader, {{raw.total_count, raw.total_count_change}});
            });
        this->listened |= DDS_REQUESTED_DEADLINE_MISSED_STATUS;
      }
      if (listener.on_requested_incompatible_qos) {
        dds_lset_requested_incompatible_qos(
            raw_listener, [](dds_entity_t entity, const dds_requested_incompatible_qos_status_t raw, void* self) noexcept {
              DataReader reader(self, entity);
              reader.own_state()->listener.on_requested_incompatible_qos(reader,
                                                                         {{{raw.total_count, raw.total_count_change}, raw.last_policy_id}});
            });
        this->listened |= DDS_REQUESTED_INCOMPATIBLE_QOS_STATUS;
      }
      if (listener.on_sample_lost) {
        dds_lset_sample_lost(raw_listener, [](dds_entity_t entity, const dds_sample_lost_status_t raw, void* self) noexcept {
          DataReader reader(self, entity);
          reader.own_state()->listener.on_sample_lost(reader, {{raw.total_count, raw.total_count_change}});
        });
        this->listened |= DDS_SAMPLE_LOST_STATUS;
      }
    }

    Listener listener;
  };

  /// A reference for the length of a callback; it does not own, as the entity outlives its callbacks.
  DataReader(void* self, dds_entity_t entity) : Entity(std::shared_ptr<State>(std::shared_ptr<void>(), static_cast<State*>(self))) {
    state_->handle.store(entity, std::memory_order_relaxed);
  }
  State* own_state() const { return static_cast<State*>(state_.get()); }
};

/// Handles of the writers matched with `reader`.
template <class T>
core::InstanceHandleSeq matched_publications(const DataReader<T>& reader) {
  core::InstanceHandleSeq result(16);
  for (;;) {
    const auto count = static_cast<std::size_t>(core::expect(dds_get_matched_publications(reader.handle(), result.data(), result.size()),
                                                             "get matched writers of topic ", reader.state()->name));
    const bool complete = count <= result.size();
    result.resize(count);
    if (complete) return result;
  }
}

/// What discovery knows of one matched writer. Throws InvalidArgumentError when it is matched no longer; and
/// from a listener that runs while the reader is being created.
template <class T>
PublicationBuiltinTopicData matched_publication_data(const DataReader<T>& reader, core::InstanceHandle publication) {
  struct Deleter {
    void operator()(dds_builtintopic_endpoint_t* endpoint) const { dds_builtintopic_free_endpoint(endpoint); }
  };
  const std::unique_ptr<dds_builtintopic_endpoint_t, Deleter> endpoint(dds_get_matched_publication_data(reader.handle(), publication));
  if (!endpoint) core::raise(DDS_RETCODE_BAD_PARAMETER, "get matched writer of topic " + reader.state()->name);
  return domain::detail::endpoint_data(*endpoint);
}

}  // namespace dds::sub
