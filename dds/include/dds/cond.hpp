#pragma once
/// dds::core::cond: conditions and the set that waits for them.

#include "dds/pub.hpp"
#include "dds/sub.hpp"

#include <algorithm>

namespace dds::core::cond {

/// Reference to anything a WaitSet can wait for. Copies share the condition.
class Condition : public Entity {
 public:
  bool trigger_value() const { return expect(dds_triggered(handle()), "look at trigger of ", state_->name) > 0; }

 protected:
  using Entity::Entity;
};

/// True from trigger_value(true) to trigger_value(false); the way to wake a waiting thread.
class GuardCondition : public Condition {
 public:
  GuardCondition() : Condition(std::make_shared<EntityState>("guard condition")) {
    state_->handle = expect(dds_create_guardcondition(DDS_CYCLONEDDS_HANDLE), "create ", state_->name);
  }
  using Condition::trigger_value;
  void trigger_value(bool triggered) { expect(dds_set_guardcondition(handle(), triggered), "set ", state_->name); }
};

/// True while `entity` has one of the enabled statuses unread. Starts with none enabled, since one that nobody reads would trigger for
/// ever. Not for a reader whose listener takes data: Cyclone 0.10 holds the reader's lock while it waits for the listener to return, which
/// may itself wait for that lock.
class StatusCondition : public Condition {
 public:
  explicit StatusCondition(const Entity& entity) : Condition(entity.state()) {
    if ((state_->listened & DDS_DATA_AVAILABLE_STATUS) != 0)
      throw PreconditionNotMetError(DDS_RETCODE_PRECONDITION_NOT_MET, "status condition of " + state_->name + ", which a listener takes");
    enabled_statuses(status::StatusMask::none());
  }
  void enabled_statuses(status::StatusMask mask) {
    state_->conditioned = mask.bits();
    expect(dds_set_status_mask(state_->handle, state_->listened | state_->conditioned), "set status mask of ", state_->name);
  }
  status::StatusMask enabled_statuses() const { return status::StatusMask(state_->conditioned); }
};

/// True while `reader` holds samples. With `unread_only`, samples that were read before do not count.
class ReadCondition : public Condition {
 public:
  template <class T>
  explicit ReadCondition(const sub::DataReader<T>& reader, bool unread_only = false)
      : Condition(std::make_shared<EntityState>("read condition of topic " + reader.state()->name, reader.state())) {
    const std::uint32_t samples = unread_only ? DDS_NOT_READ_SAMPLE_STATE : DDS_ANY_SAMPLE_STATE;
    state_->handle =
        expect(dds_create_readcondition(reader.handle(), samples | DDS_ANY_VIEW_STATE | DDS_ANY_INSTANCE_STATE), "create ", state_->name);
  }
};

using ConditionSeq = std::vector<Condition>;

/// Waits for any of its conditions. One thread waits at a time.
class WaitSet : public Entity {
 public:
  WaitSet() : Entity(std::make_shared<EntityState>("wait set")) {
    state_->handle = expect(dds_create_waitset(DDS_CYCLONEDDS_HANDLE), "create ", state_->name);
  }
  /// Throws PreconditionNotMetError when it is attached already.
  void attach_condition(const Condition& condition) {
    expect(dds_waitset_attach(handle(), condition.handle(), condition.handle()), "attach to wait set: ", condition.state()->name);
    conditions_.push_back(condition);
  }
  /// Throws PreconditionNotMetError when it is not attached.
  void detach_condition(const Condition& condition) {
    expect(dds_waitset_detach(handle(), condition.handle()), "detach from wait set: ", condition.state()->name);
    std::erase(conditions_, condition);
  }
  const ConditionSeq& conditions() const { return conditions_; }

  /// The conditions that are true, waiting up to `timeout` for the first; empty when none came true.
  ConditionSeq wait(Duration timeout = Duration::infinite()) {
    triggered_.resize(std::max<std::size_t>(conditions_.size(), 1));
    const auto count = static_cast<std::size_t>(
        expect(dds_waitset_wait(handle(), triggered_.data(), triggered_.size(), timeout.nanoseconds()), "wait for ", state_->name));
    ConditionSeq result;
    for (std::size_t i = 0; i < std::min(count, triggered_.size()); ++i) {
      const auto found = std::find_if(conditions_.begin(), conditions_.end(),
                                      [&](const Condition& condition) { return condition.handle() == triggered_[i]; });
      if (found != conditions_.end()) result.push_back(*found);
    }
    return result;
  }

 private:
  ConditionSeq conditions_;
  std::vector<dds_attach_t> triggered_;
};

}  // namespace dds::core::cond
