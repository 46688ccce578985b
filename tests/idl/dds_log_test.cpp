/// What DDS reports reaches a person in few words.

#include "idl/dds_log.hpp"

#include "idl/trust.hpp"
#include "tests/dds/ping.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

namespace consort::wire {
namespace {

bool holds(const std::vector<std::string>& texts, const std::string& part) {
  return std::any_of(texts.begin(), texts.end(), [&](const std::string& text) { return text.find(part) != std::string::npos; });
}

TEST(DdsLog, MalformedPacketsAreCountedAndNamedOnce) {
  std::vector<std::string> lines;
  DdsLog log([&](const std::string& line) { lines.push_back(line); });
  for (int i = 0; i < 1000; ++i)
    log.hear(false, "malformed packet received from vendor 1.16 state parse:data <52545053 " + std::to_string(i));
  log.hear(false, "data(application, vendor 1.16): 110b:1:2:3 #7: deserialization consort_grant/consort::wire::Grant failed (bad)");
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_NE(lines[0].find("counted"), std::string::npos);
  EXPECT_EQ(log.take_malformed(), 1001u);
  EXPECT_EQ(log.take_malformed(), 0u);
  EXPECT_TRUE(log.take_reasons().empty());
}

TEST(DdsLog, OneKindOfTroubleIsOneLineHoweverOftenItComes) {
  std::vector<std::string> lines;
  DdsLog log([&](const std::string& line) { lines.push_back(line); });
  for (int i = 0; i < 100; ++i) log.hear(true, "failed to send to 10.0.0." + std::to_string(i));
  log.hear(false, "something else");
  EXPECT_EQ(lines, (std::vector<std::string>{"DDS: failed to send to 10.0.0.0", "DDS: warning: something else"}));
  EXPECT_EQ(log.take_reasons(), (std::vector<std::string>{"failed to send to 10.0.0.0", "something else"}));
  for (int i = 0; i < 1000; ++i) log.hear(true, std::string("kind ") + static_cast<char>('g' + i % 20) + static_cast<char>('g' + i / 20));
  EXPECT_LE(log.take_reasons().size(), 50u) << "nobody fills the memory with them";
}

TEST(DdsLog, HoldsWhyADomainCannotBe) {
  DdsLog& log = DdsLog::of_this_process();
  log.take_reasons();
  EXPECT_THROW(dds::domain::DomainParticipant(dds::domain::Domain(0, dds::configuration::xml({.interface = "no-such-interface"}))),
               dds::core::Exception);
  const std::vector<std::string> reasons = log.take_reasons();
  EXPECT_TRUE(holds(reasons, "no-such-interface")) << (reasons.empty() ? "nothing was said" : reasons[0]);
}

TEST(DdsLog, WhatIsSentToTheDomainsPortsAndIsNotDdsIsCountedByTheRun) {
  constexpr std::uint16_t kDomain = 9, kPort = 7400 + 250 * kDomain;
  std::optional<Participant> participant(
      ping::Side(3, dds::configuration::xml({.tag = "malformed", .external_domain = kDomain})).participant);
  const int sender = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(kPort);
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  // An RTPS header, then a submessage (DATA) that is longer than its packet.
  const unsigned char packet[] = {'R', 'T', 'P', 'S', 2, 1, 1, 16, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 9, 0x15, 1, 4, 0, 1, 2, 3, 4};
  const auto give_up = std::chrono::steady_clock::now() + ping::kPatience;
  std::vector<Refusal> refusals;
  while (refusals.empty() && std::chrono::steady_clock::now() < give_up) {
    ASSERT_GT(sendto(sender, packet, sizeof packet, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    refusals = participant->take_refusals();
  }
  close(sender);
  participant.reset();
  DdsLog::of_this_process().take_malformed();  // of packets still on their way: other tests count theirs
  ASSERT_FALSE(refusals.empty());
  EXPECT_EQ(refusals[0].reason, Refusal::Reason::malformed);
  EXPECT_GT(refusals[0].samples, 0u);
}

}  // namespace
}  // namespace consort::wire
