/// Who belongs to a run: those whose badge shows that they know its key.

#include "idl/trust.hpp"

#include "core/errors.hpp"
#include "idl/codec.hpp"
#include "idl/wire.hpp"
#include "tests/dds/ping.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>

DDS_TOPIC_TYPE(consort_wire_Grant);

namespace consort::wire {
namespace {

using namespace dds::core::policy;
using ping::Side;
using ping::TwoSides;

constexpr const char* kTopic = "consort_grant";
const RunKey kKey("the key of this run");

/// Reads grants for a run with a key.
struct Listener {
  explicit Listener(const dds::domain::DomainParticipant& entity)
      : participant(entity, kKey),
        reader(
            participant, [this](Grant&& grant) { newest = grant.until; }, [this](std::size_t n) { writers = n; }) {}
  std::atomic<Round> newest{0};
  std::atomic<std::size_t> writers{0};
  Participant participant;
  Reader<Grant> reader;
};

/// A bare writer with whatever badge.
struct Bare {
  Bare(const dds::domain::DomainParticipant& participant, const dds::pub::qos::DataWriterQos& qos)
      : writer(dds::pub::Publisher(participant), dds::topic::Topic<consort_wire_Grant>(participant, kTopic), qos) {}
  static dds::pub::qos::DataWriterQos qos() {
    dds::pub::qos::DataWriterQos result;
    result << Reliability::Reliable() << History::KeepAll() << Durability::TransientLocal() << DurabilityService{};
    return result;
  }
  void write(Round until) {
    Arena arena;
    writer.write(encode(Grant{1, until, 0, {}}, arena));
  }
  dds::pub::DataWriter<consort_wire_Grant> writer;
};

std::uint64_t refused(const std::vector<Refusal>& refusals) {
  std::uint64_t samples = 0;
  for (const Refusal& refusal : refusals) samples += refusal.samples;
  return samples;
}

/// Waits until `samples` have been refused; all refusals so far.
std::vector<Refusal> refusals_of(const Participant& participant, std::uint64_t samples) {
  std::vector<Refusal> all;
  const auto give_up = std::chrono::steady_clock::now() + ping::kPatience;
  while (refused(all) < samples && std::chrono::steady_clock::now() < give_up)
    for (Refusal& refusal : participant.take_refusals()) all.push_back(std::move(refusal));
  return all;
}

bool comes_true(const std::function<bool()>& condition) {
  const auto give_up = std::chrono::steady_clock::now() + ping::kPatience;
  while (!condition())
    if (std::chrono::steady_clock::now() > give_up) return false;
  return true;
}

TEST(RunKey, BadgesDifferByKeyParticipantAndTopic) {
  const dds_guid_t one{{1}}, two{{2}};
  const RunKey same("the key of this run"), other("the key of that run");
  EXPECT_EQ(kKey.badge(one, "a"), same.badge(one, "a"));
  EXPECT_NE(kKey.badge(one, "a"), other.badge(one, "a"));
  EXPECT_NE(kKey.badge(one, "a"), kKey.badge(two, "a"));
  EXPECT_NE(kKey.badge(one, "a"), kKey.badge(one, "b"));
  EXPECT_NE(RunKey::random_secret(), RunKey::random_secret());
}

TEST(RunKey, ComesFromTheEnvironmentOrIsAskedFor) {
  unsetenv(RunKey::kVariable);
  EXPECT_FALSE(RunKey::secret_of_environment());
  EXPECT_THROW(RunKey::of_environment(), ConfigError);
  setenv(RunKey::kVariable, "short", 1);
  EXPECT_THROW(RunKey::of_environment(), ConfigError);
  setenv(RunKey::kVariable, "the key of this run", 1);
  EXPECT_EQ(RunKey::of_environment().badge({{1}}, "a"), kKey.badge({{1}}, "a"));
  unsetenv(RunKey::kVariable);
}

TEST(Refusals, AreCountedByKindAndNeverPileUp) {
  Refusals refusals;
  for (int i = 0; i < 5000; ++i) {
    refusals.add({kTopic, Refusal::Reason::stranger, "", "writer " + std::to_string(i), "", 1});
    refusals.add({kTopic, Refusal::Reason::bound, "report_at", "w", "", 2});
  }
  const auto taken = refusals.take();
  EXPECT_LE(taken.size(), 202u);
  EXPECT_EQ(refused(taken), 15'000u) << "whoever is not named is counted";
  EXPECT_TRUE(refusals.take().empty());
}

using Trust = TwoSides;

TEST_F(Trust, WhoKnowsTheKeyIsHeardAndCounted) {
  Listener listener(there.participant);
  Writer<Grant> writer(Participant(here.participant, kKey));
  writer.write({1, 7, 0, {}});
  EXPECT_TRUE(comes_true([&] { return listener.newest == 7 && listener.writers == 1; }));
  EXPECT_TRUE(listener.participant.take_refusals().empty());
}

TEST_F(Trust, WhoDoesNotIsNeitherHeardNorCounted) {
  Listener listener(there.participant);
  for (const RunKey& key : {RunKey(), RunKey("the key of that run")}) {
    Writer<Grant> writer(Participant(here.participant, key));
    writer.write({1, 7, 0, {}});
    const auto refusals = refusals_of(listener.participant, 1);
    ASSERT_EQ(refused(refusals), 1u);
    const Refusal& refusal = refusals.back();
    EXPECT_EQ(refusal.reason, Refusal::Reason::stranger);
    EXPECT_EQ(refusal.topic, kTopic);
    EXPECT_EQ(refusal.writer.size(), 32u);
    EXPECT_NE(refusal.who.find("pid " + std::to_string(getpid())), std::string::npos) << refusal.who;
  }
  EXPECT_EQ(listener.newest, 0u);
  EXPECT_EQ(listener.writers, 0u);
}

TEST_F(Trust, ACopiedBadgeIsWorthNothing) {
  Listener listener(there.participant);
  Participant honest(here.participant, kKey);
  Writer<Grant> writer(honest);
  writer.write({1, 7, 0, {}});
  ASSERT_TRUE(comes_true([&] { return listener.newest == 7; }));

  Side elsewhere(3);
  dds::sub::DataReader<consort_wire_Grant> spy(dds::sub::Subscriber(elsewhere.participant),
                                               dds::topic::Topic<consort_wire_Grant>(elsewhere.participant, kTopic));
  ASSERT_TRUE(ping::matches(spy, 1));
  const auto seen = dds::sub::matched_publication_data(spy, dds::sub::matched_publications(spy).at(0));
  const RunKey::Badge badge = kKey.badge(here.participant.guid(), kTopic);
  ASSERT_EQ(seen.user_data, std::vector<unsigned char>(badge.begin(), badge.end())) << "the thief has the real one";
  Bare thief(elsewhere.participant, Bare::qos() << UserData(seen.user_data));
  thief.write(99);
  EXPECT_EQ(refused(refusals_of(listener.participant, 1)), 1u);
  EXPECT_EQ(listener.newest, 7u);
  EXPECT_EQ(listener.writers, 1u);
}

TEST_F(Trust, AReaderWithoutTheKeyIsNotCountedAmongThoseWhoListen) {
  std::atomic<std::size_t> listeners{0};
  const Participant keyed(here.participant, kKey);
  const Delivery acknowledged{true, 1, 100.0, 100.0, 100.0};
  InformationWriter writer(
      keyed, AgentId{1}, [&](std::size_t n) { listeners = n; }, acknowledged);
  const std::vector<AgentId> senders{AgentId{1}};
  const InformationReader stranger(
      Participant(there.participant, RunKey()), senders, [](InformationReader::Burst&) {}, acknowledged);
  Side elsewhere(3);
  const InformationReader member(
      Participant(elsewhere.participant, kKey), senders, [](InformationReader::Burst&) {}, acknowledged);
  EXPECT_TRUE(comes_true([&] { return listeners == 1; }));
  writer.write(1, 0, {});
  EXPECT_TRUE(writer.wait_for_acknowledgments(30)) << "the stranger too is matched and acknowledges";
  EXPECT_EQ(listeners, 1u);
}

TEST_F(Trust, AMembersSampleThatBreaksABoundIsRefusedNamingTheField) {
  Listener listener(there.participant);
  const Participant member(here.participant, kKey);
  Bare bare(here.participant, Bare::qos() << member.badge(kTopic));
  Arena arena;
  bare.writer.write(encode(Grant{1, 5, 6, {}}, arena));
  const auto refusals = refusals_of(listener.participant, 1);
  ASSERT_EQ(refusals.size(), 1u);
  EXPECT_EQ(refusals[0].reason, Refusal::Reason::bound);
  EXPECT_EQ(refusals[0].field, "report_at");
  bare.write(8);
  EXPECT_TRUE(comes_true([&] { return listener.newest == 8; })) << "the next one counts again";
}

}  // namespace
}  // namespace consort::wire
