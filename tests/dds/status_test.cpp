#include "ping.hpp"

#include <condition_variable>
#include <mutex>
#include <thread>

namespace ping {
namespace {

using namespace dds::core::policy;
using dds::core::status::StatusMask;
using dds::pub::DataWriter;
using dds::pub::Publisher;
using dds::pub::qos::DataWriterQos;
using dds::sub::DataReader;
using dds::sub::Subscriber;
using dds::sub::qos::DataReaderQos;
using dds::topic::Topic;

struct Statuses : TwoSides {
  Topic<ping_Ball> out{here.participant, "watched"}, in{there.participant, "watched"};
};

TEST_F(Statuses, CountMatchesAndTheirEnd) {
  DataWriter<ping_Ball> writer(Publisher(here.participant), out);
  auto first = std::make_unique<DataReader<ping_Ball>>(Subscriber(there.participant), in);
  DataReader<ping_Ball> second(Subscriber(there.participant), in);
  ASSERT_TRUE(matches(writer, 2));
  ASSERT_TRUE(matches(second, 1));
  const auto handles = dds::sub::matched_publications(second);
  ASSERT_EQ(handles.size(), 1u);
  first.reset();
  ASSERT_TRUE(matches(writer, 1));
  EXPECT_EQ(writer.publication_matched_status().total_count(), 2u);
  writer.close();
  ASSERT_TRUE(matches(second, 0));
  EXPECT_TRUE(dds::sub::matched_publications(second).empty());
  EXPECT_THROW(dds::sub::matched_publication_data(second, handles[0]), dds::core::InvalidArgumentError);
}

TEST_F(Statuses, ThatNobodyHandlesTriggerNothing) {
  DataWriter<ping_Ball> writer(Publisher(here.participant), out, lossless_writer());
  DataReader<ping_Ball> reader(Subscriber(there.participant), in, lossless_reader());
  dds::core::cond::StatusCondition status(reader);
  dds::core::cond::WaitSet set;
  set.attach_condition(status);
  ASSERT_TRUE(matches(writer, 1));
  writer.write({1, 0.0});
  // The sample's arrival is seen without asking the status, so that nothing but the mask keeps the condition false.
  dds::core::cond::ReadCondition readable(reader);
  dds::core::cond::WaitSet data;
  data.attach_condition(readable);
  ASSERT_FALSE(data.wait(kPatience).empty());
  EXPECT_FALSE(status.trigger_value());
  EXPECT_TRUE(set.wait(dds::core::Duration::zero()).empty());
  status.enabled_statuses(StatusMask::data_available());
  writer.write({2, 0.0});
  EXPECT_EQ(set.wait(kPatience).size(), 1u);
}

/// Waits for a listener's word on another thread.
struct Notice {
  void give() {
    const std::lock_guard lock(mutex);
    given = true;
    changed.notify_all();
  }
  bool arrives() {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, kPatience, [this] { return given; });
  }
  std::mutex mutex;
  std::condition_variable changed;
  bool given = false;
};

TEST_F(Statuses, LivelinessIsLostWhenNobodyAssertsIt) {
  const Liveliness lease = Liveliness::ManualByTopic(300ms);
  Notice alive, lost, lost_here;
  DataReader<ping_Ball>::Listener listener;
  listener.on_liveliness_changed = [&](DataReader<ping_Ball>&, const dds::core::status::LivelinessChangedStatus& status) {
    if (status.alive_count() == 1) alive.give();
    if (status.not_alive_count() == 1) lost.give();
  };
  DataWriter<ping_Ball>::Listener writers_own;
  writers_own.on_liveliness_lost = [&](DataWriter<ping_Ball>&, const dds::core::status::LivelinessLostStatus& status) {
    if (status.total_count() == 1) lost_here.give();
  };
  DataReader<ping_Ball> reader(Subscriber(there.participant), in, DataReaderQos() << lease, listener);
  DataWriter<ping_Ball> writer(Publisher(here.participant), out, DataWriterQos() << lease, writers_own);
  ASSERT_TRUE(matches(reader, 1));
  ASSERT_TRUE(matches(writer, 1));
  writer.assert_liveliness();
  ASSERT_TRUE(alive.arrives());
  ASSERT_TRUE(lost.arrives());
  EXPECT_TRUE(lost_here.arrives());
  EXPECT_EQ(reader.liveliness_changed_status().not_alive_count(), 1u);
  EXPECT_EQ(reader.subscription_matched_status().current_count(), 1u);
  EXPECT_GE(writer.liveliness_lost_status().total_count(), 1u);
}

TEST_F(Statuses, ADeadlineMissedIsReported) {
  Notice missed;
  DataReader<ping_Ball>::Listener listener;
  listener.on_requested_deadline_missed = [&](DataReader<ping_Ball>&, const dds::core::status::RequestedDeadlineMissedStatus&) {
    missed.give();
  };
  DataReader<ping_Ball> reader(Subscriber(there.participant), in, lossless_reader() << Deadline{50ms}, listener);
  DataWriter<ping_Ball> writer(Publisher(here.participant), out, lossless_writer() << Deadline{50ms});
  ASSERT_TRUE(matches(reader, 1));
  ASSERT_TRUE(matches(writer, 1));
  writer.write({1, 0.0});
  EXPECT_TRUE(missed.arrives());
  EXPECT_GE(reader.requested_deadline_missed_status().total_count(), 1u);
}

TEST_F(Statuses, NameThePolicyThatKeepsEndpointsApart) {
  Notice told;
  std::string policy;
  DataReader<ping_Ball>::Listener listener;
  listener.on_requested_incompatible_qos = [&](DataReader<ping_Ball>&, const dds::core::status::RequestedIncompatibleQosStatus& status) {
    policy = status.last_policy_name();
    told.give();
  };
  DataReader<ping_Ball> reader(Subscriber(there.participant), in, DataReaderQos() << Reliability::Reliable(), listener);
  DataWriter<ping_Ball> writer(Publisher(here.participant), out, DataWriterQos() << Reliability::BestEffort());
  ASSERT_TRUE(told.arrives());
  EXPECT_EQ(policy, "Reliability");
  ASSERT_TRUE(
      reaches(writer, StatusMask::offered_incompatible_qos(), [&] { return writer.offered_incompatible_qos_status().total_count() == 1; }));
  EXPECT_EQ(writer.publication_matched_status().current_count(), 0u);
}

TEST_F(Statuses, SurviveTheMoveOfTheReferenceTheyBelongTo) {
  Notice heard, matched;
  DataReader<ping_Ball>::Listener listener;
  listener.on_data_available = [&](DataReader<ping_Ball>& reader) {
    ping_Ball ball{};
    if (reader.take_into(ball)) heard.give();
  };
  listener.on_subscription_matched = [&](auto&, const auto&) { matched.give(); };
  DataReader<ping_Ball> reader(Subscriber(there.participant), in, lossless_reader(), listener);
  std::vector<DataReader<ping_Ball>> kept;
  kept.push_back(std::move(reader));
  DataWriter<ping_Ball> writer(Publisher(here.participant), out, lossless_writer());
  ASSERT_TRUE(matched.arrives());
  ASSERT_TRUE(matches(writer, 1));
  writer.write({1, 0.0});
  EXPECT_TRUE(heard.arrives());
}

TEST_F(Statuses, OfAReaderWhoseListenerTakesHaveNoCondition) {
  DataReader<ping_Ball>::Listener listener;
  listener.on_data_available = [](DataReader<ping_Ball>& reader) { (void)reader.take(); };
  const DataReader<ping_Ball> reader(Subscriber(there.participant), in, {}, listener);
  EXPECT_THROW(dds::core::cond::StatusCondition{reader}, dds::core::PreconditionNotMetError) << "it could wait for the listener for ever";
}

TEST_F(Statuses, StopComingOnceAReaderIsClosedInTheMiddleOfThem) {
  DataWriter<ping_Ball> writer(Publisher(here.participant), out, DataWriterQos() << Reliability::BestEffort());
  std::atomic<bool> enough{false};
  std::thread flood([&] {
    for (std::uint32_t i = 0; !enough; ++i) writer.write({i, 0.0});
  });
  for (int repetition = 0; repetition < 50; ++repetition) {
    Notice heard;
    std::atomic<bool> open{true};
    DataReader<ping_Ball>::Listener listener;
    listener.on_data_available = [&](DataReader<ping_Ball>& reader) {
      EXPECT_TRUE(open);
      ping_Ball ball{};
      while (reader.take_into(ball)) heard.give();
    };
    DataReader<ping_Ball> reader(Subscriber(there.participant), in, {}, listener);
    EXPECT_TRUE(heard.arrives());
    reader.close();
    open = false;
  }
  enough = true;
  flood.join();
}

template <class E>
std::string text_of(const std::function<void()>& attempt) {
  try {
    attempt();
  } catch (const E& error) {
    EXPECT_LT(error.code(), 0);
    return error.what();
  } catch (const std::exception& other) {
    return std::string("another kind: ") + other.what();
  }
  return "nothing thrown";
}

struct Failures : TwoSides {};

TEST_F(Failures, OfAFullReliableWriterAreTimeoutsThatNameTheTopic) {
  Topic<ping_Ball> topic(here.participant, "narrow");
  DataReader<ping_Ball> reader(Subscriber(here.participant), topic,
                               DataReaderQos() << Reliability::Reliable() << History::KeepAll() << ResourceLimits{.max_samples = 2});
  DataWriter<ping_Ball> writer(Publisher(here.participant), topic,
                               DataWriterQos() << Reliability::Reliable(20ms) << History::KeepAll() << ResourceLimits{.max_samples = 2});
  const std::string text = text_of<dds::core::TimeoutError>([&] {
    for (std::uint32_t i = 0; i < 10; ++i) writer.write({i, 0.0});
  });
  EXPECT_EQ(text.find("write to topic narrow: DDS_RETCODE_TIMEOUT ("), 0u) << text;
}

TEST_F(Failures, SayWhatWasAttempted) {
  EXPECT_EQ(text_of<dds::core::PreconditionNotMetError>([] {
              dds::domain::Domain again(1, "");
            }).find("create domain 1: DDS_RETCODE_PRECONDITION_NOT_MET ("),
            0u);
  Topic<ping_Ball> topic(here.participant, "closed");
  DataWriter<ping_Ball> writer(Publisher(here.participant), topic);
  writer.close();
  EXPECT_EQ(text_of<dds::core::InvalidArgumentError>([&] {
              writer.write({1, 0.0});
            }).find("write to topic closed: DDS_RETCODE_BAD_PARAMETER ("),
            0u);
  EXPECT_NE(text_of<dds::core::Exception>([&] {
              Topic<ping_Letter> other(here.participant, "not a topic name");
            }).find("create topic not a topic name: "),
            std::string::npos);
}

TEST_F(Failures, OfContradictoryPoliciesAreRaisedAtCreation) {
  Topic<ping_Ball> topic(here.participant, "contradiction");
  const auto text = text_of<dds::core::InconsistentPolicyError>([&] {
    DataReader<ping_Ball> reader(Subscriber(here.participant), topic,
                                 DataReaderQos() << History::KeepLast(10) << ResourceLimits{.max_samples_per_instance = 5});
  });
  EXPECT_EQ(text.find("create reader of topic contradiction: DDS_RETCODE_INCONSISTENT_POLICY ("), 0u) << text;
}

TEST(Entities, LiveAsLongAsAReferenceToThemOrToAChild) {
  std::unique_ptr<dds::sub::DataReader<ping_Ball>> reader;
  dds_entity_t participant = 0;
  {
    Side side(1);
    participant = side.participant.handle();
    Topic<ping_Ball> topic(side.participant, "kept_alive");
    reader = std::make_unique<DataReader<ping_Ball>>(Subscriber(side.participant), topic);
  }
  EXPECT_EQ(reader->take().length(), 0u);
  EXPECT_EQ(dds_get_parent(participant) >= 0, true);
  reader.reset();
  EXPECT_LT(dds_get_parent(participant), 0);
}

}  // namespace
}  // namespace ping
