#include "ping.hpp"

#include <condition_variable>
#include <mutex>

namespace ping {
namespace {

using namespace dds::core::policy;
using dds::core::cond::GuardCondition;
using dds::core::cond::ReadCondition;
using dds::core::cond::WaitSet;
using dds::pub::DataWriter;
using dds::pub::Publisher;
using dds::pub::qos::DataWriterQos;
using dds::pub::qos::PublisherQos;
using dds::sub::DataReader;
using dds::sub::Subscriber;
using dds::sub::qos::DataReaderQos;
using dds::sub::qos::SubscriberQos;
using dds::topic::OwnSample;
using dds::topic::Topic;

template <class T>
struct Exchange {
  Exchange(Side& from, Side& to)
      : out(from.participant, "exchange"),
        in(to.participant, "exchange"),
        writer(Publisher(from.participant), out, lossless_writer()),
        reader(Subscriber(to.participant), in, lossless_reader()) {}
  bool matched() { return matches(writer, 1) && matches(reader, 1); }
  Topic<T> out, in;
  DataWriter<T> writer;
  DataReader<T> reader;
};

struct Samples : TwoSides {};

TEST_F(Samples, ArriveInOrderWithTheirValues) {
  Exchange<ping_Ball> exchange(here, there);
  ASSERT_TRUE(exchange.matched());
  for (std::uint32_t i = 0; i < 100; ++i) exchange.writer.write({i, i * 0.5});
  ping_Ball ball{};
  dds::sub::SampleInfo info;
  for (std::uint32_t i = 0; i < 100; ++i) {
    ASSERT_TRUE(next(exchange.reader, ball, info));
    EXPECT_EQ(ball.number, i);
    EXPECT_EQ(ball.value, i * 0.5);
    EXPECT_TRUE(info.valid());
  }
  EXPECT_EQ(info.publication_handle(), dds::sub::matched_publications(exchange.reader).at(0));
  EXPECT_TRUE(exchange.writer.wait_for_acknowledgments(kPatience));
  EXPECT_FALSE(exchange.reader.take_into(ball));
}

TEST_F(Samples, OnLoanAreGivenBackAndSkipTheInvalidOnes) {
  Exchange<ping_Letter> exchange(here, there);
  ASSERT_TRUE(exchange.matched());
  double numbers[] = {1.0, 2.0, 3.0};
  char text[] = "dinner at six";
  ping_Letter letter{};
  letter.text = text;
  letter.numbers = {3, 3, numbers, false};
  constexpr std::uint32_t kSenders = 3;
  for (letter.sender = 1; letter.sender <= kSenders; ++letter.sender) exchange.writer.write(letter);
  ASSERT_TRUE(exchange.writer.wait_for_acknowledgments(kPatience));
  exchange.writer.close();
  ASSERT_TRUE(matches(exchange.reader, 0));

  // The writer's end marks each of its instances: three samples with data, and what only reports the end must not be visited.
  std::size_t seen = 0, invalid = 0;
  for (int attempt = 0; attempt < 2; ++attempt) {
    const auto loan = exchange.reader.take();
    for (const auto& sample : loan) {
      ++seen;
      EXPECT_TRUE(sample.info().valid());
      EXPECT_EQ(sample.data().sender, seen);
      EXPECT_STREQ(sample.data().text, "dinner at six");
      ASSERT_EQ(sample.data().numbers._length, 3u);
      EXPECT_EQ(sample.data().numbers._buffer[2], 3.0);
    }
    EXPECT_EQ(loan.length(), attempt == 0 ? kSenders : 0u);
    invalid += loan.invalid();
  }
  EXPECT_EQ(seen, kSenders);
  // An instance whose samples are still unread carries its end in its last sample, so an extra entry may or may not come.
  EXPECT_LE(invalid, kSenders);
}

TEST_F(Samples, OnLoanMayMoveAndOverlap) {
  Exchange<ping_Ball> exchange(here, there);
  ASSERT_TRUE(exchange.matched());
  for (std::uint32_t i = 0; i < 4; ++i) exchange.writer.write({i, 0.0});
  ASSERT_TRUE(exchange.writer.wait_for_acknowledgments(kPatience));
  auto first = exchange.reader.take(1);
  auto second = exchange.reader.take(1);
  ASSERT_EQ(first.length(), 1u);
  ASSERT_EQ(second.length(), 1u);
  EXPECT_EQ((*first.begin()).data().number, 0u);
  EXPECT_EQ((*second.begin()).data().number, 1u);
  auto moved = std::move(first);
  EXPECT_EQ((*moved.begin()).data().number, 0u);
  moved = exchange.reader.take(1);
  EXPECT_EQ((*moved.begin()).data().number, 2u);
  second = exchange.reader.take(1);
  EXPECT_EQ((*second.begin()).data().number, 3u);
  EXPECT_EQ(exchange.reader.take().length(), 0u);
}

TEST_F(Samples, TakenIntoOwnMemoryReuseIt) {
  Exchange<ping_Letter> exchange(here, there);
  ASSERT_TRUE(exchange.matched());
  double numbers[] = {1.0, 2.0, 3.0};
  char text[] = "x";
  ping_Letter letter{};
  letter.text = text;
  OwnSample<ping_Letter> own;
  const double* buffer = nullptr;
  dds::sub::SampleInfo info;
  for (std::uint32_t i = 0; i < 3; ++i) {
    numbers[0] = i;
    letter.numbers = {3, 3, numbers, false};
    exchange.writer.write(letter);
    ASSERT_TRUE(next(exchange.reader, *own, info));
    EXPECT_EQ(own->numbers._buffer[0], i);
    if (i > 0) {
      EXPECT_EQ(own->numbers._buffer, buffer);
    }
    buffer = own->numbers._buffer;
  }
}

TEST_F(Samples, ComeInBatchesThatSayWhetherMoreIsThere) {
  Exchange<ping_Ball> exchange(here, there);
  ASSERT_TRUE(exchange.matched());
  for (std::uint32_t i = 0; i < 6; ++i) exchange.writer.write({i, 0.0});
  ASSERT_TRUE(exchange.writer.wait_for_acknowledgments(kPatience));
  dds::sub::SampleBatch<ping_Ball, 4> batch;
  std::vector<std::uint32_t> numbers;
  do {
    for (const auto& sample : exchange.reader.take_into(batch)) numbers.push_back(sample.data().number);
  } while (batch.full());
  EXPECT_EQ(numbers, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5}));
}

