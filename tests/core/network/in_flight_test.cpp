#include "core/network/in_flight.hpp"

#include "tests/core/cases.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

void add(InFlight& in_flight, Round due, Round sent, double value, double weight = 1.0) { in_flight.add(due, sent, weight, 1)[0] = value; }

TEST(InFlight, ArrivesInItsRoundWithTheWeightOfItsEmission) {
  InFlight in_flight;
  EXPECT_FALSE(in_flight.take(0));
  add(in_flight, 3, 1, 10.0, 0.5);
  EXPECT_FALSE(in_flight.take(2));
  const auto message = in_flight.take(3);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->sent, 1U);
  EXPECT_EQ(message->weight, 0.5);
  EXPECT_EQ(message->payload[0], 10.0);
  EXPECT_EQ(in_flight.count(), 0U);
  EXPECT_FALSE(in_flight.take(4));
}

TEST(InFlight, TheNewestDueSupersedesTheOlder) {
  InFlight in_flight;
  add(in_flight, 5, 2, 2.0);
  add(in_flight, 5, 4, 4.0);  // overtook
  add(in_flight, 5, 3, 3.0);
  add(in_flight, 6, 1, 1.0);
  EXPECT_EQ(in_flight.take(5)->payload[0], 4.0);
  EXPECT_EQ(in_flight.count(), 1U);
  EXPECT_EQ(in_flight.take(6)->sent, 1U);  // older, but the only one due
}

TEST(InFlight, KeepsATakenPayloadUntilTheNextCall) {
  InFlight in_flight;
  add(in_flight, 1, 0, 7.0);
  const auto message = in_flight.take(1);
  EXPECT_EQ(message->payload[0], 7.0);
  add(in_flight, 2, 1, 8.0);
  EXPECT_EQ(in_flight.take(2)->payload[0], 8.0);
}

TEST(InFlight, CarriesEmptyPayloads) {
  InFlight in_flight;
  EXPECT_TRUE(in_flight.add(1, 0, 1.0, 0).empty());
  const auto message = in_flight.take(1);
  ASSERT_TRUE(message);
  EXPECT_TRUE(message->payload.empty());
}

TEST(InFlight, AgreesWithAPlainList) {
  struct Item {
    Round due, sent;
    double value;
  };
  for (std::uint64_t seed = 0; seed < cases::kSeeds; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose{"in flight"});
    InFlight in_flight;
    std::vector<Item> list;
    for (Round k = 0; k < 60; ++k) {
      if (stream.uniform() < 0.8) {
        list.push_back({k + static_cast<Round>(stream.below(9)), k, stream.uniform()});
        add(in_flight, list.back().due, k, list.back().value);
      }
      const Item* newest = nullptr;
      for (const Item& item : list) {
        if (item.due <= k && (newest == nullptr || item.sent > newest->sent)) newest = &item;
      }
      const auto message = in_flight.take(k);
      ASSERT_EQ(message.has_value(), newest != nullptr);
      if (message) {
        ASSERT_EQ(message->sent, newest->sent);
        ASSERT_EQ(message->payload[0], newest->value);
      }
      std::erase_if(list, [k](const Item& item) { return item.due <= k; });
      ASSERT_EQ(in_flight.count(), list.size());
    }
  }
}

}  // namespace
}  // namespace consort
