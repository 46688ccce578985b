#include "core/network/mailbox.hpp"

#include "tests/core/cases.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

using Post = Mailbox::Post;
using cases::edge;

constexpr AgentId kSelf{3};
const Layout kTwoNumbers{{{"x", 2, 1}}, 0, 2};
const std::vector<AgentId> kSenders{AgentId{1}, AgentId{2}, AgentId{5}};

Mailbox mailbox(const LinkModel& links = {}, Round window = 4) { return Mailbox(kSelf, kSenders, kTwoNumbers, links, Seed{1}, window); }

LinkModel all_links(LinkSpec spec) { return {std::move(spec), {}}; }

Post post(Mailbox& box, std::uint32_t from, Round sent, double value = 0.0) {
  const std::array<double, 2> payload{value, -value};
  return box.post(AgentId{from}, sent, payload);
}

std::vector<Neighbour> from(std::initializer_list<std::uint32_t> ids, double weight = 1.0) {
  std::vector<Neighbour> neighbours;
  for (const std::uint32_t id : ids) neighbours.push_back({AgentId{id}, weight});
  return neighbours;
}

TEST(Mailbox, GivesTheRoundsMessagesAscendingBySender) {
  Mailbox box = mailbox();
  EXPECT_EQ(post(box, 5, 0, 50.0), Post::accepted);
  EXPECT_EQ(post(box, 1, 0, 10.0), Post::accepted);
  const Inbox inbox = box.take(0, std::vector<Neighbour>{{AgentId{1}, 0.5}, {AgentId{5}, 2.0}});
  ASSERT_EQ(inbox.size(), 2U);
  EXPECT_EQ(inbox[0].from, AgentId{1});
  EXPECT_EQ(inbox[0].weight, 0.5);
  EXPECT_EQ(inbox[0].sent, 0U);
  EXPECT_EQ(inbox[0].payload[1], -10.0);
  EXPECT_EQ(inbox[1].from, AgentId{5});
  EXPECT_EQ(inbox[1].weight, 2.0);
  EXPECT_EQ(inbox[1].payload[0], 50.0);
}