TEST_F(Samples, ReachOnlyThePartitionsTheyAreFor) {
  Topic<ping_Ball> out(here.participant, "parted"), in(there.participant, "parted");
  DataWriter<ping_Ball> red(Publisher(here.participant, PublisherQos() << Partition("red")), out, lossless_writer());
  DataWriter<ping_Ball> blue(Publisher(here.participant, PublisherQos() << Partition("blue")), out, lossless_writer());
  DataWriter<ping_Ball> green(Publisher(here.participant, PublisherQos() << Partition("green")), out, lossless_writer());
  DataReader<ping_Ball> reader(Subscriber(there.participant, SubscriberQos() << Partition({"red", "blue"})), in, lossless_reader());
  ASSERT_TRUE(matches(reader, 2));
  ASSERT_TRUE(matches(red, 1));
  ASSERT_TRUE(matches(blue, 1));
  EXPECT_EQ(green.publication_matched_status().current_count(), 0u);
  green.write({3, 0.0});
  blue.write({2, 0.0});
  red.write({1, 0.0});
  ASSERT_TRUE(red.wait_for_acknowledgments(kPatience));
  ASSERT_TRUE(blue.wait_for_acknowledgments(kPatience));
  std::vector<std::uint32_t> numbers;
  for (const auto& sample : reader.take()) numbers.push_back(sample.data().number);
  std::sort(numbers.begin(), numbers.end());
  EXPECT_EQ(numbers, (std::vector<std::uint32_t>{1, 2}));

  std::vector<std::string> partitions;
  for (const auto publication : dds::sub::matched_publications(reader)) {
    const auto data = dds::sub::matched_publication_data(reader, publication);
    EXPECT_EQ(data.topic_name, "parted");
    EXPECT_EQ(data.type_name, "ping::Ball");
    ASSERT_EQ(data.partition.size(), 1u);
    partitions.push_back(data.partition[0]);
  }
  std::sort(partitions.begin(), partitions.end());
  EXPECT_EQ(partitions, (std::vector<std::string>{"blue", "red"}));
}

TEST_F(Samples, OfATransientLocalWriterReachALateReader) {
  const auto late = DataReaderQos() << Reliability::Reliable() << Durability::TransientLocal() << History::KeepAll();
  Topic<ping_Ball> out(here.participant, "kept"), in(there.participant, "kept");
  DataWriter<ping_Ball> writer(Publisher(here.participant), out,
                               DataWriterQos() << Reliability::Reliable() << Durability::TransientLocal() << History::KeepLast(8)
                                               << DurabilityService{.history = History::KeepLast(5)});
  for (std::uint32_t i = 0; i < 20; ++i) writer.write({i, 0.0});
  DataReader<ping_Ball> reader(Subscriber(there.participant), in, late);
  ping_Ball ball{};
  dds::sub::SampleInfo info;
  for (std::uint32_t i = 15; i < 20; ++i) {
    ASSERT_TRUE(next(reader, ball, info));
    EXPECT_EQ(ball.number, i);
  }
}

TEST_F(Samples, ReachTheListenerOnTheReceiveThread) {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::uint32_t> numbers;
  int matched = 0;
  Topic<ping_Ball> out(here.participant, "heard"), in(there.participant, "heard");
  DataReader<ping_Ball>::Listener listener;
  listener.on_data_available = [&](DataReader<ping_Ball>& reader) {
    ping_Ball ball{};
    const std::lock_guard lock(mutex);
    while (reader.take_into(ball)) numbers.push_back(ball.number);
    changed.notify_all();
  };
  listener.on_subscription_matched = [&](DataReader<ping_Ball>&, const dds::core::status::SubscriptionMatchedStatus& status) {
    const std::lock_guard lock(mutex);
    matched += status.current_count_change();
  };
  DataReader<ping_Ball> reader(Subscriber(there.participant), in, lossless_reader(), listener);
  DataWriter<ping_Ball> writer(Publisher(here.participant), out, lossless_writer());
  ASSERT_TRUE(matches(writer, 1));
  for (std::uint32_t i = 0; i < 10; ++i) writer.write({i, 0.0});
  std::unique_lock lock(mutex);
  ASSERT_TRUE(changed.wait_for(lock, kPatience, [&] { return numbers.size() == 10; }));
  EXPECT_EQ(numbers.back(), 9u);
  EXPECT_EQ(matched, 1);
}

TEST_F(Samples, WithinAParticipantAreLeftAloneWhenLocalIsIgnored) {
  Exchange<ping_Ball> heard(here, here);
  EXPECT_TRUE(heard.matched());
  Topic<ping_Ball> topic(here.participant, "ignored");
  DataWriter<ping_Ball> writer(Publisher(here.participant), topic, DataWriterQos() << IgnoreLocal::Participant());
  DataReader<ping_Ball> reader(Subscriber(here.participant), topic);
  EXPECT_EQ(writer.publication_matched_status().current_count(), 0u);
}

TEST_F(Samples, OfAnotherTagNeverMeet) {
  Side stranger(3, configuration("another tag"));
  Exchange<ping_Ball> together(here, there);
  Topic<ping_Ball> in(stranger.participant, "exchange");
  DataReader<ping_Ball> apart(Subscriber(stranger.participant), in);
  ASSERT_TRUE(together.matched());
  EXPECT_EQ(together.writer.publication_matched_status().total_count(), 1u);
  EXPECT_EQ(apart.subscription_matched_status().total_count(), 0u);
}

TEST_F(Samples, WakeAWaitSetThroughAReadCondition) {
  Exchange<ping_Ball> exchange(here, there);
  ASSERT_TRUE(exchange.matched());
  ReadCondition readable(exchange.reader);
  GuardCondition stop;
  WaitSet set;
  set.attach_condition(readable);
  set.attach_condition(stop);
  EXPECT_TRUE(set.wait(dds::core::Duration::zero()).empty());
  exchange.writer.write({1, 0.0});
  EXPECT_EQ(set.wait(kPatience), dds::core::cond::ConditionSeq{readable});
  EXPECT_TRUE(readable.trigger_value());
  stop.trigger_value(true);
  EXPECT_EQ(set.wait(kPatience).size(), 2u);
  ping_Ball ball{};
  EXPECT_TRUE(exchange.reader.take_into(ball));
  EXPECT_EQ(set.wait(kPatience), dds::core::cond::ConditionSeq{stop});
  set.detach_condition(stop);
  EXPECT_TRUE(set.wait(dds::core::Duration::zero()).empty());
}

}  // namespace
}  // namespace ping