TEST(Mailbox, TakesNoMoreThanItsSendersDo) {
  const std::vector<AgentId> far{AgentId{7}, AgentId{4'000'000'000U}};  // a place for every number up to the last would be 16 GB
  Mailbox box(kSelf, far, kTwoNumbers, {}, Seed{1}, 4);
  EXPECT_EQ(post(box, 4'000'000'000U, 0, 40.0), Post::accepted);
  EXPECT_EQ(post(box, 3'999'999'999U, 0), Post::unknown_sender);
  const Inbox inbox = box.take(0, from({4'000'000'000U}));
  ASSERT_EQ(inbox.size(), 1U);
  EXPECT_EQ(inbox[0].payload[0], 40.0);
}

TEST(Mailbox, FindsEachOfManySendersAmongFewOrAll) {
  std::vector<AgentId> many;
  for (std::uint32_t id = 10; id <= 4000; id += 1 + id % 3) many.push_back(AgentId{id});
  Mailbox box(kSelf, many, {{{"x", 1, 1}}, 0, 1}, {}, Seed{1}, 4);
  const std::array<double, 1> payload{1.0};
  Stream stream = Seed{1}.stream(Purpose{"who talks"});
  for (Round k = 0; k < 60; ++k) {
    std::vector<Neighbour> talking;
    const double share = stream.uniform() * stream.uniform();
    for (const AgentId id : many)
      if (k == 0 || stream.uniform() < share) talking.push_back({id, 1.0});
    const Inbox inbox = box.take_from(k, talking, [&](std::size_t) { return std::span<const double>(payload); });
    ASSERT_EQ(inbox.size(), talking.size());
    for (std::size_t i = 0; i < talking.size(); ++i) ASSERT_EQ(inbox[i].from, talking[i].id);
  }
  std::uint64_t delivered = 0;
  for (const AgentId id : many) delivered += box.counters(id).delivered;
  EXPECT_EQ(delivered, box.counters().delivered);
  EXPECT_THROW((void)box.take_from(60, from({12, 10}), [&](std::size_t) { return std::span<const double>(payload); }), ContractViolation);
}

TEST(Mailbox, SaysWhatBecomesOfAPost) {
  Mailbox box = mailbox({}, 2);
  EXPECT_EQ(post(box, 4, 0), Post::unknown_sender);
  EXPECT_EQ(post(box, 3, 0), Post::unknown_sender);  // itself
  EXPECT_EQ(post(box, 0, 0), Post::unknown_sender);
  EXPECT_EQ(post(box, 4000000000U, 0), Post::unknown_sender);
  EXPECT_EQ(box.post(AgentId{1}, 0, std::vector<double>{1.0}), Post::wrong_size);
  EXPECT_EQ(post(box, 1, 3), Post::too_early);
  EXPECT_EQ(post(box, 1, 2), Post::accepted);
  EXPECT_EQ(post(box, 1, 2), Post::duplicate);
  EXPECT_EQ(post(box, 1, 0), Post::accepted);
  (void)box.take(0, from({1}));
  EXPECT_EQ(post(box, 1, 0), Post::stale);
  EXPECT_EQ(post(box, 2, 0), Post::stale);
  EXPECT_EQ(post(box, 1, 3), Post::accepted);  // the window moves with the rounds
  EXPECT_EQ(post(box, 1, 4), Post::too_early);
}

TEST(Mailbox, KeepsTheFirstOfADuplicate) {
  Mailbox box = mailbox();
  post(box, 1, 0, 10.0);
  EXPECT_EQ(post(box, 1, 0, 99.0), Post::duplicate);
  EXPECT_EQ(box.take(0, from({1}))[0].payload[0], 10.0);
}

TEST(Mailbox, TheLinkDecidesOnALateMessageAsOnAnyOther) {
  LinkSpec lossy, slow;
  lossy.loss_probability = 1.0;
  slow.delay_rounds = 3;
  LinkModel links;
  links.overrides[edge(2, 3)] = lossy;
  links.overrides[edge(5, 3)] = slow;
  Mailbox box = mailbox(links);
  (void)box.take(0, {});
  (void)box.take(1, {});
  const std::array<double, 2> payload{7.0, -7.0};
  const auto at_once = box.take_late({AgentId{1}, 0.5}, 0, payload);
  ASSERT_TRUE(at_once.has_value());
  EXPECT_EQ(at_once->sent, 0U);
  EXPECT_EQ(at_once->weight, 0.5);
  EXPECT_EQ(at_once->payload[1], -7.0);
  EXPECT_FALSE(box.take_late({AgentId{2}, 1.0}, 0, payload));
  EXPECT_EQ(box.counters(AgentId{2}).lost, 1U);
  EXPECT_FALSE(box.take_late({AgentId{5}, 1.0}, 0, payload));
  EXPECT_TRUE(box.take(2, {}).empty());
  const Inbox due = box.take(3, {});
  ASSERT_EQ(due.size(), 1U);
  EXPECT_EQ(due[0].from, AgentId{5});
  EXPECT_EQ(due[0].sent, 0U);
  EXPECT_EQ(box.counters().delivered, 2U);
}

TEST(Mailbox, KnowsWhomItHasHeard) {
  Mailbox box = mailbox();
  const auto neighbours = from({1, 2, 5});
  EXPECT_EQ(box.missing(0, neighbours), 3U);
  EXPECT_FALSE(box.heard(AgentId{2}, 0));
  post(box, 2, 0);
  post(box, 1, 1);
  EXPECT_TRUE(box.heard(AgentId{2}, 0));
  EXPECT_FALSE(box.heard(AgentId{1}, 0));
  EXPECT_TRUE(box.heard(AgentId{1}, 1));
  EXPECT_FALSE(box.heard(AgentId{4}, 0));
  EXPECT_FALSE(box.heard(AgentId{9}, 0));
  EXPECT_EQ(box.missing(0, neighbours), 2U);
  EXPECT_EQ(box.missing(0, from({2})), 0U);
  (void)box.take(0, from({2}));
  EXPECT_FALSE(box.heard(AgentId{2}, 0));  // taken: no longer here
}

TEST(Mailbox, DiscardsMessagesOfOthers) {
  Mailbox box = mailbox();
  post(box, 1, 0, 1.0);
  post(box, 2, 0, 2.0);
  EXPECT_EQ(box.take(0, from({1})).size(), 1U);
  post(box, 1, 1, 11.0);
  const Inbox inbox = box.take(1, from({1}));
  ASSERT_EQ(inbox.size(), 1U);
  EXPECT_EQ(inbox[0].payload[0], 11.0);
  EXPECT_EQ(box.counters(AgentId{2}).delivered, 0U);
}

TEST(Mailbox, HoldsWhatASenderAheadHasSent) {
  constexpr Round kWindow = 1000;
  Mailbox box = mailbox({}, kWindow);
  for (Round k = 0; k <= kWindow; ++k) ASSERT_EQ(post(box, 1, kWindow - k, kWindow - k), Post::accepted);
  for (Round k = 0; k < 2 * kWindow; ++k) {
    ASSERT_EQ(box.take(k, from({1}))[0].payload[0], k);
    ASSERT_EQ(post(box, 1, k + kWindow + 1, k + kWindow + 1), Post::accepted);
  }
}

TEST(Mailbox, RefusesABrokenContract) {
  const auto broken = [](const std::vector<Neighbour>& neighbours, Round k = 0) {
    Mailbox box = mailbox();
    post(box, 1, 0);
    post(box, 2, 0);
    EXPECT_THROW((void)box.take(k, neighbours), ContractViolation);
  };
  broken(from({5}));     // not heard
  broken(from({1}), 1);  // round 0 comes first
  broken(from({4}));     // nobody it may hear
  broken(from({2, 1}));  // out of order
  broken(from({1, 1}));  // twice
  Mailbox box = mailbox();
  EXPECT_THROW((void)box.take_from(0, from({1}), [](std::size_t) { return std::span<const double>(); }), ContractViolation);
  EXPECT_THROW((void)box.counters(AgentId{4}), ContractViolation);
  EXPECT_THROW(Mailbox(kSelf, {AgentId{2}, AgentId{1}}, kTwoNumbers, {}, Seed{1}, 1), ContractViolation);
  EXPECT_THROW(Mailbox(kSelf, {AgentId{1}, AgentId{3}}, kTwoNumbers, {}, Seed{1}, 1), ContractViolation);
  EXPECT_THROW(Mailbox(kSelf, {AgentId{0}}, kTwoNumbers, {}, Seed{1}, 1), ContractViolation);
  EXPECT_THROW(Mailbox(kSelf, {}, Layout{{{"x", 2, 1}}, 1, 2}, {}, Seed{1}, 1), ContractViolation);
  EXPECT_THROW(mailbox(all_links({.loss_probability = 2.0})), ConfigError);
}

TEST(Mailbox, WithoutSendersOrNumbersStillTurns) {
  Mailbox alone(AgentId{1}, {}, kTwoNumbers, {}, Seed{1}, 1);
  for (Round k = 0; k < 3; ++k) EXPECT_TRUE(alone.take(k, {}).empty());
  EXPECT_EQ(alone.missing(3, {}), 0U);
  EXPECT_TRUE(alone.senders().empty());
  for (const LinkSpec& spec : {LinkSpec{}, LinkSpec{.delay_rounds = 1}, LinkSpec{.noise_covariance = Matrix::Ones(1, 1)}}) {
    Mailbox empty(AgentId{1}, {AgentId{2}}, Layout{}, all_links(spec), Seed{1}, 1);
    EXPECT_EQ(empty.post(AgentId{2}, 0, {}), Post::accepted);
    EXPECT_EQ(empty.take(0, from({2})).size(), spec.delay_rounds > 0 ? 0U : 1U);
  }
}

TEST(Mailbox, OnAnIdealLinkPointsAtTheDriversOwnNumbers) {
  Mailbox box = mailbox();
  const std::array<double, 10> all{0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  const Inbox inbox = box.take_from(0, from({2, 5}), [&](std::size_t i) { return std::span(all).subspan(2 * i, 2); });
  ASSERT_EQ(inbox.size(), 2U);
  EXPECT_EQ(inbox[0].payload.data(), &all[2]);
  EXPECT_EQ(inbox[1].payload.data(), &all[8]);
  EXPECT_EQ(box.counters().delivered, 2U);
}

TEST(LossyMailbox, OfLossOneDeliversNothingAndCountsEverything) {
  Mailbox box = mailbox(all_links({.loss_probability = 1.0}));
  for (Round k = 0; k < 10; ++k) {
    post(box, 1, k);
    post(box, 2, k);
    EXPECT_TRUE(box.take(k, from({1, 2})).empty());
  }
  EXPECT_EQ(box.counters().lost, 20U);
  EXPECT_EQ(box.counters().delivered, 0U);
  EXPECT_EQ(box.counters(AgentId{1}).lost, 10U);
  EXPECT_EQ(box.counters(AgentId{5}).lost, 0U);
}

TEST(LossyMailbox, LosesOnlyOnItsLossyLinks) {
  LinkModel links;
  links.overrides[edge(2, 3)].loss_probability = 0.5;
  links.overrides[edge(3, 2)].loss_probability = 1.0;  // the other way: not ours
  Mailbox box = mailbox(links);
  for (Round k = 0; k < 1000; ++k) {
    post(box, 1, k);
    post(box, 2, k);
    const Inbox inbox = box.take(k, from({1, 2}));
    ASSERT_EQ(inbox[0].from, AgentId{1});
    ASSERT_EQ(inbox.size() == 1, Link(edge(2, 3), links.overrides[edge(2, 3)], 2, Seed{1}).lost(k));
  }
  EXPECT_EQ(box.counters(AgentId{1}).delivered, 1000U);
  EXPECT_EQ(box.counters(AgentId{2}).delivered + box.counters(AgentId{2}).lost, 1000U);
  EXPECT_NEAR(static_cast<double>(box.counters(AgentId{2}).lost), 500, 5 * std::sqrt(250.0));
}

TEST(NoisyMailbox, DisturbsOnlyTheNoisyPartOfTheMessage) {
  const Layout layout{{{"x", 2, 1}, {"P", 1, 1}}, 1, 1};
  Mailbox box(kSelf, {AgentId{1}}, layout, all_links({.noise_covariance = Matrix::Ones(1, 1)}), Seed{1}, 1);
  const std::array<double, 3> payload{1, 2, 3};
  box.post(AgentId{1}, 0, payload);
  const Inbox inbox = box.take(0, from({1}));
  double noise = 0.0;
  Link(edge(1, 3), {.noise_covariance = Matrix::Ones(1, 1)}, 1, Seed{1}).disturb(0, std::span(&noise, 1));
  EXPECT_EQ(inbox[0].payload[0], 1.0);
  EXPECT_EQ(inbox[0].payload[1], 2.0 + noise);
  EXPECT_EQ(inbox[0].payload[2], 3.0);
  EXPECT_NE(noise, 0.0);
  EXPECT_EQ(payload[1], 2.0);
}

TEST(DelayingMailbox, DeliversAfterSoManyRounds) {
  Mailbox box = mailbox(all_links({.delay_rounds = 2}));
  for (Round k = 0; k < 20; ++k) {
    post(box, 1, k, k);
    const Inbox inbox = box.take(k, from({1}));
    ASSERT_EQ(inbox.size(), k < 2 ? 0U : 1U);
    if (k < 2) continue;
    ASSERT_EQ(inbox[0].sent, k - 2);
    ASSERT_EQ(inbox[0].payload[0], k - 2);
  }
  EXPECT_EQ(box.counters().delivered, 18U);  // two are still under way
  EXPECT_EQ(box.counters().lost, 0U);
}

TEST(DelayingMailbox, DeliversWhatIsUnderWayWhenTheEdgeIsGone) {
  Mailbox box = mailbox(all_links({.delay_rounds = 2}));
  post(box, 1, 0, 10.0);
  EXPECT_TRUE(box.take(0, from({1}, 0.25)).empty());
  EXPECT_TRUE(box.take(1, {}).empty());
  const Inbox inbox = box.take(2, {});
  ASSERT_EQ(inbox.size(), 1U);
  EXPECT_EQ(inbox[0].weight, 0.25);  // of round 0
  EXPECT_EQ(inbox[0].sent, 0U);
  EXPECT_EQ(inbox[0].payload[0], 10.0);
  EXPECT_TRUE(box.take(3, {}).empty());
}

TEST(DelayingMailbox, MixesWithPromptLinksInOrder) {
  LinkModel links;
  links.overrides[edge(2, 3)].delay_rounds = 1;
  Mailbox box = mailbox(links);
  for (Round k = 0; k < 5; ++k) {
    for (const std::uint32_t sender : {5U, 2U, 1U}) post(box, sender, k, k);
    const Inbox inbox = box.take(k, from({1, 2, 5}));
    ASSERT_EQ(inbox.size(), k == 0 ? 2U : 3U);
    ASSERT_EQ(inbox.front().from, AgentId{1});
    ASSERT_EQ(inbox.back().from, AgentId{5});
    ASSERT_EQ(inbox.back().payload[0], k);
    ASSERT_EQ(inbox[1].payload[0], k == 0 ? 0 : k - 1);
  }
}

TEST(DelayingMailbox, SurvivesADelayBeyondTheLastRound) {
  constexpr Round kFirst = std::numeric_limits<Round>::max() - 10;
  Mailbox box(kSelf, kSenders, kTwoNumbers, all_links({.delay_rounds = kLongestDelay}), Seed{1}, 4, kFirst);
  for (Round k = kFirst; k < kFirst + 5; ++k) {
    post(box, 1, k);
    ASSERT_TRUE(box.take(k, from({1})).empty());
  }
}

}  // namespace
}  // namespace consort
